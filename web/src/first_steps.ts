import { element } from './element';

/** Where the browser keeps that the first steps were seen. */
const SEEN = 'steadyhand.first-steps-seen';

/** Some browsers keep nothing for a page: then it is as on the first opening. */
function seen(): boolean {
  try { return localStorage.getItem(SEEN) !== null; } catch { return false; }
}

/**
 * What this is, and what to do first: on the first opening, until it is dismissed. And the keys, whenever they are asked for.
 * @param show a recorded hand leads the arm
 */
export function offerFirstSteps(show: () => void): void {
  const first = element('first-steps', HTMLElement), help = element('help', HTMLElement);
  const dismiss = () => {
    first.hidden = true;
    try { localStorage.setItem(SEEN, '1'); } catch { /* it comes again next time */ }
  };
  first.hidden = seen();
  element('first-close', HTMLButtonElement).onclick = dismiss;
  element('first-demo', HTMLButtonElement).onclick = () => {
    dismiss();
    show();
  };
  const toggle = () => { help.hidden = !help.hidden; };
  element('help-open', HTMLButtonElement).onclick = toggle;
  element('help-close', HTMLButtonElement).onclick = toggle;
  addEventListener('keydown', (event) => {
    if (event.key === '?' && !event.repeat && !(event.target instanceof HTMLInputElement && event.target.type === 'text')) toggle();
  });
}
