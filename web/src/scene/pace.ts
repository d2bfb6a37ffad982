/** Drawing quality: 0 is the best, each step needs less of the graphics card. */
export const COARSEST = 3;

/** s between frames above which a coarser level is tried: a few of 60 a second may be late. */
const SLOW = 1 / 48;
/** A step must reduce the time below this share; otherwise drawing was not the cause. */
const HELPED = 0.8;
/** s of frames, and their number, for a decision; whichever comes first, but at least LEAST frames. */
const SPAN = 2, PICTURES = 40, LEAST = 5;
/** s; a longer time between two frames means that the page was hidden or the machine asleep. */
const AWAY = 5;

/**
 * Draws as well as 60 frames a second allow. Decides by medians, so that one late frame changes nothing. Reverts a
 * step that did not help: browsers that save power draw 30 frames a second at any size.
 */
export class Pace {
  #level: number;
  readonly #times = new Float64Array(PICTURES);
  #count = 0;
  #sum = 0;
  /** Time at the level before, while the new level is being judged. */
  #before: number | null = null;
  #settled = false;

  constructor(level: number) { this.#level = level; }

  get level(): number { return this.#level; }

  /** The cause of the time may have changed: another size, another level. */
  restart(level = this.#level): void {
    this.#level = level;
    this.#before = null;
    this.#settled = false;
    this.#begin();
  }

  /** @param dt s, since the last frame @returns whether the level has changed */
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
