import { metaQuest3, XRDevice } from 'iwer';
import { P_SPACE } from 'iwer/lib/private.js';

/** The WebXR names of a Quest's buttons. */
type Button = 'squeeze' | 'trigger' | 'a-button';
const REACH = 0.0016; // m of the hand for each pixel of the mouse

/** A Quest 3 in place of the browser's own WebXR, before the arm and facing it. */
export function emulatedQuest(): XRDevice {
  const device = new XRDevice(metaQuest3);
  device.installRuntime({ forceInstall: true } as never);
  device.position.set(-0.5, 1.55, -0.1);
  device.quaternion.set(-0.1, -0.17, -0.017, 0.98);
  device.controllers.right?.position.set(-0.18, 1.25, -0.6);
  device.controllers.left?.position.set(-0.62, 1.2, -0.5);
  // iwer calls all its poses guesses; these are known.
  for (const controller of Object.values(device.controllers)) {
    const space = controller?.inputSource.gripSpace;
    if (space) space[P_SPACE].emulated = false;
  }
  return device;
}

/**
 * A mouse and a few keys as the right hand of a headset that the page emulates: pressing grips, moving moves it across the
 * view, the wheel to and fro; the other button pulls the trigger; the arrow keys turn the head. While a session runs.
 */
export class EmulatedHand {
  #running = false;
  readonly #keys: Readonly<Record<string, () => void>>;
  /** Where the picture stands in the page, under all that lies over it. */
  readonly #before: ChildNode | null;

  constructor(private readonly device: XRDevice, private readonly canvas: HTMLCanvasElement) {
    this.#before = canvas.nextSibling;
    const turn = (angle: number) => () => {
      const q = device.quaternion, half = Math.atan2(q.y, q.w) + angle / 2;
      q.set(0, Math.sin(half), 0, Math.cos(half));
    };
    this.#keys = { ArrowLeft: turn(0.1), ArrowRight: turn(-0.1), KeyF: () => this.#tap('a-button') };
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
    addEventListener('keydown', (event) => { if (this.#running) this.#keys[event.code]?.(); });
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

  /** m, along the head's own axes. */
  #move(right: number, up: number, back: number): void {
    const hand = this.device.controllers.right;
    if (!hand) return;
    const q = this.device.quaternion, heading = 2 * Math.atan2(q.y, q.w), c = Math.cos(heading), s = Math.sin(heading);
    const p = hand.position;
    p.set(p.x + c * right + s * back, p.y + up, p.z - s * right + c * back);
  }

  #press(button: Button, value: number): void { this.device.controllers.right?.updateButtonValue(button, value); }

  #tap(button: Button): void {
    this.#press(button, 1);
    setTimeout(() => this.#press(button, 0), 60);
  }
}
