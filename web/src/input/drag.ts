import * as THREE from 'three';
import { TransformControls } from 'three/examples/jsm/controls/TransformControls.js';
import type { Hand } from '../hand';
import type { MutableQuat, MutableVec3 } from '../frames';
import { STAYS_UPRIGHT, type Session } from '../session';
import { Lately } from '../scene/lately';
import type { Stage } from '../scene/stage';
import { clearTheMiddle, sizeOf } from './handles';
import { Reach } from './reach';

/** s; mice that report their motion more often are read this often. */
const RAW_EVERY = 0.004;
/** rad/s of the hand: half of what counts as a jump. */
const FASTEST_TURN = 15;
/** s, of a pause that the hand catches up. */
const PAUSE = 0.05;

/** Of the handles of a tool that is not active; a finger needs them as large. */
const SMALLER = 0.7;

/**
 * Handles on a tool's target for mouse and touch, and the glass itself, which may be elsewhere: a press engages, its end
 * releases.
 */
export class Drag {
  readonly controls: TransformControls;
  readonly #proxy = new THREE.Object3D();
  readonly #follower: THREE.Object3D;
  readonly #glass = new Lately(); // world frame
  readonly #coarse = matchMedia('(pointer: coarse)').matches;
  readonly #at = new THREE.Vector3(); // world frame
  readonly #startTurn = new THREE.Quaternion();
  readonly #turn = new THREE.Quaternion();
  readonly #reach = new Reach();
  /** The turn last sent to the hand, on its way to the turn of the handle. */
  readonly #toldTurn = new THREE.Quaternion();
  #toldAt = 0; // s
  readonly #shift: MutableVec3 = [0, 0, 0];
  readonly #spin: MutableQuat = [0, 0, 0, 1];
  /** In the form that TransformControls takes: position in the picture, no changed button. */
  readonly #pointer = { x: 0, y: 0, button: -1 };
  /** s, of the newest event, and of the one that last moved the hand. */
  #eventTime = 0;
  #ledTime = 0;
  #holding = false;

  constructor(private readonly stage: Stage, private readonly hand: Hand, private readonly session: Session,
              private readonly wantLease: () => boolean, private readonly canvas: HTMLCanvasElement, readonly tool = 0) {
    stage.base.add(this.#proxy);
    this.controls = new TransformControls(stage.view.camera, canvas);
    this.#follower = clearTheMiddle(this.controls);
    this.controls.space = 'local';
    this.controls.attach(this.#proxy);
    stage.scene.add(this.controls.getHelper());
    // Our listener sees the event before the handle moves, so that the sample carries the event's time.
    for (const type of ['pointerdown', 'pointermove'] as const) {
      canvas.addEventListener(type, (event) => { this.#eventTime = event.timeStamp / 1000; }, { capture: true });
    }
    // `pointermove` waits for the next frame; `pointerrawupdate`, where available, does not.
    canvas.addEventListener('pointerrawupdate', (event) => this.#moved(event as PointerEvent));
    this.controls.addEventListener('dragging-changed', (event) => this.#held(event.value === true));
    this.controls.addEventListener('axis-changed', (event) => { canvas.style.cursor = event.value ? 'grab' : ''; });
    this.controls.addEventListener('objectChange', () => this.lead());
    canvas.addEventListener('pointercancel', () => this.#held(false));
    addEventListener('blur', () => this.#held(false));
  }

  get holding(): boolean { return this.#holding; }

  setMode(mode: 'translate' | 'rotate'): void { this.controls.setMode(mode); }

  /** @param free no other handle is held */
  show(shown: boolean, free = true): void {
    // Handles that are hidden during a drag would miss its end.
    if (!shown) this.controls.dragging = false;
    this.controls.getHelper().visible = shown;
    this.controls.enabled = shown && free;
  }

  /** Another handle takes the press: this one does not see it. */
  pass(): void {
    this.controls.enabled = false;
    this.controls.axis = null;
  }

  /** 90 times a second: while engaged, the hand is reported even when it does not move. */
  report(): void {
    if (this.#holding) this.lead(true);
  }

  /** Every frame: the handles stay on the target. */
  follow(): void {
    const target = this.session.state?.tools[this.tool]?.target, size = sizeOf(this.stage.view.camera, this.#proxy.getWorldPosition(this.#at), this.#coarse, this.canvas.clientHeight);
    this.controls.size = this.tool === this.session.active || this.#coarse ? size : SMALLER * size;
    const frame = this.stage.arm?.tools[this.tool];
    if (frame) {
      this.#follower.matrixWorld.setPosition(frame.getWorldPosition(this.#at));
      this.#glass.see(this.#at, performance.now() / 1000);
    }
    if (!target || this.#holding) return;
    // Upright handles: they move along the base's axes.
    this.#proxy.position.set(target.p[0], target.p[1], target.p[2]);
    this.#proxy.quaternion.identity();
  }

  #moved(event: PointerEvent): void {
    const time = event.timeStamp / 1000;
    if (!this.#holding || time - this.#ledTime < RAW_EVERY) return;
    this.#eventTime = time;
    this.controls.pointerMove(this.#place(event));
  }

  #place({ clientX, clientY }: PointerEvent): PointerEvent {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    this.#pointer.x = (2 * (clientX - left)) / width - 1;
    this.#pointer.y = 1 - (2 * (clientY - top)) / height;
    return this.#pointer as PointerEvent;
  }

  /** Whether the press is on this handle. Runs before the view's listener: the view must not turn where a handle is. */
  takes(event: PointerEvent): boolean {
    if (this.#holding || !this.controls.enabled) return false;
    const at = this.#place(event), isHit = (): boolean => {
      this.controls.pointerHover(at);
      return this.controls.axis !== null;
    };
    // A pointer aims at where a moving glass was seen; the next frame puts its handle back.
    const wasHit = (glass: THREE.Vector3): boolean => {
      this.#follower.matrixWorld.setPosition(glass);
      return isHit();
    };
    if (!isHit() && !this.#glass.find(wasHit, performance.now() / 1000)) return false;
    this.stage.view.orbit.enabled = false;
    setTimeout(() => { this.stage.view.orbit.enabled = !this.#holding; });
    return true;
  }

  /** Takes over from another input device: the new engagement starts at the glass, wherever the target is. */
  #takeOver(): void {
    const tool = this.session.state?.tools[this.tool], { _positionStart: from } = this.controls as unknown as { _positionStart: THREE.Vector3 };
    if (tool?.state === 'engaged') this.#proxy.position.copy(from.fromArray(tool.pose.p));
  }

  #held(held: boolean): void {
    if (held === this.#holding) return;
    this.stage.view.orbit.enabled = !held;
    if (held) {
      this.hand.grab('drag', this.wantLease());
      this.#takeOver();
      this.#holding = true;
      this.#startTurn.copy(this.#proxy.quaternion);
      this.#toldTurn.identity();
      this.#toldAt = performance.now() / 1000;
      this.#reach.begin(this.#proxy.position, this.#toldAt);
      if (this.controls.mode === 'rotate' && this.controls.axis !== 'Z' && this.session.staysUpright) this.session.hint(STAYS_UPRIGHT, performance.now() / 1000);
      this.lead(true);
    } else {
      this.#holding = false;
      this.hand.release('drag');
    }
  }

  lead(idle = false): void {
    const { state } = this.session, tool = state?.tools[this.tool];
    if (!this.#holding || !state || !tool || (!idle && this.#eventTime <= this.#ledTime)) return;
    if (!idle) this.#ledTime = this.#eventTime;
    const now = performance.now() / 1000, passed = Math.min(now - this.#toldAt, PAUSE);
    this.#toldAt = now;
    this.#turn.copy(this.#startTurn).invert().premultiply(this.#proxy.quaternion);
    this.#toldTurn.rotateTowards(this.#turn, FASTEST_TURN * passed);
    const { scale, yaw } = state.controls;
    this.#reach.toward(this.#proxy.position, tool, state.now_s, scale, now);
    this.#reach.shift.toArray(this.#shift);
    this.#toldTurn.toArray(this.#spin);
    this.hand.lead('drag', this.#shift, this.#spin, scale, yaw, idle ? undefined : this.#eventTime);
  }
}

/**
 * Gives each press in the scene to one handle only: to the active tool's, if both are under the pointer. While one is
 * held, a second finger holds none.
 * @param activate the handle of another tool is pressed
 */
export function listenForPresses(canvas: HTMLCanvasElement, drags: readonly Drag[], activate: (tool: number) => void, active: () => number): void {
  canvas.addEventListener('pointerdown', (event) => {
    const first = drags[active()], taker = first?.takes(event) ? first : drags.find((drag) => drag !== first && drag.takes(event));
    if (!taker) return;
    for (const drag of drags) if (drag !== taker) drag.pass();
    activate(taker.tool);
  }, { capture: true });
}
