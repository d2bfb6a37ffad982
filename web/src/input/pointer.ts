import * as THREE from 'three';
import type { Board } from './board';

/** m along a ray from which on nothing is drawn: it ends at the board. */
const THIN = 0.0015;

/**
 * Rays of controllers onto the board: the item under a ray is chosen, a trigger presses it; elsewhere the trigger
 * drags the board.
 */
export class Pointer extends THREE.Group {
  /** A trigger has pressed on the board before. */
  isUsed = false;
  readonly #line = new THREE.Mesh(new THREE.CylinderGeometry(THIN, THIN, 1, 6).rotateX(Math.PI / 2).translate(0, 0, -0.5), new THREE.MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.6 }));
  readonly #from = new THREE.Vector3(); // world frame
  readonly #along = new THREE.Vector3();
  readonly #turn = new THREE.Quaternion();
  readonly #hit = new THREE.Vector3();
  readonly #local = new THREE.Vector3();
  readonly #localAlong = new THREE.Vector3();
  readonly #back = new THREE.Quaternion();
  /** The hand that drags the board, its distance, m, and the point of the board. */
  #holder: XRHandedness | null = null;
  #away = 0;
  readonly #taken = new THREE.Vector3();
  #held = false;
  #on = -1;
  /** A frame ago. */
  #was = -1;
  #pressed = -1;
  #seen = false;

  constructor(private readonly board: Board) {
    super();
    this.add(this.#line);
  }

  begin(): void {
    this.#seen = this.#held = false;
    this.#on = this.#pressed = -1;
  }

  /** @param pose of the ray, world frame @param pressed its trigger @param began it was open a frame ago */
  aim(hand: XRHandedness, pose: XRPose, pressed: boolean, began: boolean): void {
    const { position: p, orientation: q } = pose.transform;
    this.#from.set(p.x, p.y, p.z);
    this.#along.set(0, 0, -1).applyQuaternion(this.#turn.set(q.x, q.y, q.z, q.w));
    if (this.#holder === hand) {
      this.#held = pressed;
      if (pressed) this.board.position.copy(this.#from).addScaledVector(this.#along, this.#away).add(this.#taken);
    }
    const away = this.#meet();
    if (away === null) return;
    this.#seen = true;
    this.#line.position.copy(this.#from);
    this.#line.quaternion.copy(this.#turn);
    this.#line.scale.z = away;
    const { width, height } = this.board.geometry.parameters, item = this.board.itemAt(this.#local.x / width + 0.5, this.#local.y / height + 0.5);
    if (item >= 0) this.#on = item;
    if (!began) return;
    this.isUsed = true;
    if (item >= 0) {
      this.#pressed = item;
    } else {
      this.#holder = hand;
      this.#held = true;
      this.#away = away;
      this.#taken.copy(this.board.position).sub(this.#hit);
    }
  }

  /** m from a point along a direction to the board, world frame; null: not met. */
  distance(from: THREE.Vector3, along: THREE.Vector3): number | null {
    this.#from.copy(from);
    this.#along.copy(along);
    return this.#meet();
  }

  /** m along the ray to the board; null: not met. Sets `#hit` (world frame) and `#local` (board's frame). */
  #meet(): number | null {
    this.board.worldToLocal(this.#local.copy(this.#from));
    this.#localAlong.copy(this.#along).applyQuaternion(this.#back.copy(this.board.quaternion).invert());
    const away = -this.#local.z / this.#localAlong.z;
    if (!(away > 0)) return null;
    this.#local.addScaledVector(this.#localAlong, away);
    const { width, height } = this.board.geometry.parameters;
    if (Math.abs(this.#local.x) > width / 2 || this.#local.y > height / 2 || this.#local.y < this.board.bottom) return null;
    this.#hit.copy(this.#from).addScaledVector(this.#along, away);
    return away;
  }

  /** The item that was pressed; -1: none. */
  end(): number {
    if (!this.#held) this.#holder = null;
    this.visible = this.#seen;
    if (this.#on >= 0) this.board.chosen = this.#on;
    else if (this.#was >= 0 && this.board.chosen === this.#was) this.board.chosen = -1; // the ray has left it
    this.#was = this.#on;
    return this.#pressed;
  }
}
