import type { Hand } from '../hand';
import { multiply, normalize, rotation, turn, type MutableQuat, type MutableVec3 } from '../frames';
import { LOOKS_THE_SAME, STAYS_UPRIGHT, type Session } from '../session';
import { Trigger } from './controllers';
import { isTyped } from './shortcuts';
import { type Side, toolOf } from './sides';

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
class RateInput {
  readonly rates = new Float64Array(6);
  readonly #shift: MutableVec3 = [0, 0, 0];
  readonly #spin: MutableQuat = [0, 0, 0, 1];
  readonly #way: MutableVec3 = [0, 0, 0];
  readonly #axis: MutableVec3 = [0, 0, 0];
  readonly #step: MutableQuat = [0, 0, 0, 1];
  /** The hand of the engagement that is held. */
  #held: Hand | null = null;

  /** @param hand the one to engage with @param looks rad, about the base's z: the operator's viewing direction, from the arm's forward */
  constructor(private readonly name: string, private readonly hand: () => Hand, protected readonly session: Session,
              private readonly wantLease: () => boolean, private readonly looks: () => number) {}

  /** @param dt s @param eventTime s, of the event that this call follows at once */
  advance(dt: number, held: boolean, eventTime?: number): void {
    const controls = this.session.state?.controls;
    if (!held || !controls) {
      this.#held?.release(this.name);
      this.#held = null;
      return;
    }
    if (!this.#held) {
      // If another input device has the hand, this engagement is lost to it, even after that device releases.
      this.#held = this.hand();
      this.#held.grab(this.name, this.wantLease());
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
    this.#held.lead(this.name, this.#shift, this.#spin, controls.scale, controls.yaw, eventTime);
  }
}

export class Keys extends RateInput {
  readonly #down = new Set<string>();
  readonly #add = (code: string): void => {
    const key = KEYS[code]!;
    this.rates[key[0]]! += key[1];
  };

  constructor(hand: () => Hand, session: Session, wantLease: () => boolean, looks: () => number) {
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
const STOP = 1, GRIP = 5;
/** Of a standard gamepad: what moves the arm at each side if there are two; `up` and `down` are the cross and Y, A. */
const SIDES = [
  { side: 'left', grip: 4, trigger: 6, ahead: 1, aside: 0, up: 12, down: 13 },
  { side: 'right', grip: GRIP, trigger: 7, ahead: 3, aside: 2, up: 3, down: 0 },
] as const;

const stick = (pad: Gamepad, axis: number): number => {
  const value = pad.axes[axis] ?? 0;
  return Math.abs(value) > 0.12 ? -value : 0;
};

/**
 * One arm: the right bumper engages; the left stick moves, the right stick lifts and turns, either trigger closes the
 * gripper. Two arms: each side's bumper, stick and trigger belong to the arm at that side; the cross and Y, A lift.
 * Button B of any gamepad stops.
 */
export class Gamepads {
  readonly #stopHeld: boolean[] = [];
  /** The gamepad that is engaged, by its index in the browser's list. */
  #leads = -1;
  /** For each arm: its bumper was seen open since its last timeout. */
  readonly #opened = [false, false];
  readonly #triggers = [new Trigger(), new Trigger()];
  readonly #inputs: RateInput[];
  #timestamp = 0;
  #heard = -Infinity;
  #plugged = false;

  /** @param hands one for each tool @param onGripper 0 open to 1 closed, and the tool */
  constructor(hands: readonly Hand[], private readonly session: Session, wantLease: () => boolean, private readonly looks: () => number, private readonly onStop: () => void,
              private readonly onGripper: (closed: number, tool: number) => void, private readonly now: () => number) {
    this.#inputs = SIDES.map(({ side }) => new RateInput('gamepad', () => hands[this.#tool(side)]!, session, wantLease, looks));
    // Called 90 times a second, the browser would create its list each time.
    const look = (): void => { this.#plugged = (navigator.getGamepads?.() ?? []).some((pad) => pad?.mapping === 'standard'); };
    addEventListener('gamepadconnected', look);
    addEventListener('gamepaddisconnected', look);
    look();
  }

  #tool(side: Side): number { return toolOf(side, this.session.welcome?.robot, this.looks()); }

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
      this.#opened.fill(false);
      for (let i = 0; i < 2; ++i) {
        this.#triggers[i]!.forget();
        this.#inputs[i]!.advance(dt, false);
      }
      return;
    }
    if (pad.timestamp !== this.#timestamp) {
      this.#timestamp = pad.timestamp;
      this.#heard = this.now();
    }
    if (this.session.hasTwo) for (let i = 0; i < 2; ++i) this.#useSide(pad, i, dt);
    else this.#useWhole(pad, dt);
  }

  #useWhole(pad: Gamepad, dt: number): void {
    const { rates } = this.#inputs[0]!;
    this.#squeeze(0, Math.max(pad.buttons[SIDES[0].trigger]?.value ?? 0, pad.buttons[SIDES[1].trigger]?.value ?? 0), 0);
    rates[0] = stick(pad, 1);
    rates[1] = stick(pad, 0);
    rates[2] = stick(pad, 3);
    rates[5] = stick(pad, 2);
    this.#engage(0, pad.buttons[GRIP]?.pressed ?? false, dt);
  }

  #useSide(pad: Gamepad, i: number, dt: number): void {
    const { side, grip, trigger, ahead, aside, up, down } = SIDES[i]!, { rates } = this.#inputs[i]!, value = (button: number): number => pad.buttons[button]?.value ?? 0;
    this.#squeeze(i, value(trigger), this.#tool(side));
    rates.fill(0);
    rates[0] = stick(pad, ahead);
    rates[1] = stick(pad, aside);
    rates[2] = value(up) - value(down);
    this.#engage(i, pad.buttons[grip]?.pressed ?? false, dt);
  }

  #squeeze(i: number, value: number, tool: number): void {
    const closed = this.#triggers[i]!.moved(value);
    if (closed !== null) this.onGripper(closed, tool);
  }

  #engage(i: number, gripped: boolean, dt: number): void {
    if (!gripped) this.#opened[i] = true;
    else if (this.now() - this.#heard > SILENT) this.#opened[i] = false;
    this.#inputs[i]!.advance(dt, gripped && this.#opened[i]!);
  }
}
