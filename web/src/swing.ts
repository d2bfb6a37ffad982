/** s after a change of the profile in which the arm and the liquid still move from the profile before. */
export const SETTLING = 1;

/** The profile whose motion causes the swing of the liquid. */
export class Swing {
  #led = -1;
  #before = -1;
  #since = -Infinity;

  /**
   * A profile that keeps the liquid in is not responsible for a swing that it took over.
   * @param now s @param profile the index of the engaged one @param keeps it keeps the liquid in
   * @returns the index of the one that causes a spill now
   */
  of(now: number, profile: number, keeps: boolean): number {
    if (now < this.#since) this.#since = -Infinity; // another session
    if (profile !== this.#led) {
      if (this.#led >= 0) this.#since = now;
      this.#before = this.#led;
      this.#led = profile;
    }
    return keeps && now - this.#since < SETTLING ? this.#before : profile;
  }
}
