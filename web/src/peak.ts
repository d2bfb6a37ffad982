/** The largest value of the last moments: of at least half of `held` s, at most all of it. */
export class Peak {
  #begun = -Infinity;
  #now = 0;
  #before = 0;

  constructor(private readonly held: number) {}

  /** @param at s */
  of(value: number, at: number): number {
    const age = at - this.#begun;
    if (age > this.held / 2) {
      this.#before = age > this.held ? value : this.#now;
      this.#now = value;
      this.#begun = at;
    }
    this.#now = Math.max(this.#now, value);
    return Math.max(this.#now, this.#before);
  }
}
