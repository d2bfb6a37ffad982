/**
 * While saving: s between two frames at least; pause before the next frame, as a multiple of the time that drawing
 * took.
 */
const SPARING = { inTime: { every: 0.04, leaves: 0.5 }, late: { every: 0.1, leaves: 2 } };
/** s, longest such pause: without a limit the picture would not change for too long. */
const LEAVES_AT_MOST = 0.25;
/** s that a picture waits at most for a browser frame without other work: two of 60 a second. */
const WAITS = 0.03;
/**
 * s without motion after which a coarse picture is drawn once as sharp as possible: longer than the arm takes to
 * become translucent.
 */
const STILL = 1.2;
/** s for which drawing is reduced after late plans. */
const SPARES_FOR = 20;
/** Smaller differences are not visible: rad and m. */
const SAME = 3e-4;

export type Picture = 'none' | 'usual' | 'sharp';

/**
 * Decides when a picture is worth the processor's time. With software rendering there are about 20 pictures a second,
 * or about 10 if the arm's plans are late. No picture waits for another. A stationary scene needs none after one sharp
 * picture.
 */
export class Thrift {
  #spares = false;
  #lateAt = -Infinity;
  #movedAt = -Infinity;
  #due = 0;
  #begun = NaN;
  #sharp = false;
  #blank = false;
  #seen = new Float64Array(0);

  /** @param software software rendering */
  constructor(public software: boolean) {}

  /** Plans, or commands, are late. */
  late(now: number): void { this.#lateAt = now; }

  /** Something changed, or may have changed, that `look` does not see. */
  wake(now: number): void {
    this.#movedAt = now;
    this.#sharp = false;
  }

  /** The picture is gone, as after a change of size. */
  blank(now: number): void {
    this.wake(now);
    this.#blank = true;
  }

  /**
   * Compares the values that move with those of the last call, from index `from` on.
   * @returns the number of values so far
   */
  look(values: ArrayLike<number>, now: number, from = 0): number {
    const count = from + values.length;
    if (this.#seen.length < count) {
      const more = new Float64Array(2 * count).fill(NaN);
      more.set(this.#seen);
      this.#seen = more;
    }
    const seen = this.#seen;
    let moved = false;
    for (let i = 0; i < values.length; ++i) {
      const value = values[i]!;
      if (Math.abs(value - seen[from + i]!) <= SAME) continue;
      seen[from + i] = value;
      moved = true;
    }
    if (moved) this.wake(now);
    return count;
  }

  get spares(): boolean { return this.#spares; }

  /**
   * @param drawing the last picture is not complete yet
   * @param coarse it could be sharper than usual
   * @param busy the page did other work in this frame: input would have to wait for both
   */
  next(now: number, drawing: boolean, coarse: boolean, busy = false): Picture {
    const late = now - this.#lateAt < SPARES_FOR, { every, leaves } = SPARING[late ? 'late' : 'inTime'];
    this.#spares = this.software || late;
    if (!drawing && !Number.isNaN(this.#begun)) {
      this.#due = Math.max(this.#begun + every, now + Math.min(leaves * (now - this.#begun), LEAVES_AT_MOST));
      this.#begun = NaN;
    }
    if (this.#blank) {
      this.#blank = false;
      this.#begun = now;
      return 'usual';
    }
    if (this.#sharp || drawing) return 'none';
    const sharp = coarse && now - this.#movedAt > STILL;
    if (!sharp && this.#spares && now < this.#due) return 'none';
    if (busy && this.#spares && now < this.#due + WAITS) return 'none';
    this.#sharp = sharp;
    this.#begun = now;
    return sharp ? 'sharp' : 'usual';
  }
}
