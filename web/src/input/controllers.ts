/** Buttons of the `xr-standard` mapping; on the left A is called X and B is called Y. */
export const TRIGGER = 0, GRIP = 1, STICK = 3, A = 4, B = 5;

const isPressed = (source: XRInputSource, button: number): boolean => source.gamepad?.buttons[button]?.pressed === true;

/** A controller in the operator's hand. Tracked hands are sources, too; some have a gamepad with one button. */
export function isController(source: XRInputSource): boolean {
  return !source.hand && Boolean(source.gripSpace) && (source.gamepad?.buttons.length ?? 0) > GRIP
    && !source.profiles.some((profile) => profile.includes('hand'));
}

const SMALLEST_MOVE = 0.02; // share of a trigger's travel: less is noise

/**
 * A gamepad's trigger as a gripper: how far it is pulled, each time that it moves. A trigger that does not move
 * reports nothing: a gripper keeps its object when a gamepad is plugged in or another input device opened or closed
 * it.
 */
export class Trigger {
  #at: number | null = null;

  /** @returns 0 to 1 if it moved; null if it did not, or is seen for the first time */
  moved(value: number): number | null {
    const before = this.#at, end = value === 0 || value === 1;
    if (before !== null && (end ? value === before : Math.abs(value - before) < SMALLEST_MOVE)) return null;
    this.#at = value;
    return before === null ? null : value;
  }

  /** It is out of sight: its next position is not a motion. */
  forget(): void { this.#at = null; }
}

/** What each controller's buttons did from one frame to the next. */
export class Buttons {
  #held = new WeakMap<XRInputSource, boolean[]>();

  isPressed(source: XRInputSource, button: number): boolean { return isPressed(source, button); }
  /**
   * Pressed, and not pressed a frame ago; also without an earlier frame of this controller: better to stop twice than
   * never.
   */
  isNew(source: XRInputSource, button: number): boolean { return isPressed(source, button) && this.#held.get(source)?.[button] !== true; }
  /** Pressed, and seen open a frame ago: a press that starts motion must be intended. */
  began(source: XRInputSource, button: number): boolean { return isPressed(source, button) && this.#held.get(source)?.[button] === false; }

  /** At the end of a frame. */
  note(source: XRInputSource): void {
    let held = this.#held.get(source);
    if (!held) this.#held.set(source, (held = []));
    const buttons = source.gamepad?.buttons ?? [];
    for (let i = 0; i < buttons.length; ++i) held[i] = buttons[i]!.pressed;
  }

  /** Frames were missed: a button that is pressed in the next frame was pressed unseen. */
  forget(): void { this.#held = new WeakMap(); }
}
