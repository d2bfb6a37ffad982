import type { Connection } from './connection';
import { handFor, normalize, type MutablePose } from './frames';
import type { ClientMessage, Pose, Quat, Vec3 } from './protocol';

/** s for which a release is sent again and again: a lost or late one must not leave the arm following. */
const REPEATED = 0.3;
/** s within which control must come after a grip requested it: the grip counts from then on. */
const TAKEN_WITHIN = 1;

type Sample = Extract<ClientMessage, { type: 'sample' }>;

const rest = (): MutablePose => ({ p: [0, 0, 1], q: [0, 0, 0, 1] });

function copy(from: Pose, to: MutablePose): void {
  for (let i = 0; i < 3; ++i) to.p[i] = from.p[i]!;
  for (let i = 0; i < 4; ++i) to.q[i] = from.q[i]!;
}

/** A hand of the operator as it is sent to the server: it moves one tool. One source controls it at a time. */
export class Hand {
  /** s, from the newest input event to its sample's way out; for the budget in docs/explanation/results.md. */
  readonly delays: number[] = [];
  #source: string | null = null;
  #clutch = false;
  #gripped = -Infinity;
  #released = -Infinity;
  /** s, when the grip requested control, which has not come yet. */
  #tookAt = -Infinity;
  #gripper: number | null = null;
  readonly #pose = rest();
  readonly #origin = rest();

  /**
   * @param allowed whether this hand may control the arm now. A grip counts only if that was so when it started, or
   * if the grip itself requested control, and that came within TAKEN_WITHIN
   * @param tool index of the tool that it moves @param count of samples, common to all hands
   */
  constructor(private readonly connection: Pick<Connection, 'send'>, private readonly now: () => number,
              private readonly allowed: () => boolean, readonly tool = 0, private readonly count = { sequence: 0 }) {}

  get source(): string | null { return this.#source; }
  /** Closed, as it is sent to the server. */
  get clutch(): boolean { return this.#clutch; }
  /** s for which a source has had it; 0: none has. */
  get heldFor(): number { return this.#source === null ? 0 : this.now() - this.#gripped; }

  /** A source takes the hand; false while another one has it. @param takes it requested control, which was free */
  grab(source: string, takes = false): boolean {
    if (this.#source !== null) return this.#source === source;
    this.#source = source;
    this.#gripped = this.now();
    copy(this.#pose, this.#origin);
    this.#clutch = this.allowed();
    this.#tookAt = takes && !this.#clutch ? this.#gripped : -Infinity;
    if (this.#clutch) this.#sample(false, true, false);
    return true;
  }

  /** Releases; the server gets it at once. */
  release(source: string): void {
    if (this.#source !== source) return;
    this.#source = null;
    this.#tookAt = -Infinity;
    if (!this.#clutch) return;
    this.#clutch = false;
    this.#released = this.now();
    this.#sample(false, true, false);
  }

  /** Releases, from any source. */
  letGo(): void { if (this.#source !== null) this.release(this.#source); }

  /** Starts a held grip again: one that timed out while the browser could not send it. */
  resume(): void {
    if (this.#source !== null && this.#clutch && this.allowed()) this.#sample(false, true, false);
  }

  /** Opens (0) or closes (1) the gripper, in a grip of the hand or without one. */
  set gripper(value: number) {
    this.#gripper = Math.min(Math.max(value, 0), 1);
    if (this.#clutch) return; // the next pose sends it
    this.#released = this.now();
    if (this.allowed()) this.#sample(false, true, false);
  }
  /** The last command; null: none. */
  get gripper(): number | null { return this.#gripper; }

  /** Another source commands the gripper: it stays so until this hand commands it again. */
  leaveGripper(): void { this.#gripper = null; }

  /** 90 times a second. */
  repeat(): void {
    if (this.#source === null && this.now() - this.#released < REPEATED && this.allowed()) this.#sample(false, true, false);
  }

  /** Moves by as much from where it was grabbed, so that the tool moves by `shift` and turns by `spin` (base frame). */
  lead(source: string, shift: Vec3, spin: Quat, scale: number, yaw: number, eventTime?: number): void {
    if (this.#source !== source) return;
    handFor(this.#origin, shift, spin, scale, yaw, this.#pose);
    this.#close(true, false, 0, eventTime);
  }

  /** A device's own pose, in robot axes; null: it knows none. @param lead s by which the device predicted it */
  report(source: string, pose: Pose | null, emulated: boolean, lead = 0): void {
    if (this.#source !== source) return;
    if (pose) {
      copy(pose, this.#pose);
      normalize(this.#pose.q, this.#pose.q);
    }
    this.#close(pose !== null, emulated, lead);
  }

  #close(tracked: boolean, emulated: boolean, lead: number, eventTime?: number): void {
    this.#clutch &&= this.allowed();
    if (!this.#clutch) return this.#begin();
    this.#sample(true, tracked, emulated, lead);
    if (eventTime === undefined) return;
    this.delays.push(this.now() - eventTime);
    if (this.delays.length > 600) this.delays.shift();
  }

  /** A grip that waits for control is open until control has come; the next pose is closed. */
  #begin(): void {
    if (this.now() - this.#tookAt > TAKEN_WITHIN || !this.allowed()) return;
    this.#tookAt = -Infinity;
    this.#clutch = true;
    this.#sample(false, true, false);
  }

  #sample(clutch: boolean, tracked: boolean, emulated: boolean, lead = 0): void {
    const { p, q } = this.#pose, sample: Sample = { type: 'sample', sequence: ++this.count.sequence, t_s: this.now(), p, q, clutch, tracked, emulated };
    if (lead > 0) sample.lead_s = lead;
    if (this.#gripper !== null) sample.gripper = this.#gripper;
    if (this.tool > 0) sample.tool = this.tool;
    this.connection.send(sample);
  }
}
