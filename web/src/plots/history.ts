export const SPAN = 60; // s shown
export const RATE = 15; // points a second
const POINTS = SPAN * RATE;
/** s without a row after which the time between is unknown: the line is broken. */
const GAP = 1;
/** s, steps in which the interval of a young session grows. */
const STEP = 10;

/** The newest POINTS rows of several series; the first series has the times. */
export class History {
  readonly times: number[] = [];
  readonly series: (number | null)[][];
  readonly #ages: number[] = [];
  readonly #data: [number[], ...(number | null)[][]];

  constructor(series: number) {
    this.series = Array.from({ length: series }, () => []);
    this.#data = [this.#ages, ...this.series];
  }

  /** s; for a young session its length in steps, so that the plots are not mostly empty. */
  get span(): number {
    const age = this.newest - (this.times[0] ?? 0);
    return Math.min(SPAN, Math.max(STEP, STEP * Math.ceil(age / STEP)));
  }

  get newest(): number { return this.times[this.times.length - 1] ?? 0; }

  push(time: number, values: readonly (number | null)[]): void {
    const { times, series } = this;
    // A session that has restarted has no past.
    if (time < this.newest) for (const row of [times, ...series]) row.length = 0;
    if (times.length > 0 && time - this.newest > GAP) {
      times.push(this.newest + 1 / RATE);
      for (const row of series) row.push(null);
    }
    times.push(time);
    for (let i = 0; i < series.length; ++i) series[i]!.push(values[i] ?? null);
    while (times.length > POINTS || time - times[0]! > SPAN) {
      times.shift();
      for (const row of series) row.shift();
    }
  }

  /** Times are s relative to the newest row, not the session's clock; the same arrays each time. */
  get data(): [number[], ...(number | null)[][]] {
    const { times, newest } = this;
    this.#ages.length = times.length;
    for (let i = 0; i < times.length; ++i) this.#ages[i] = times[i]! - newest;
    return this.#data;
  }
}
