const isSpace = (event: KeyboardEvent): boolean => event.key === ' ' || event.code === 'Space';

/** The target takes typed letters, so they must not move the arm. */
export const isTyped = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === 'text';

const isPressed = (target: EventTarget | null): target is HTMLButtonElement | HTMLInputElement =>
  target instanceof HTMLButtonElement || (target instanceof HTMLInputElement && (target.type === 'checkbox' || target.type === 'radio'));
const hasOwnEnter = (target: EventTarget | null): boolean => isTyped(target) || target instanceof HTMLAnchorElement || target instanceof HTMLSelectElement || (target instanceof HTMLElement && target.tagName === 'SUMMARY');

/** An option that is chosen already: Enter has no effect there. */
const isChosen = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === 'radio' && target.checked;

/** Whether Enter has an effect on this target, and so does not reset. */
export const takesEnter = (target: EventTarget | null): boolean => (isPressed(target) && !isChosen(target)) || hasOwnEnter(target);

/**
 * The same keys on the whole page, wherever the focus is. Space and Escape stop the arm; in a text, Space types a
 * blank as well, and only that while the arm is stationary. Enter presses or toggles what has the focus, as Space does
 * elsewhere; it resets where there is nothing to press. Runs before all other key listeners.
 * @param stands the arm is seen to be stationary: typing is no request to stop
 */
export function listenForShortcuts(stop: () => void, reset: () => void, stands: () => boolean): void {
  addEventListener('keydown', (event) => {
    if (isSpace(event) && isTyped(event.target) && stands()) return;
    if (isSpace(event) || event.key === 'Escape') {
      if (!isSpace(event) || !isTyped(event.target)) event.preventDefault(); // in a text the blank is typed, too
      event.stopImmediatePropagation();
      if (!event.repeat) stop(); // a second stop brakes harder: a key held down is one stop
      return;
    }
    if (event.key !== 'Enter') return;
    const { target } = event;
    if (isPressed(target) && !isChosen(target)) {
      event.preventDefault(); // not every browser presses every button with Enter
      if (!event.repeat) target.click();
      return;
    }
    if (!hasOwnEnter(target) && !event.repeat) reset();
  }, { capture: true });
  // A button pressed with the mouse loses the focus: Enter would press it again and not reset.
  addEventListener('click', (event) => {
    if (event instanceof PointerEvent && event.pointerType === 'mouse' && isPressed(event.target)) event.target.blur();
  });
  // Some browsers press a button when Space is released.
  addEventListener('keyup', (event) => { if (isSpace(event) && !isTyped(event.target)) event.preventDefault(); }, { capture: true });
}
