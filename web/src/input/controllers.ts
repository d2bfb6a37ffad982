/** Buttons of the `xr-standard` mapping; on the left A is called X and B is called Y. */
export const TRIGGER = 0, GRIP = 1, STICK = 3, A = 4, B = 5;

const isPressed = (source: XRInputSource, button: number): boolean => source.gamepad?.buttons[button]?.pressed === true;

/** What an operator holds. Hands that the headset sees come as sources, too: some of them with a gamepad of one button. */
export function isController(source: XRInputSource): boolean {
  return !source.hand && Boolean(source.gripSpace) && (source.gamepad?.buttons.length ?? 0) > GRIP
    && !source.profiles.some((profile) => profile.includes('hand'));
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
