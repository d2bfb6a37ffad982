import type { Connection } from './connection';
import { handFor, normalize } from './frames';
import type { Pose, Quat, Vec3 } from './protocol';

export const REST: Pose = { p: [0, 0, 1], q: [0, 0, 0, 1] };

/** The operator's hand as the server hears of it, whichever way in leads it. One at a time. */
export class Hand {
  clutch = false;
  /** s, from the newest input event to its sample's way out; for the budget in docs/page.md. */
  readonly delays: number[] = [];
  #source: string | null = null;
  #sequence = 0;
  #pose: Pose = REST;
  #origin: Pose = REST;

  /** @param allowed whether the server would take samples now: until then the clutch counts as open */
  constructor(private readonly connection: Pick<Connection, 'send'>, private readonly now: () => number,
              private readonly allowed: () => boolean) {}

  get source(): string | null { return this.#source; }

  /** A way in takes the hand; false while another one has it. */
  grab(source: string): boolean {
    if (this.#source !== null && this.#source !== source) return false;
    if (this.#source === null) this.#origin = this.#pose;
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
    this.#pose = handFor(this.#origin, shift, spin, scale, yaw);
    this.#send(true, true, false, eventTime);
  }

  /** A device's own pose, in robot axes. */
  report(source: string, pose: Pose | null, clutch: boolean, emulated: boolean): void {
    if (this.#source !== source) return;
    if (pose) this.#pose = { p: pose.p, q: normalize(pose.q) };
    this.#send(clutch, pose !== null, emulated);
  }

  #send(clutch: boolean, tracked: boolean, emulated: boolean, eventTime?: number): void {
    if (!this.allowed()) {
      this.clutch = false;
      return;
    }
    const sample = (closed: boolean): void => {
      this.connection.send({
        type: 'sample', sequence: ++this.#sequence, t_s: this.now(), p: this.#pose.p, q: this.#pose.q, clutch: closed, tracked, emulated,
      });
    };
    // A grip counts only where the clutch was seen open before it closes.
    if (clutch && !this.clutch) sample(false);
    sample(clutch);
    this.clutch = clutch;
    if (eventTime === undefined) return;
    this.delays.push(this.now() - eventTime);
    if (this.delays.length > 600) this.delays.shift();
  }
}
