/** The median of the newest measurements. */
export class Median {
  readonly #newest: Float64Array;
  readonly #sorted: Float64Array;
  #count = 0;

  /** @param most how many count */
  constructor(most: number) {
    this.#newest = new Float64Array(most);
    this.#sorted = new Float64Array(most);
  }

  /** NaN does not count. */
  add(value: number): void {
    if (!Number.isNaN(value)) this.#newest[this.#count++ % this.#newest.length] = value;
  }

  /** NaN: nothing was measured. */
  value(): number {
    const count = Math.min(this.#count, this.#newest.length);
    if (count === 0) return NaN;
    this.#sorted.fill(Infinity);
    for (let i = 0; i < count; ++i) this.#sorted[i] = this.#newest[i]!;
    this.#sorted.sort();
    return (this.#sorted[(count - 1) >> 1]! + this.#sorted[count >> 1]!) / 2;
  }

  clear(): void { this.#count = 0; }
}
