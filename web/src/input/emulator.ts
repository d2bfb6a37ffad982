import { metaQuest3, XRDevice } from 'iwer';
import { P_SPACE } from 'iwer/lib/private.js';

/** The WebXR names of a Quest's buttons. */
type Button = 'squeeze' | 'trigger' | 'a-button';
const REACH = 0.0016; // m of the hand for each pixel of the mouse
/** rad, of a press of an arrow key; and how far the head nods at most. */
const TURN = 0.1, NOD = 0.9;
/** rad, of the picture's height: narrower than the lenses', for a picture on a screen. */
const FIELD = 1.15;
/** Before the arm and facing it, with the board to the left. m, and rad: to the left, and up. */
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
  device.controllers.left?.position.set(-0.85, 1.1, -0.7);
  // iwer calls all its poses guesses; these are known.
  for (const controller of Object.values(device.controllers)) {
    const space = controller?.inputSource.gripSpace;
    if (space) space[P_SPACE].emulated = false;
  }
  return device;
}

/**
 * A mouse and a few keys as the right hand of a headset that the page emulates: pressing grips, moving moves it across the
 * view, the wheel to and fro; the other button pulls the trigger; the arrow keys turn the head, Home turns it back. While a session runs.
 */
export class EmulatedHand {
  #running = false;
  #yaw: number = HEAD.yaw;
  #pitch: number = HEAD.pitch;
  readonly #keys: Readonly<Record<string, () => void>>;
  /** Where the picture stands in the page, under all that lies over it. */
  readonly #before: ChildNode | null;

  constructor(private readonly device: XRDevice, private readonly canvas: HTMLCanvasElement) {
    this.#before = canvas.nextSibling;
    const turn = (yaw: number, pitch: number) => () => this.#look(this.#yaw + yaw, this.#pitch + pitch);
    this.#keys = {
      ArrowLeft: turn(TURN, 0), ArrowRight: turn(-TURN, 0), ArrowUp: turn(0, TURN), ArrowDown: turn(0, -TURN),
      Home: () => this.#look(HEAD.yaw, HEAD.pitch), KeyF: () => this.#tap('a-button'),
    };
    const listen = <K extends keyof HTMLElementEventMap>(type: K, act: (event: HTMLElementEventMap[K]) => void) => {
      canvas.addEventListener(type, (event) => {
        if (!this.#running) return;
        // The camera is the head now: orbiting would fight it.
        event.stopImmediatePropagation();
        event.preventDefault();
        act(event);
      }, { capture: true, passive: false });
    };
    listen('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#press(event.button === 2 ? 'trigger' : 'squeeze', 1);
    });
    listen('pointermove', (event) => this.#move(event.movementX * REACH, -event.movementY * REACH, 0));
    for (const type of ['pointerup', 'pointercancel'] as const) {
      listen(type, (event) => this.#press(event.button === 2 ? 'trigger' : 'squeeze', 0));
    }
    listen('wheel', (event) => this.#move(0, 0, Math.sign(event.deltaY) * 0.02));
    listen('contextmenu', () => undefined);
    addEventListener('keydown', (event) => {
      const act = this.#keys[event.code];
      if (!this.#running || !act || event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) return; // arrows are theirs
      event.preventDefault(); // nor does the page scroll
      act();
    });
    addEventListener('blur', () => this.#press('squeeze', 0));
  }

  set running(running: boolean) {
    this.#running = running;
    if (running) return;
    this.#press('squeeze', 0);
    // iwer leaves it above all else there.
    setTimeout(() => this.#before?.parentElement?.insertBefore(this.canvas, this.#before));
  }

  /** iwer makes the picture as large as the window; here it has a part of it. @param ratio pixels of the picture to those of the page */
  fit(ratio: number): void {
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

  /** m, along the head's own axes, but for its nod. */
  #move(right: number, up: number, back: number): void {
    const hand = this.device.controllers.right;
    if (!hand) return;
    const c = Math.cos(this.#yaw), s = Math.sin(this.#yaw);
    const p = hand.position;
    p.set(p.x + c * right + s * back, p.y + up, p.z - s * right + c * back);
  }

  #press(button: Button, value: number): void { this.device.controllers.right?.updateButtonValue(button, value); }

  #tap(button: Button): void {
    this.#press(button, 1);
    setTimeout(() => this.#press(button, 0), 60);
  }
}
