import type { Hand } from '../hand';
import { multiply, normalize, rotation } from '../frames';
import type { Quat, Vec3 } from '../protocol';
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
  protected readonly rates = [0, 0, 0, 0, 0, 0];
  #shift: Vec3 = [0, 0, 0];
  #spin: Quat = [0, 0, 0, 1];
  #active = false;

  constructor(private readonly name: string, protected readonly hand: Hand, protected readonly session: Session,
              private readonly wantLease: () => void) {}

  /** @param dt s */
  protected advance(dt: number, held: boolean): void {
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
      this.#shift = [0, 0, 0];
      this.#spin = [0, 0, 0, 1];
    }
    const [x, y, z, rx, ry, rz] = this.rates as [number, number, number, number, number, number];
    this.#shift = [this.#shift[0] + x * SPEED * dt, this.#shift[1] + y * SPEED * dt, this.#shift[2] + z * SPEED * dt];
    const rate = Math.hypot(rx, ry, rz);
    if (rate > 0) this.#spin = normalize(multiply(rotation([rx / rate, ry / rate, rz / rate], rate * TURN * dt), this.#spin));
    this.hand.lead(this.name, this.#shift, this.#spin, controls.scale, controls.yaw);
  }
}

export class Keys extends RateInput {
  readonly #down = new Set<string>();

  constructor(hand: Hand, session: Session, wantLease: () => void, onStop: () => void) {
    super('keys', hand, session, wantLease);
    addEventListener('keydown', (event) => {
      if (event.code === 'Escape' || (event.code === 'Space' && !(event.target instanceof HTMLButtonElement))) {
        event.preventDefault();
        return onStop();
      }
      if (event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) return;
      if (event.ctrlKey || event.altKey || event.metaKey || !(event.code in KEYS)) return;
      this.#down.add(event.code);
    });
    addEventListener('keyup', (event) => this.#down.delete(event.code));
    addEventListener('blur', () => this.#down.clear());
  }

  update(dt: number): void {
    this.rates.fill(0);
    for (const code of this.#down) {
      const [axis, sign] = KEYS[code]!;
      this.rates[axis]! += sign;
    }
    this.advance(dt, this.#down.size > 0);
  }
}

/** Right bumper held engages; left stick moves, right stick lifts and turns, button B stops. */
export class Gamepads extends RateInput {
  #stopHeld = false;

  constructor(hand: Hand, session: Session, wantLease: () => void, private readonly onStop: () => void) {
    super('gamepad', hand, session, wantLease);
  }

  update(dt: number): void {
    const pad = navigator.getGamepads?.().find((one) => one?.mapping === 'standard');
    if (!pad) return this.advance(dt, false);
    const stop = pad.buttons[1]?.pressed ?? false;
    if (stop && !this.#stopHeld) this.onStop();
    this.#stopHeld = stop;
    const axis = (i: number): number => {
      const value = pad.axes[i] ?? 0;
      return Math.abs(value) > 0.12 ? -value : 0;
    };
    this.rates[0] = axis(1);
    this.rates[1] = axis(0);
    this.rates[2] = axis(3);
    this.rates[5] = axis(2);
    this.advance(dt, pad.buttons[5]?.pressed ?? false);
  }
}
