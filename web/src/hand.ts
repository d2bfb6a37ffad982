import type { Connection } from './connection';
import { handFor, normalize, type MutablePose } from './frames';
import type { Pose, Quat, Vec3 } from './protocol';

const rest = (): MutablePose => ({ p: [0, 0, 1], q: [0, 0, 0, 1] });

function copy(from: Pose, to: MutablePose): void {
  for (let i = 0; i < 3; ++i) to.p[i] = from.p[i]!;
  for (let i = 0; i < 4; ++i) to.q[i] = from.q[i]!;
}

/** The operator's hand as the server hears of it, whichever way in leads it. One at a time. */
export class Hand {
  clutch = false;
  /** s, from the newest input event to its sample's way out; for the budget in docs/page.md. */
  readonly delays: number[] = [];
  #source: string | null = null;
  #sequence = 0;
  readonly #pose = rest();
  readonly #origin = rest();

  /** @param allowed whether the server would take samples now: until then the clutch counts as open */
  constructor(private readonly connection: Pick<Connection, 'send'>, private readonly now: () => number,
              private readonly allowed: () => boolean) {}

  get source(): string | null { return this.#source; }

  /** A way in takes the hand; false while another one has it. */
  grab(source: string): boolean {
    if (this.#source !== null && this.#source !== source) return false;
    if (this.#source === null) copy(this.#pose, this.#origin);
    this.#source = source;
    return true;
  }

  /** Lets go; the server hears of it at once. */
  release(source: string): void {
    if (this.#source !== source) return;
    this.#source = null;
    if (this.clutch) this.#send(false, true, false);
  }

  /** Moves by as much from where it was grabbed, so that the tool moves by `shift` and turns by `spin` (base frame). */
  lead(source: string, shift: Vec3, spin: Quat, scale: number, yaw: number, eventTime?: number): void {
    if (this.#source !== source) return;
    handFor(this.#origin, shift, spin, scale, yaw, this.#pose);
    this.#send(true, true, false, eventTime);
  }

  /** A device's own pose, in robot axes. */
  report(source: string, pose: Pose | null, clutch: boolean, emulated: boolean): void {
    if (this.#source !== source) return;
    if (pose) {
      copy(pose, this.#pose);
      normalize(this.#pose.q, this.#pose.q);
    }
    this.#send(clutch, pose !== null, emulated);
  }

  #send(clutch: boolean, tracked: boolean, emulated: boolean, eventTime?: number): void {
    if (!this.allowed()) {
      this.clutch = false;
      return;
    }
    // A grip counts only where the clutch was seen open before it closes.
    if (clutch && !this.clutch) this.#sample(false, tracked, emulated);
    this.#sample(clutch, tracked, emulated);
    this.clutch = clutch;
    if (eventTime === undefined) return;
    this.delays.push(this.now() - eventTime);
    if (this.delays.length > 600) this.delays.shift();
  }

  #sample(clutch: boolean, tracked: boolean, emulated: boolean): void {
    this.connection.send({ type: 'sample', sequence: ++this.#sequence, t_s: this.now(), p: this.#pose.p, q: this.#pose.q, clutch, tracked, emulated });
  }
}
