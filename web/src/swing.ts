/** s after another profile led, in which the arm and the liquid still move as that one left them. */
export const SETTLING = 1;

/** Whose motion the liquid swings by. */
export class Swing {
  #led = -1;
  #before = -1;
  #since = -Infinity;

  /**
   * A profile that keeps the liquid in answers for nothing that it took over swinging.
   * @param now s @param profile the index of the one that leads @param keeps it keeps the liquid in
   * @returns the index of the one that what goes over the rim now comes of
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
