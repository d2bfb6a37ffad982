import * as THREE from 'three';
import type { StateMessage } from '../protocol';

/** m/s of the hand: half of what is taken for a jump. A busy browser tells of a mouse's whole way at once. */
const FASTEST = 3;
/** s, of a pause that the hand makes up for. */
const PAUSE = 0.05;
/** s after a grip in which the target follows by growing shares of the hand's motion (kLiveRamp), and the least share that is reckoned with. */
const RAMP = 0.5, LEAST_SHARE = 0.1;
/** s, of the server's clock, for which the hand has been where it should: then the state tells of it, and what was left behind is made up for. */
const SETTLED = 0.4;
/** m, that the target may be from the handle. */
const NEAR = 5e-4;

/** Moves the hand so that the target comes to a handle, although the server follows a new grip slowly and may lose one. */
export class Reach {
  /** m of the tool, that the hand has moved since the grip; base frame. */
  readonly shift = new THREE.Vector3();
  readonly #from = new THREE.Vector3();
  /** What of `shift` the target followed, from `#from`. */
  readonly #followed = new THREE.Vector3();
  readonly #left = new THREE.Vector3();
  #toldAt = 0; // s
  /** s, of the server's clock, of the news when the hand was not yet where it should be: old news call for nothing. */
  #awayAt = Infinity;
  /** s, when the grip began that the arm follows; NaN: it was lost. */
  #grippedAt = NaN;
  #followsHand = false;

  begin(target: THREE.Vector3, now: number): void {
    this.#from.copy(target);
    this.shift.setScalar(0);
    this.#followed.setScalar(0);
    this.#toldAt = this.#grippedAt = now;
    this.#awayAt = Infinity;
    this.#followsHand = false;
  }

  /** @param handle where the target is wanted @param scale m of the tool for each of the hand */
  toward(handle: THREE.Vector3, state: Pick<StateMessage, 'now_s' | 'state' | 'leader' | 'target'>, scale: number, now: number): void {
    const passed = Math.min(now - this.#toldAt, PAUSE);
    this.#toldAt = now;
    this.#look(state, now);
    if (Number.isNaN(this.#grippedAt)) return;
    const left = this.#left.subVectors(handle, this.#from).sub(this.#followed);
    if (left.length() > NEAR || this.#awayAt === Infinity) this.#awayAt = state.now_s;
    const share = Math.min(1, Math.max(LEAST_SHARE, (now - this.#grippedAt) / RAMP));
    left.divideScalar(share).clampLength(0, FASTEST * scale * passed);
    this.shift.add(left);
    this.#followed.addScaledVector(left, share);
  }

  #look({ now_s, state, leader, target }: Pick<StateMessage, 'now_s' | 'state' | 'leader' | 'target'>, now: number): void {
    const follows = state === 'engaged' && leader === 'person', anew = Number.isNaN(this.#grippedAt);
    if (follows && (anew || now_s - this.#awayAt > SETTLED)) this.#from.fromArray(target.p).sub(this.#followed);
    if (follows && anew) this.#grippedAt = now;
    if (this.#followsHand && !follows) this.#grippedAt = NaN;
    this.#followsHand = follows;
  }
}
