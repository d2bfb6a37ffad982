import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { PRESETS, type Preset } from './presets';

/** The part of the picture without cards, in normalised device coordinates; cards at the top appear and disappear. */
const CLEAR = { left: -0.85, right: 0.85, bottom: -0.58 };
/** m, above the target, of the end of its upper handle. */
const HANDLE = 0.18;
const WIDENING = 1.2, NEARING = 0.4; // 1/s, of the distance
/** Free space required next to the target before the view comes nearer again, in normalised device coordinates. */
const SPARE = 0.15;
const FOLLOWING = 3; // 1/s, of the remaining way
/** 1/s, of the remaining way to another middle; and the share of the picture that is too small to see. */
const GLIDING = 5, ARRIVED = 1e-3;

/** The camera: turned by pointers, and far enough away that the target stays visible. */
export class View {
  readonly camera = new THREE.PerspectiveCamera(45, 1, 0.05, 30);
  readonly orbit: OrbitControls;
  /** The view moves with the target. */
  follows = false;
  #arms = 1;
  readonly #seen = new THREE.Vector3();
  readonly #step = new THREE.Vector3();
  #turning = false;
  /** A pointer is down in the picture; the wheel does not count. */
  isPressed = false;
  /** The view before the current special one. */
  #before: { camera: THREE.Vector3; target: THREE.Vector3; chosen: number } | null = null;
  /** The part covered by a card: as the picture is centred now, and as it will be; NaN: not set yet. */
  readonly #room = new THREE.Vector2(NaN, NaN);
  readonly #wanted = new THREE.Vector2();
  #inSight = true;
  /** m, distance from which the view stepped back automatically; NaN: it did not. */
  #chosen = NaN;
  /** The target, or its handle, is behind the cards. */
  isCovered = false;
  /** Normalised device coordinates of the cards' lower edge, and of their right edge. */
  #top = 0.45;
  #cardsEnd = 1;

  constructor(canvas: HTMLCanvasElement, private readonly reducedMotion: boolean) {
    for (const type of ['pointerdown', 'pointerup', 'pointercancel'] as const) canvas.addEventListener(type, () => { this.isPressed = type === 'pointerdown'; }, { capture: true });
    this.orbit = new OrbitControls(this.camera, canvas);
    this.look('shoulder');
    this.orbit.enableDamping = !reducedMotion;
    this.orbit.minDistance = 0.4;
    this.orbit.maxDistance = 4;
    this.orbit.maxPolarAngle = 0.53 * Math.PI;
    this.orbit.addEventListener('start', () => {
      this.#turning = true;
      this.#chosen = NaN;
      this.#before = null;
    });
    this.orbit.addEventListener('end', () => { this.#turning = false; });
  }

  /** Another robot: the first view depends on how many arms it has. */
  forArms(count: number): void {
    if (count === this.#arms) return;
    this.#arms = count;
    this.look('shoulder');
  }

  look(preset: Preset): void {
    const { from, at } = PRESETS[preset === 'shoulder' && this.#arms > 1 ? 'shoulders' : preset];
    this.camera.position.set(...from);
    this.orbit.target.set(...at);
    this.#before = null;
    this.#inSight = true;
    this.#chosen = NaN;
    this.orbit.update();
  }

  /**
   * Starts or ends showing a recording or a headset's picture. At the end the view is restored, unless the operator
   * chose another one meanwhile.
   */
  shows(other: boolean): void {
    const { camera: { position }, orbit: { target } } = this;
    if (other) {
      this.#before ??= { camera: position.clone(), target: target.clone(), chosen: this.#chosen };
    } else if (this.#before) {
      position.copy(this.#before.camera);
      target.copy(this.#before.target);
      this.#chosen = this.#before.chosen;
      this.#before = null;
      this.#inSight = true;
    }
  }

  /** Moves the camera away, in its current direction, until the box is in the picture. @param box world frame */
  frame(box: THREE.Box3): void {
    if (box.isEmpty()) return;
    const sphere = box.getBoundingSphere(new THREE.Sphere()), half = THREE.MathUtils.degToRad(this.camera.fov) / 2;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * this.camera.aspect)), { target, maxDistance, minDistance } = this.orbit;
    const away = this.camera.position.clone().sub(target);
    target.copy(sphere.center);
    away.setLength(THREE.MathUtils.clamp((1.15 * sphere.radius) / Math.sin(narrow), minDistance, maxDistance));
    this.camera.position.copy(target).add(away);
    this.#inSight = true;
    this.#chosen = NaN;
    this.orbit.update();
  }

  /** rad, about the arm's z: viewing direction, from the arm's forward (-z of the world). */
  get heading(): number {
    const { elements } = this.camera.matrixWorld; // its first column points to the picture's right; the picture is upright
    return Math.atan2(-elements[2]!, elements[0]!);
  }

  /**
   * @param room part covered by a card at the right and at the top, as shares of the picture: the scene is centred in
   * the rest
   */
  resize(aspect: number, room: readonly [number, number] = [0, 0]): void {
    this.camera.aspect = aspect;
    // Tall and narrow screens need a wider view.
    this.camera.fov = aspect < 1 ? 56 : 40;
    this.#wanted.set(...room);
    // When a card appears or disappears, the picture glides; with the first one it is centred at once.
    if (this.reducedMotion || Number.isNaN(this.#room.x)) this.#room.copy(this.#wanted);
    this.#centre();
  }

  /** The part that cards cover at the picture's top, as shares of it: the target's handles stay clear of it. */
  cover(width: number, height: number): void {
    this.#top = 1 - 2 * Math.min(height, 0.4);
    this.#cardsEnd = 2 * width - 1;
  }

  #centre(): void {
    const { camera } = this, { aspect } = camera, { x, y } = this.#room;
    if (x > 0 || y > 0) return camera.setViewOffset(aspect, 1, (aspect * x) / 2, -y / 2, aspect, 1);
    camera.clearViewOffset();
    camera.updateProjectionMatrix();
  }

  /** @param dt s */
  #glide(dt: number): void {
    if (this.#room.equals(this.#wanted) || Number.isNaN(this.#room.x)) return;
    this.#room.lerp(this.#wanted, 1 - Math.exp(-GLIDING * Math.min(dt, 0.1)));
    if (this.#room.distanceTo(this.#wanted) < ARRIVED) this.#room.copy(this.#wanted);
    this.#centre();
  }

  /**
   * Steps back if the target leaves the picture by itself, and comes nearer again when there is room. If the operator
   * turned away from the target, the view does not change.
   * @param target world frame, m; null if none is shown
   * @param dt s
   */
  update(target: THREE.Vector3 | null, dt: number): void {
    this.#glide(dt);
    if (this.follows && target && !this.#turning && this.orbit.enabled) {
      this.#step.copy(target).sub(this.orbit.target).multiplyScalar(this.reducedMotion ? 1 : 1 - Math.exp(-FOLLOWING * Math.min(dt, 0.1)));
      this.orbit.target.add(this.#step);
      this.camera.position.add(this.#step);
    }
    this.orbit.update();
    this.camera.updateMatrixWorld();
    this.isCovered = false;
    if (!target) return;
    const sees = this.#sees(target);
    if (sees || this.#turning) this.#inSight = sees;
    // A held handle moves with the pointer through the picture, so the view must not move.
    if (this.#turning || !this.#inSight || !this.orbit.enabled) return;
    if (sees) return this.#comeNearer(target, Math.min(dt, 0.1));
    if (Number.isNaN(this.#chosen)) this.#chosen = this.camera.position.distanceTo(this.orbit.target);
    do this.#stepBack(this.reducedMotion ? 0.1 : Math.min(dt, 0.1));
    while (this.reducedMotion && !this.#sees(target) && this.camera.position.distanceTo(this.orbit.target) < this.orbit.maxDistance);
  }

  /** @param spare free space required next to it */
  #sees(target: THREE.Vector3, spare = 0): boolean {
    const { x, y, z } = this.#seen.copy(target).project(this.camera);
    if (z >= 1 || x <= CLEAR.left + spare || x >= CLEAR.right - spare || y <= CLEAR.bottom + spare) return false;
    this.#seen.copy(target).y += HANDLE;
    const clear = this.#seen.project(this.camera).y < this.#top - spare;
    this.isCovered = spare === 0 && !clear && x < this.#cardsEnd;
    return clear;
  }

  #stepBack(dt: number): void {
    this.#standAt(Math.min(this.orbit.maxDistance, this.camera.position.distanceTo(this.orbit.target) * Math.exp(WIDENING * dt)));
  }

  /** With reduced motion the view jumps; it does not come back, because it would jump twice. */
  #comeNearer(target: THREE.Vector3, dt: number): void {
    const distance = this.camera.position.distanceTo(this.orbit.target);
    if (this.reducedMotion || !(distance > this.#chosen)) return;
    this.#standAt(Math.max(this.#chosen, distance * Math.exp(-NEARING * dt)));
    if (!this.#sees(target, SPARE)) this.#standAt(distance);
  }

  /** @param distance m, from the middle */
  #standAt(distance: number): void {
    this.camera.position.sub(this.orbit.target).setLength(distance).add(this.orbit.target);
    this.camera.updateMatrixWorld();
  }
}
