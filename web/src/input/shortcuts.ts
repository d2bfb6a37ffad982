const isSpace = (event: KeyboardEvent): boolean => event.key === ' ' || event.code === 'Space';

/** Takes letters that are typed, so that they lead nothing. */
export const isTyped = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === 'text';

const isPressed = (target: EventTarget | null): target is HTMLButtonElement | HTMLInputElement =>
  target instanceof HTMLButtonElement || (target instanceof HTMLInputElement && (target.type === 'checkbox' || target.type === 'radio'));
const hasOwnEnter = (target: EventTarget | null): boolean => isTyped(target) || target instanceof HTMLAnchorElement || target instanceof HTMLSelectElement || (target instanceof HTMLElement && target.tagName === 'SUMMARY');

/** A choice that is made already: Enter has nothing to do there. */
const isChosen = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === 'radio' && target.checked;

/** Whether Enter does something here, and so does not reset. */
export const takesEnter = (target: EventTarget | null): boolean => (isPressed(target) && !isChosen(target)) || hasOwnEnter(target);

/**
 * One rule for the page, whatever has the focus: Space and Escape stop the arm; in a text Space is a blank as well, and while the arm stands it is no more. Enter does what Space does elsewhere: it presses or toggles
 * what has the focus, and resets where there is nothing to press. Comes before all else that listens to keys.
 * @param stands the arm is seen to stand: what is typed then is no cry for a stop
 */
export function listenForShortcuts(stop: () => void, reset: () => void, stands: () => boolean): void {
  addEventListener('keydown', (event) => {
    if (isSpace(event) && isTyped(event.target) && stands()) return;
    if (isSpace(event) || event.key === 'Escape') {
      if (!isSpace(event) || !isTyped(event.target)) event.preventDefault(); // who types has the blank, too
      event.stopImmediatePropagation();
      if (!event.repeat) stop(); // a second stop brakes harder: held down it is still one
      return;
    }
    if (event.key !== 'Enter') return;
    const { target } = event;
    if (isPressed(target) && !isChosen(target)) {
      event.preventDefault(); // not every browser's Enter presses every button
      if (!event.repeat) target.click();
      return;
    }
    if (!hasOwnEnter(target) && !event.repeat) reset();
  }, { capture: true });
  // What a mouse has pressed keeps no focus: Enter would press it again in place of a reset.
  addEventListener('click', (event) => {
    if (event instanceof PointerEvent && event.pointerType === 'mouse' && isPressed(event.target)) event.target.blur();
  });
  // Some browsers press a button when Space comes up again.
  addEventListener('keyup', (event) => { if (isSpace(event) && !isTyped(event.target)) event.preventDefault(); }, { capture: true });
}
