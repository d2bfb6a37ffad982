import type { Hand } from '../hand';
import { multiply, normalize, rotation, type MutableQuat, type MutableVec3 } from '../frames';
import type { Session } from '../session';

const SPEED = 0.25; // m/s
const TURN = 0.8;   // rad/s

/** Axis and sign of each key, base frame; the first three move, the last three turn. */
const KEYS: Readonly<Record<string, readonly [number, number]>> = {
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 1], KeyD: [1, -1], KeyE: [2, 1], KeyQ: [2, -1],
  KeyJ: [5, 1], KeyL: [5, -1], KeyI: [4, 1], KeyK: [4, -1], KeyU: [3, 1], KeyO: [3, -1],
};

/** Rates along and about the axes: from keys or a gamepad. The hand moves while any is not zero, and is let go when all are. */
abstract class RateInput {
  protected readonly rates = new Float64Array(6);
  readonly #shift: MutableVec3 = [0, 0, 0];
  readonly #spin: MutableQuat = [0, 0, 0, 1];
  readonly #axis: MutableVec3 = [0, 0, 0];
  readonly #step: MutableQuat = [0, 0, 0, 1];
  #active = false;

  constructor(private readonly name: string, protected readonly hand: Hand, protected readonly session: Session,
              private readonly wantLease: () => void) {}

  /** @param dt s; @param eventTime s, of the event that this follows at once */
  protected advance(dt: number, held: boolean, eventTime?: number): void {
    const controls = this.session.state?.controls;
    if (!held || !controls) {
      if (this.#active) this.hand.release(this.name);
      this.#active = false;
      return;
    }
    if (!this.#active) {
      this.wantLease();
      if (!this.hand.grab(this.name)) return;
      this.#active = true;
      this.#shift.fill(0);
      this.#spin.fill(0);
      this.#spin[3] = 1;
    }
    const rate = Math.hypot(this.rates[3]!, this.rates[4]!, this.rates[5]!);
    for (let i = 0; i < 3; ++i) {
      this.#shift[i]! += this.rates[i]! * SPEED * dt;
      this.#axis[i] = this.rates[3 + i]! / rate;
    }
    if (rate > 0) normalize(multiply(rotation(this.#axis, rate * TURN * dt, this.#step), this.#spin, this.#spin), this.#spin);
    this.hand.lead(this.name, this.#shift, this.#spin, controls.scale, controls.yaw, eventTime);
  }
}

export class Keys extends RateInput {
  readonly #down = new Set<string>();
  readonly #add = (code: string): void => {
    const key = KEYS[code]!;
    this.rates[key[0]]! += key[1];
  };

  constructor(hand: Hand, session: Session, wantLease: () => void, onStop: () => void) {
    super('keys', hand, session, wantLease);
    addEventListener('keydown', (event) => {
      if (event.code === 'Escape' || (event.code === 'Space' && !(event.target instanceof HTMLButtonElement))) {
        event.preventDefault();
        return onStop();
      }
      if (event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) return;
      if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || !(event.code in KEYS)) return;
      this.#down.add(event.code);
      this.update(0, event.timeStamp / 1000);
    });
    addEventListener('keyup', (event) => { if (this.#down.delete(event.code)) this.update(0, event.timeStamp / 1000); });
    addEventListener('blur', () => {
      this.#down.clear();
      this.update(0);
    });
  }

  update(dt: number, eventTime?: number): void {
    this.rates.fill(0);
    this.#down.forEach(this.#add);
    this.advance(dt, this.#down.size > 0, eventTime);
  }
}

/** Right bumper held engages; left stick moves, right stick lifts and turns, button B stops. */
export class Gamepads extends RateInput {
  #stopHeld = false;
  #plugged = false;

  constructor(hand: Hand, session: Session, wantLease: () => void, private readonly onStop: () => void) {
    super('gamepad', hand, session, wantLease);
    // Asked 90 times a second, the browser makes its list anew each time.
    const look = (): void => { this.#plugged = this.#pad() !== undefined; };
    addEventListener('gamepadconnected', look);
    addEventListener('gamepaddisconnected', look);
    look();
  }

  #pad(): Gamepad | undefined {
    for (const pad of navigator.getGamepads?.() ?? []) {
      if (pad?.mapping === 'standard') return pad;
    }
    return undefined;
  }

  #stick(pad: Gamepad, axis: number): number {
    const value = pad.axes[axis] ?? 0;
    return Math.abs(value) > 0.12 ? -value : 0;
  }

  update(dt: number): void {
    const pad = this.#plugged && this.#pad();
    if (!pad) return this.advance(dt, false);
    const stop = pad.buttons[1]?.pressed ?? false;
    if (stop && !this.#stopHeld) this.onStop();
    this.#stopHeld = stop;
    this.rates[0] = this.#stick(pad, 1);
    this.rates[1] = this.#stick(pad, 0);
    this.rates[2] = this.#stick(pad, 3);
    this.rates[5] = this.#stick(pad, 2);
    this.advance(dt, pad.buttons[5]?.pressed ?? false);
  }
}
