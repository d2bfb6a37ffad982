import * as THREE from 'three';
import type { Tool } from '../protocol';

/** The parts of the state that show what the target did. */
export type Followed = Pick<Tool, 'state' | 'leader' | 'target'>;

/** m/s of the hand: half of what counts as a jump. A busy browser reports a mouse's whole motion at once. */
const FASTEST = 3;
/** s, of a pause that the hand catches up. */
const PAUSE = 0.05;
/**
 * s after engaging in which the target follows growing shares of the hand's motion (kLiveRamp), and the least share
 * assumed.
 */
const RAMP = 0.5, LEAST_SHARE = 0.1;
/**
 * s, of the server's clock: after the hand was in place for so long, the state reflects it, and the remaining error is
 * corrected.
 */
const SETTLED = 0.4;
/** m, tolerated from the target to the handle. */
const NEAR = 5e-4;

/**
 * Moves the hand so that the target reaches a handle, although the server ramps up a new engagement and may lose one.
 */
export class Reach {
  /** m of the tool, that the hand has moved since it engaged; base frame. */
  readonly shift = new THREE.Vector3();
  readonly #from = new THREE.Vector3();
  /** The part of `shift` that the target followed, from `#from`. */
  readonly #followed = new THREE.Vector3();
  readonly #left = new THREE.Vector3();
  #toldAt = 0; // s
  /** s, of the server's clock, of the last state while the hand was not in place: older states cause no correction. */
  #awayAt = Infinity;
  /** s, start of the engagement that the arm follows; NaN: it was lost. */
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

  /** @param handle wanted position of the target @param now_s of the state that has the tool @param scale m of the tool for each m of the hand */
  toward(handle: THREE.Vector3, tool: Followed, now_s: number, scale: number, now: number): void {
    const passed = Math.min(now - this.#toldAt, PAUSE);
    this.#toldAt = now;
    this.#look(tool, now_s, now);
    if (Number.isNaN(this.#grippedAt)) return;
    const left = this.#left.subVectors(handle, this.#from).sub(this.#followed);
    if (left.length() > NEAR || this.#awayAt === Infinity) this.#awayAt = now_s;
    const share = Math.min(1, Math.max(LEAST_SHARE, (now - this.#grippedAt) / RAMP));
    left.divideScalar(share).clampLength(0, FASTEST * scale * passed);
    this.shift.add(left);
    this.#followed.addScaledVector(left, share);
  }

  #look({ state, leader, target }: Followed, now_s: number, now: number): void {
    const follows = state === 'engaged' && leader === 'person', anew = Number.isNaN(this.#grippedAt);
    if (follows && (anew || now_s - this.#awayAt > SETTLED)) this.#from.fromArray(target.p).sub(this.#followed);
    if (follows && anew) this.#grippedAt = now;
    if (this.#followsHand && !follows) this.#grippedAt = NaN;
    this.#followsHand = follows;
  }
}
