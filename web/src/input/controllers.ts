/** Buttons of the `xr-standard` mapping; on the left A is called X and B is called Y. */
export const TRIGGER = 0, GRIP = 1, STICK = 3, A = 4, B = 5;

const isPressed = (source: XRInputSource, button: number): boolean => source.gamepad?.buttons[button]?.pressed === true;

/** What an operator holds. Hands that the headset sees come as sources, too: some of them with a gamepad of one button. */
export function isController(source: XRInputSource): boolean {
  return !source.hand && Boolean(source.gripSpace) && (source.gamepad?.buttons.length ?? 0) > GRIP
    && !source.profiles.some((profile) => profile.includes('hand'));
}

const SMALLEST_MOVE = 0.02; // of a trigger's way: less is noise

/**
 * A gamepad's trigger as a gripper: how far it is pulled, each time that it moves. One that lies still says nothing, so
 * that a gripper keeps what it holds when a gamepad is plugged in, and when another way in opened or closed it.
 */
export class Trigger {
  #at: number | null = null;

  /** @returns 0 to 1, where it moved; null where it did not, or is seen for the first time */
  moved(value: number): number | null {
    const before = this.#at, end = value === 0 || value === 1;
    if (before !== null && (end ? value === before : Math.abs(value - before) < SMALLEST_MOVE)) return null;
    this.#at = value;
    return before === null ? null : value;
  }

  /** It is out of sight: where it is then, it was moved unseen. */
  forget(): void { this.#at = null; }
}

/** What each controller's buttons did from one frame to the next. */
export class Buttons {
  #held = new WeakMap<XRInputSource, boolean[]>();

  isPressed(source: XRInputSource, button: number): boolean { return isPressed(source, button); }
  /** Pressed, and was not a frame ago; also if there was none of this controller: what stops does so rather twice than never. */
  isNew(source: XRInputSource, button: number): boolean { return isPressed(source, button) && this.#held.get(source)?.[button] !== true; }
  /** Pressed, and was seen open a frame ago: what moves the arm was meant to. */
  began(source: XRInputSource, button: number): boolean { return isPressed(source, button) && this.#held.get(source)?.[button] === false; }

  /** At the end of a frame. */
  note(source: XRInputSource): void {
    let held = this.#held.get(source);
    if (!held) this.#held.set(source, (held = []));
    const buttons = source.gamepad?.buttons ?? [];
    for (let i = 0; i < buttons.length; ++i) held[i] = buttons[i]!.pressed;
  }

  /** Frames were missed: whatever is pressed when the next one comes was pressed unseen. */
  forget(): void { this.#held = new WeakMap(); }
}
