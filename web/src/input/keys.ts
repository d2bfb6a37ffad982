import type { Hand } from '../hand';
import { multiply, normalize, rotation, turn, type MutableQuat, type MutableVec3 } from '../frames';
import { LOOKS_THE_SAME, STAYS_UPRIGHT, type Session } from '../session';
import { Trigger } from './controllers';
import { isTyped } from './shortcuts';

const SPEED = 0.25; // m/s
const TURN = 0.8;   // rad/s

/**
 * Axis (x away from the operator, y to the left of the picture, z up) and sign of each key; the first three move, the
 * last three turn.
 */
const KEYS: Readonly<Record<string, readonly [number, number]>> = {
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 1], KeyD: [1, -1], KeyE: [2, 1], KeyQ: [2, -1],
  KeyJ: [5, 1], KeyL: [5, -1], KeyI: [4, 1], KeyK: [4, -1], KeyU: [3, 1], KeyO: [3, -1],
};

/** Rates along and about the picture's axes, from keys or a gamepad, while these engage. */
abstract class RateInput {
  protected readonly rates = new Float64Array(6);
  readonly #shift: MutableVec3 = [0, 0, 0];
  readonly #spin: MutableQuat = [0, 0, 0, 1];
  readonly #way: MutableVec3 = [0, 0, 0];
  readonly #axis: MutableVec3 = [0, 0, 0];
  readonly #step: MutableQuat = [0, 0, 0, 1];
  #held = false;

  /** @param looks rad, about the base's z: the operator's viewing direction, from the arm's forward */
  constructor(private readonly name: string, protected readonly hand: Hand, protected readonly session: Session,
              private readonly wantLease: () => boolean, private readonly looks: () => number) {}

  /** @param dt s @param eventTime s, of the event that this call follows at once */
  protected advance(dt: number, held: boolean, eventTime?: number): void {
    const controls = this.session.state?.controls;
    if (!held || !controls) {
      this.#held = false;
      return this.hand.release(this.name);
    }
    if (!this.#held) {
      // If another input device has the hand, this engagement is lost to it, even after that device releases.
      this.#held = true;
      this.hand.grab(this.name, this.wantLease());
      this.#shift.fill(0);
      this.#spin.fill(0);
      this.#spin[3] = 1;
    }
    const rate = Math.hypot(this.rates[3]!, this.rates[4]!, this.rates[5]!), heading = this.looks();
    for (let i = 0; i < 3; ++i) {
      this.#way[i] = this.rates[i]! * SPEED * dt;
      this.#axis[i] = this.rates[3 + i]! / rate;
    }
    turn(this.#way, heading, this.#way);
    turn(this.#axis, heading, this.#axis);
    for (let i = 0; i < 3; ++i) this.#shift[i]! += this.#way[i]!;
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

  constructor(hand: Hand, session: Session, wantLease: () => boolean, looks: () => number) {
    super('keys', hand, session, wantLease, looks);
    addEventListener('keydown', (event) => {
      if (isTyped(event.target) || event.ctrlKey || event.altKey || event.metaKey || !(event.code in KEYS)) return;
      event.preventDefault(); // otherwise a list with the focus would search for a name with this letter
      if (event.repeat) return;
      this.#explain(event.code);
      this.#down.add(event.code);
      this.update(0, event.timeStamp / 1000);
    });
    addEventListener('keyup', (event) => { if (this.#down.delete(event.code)) this.update(0, event.timeStamp / 1000); });
    addEventListener('blur', () => {
      this.#down.clear();
      this.update(0);
    });
  }

  /** Shows why a key has no effect. */
  #explain(code: string): void {
    const { session } = this, axis = KEYS[code]![0], at = performance.now() / 1000;
    if (session.mayReset) session.hint('The arm is stopped: press “Reset” first.', at);
    else if ((axis === 3 || axis === 4) && session.staysUpright) session.hint(STAYS_UPRIGHT, at);
    else if (axis === 5 && session.hasGlass) session.hint(LOOKS_THE_SAME, at);
  }

  update(dt: number, eventTime?: number): void {
    this.rates.fill(0);
    this.#down.forEach(this.#add);
    this.advance(dt, this.#down.size > 0, eventTime);
  }
}

/** s without a new timestamp after which a gamepad counts as disconnected: browsers keep its last values. */
const SILENT = 0.5;
const STOP = 1, GRIP = 5, LEFT_TRIGGER = 6, RIGHT_TRIGGER = 7;

/**
 * The right bumper engages; the left stick moves, the right stick lifts and turns, either trigger closes the gripper,
 * button B of any gamepad stops.
 */
export class Gamepads extends RateInput {
  readonly #stopHeld: boolean[] = [];
  /** The gamepad that is engaged, by its index in the browser's list. */
  #leads = -1;
  /** Its bumper was seen open since its last timeout. */
  #opened = false;
  readonly #trigger = new Trigger();
  #timestamp = 0;
  #heard = -Infinity;
  #plugged = false;

  constructor(hand: Hand, session: Session, wantLease: () => boolean, looks: () => number, private readonly onStop: () => void,
              private readonly onGripper: (closed: number) => void, private readonly now: () => number) {
    super('gamepad', hand, session, wantLease, looks);
    // Called 90 times a second, the browser would create its list each time.
    const look = (): void => { this.#plugged = (navigator.getGamepads?.() ?? []).some((pad) => pad?.mapping === 'standard'); };
    addEventListener('gamepadconnected', look);
    addEventListener('gamepaddisconnected', look);
    look();
  }

  #stick(pad: Gamepad, axis: number): number {
    const value = pad.axes[axis] ?? 0;
    return Math.abs(value) > 0.12 ? -value : 0;
  }

  update(dt: number): void {
    const pads = this.#plugged ? navigator.getGamepads() : [];
    for (let i = 0; i < pads.length; ++i) {
      const pad = pads[i];
      if (pad?.mapping !== 'standard') continue;
      const stop = pad.buttons[STOP]?.pressed ?? false;
      if (stop && !this.#stopHeld[i]) this.onStop();
      this.#stopHeld[i] = stop;
      if (this.#leads < 0) this.#leads = i;
    }
    const pad = pads[this.#leads];
    if (pad?.mapping !== 'standard') {
      this.#leads = -1;
      this.#opened = false;
      this.#trigger.forget();
      return this.advance(dt, false);
    }
    if (pad.timestamp !== this.#timestamp) {
      this.#timestamp = pad.timestamp;
      this.#heard = this.now();
    }
    const closed = this.#trigger.moved(Math.max(pad.buttons[LEFT_TRIGGER]?.value ?? 0, pad.buttons[RIGHT_TRIGGER]?.value ?? 0));
    if (closed !== null) this.onGripper(closed);
    const gripped = pad.buttons[GRIP]?.pressed ?? false;
    if (!gripped) this.#opened = true;
    else if (this.now() - this.#heard > SILENT) this.#opened = false;
    this.rates[0] = this.#stick(pad, 1);
    this.rates[1] = this.#stick(pad, 0);
    this.rates[2] = this.#stick(pad, 3);
    this.rates[5] = this.#stick(pad, 2);
    this.advance(dt, gripped && this.#opened);
  }
}
