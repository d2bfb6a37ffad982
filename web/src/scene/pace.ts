/** How well the scene is drawn: 0 is all of it, each step takes less of the graphics card. */
export const COARSEST = 3;

/** s between pictures above which a coarser one is tried: a few of 60 a second may be late. */
const SLOW = 1 / 48;
/** A step must leave less than this share of the time, or it was not the drawing that took it. */
const HELPED = 0.8;
/** s of pictures, and their number, that a judgement takes; whichever comes first, but at least LEAST of them. */
const SPAN = 2, PICTURES = 40, LEAST = 5;
/** s; longer between two pictures, the page was hidden or the machine asleep. */
const AWAY = 5;

/**
 * Draws as well as 60 pictures a second allow. Judges by medians, so that a hiccup costs nothing, and takes a step back that did
 * not help: browsers that save power draw 30 pictures a second, however small.
 */
export class Pace {
  #level: number;
  readonly #times = new Float64Array(PICTURES);
  #count = 0;
  #sum = 0;
  /** Of the level before, while the one that was stepped to is being judged. */
  #before: number | null = null;
  #settled = false;

  constructor(level: number) { this.#level = level; }

  get level(): number { return this.#level; }

  /** What took the time may have changed: another size, another level. */
  restart(level = this.#level): void {
    this.#level = level;
    this.#before = null;
    this.#settled = false;
    this.#begin();
  }

  /** @param dt s, since the picture before; @returns whether the level has changed */
  take(dt: number): boolean {
    if (this.#settled || dt > AWAY) return false;
    this.#times[this.#count++] = dt;
    this.#sum += dt;
    if (this.#count < PICTURES && (this.#sum < SPAN || this.#count < LEAST)) return false;
    const median = this.#times.subarray(0, this.#count).sort()[this.#count >> 1]!, before = this.#before, level = this.#level;
    this.#begin();
    this.#before = null;
    if (before !== null && median > HELPED * before) {
      --this.#level;
      this.#settled = true;
    } else if (median > SLOW && this.#level < COARSEST) {
      this.#before = median;
      ++this.#level;
    }
    return this.#level !== level;
  }

  #begin(): void {
    this.#count = 0;
    this.#sum = 0;
  }
}
