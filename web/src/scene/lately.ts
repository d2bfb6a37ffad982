import * as THREE from 'three';

/** s: who presses where something that moves was seen has seen it so long ago at most. */
const LATELY = 0.7;
/** Of places that are kept: as many as pictures in that time, or fewer. */
const ROOM = 24;

/** Where something was seen in the pictures of the last moments. */
export class Lately {
  readonly #places = Array.from({ length: ROOM }, () => ({ at: new THREE.Vector3(), t: -Infinity }));
  #newest = 0;

  /** @param t s, of a picture, in their order; where they come closer than there is room for, it takes the last one's place */
  see(place: THREE.Vector3, t: number): void {
    const last = this.#places[this.#newest]!, before = this.#places[(this.#newest + ROOM - 1) % ROOM]!;
    if (!(last.t - before.t < LATELY / ROOM)) this.#newest = (this.#newest + 1) % ROOM;
    const newest = this.#places[this.#newest]!;
    newest.at.copy(place);
    newest.t = t;
  }

  /** The newest place for which it is so, if any. @param t s, now */
  find(is: (place: THREE.Vector3) => boolean, t: number): boolean {
    for (let i = 0; i < ROOM; ++i) {
      const { at, t: seen } = this.#places[(this.#newest + ROOM - i) % ROOM]!;
      if (t - seen > LATELY) return false;
      if (is(at)) return true;
    }
    return false;
  }
}
