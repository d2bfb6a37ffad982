import * as THREE from 'three';
import { metaQuest3, XRDevice } from 'iwer';
import { P_SPACE } from 'iwer/lib/private.js';

/** The WebXR names of a Quest's buttons. */
type Button = 'squeeze' | 'trigger' | 'a-button';
/** Of a mouse, in `MouseEvent.buttons`: the main button and the wheel engage, the other button is the trigger. */
const GRIPS = 1 | 4, TRIGGERS = 2;
const REACH = 0.0016; // m of the hand for each pixel of the mouse
/** Position of the hand: share of the way to what it points at; m to the right of and below the line of sight. */
const HALFWAY = 0.5, ASIDE = { right: 0.1, down: 0.14 };
/** m, distance of what the mouse points at where that is not the board; and the range of the wheel. */
const AWAY = 1.25, NEAR = 0.5, FAR = 2.5;
/** rad: turn for each press of an arrow key; largest nod of the head. */
const TURN = 0.1, NOD = 0.9;
/** rad, height of the picture: narrower than that of lenses, for a screen. */
const FIELD = 1.15;
/** In front of the arm and facing it, with the board to the left. m; rad to the left and up. */
const HEAD = { p: [-0.5, 1.55, -0.1], yaw: -0.2, pitch: -0.18 } as const;

function look(device: XRDevice, yaw: number, pitch: number): void {
  const cy = Math.cos(yaw / 2), sy = Math.sin(yaw / 2), cp = Math.cos(pitch / 2), sp = Math.sin(pitch / 2);
  device.quaternion.set(cy * sp, sy * cp, -sy * sp, cy * cp);
}

/** A Quest 3 in place of the browser's own WebXR. */
export function emulatedQuest(): XRDevice {
  const device = new XRDevice(metaQuest3);
  device.installRuntime({ forceInstall: true } as never);
  device.position.set(...HEAD.p);
  device.fovy = FIELD;
  look(device, HEAD.yaw, HEAD.pitch);
  device.controllers.right?.position.set(-0.08, 1.17, -0.62);
  device.controllers.left?.position.set(-0.9, 0.85, -0.5); // hangs down and does not move
  // iwer marks all its positions as emulated (estimated); these are known.
  for (const controller of Object.values(device.controllers)) {
    const space = controller?.inputSource.gripSpace;
    if (space) space[P_SPACE].emulated = false;
  }
  return device;
}

/**
 * A mouse and a few keys as the right hand of an emulated headset, or after H as the other, while a session runs. A press engages; motion moves
 * the hand across the view, the wheel moves it back and forth. While not engaged, the hand is under the mouse. The
 * other button pulls the trigger; on the board both buttons press. The arrow keys turn the head, Home turns it back.
 */
export class EmulatedHand {
  #running = false;
  /** The mouse is this hand. */
  #side: 'right' | 'left' = 'right';
  #yaw: number = HEAD.yaw;
  #pitch: number = HEAD.pitch;
  readonly #keys: Readonly<Record<string, () => void>>;
  /** The picture's place in the page, below all that covers it. */
  readonly #before: ChildNode | null;

  /** Pressed, but not yet seen by a frame of the headset; and those of them that are released already. */
  readonly #unseen = new Set<Button>();
  readonly #opened = new Set<Button>();
  #held = false;
  #pulled = false;
  #away = AWAY;
  /** The mouse is on the board: a press there presses an item and does not engage. */
  #onBoard = false;
  #presses = false;
  readonly #eye = new THREE.Vector3();
  readonly #sight = new THREE.Vector3();
  readonly #at = new THREE.Vector3();
  readonly #hand = new THREE.Vector3();
  readonly #up = new THREE.Vector3(0, 1, 0);
  readonly #gaze = new THREE.Quaternion();
  readonly #frame = new THREE.Matrix4();

  /** @param boardAt distance to the board, m, from a point along a direction, both in the world frame; null: not met */
  constructor(private readonly device: XRDevice, private readonly canvas: HTMLCanvasElement,
              private readonly boardAt: (from: THREE.Vector3, along: THREE.Vector3) => number | null) {
    this.#before = canvas.nextSibling;
    const turn = (yaw: number, pitch: number) => () => this.#look(this.#yaw + yaw, this.#pitch + pitch);
    this.#keys = {
      ArrowLeft: turn(TURN, 0), ArrowRight: turn(-TURN, 0), ArrowUp: turn(0, TURN), ArrowDown: turn(0, -TURN),
      Home: () => this.#look(HEAD.yaw, HEAD.pitch), KeyF: () => this.#tap('a-button'),
      KeyH: () => { if (!this.#held && !this.#pulled && this.#unseen.size === 0) this.#side = this.#side === 'right' ? 'left' : 'right'; },
    };
    const listen = <K extends keyof HTMLElementEventMap>(type: K, act: (event: HTMLElementEventMap[K]) => void) => {
      canvas.addEventListener(type, (event) => {
        if (!this.#running) return;
        // The camera is the head now: orbiting would move it, too.
        event.stopImmediatePropagation();
        event.preventDefault();
        act(event);
      }, { capture: true, passive: false });
    };
    listen('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#point(event);
      this.#hold(event.buttons);
    });
    listen('pointermove', (event) => {
      this.#hold(event.buttons); // while a button is down, browsers report another press or release as a move
      if (this.#held) this.#move(event.movementX * REACH, -event.movementY * REACH, 0);
      else this.#point(event);
    });
    for (const type of ['pointerup', 'pointercancel'] as const) listen(type, () => this.#hold(0));
    listen('wheel', (event) => {
      const back = Math.sign(event.deltaY) * 0.02;
      if (this.#held) return this.#move(0, 0, back);
      this.#away = Math.min(FAR, Math.max(NEAR, this.#away - 2 * back));
      this.#point(event);
    });
    listen('contextmenu', () => undefined);
    addEventListener('keydown', (event) => {
      const act = this.#keys[event.code];
      if (!this.#running || !act || event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) return; // arrows are theirs
      event.preventDefault(); // the page must not scroll
      act();
    });
    addEventListener('blur', () => this.#hold(0));
  }

  set running(running: boolean) {
    this.#running = running;
    if (running) {
      this.#look(HEAD.yaw, HEAD.pitch);
      return;
    }
    this.#hold(0);
    this.#settle();
    // iwer leaves the canvas on top of the page.
    setTimeout(() => this.#before?.parentElement?.insertBefore(this.canvas, this.#before));
  }

  /**
   * In each frame of the headset, which has now seen all presses. @param ratio pixels of the picture to those of the
   * page
   */
  update(ratio: number): void {
    this.#settle();
    this.#fit(ratio);
  }

  /** iwer makes the picture as large as the window; here it is a part of the window. */
  #fit(ratio: number): void {
    const canvas = this.device.appCanvas, box = this.device.canvasContainer;
    if (!this.#running || !canvas || !box.clientWidth) return;
    const width = Math.round(box.clientWidth * ratio), height = Math.round(box.clientHeight * ratio);
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
  }

  #look(yaw: number, pitch: number): void {
    this.#yaw = yaw;
    this.#pitch = Math.min(NOD, Math.max(-NOD, pitch));
    look(this.device, this.#yaw, this.#pitch);
  }

  /** While not engaged, the hand is under the mouse and points at what is there. */
  #point(event: MouseEvent): void {
    const hand = this.device.controllers[this.#side], { left, top, width, height } = this.canvas.getBoundingClientRect();
    if (!hand || !width || !height) return;
    const { position: p, quaternion: q } = this.device, half = Math.tan(FIELD / 2);
    this.#eye.set(p.x, p.y, p.z);
    this.#gaze.set(q.x, q.y, q.z, q.w);
    this.#sight.set(((2 * (event.clientX - left)) / width - 1) * half * (width / height), (1 - (2 * (event.clientY - top)) / height) * half, -1);
    this.#sight.normalize().applyQuaternion(this.#gaze);
    const board = this.boardAt(this.#eye, this.#sight), away = board ?? this.#away;
    this.#onBoard = board !== null;
    this.#at.copy(this.#eye).addScaledVector(this.#sight, away);
    this.#hand.set(ASIDE.right, -ASIDE.down, 0).applyQuaternion(this.#gaze).add(this.#eye).addScaledVector(this.#sight, HALFWAY * away);
    this.#gaze.setFromRotationMatrix(this.#frame.lookAt(this.#hand, this.#at, this.#up));
    hand.position.set(this.#hand.x, this.#hand.y, this.#hand.z);
    hand.quaternion.set(this.#gaze.x, this.#gaze.y, this.#gaze.z, this.#gaze.w);
  }

  /** m, along the head's axes without its nod. */
  #move(right: number, up: number, back: number): void {
    const hand = this.device.controllers[this.#side];
    if (!hand) return;
    const c = Math.cos(this.#yaw), s = Math.sin(this.#yaw);
    const p = hand.position;
    p.set(p.x + c * right + s * back, p.y + up, p.z - s * right + c * back);
  }

  /** @param buttons of the mouse that are down */
  #hold(buttons: number): void {
    const down = (buttons & GRIPS) !== 0;
    if (!down) this.#presses = false;
    else if (!this.#held && this.#onBoard) this.#presses = true;
    const held = down && !this.#presses;
    if (held !== this.#held) this.#press('squeeze', held);
    this.#held = held;
    const pulled = (buttons & TRIGGERS) !== 0 || this.#presses;
    if (pulled !== this.#pulled) this.#press('trigger', pulled);
    this.#pulled = pulled;
  }

  /** A press shorter than a frame lasts one frame. */
  #press(button: Button, down: boolean): void {
    if (!down && this.#unseen.has(button)) {
      this.#opened.add(button);
      return;
    }
    if (down) {
      this.#unseen.add(button);
      this.#opened.delete(button);
    }
    const side = button === 'a-button' ? 'right' : this.#side;
    this.device.controllers[side]?.updateButtonValue(button, Number(down));
  }

  /** Releases what was released before a frame saw its press. */
  #settle(): void {
    this.#unseen.clear();
    for (const button of this.#opened) this.#press(button, false);
    this.#opened.clear();
  }

  #tap(button: Button): void {
    this.#press(button, true);
    this.#press(button, false);
  }
}
