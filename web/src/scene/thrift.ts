/** s between two pictures of a page that spares the processor, at least; of the time that the drawing took, what it leaves to others before it begins anew. */
const SPARING = { inTime: { every: 0.04, leaves: 0.5 }, late: { every: 0.1, leaves: 2 } };
/** s, that it leaves to others at most: who waits sees nothing. */
const LEAVES_AT_MOST = 0.25;
/** s for which a picture waits for a frame of its own, at most: two of 60 a second. */
const WAITS = 0.03;
/** s without motion after which a coarse picture is drawn once as sharp as can be: longer than the arm takes to turn translucent. */
const STILL = 1.2;
/** s for which the page spares after plans came late. */
const SPARES_FOR = 20;
/** Values that differ by less look the same: rad and m. */
const SAME = 3e-4;

export type Picture = 'none' | 'usual' | 'sharp';

/**
 * When a picture is worth its processor's time. Where the processor draws, some 20 a second must do, and some 10 where it is late with
 * the arm's plans; none waits for another. A scene that stands still needs none: one sharp one stays.
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

  /** @param software the processor draws */
  constructor(public software: boolean) {}

  /** Plans, or commands, come late. */
  late(now: number): void { this.#lateAt = now; }

  /** Something is another than it was, or may be: what `look` does not see. */
  wake(now: number): void {
    this.#movedAt = now;
    this.#sharp = false;
  }

  /** There is no picture any more, as another size leaves none. */
  blank(now: number): void {
    this.wake(now);
    this.#blank = true;
  }

  /** What moves, as numbers, behind `from` others. @returns how many there are by now */
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
   * @param drawing the picture before is not done yet @param coarse it could be sharper than usual
   * @param busy the page did other work in this frame: a hand that moves meanwhile would wait for both
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
