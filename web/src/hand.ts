import type { Connection } from './connection';
import { handFor, normalize, type MutablePose } from './frames';
import type { ClientMessage, Pose, Quat, Vec3 } from './protocol';

/** s for which letting go is said again and again: one that is lost or late must not leave the arm following. */
const REPEATED = 0.3;
/** s within which the lease comes that a grip took: it counts from then on. */
const TAKEN_WITHIN = 1;

type Sample = Extract<ClientMessage, { type: 'sample' }>;

const rest = (): MutablePose => ({ p: [0, 0, 1], q: [0, 0, 0, 1] });

function copy(from: Pose, to: MutablePose): void {
  for (let i = 0; i < 3; ++i) to.p[i] = from.p[i]!;
  for (let i = 0; i < 4; ++i) to.q[i] = from.q[i]!;
}

/** The operator's hand as the server hears of it, whichever way in leads it. One at a time. */
export class Hand {
  /** s, from the newest input event to its sample's way out; for the budget in docs/explanation/results.md. */
  readonly delays: number[] = [];
  #source: string | null = null;
  #clutch = false;
  #gripped = -Infinity;
  #released = -Infinity;
  /** s, when the grip took the lease, which has not come yet. */
  #tookAt = -Infinity;
  #sequence = 0;
  #gripper: number | null = null;
  readonly #pose = rest();
  readonly #origin = rest();

  /**
   * @param allowed whether this hand may lead the arm now. A grip counts only if it was so from the grip's begin on, or
   * if it took the lease itself, and that came at once
   */
  constructor(private readonly connection: Pick<Connection, 'send'>, private readonly now: () => number,
              private readonly allowed: () => boolean) {}

  get source(): string | null { return this.#source; }
  /** Closed, as the server hears of it. */
  get clutch(): boolean { return this.#clutch; }
  /** s for which a way in has had it; 0: none has. */
  get heldFor(): number { return this.#source === null ? 0 : this.now() - this.#gripped; }

  /** A way in takes the hand, which was open until now; false while another one has it. @param takes it took the lease, which nobody had */
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

  /** Lets go; the server hears of it at once. */
  release(source: string): void {
    if (this.#source !== source) return;
    this.#source = null;
    this.#tookAt = -Infinity;
    if (!this.#clutch) return;
    this.#clutch = false;
    this.#released = this.now();
    this.#sample(false, true, false);
  }

  /** Whoever has it. */
  letGo(): void { if (this.#source !== null) this.release(this.#source); }

  /** The grip that is still held begins anew: for one that was lost as the browser could not tell of it. */
  resume(): void {
    if (this.#source !== null && this.#clutch && this.allowed()) this.#sample(false, true, false);
  }

  /** Opens (0) or closes (1) the gripper, in a grip of the hand or without one. */
  set gripper(value: number) {
    this.#gripper = Math.min(Math.max(value, 0), 1);
    if (this.#clutch) return; // the next pose says it
    this.#released = this.now();
    if (this.allowed()) this.#sample(false, true, false);
  }
  /** As it was wanted last; null: nothing was said. */
  get gripper(): number | null { return this.#gripper; }

  /** Somebody else says how the gripper is to be: it stays so until this hand says it anew. */
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

  /** A grip that waits for the lease it took is open until that has come; the next pose is closed. */
  #begin(): void {
    if (this.now() - this.#tookAt > TAKEN_WITHIN || !this.allowed()) return;
    this.#tookAt = -Infinity;
    this.#clutch = true;
    this.#sample(false, true, false);
  }

  #sample(clutch: boolean, tracked: boolean, emulated: boolean, lead = 0): void {
    const { p, q } = this.#pose, sample: Sample = { type: 'sample', sequence: ++this.#sequence, t_s: this.now(), p, q, clutch, tracked, emulated };
    if (lead > 0) sample.lead_s = lead;
    if (this.#gripper !== null) sample.gripper = this.#gripper;
    this.connection.send(sample);
  }
}
