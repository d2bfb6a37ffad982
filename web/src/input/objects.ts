import * as THREE from 'three';
import type { Connection } from '../connection';
import type { CellObject, PlacedShape } from '../protocol';
import type { Stage } from '../scene/stage';
import type { Session } from '../session';

/** s, between two positions sent to the server while an object is dragged. */
const TELL_EVERY = 0.05;
/** Of an added box: size, m, and position. */
const SIZE = 0.2, BESIDE = new THREE.Vector3(0.45, 0.45, 0.1);
/**
 * m from the base, the limit for dragging. A pointer near the horizon meets the floor far away, or behind the camera.
 */
const FURTHEST = 2;

/** The members of an object that the server accepts back; it refuses others, and clients that keep sending them. */
const TAKEN = ['shape', 'radius', 'length', 'size', 'rounding', 'margin'];
const shapeOf = (object: CellObject) => Object.fromEntries(Object.entries(object).filter(([member]) => TAKEN.includes(member)));

/** Obstacles, moved over the floor by mouse and touch if this client has control, or may take it. */
export class Objects {
  readonly #ray = new THREE.Raycaster();
  readonly #pointer = new THREE.Vector2();
  readonly #floor = new THREE.Plane();
  readonly #from = new THREE.Vector3();
  readonly #to = new THREE.Vector3();
  readonly #start = new THREE.Vector3();
  #held: CellObject | null = null;
  /** Of the mouse or finger that drags it. */
  #pointerId = 0;
  #last = '';
  #toldAt = 0;
  #moved = false;

  constructor(private readonly stage: Stage, private readonly onHandle: () => boolean, private readonly session: Session,
              private readonly connection: Connection, canvas: HTMLCanvasElement, private readonly takeLease: () => void) {
    // Before the camera's listener, which must not turn the view as well.
    canvas.addEventListener('pointerdown', (event) => this.#grab(event, canvas), { capture: true });
    addEventListener('pointermove', (event) => this.#move(event, canvas));
    for (const end of ['pointerup', 'pointercancel'] as const) addEventListener(end, (event) => { if (event.pointerId === this.#pointerId) this.#release(); });
    addEventListener('blur', () => this.#release());
  }

  /** The object that the active tool carries; otherwise the last added or dragged one that still exists; empty: none. */
  get chosen(): string { return this.stage.surroundings.carriedOr(this.#last, this.session.active); }

  /** The active tool carries an object. */
  get carries(): boolean { return this.stage.surroundings.carriedOr('', this.session.active) !== ''; }

  get #may(): boolean { return this.session.mayTake && !this.session.past; }

  addBox(): void {
    if (!this.#may) return;
    const names = new Set(this.stage.surroundings.objects.map((object) => object.name));
    let number = 1;
    while (names.has(`box ${number}`)) ++number;
    this.#last = `box ${number}`;
    this.#tell(this.#last, { shape: 'box', size: [SIZE, SIZE, SIZE], rounding: 0.005, p: [BESIDE.x, BESIDE.y, BESIDE.z], q: [0, 0, 0, 1] });
  }

  /** The active tool takes the last added or dragged object, or releases the one it has. */
  carry(): void {
    if (!this.#may) return;
    const tool = this.session.active, carried = this.stage.surroundings.objects.find((object) => object.attached && (object.tool ?? 0) === tool);
    const text = carried?.name ?? this.#last;
    if (!text) return;
    this.takeLease();
    if (carried) this.connection.send({ type: 'request', kind: 'detach', text });
    else this.connection.send({ type: 'request', kind: 'attach', text, ...(tool > 0 && { tool }) });
  }

  /** Removes the last added or dragged object. */
  remove(): void {
    if (!this.#may || !this.#last) return;
    this.#tell(this.#last, null);
    this.#last = '';
  }

  /** Every frame: the dragged object stays under the pointer, even before the server has its position. */
  draw(): void {
    if (!this.#held) return;
    if (!this.#may) return this.#release();
    this.stage.surroundings.solid(this.#held.name)?.position.copy(this.#to);
    const t = performance.now() / 1000;
    if (!this.#moved || t - this.#toldAt < TELL_EVERY) return;
    this.#toldAt = t;
    this.#place();
  }

  #aim(event: PointerEvent, canvas: HTMLCanvasElement): void {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    this.#pointer.set((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height);
    this.#ray.setFromCamera(this.#pointer, this.stage.view.camera);
  }

  #grab(event: PointerEvent, canvas: HTMLCanvasElement): void {
    if (this.#held || !this.#may || event.button !== 0 || this.onHandle()) return;
    this.#aim(event, canvas);
    this.#held = this.stage.surroundings.under(this.#ray, this.#from);
    if (!this.#held) return;
    event.stopPropagation();
    this.#pointerId = event.pointerId;
    this.stage.view.orbit.enabled = false;
    this.#last = this.#held.name;
    this.#floor.setFromNormalAndCoplanarPoint(new THREE.Vector3(0, 1, 0), this.#from);
    this.stage.base.worldToLocal(this.#from);
    this.#start.copy(this.stage.surroundings.solid(this.#last)!.position);
    this.#to.copy(this.#start);
    this.#moved = false;
  }

  #move(event: PointerEvent, canvas: HTMLCanvasElement): void {
    if (!this.#held || event.pointerId !== this.#pointerId) return;
    this.#aim(event, canvas);
    if (!this.#ray.ray.intersectPlane(this.#floor, this.#to)) return;
    this.stage.base.worldToLocal(this.#to).sub(this.#from).add(this.#start);
    const out = Math.hypot(this.#to.x, this.#to.y), most = Math.max(FURTHEST, Math.hypot(this.#start.x, this.#start.y));
    if (out > most) this.#to.set((this.#to.x * most) / out, (this.#to.y * most) / out, this.#to.z);
    this.#moved = true;
  }

  #release(): void {
    if (!this.#held) return;
    if (this.#may && this.#moved) this.#place();
    if (!this.#may) this.stage.surroundings.standAsTold(this.#held.name);
    this.#held = null;
    this.stage.view.orbit.enabled = true;
  }

  #place(): void {
    const held = this.#held!, q = this.stage.surroundings.solid(held.name)?.quaternion;
    if (!q) return;
    this.#moved = false;
    this.#tell(held.name, { ...shapeOf(held), p: [this.#to.x, this.#to.y, this.#to.z], q: [q.x, q.y, q.z, q.w] } as unknown as PlacedShape);
  }

  #tell(name: string, object: PlacedShape | null): void {
    this.takeLease();
    this.connection.send({ type: 'request', kind: 'object', text: name, object });
  }
}
