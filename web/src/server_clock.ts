/** s, of each of the two windows of which the best ping is taken. */
const WINDOW = 5;

/** The session's clock as the page knows it: by the ping of the last 5 to 10 s that was answered soonest. */
export class ServerClock {
  /** s, by which it may be off: half of that ping's round trip. NaN: nothing is known yet. */
  uncertainty = NaN;
  #offset = NaN;
  #begun = -Infinity;
  #best = Infinity;
  #bestOffset = NaN;

  /** @param now s, of the page's clock, as `t_s` */
  take({ t_s, now_s }: { t_s: number; now_s: number }, now: number): void {
    if (now - this.#begun > WINDOW) {
      this.#begun = now;
      this.uncertainty = this.#best;
      this.#offset = this.#bestOffset;
      this.#best = Infinity;
    }
    const half = (now - t_s) / 2;
    if (half < this.#best) {
      this.#best = half;
      this.#bestOffset = now_s - t_s - half;
    }
    if (this.uncertainty <= this.#best) return;
    this.uncertainty = this.#best;
    this.#offset = this.#bestOffset;
  }

  /** What it says, s; NaN: not known. */
  at(now: number): number { return now + this.#offset; }

  /** Another program, perhaps. */
  forget(): void {
    this.uncertainty = this.#offset = NaN;
    this.#begun = -Infinity;
    this.#best = Infinity;
  }
}
