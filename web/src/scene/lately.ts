import * as THREE from 'three';

/** s: longest delay between seeing a moving object and pressing on it. */
const LATELY = 0.7;
/** Number of places that are kept: about the frames in that time, or fewer. */
const ROOM = 24;

/** Where an object was seen in recent frames. */
export class Lately {
  readonly #places = Array.from({ length: ROOM }, () => ({ at: new THREE.Vector3(), t: -Infinity }));
  #newest = 0;

  /** @param t s, of a frame, in order; frames closer in time than the memory allows replace the last place */
  see(place: THREE.Vector3, t: number): void {
    const last = this.#places[this.#newest]!, before = this.#places[(this.#newest + ROOM - 1) % ROOM]!;
    if (!(last.t - before.t < LATELY / ROOM)) this.#newest = (this.#newest + 1) % ROOM;
    const newest = this.#places[this.#newest]!;
    newest.at.copy(place);
    newest.t = t;
  }

  /** Whether the condition holds for a recent place, the newest first. @param t s, now */
  find(is: (place: THREE.Vector3) => boolean, t: number): boolean {
    for (let i = 0; i < ROOM; ++i) {
      const { at, t: seen } = this.#places[(this.#newest + ROOM - i) % ROOM]!;
      if (t - seen > LATELY) return false;
      if (is(at)) return true;
    }
    return false;
  }
}
