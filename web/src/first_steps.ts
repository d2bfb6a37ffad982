import { element, put } from './element';
import { isTyped } from './input/shortcuts';

/** Key of the storage for "the first steps were seen". */
const SEEN = 'steadyhand.first-steps-seen';
/** Keys that move the arm or its gripper, or act on an episode: they act only where the scene is seen. */
const ACTS_ON_THE_ARM = /^Key[WASDQEIJKLUOGBNXR]$/;

/** Some browsers keep nothing for a page: then it is as on the first opening. */
function seen(): boolean {
  try { return localStorage.getItem(SEEN) !== null; } catch { return false; }
}

/**
 * A card with the first steps, on the first opening until it is dismissed; and a card of the keys, on request. The
 * second covers the scene, so nothing controls the arm while it is open. Create it before the listeners of keys that
 * move the arm.
 * @param show starts a recorded hand @param letGo releases the hand of this page
 */
export class FirstSteps {
  readonly #first = element('first-steps', HTMLElement);
  readonly #help = element('help', HTMLElement);
  /** Had the focus when the card of the keys was opened. */
  #before: Element | null = null;

  /** @param onGone the card of the first steps leaves the scene free */
  constructor(show: () => void, private readonly letGo: () => void, private readonly onGone: () => void) {
    this.#first.hidden = seen();
    element('first-close', HTMLButtonElement).onclick = () => this.dismiss();
    element('first-demo', HTMLButtonElement).onclick = () => {
      this.dismiss();
      show();
    };
    const toggle = () => (this.#help.hidden ? this.#openHelp() : this.closeHelp());
    element('help-open', HTMLButtonElement).onclick = toggle;
    element('help-close', HTMLButtonElement).onclick = toggle;
    addEventListener('keydown', (event) => {
      if (isTyped(event.target) || event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.key === '?' && !event.repeat) return toggle();
      if (this.#help.hidden || !ACTS_ON_THE_ARM.test(event.code)) return;
      // The key only closes the card: the next press starts a grip.
      this.closeHelp();
      event.preventDefault();
      event.stopImmediatePropagation();
    }, { capture: true });
  }

  /**
   * @param watches this page may only watch @param why no motion can be requested; empty: one can
   * @param plays a recorded hand controls the arm already @param past a recording is shown
   */
  draw(watches: boolean, why: string, plays: boolean, past: boolean): void {
    if (this.#first.hidden) return;
    if (past) return this.dismiss();
    put(this.#first.dataset, 'plays', String(plays));
    put(this.#first.dataset, 'watches', String(watches));
    put(this.#first.dataset, 'waits', String(why !== ''));
    const demo = element('first-demo', HTMLButtonElement), does = plays ? 'Start it again' : 'Show me a motion';
    put(demo, 'disabled', why !== '');
    put(demo, 'textContent', does);
    const words = element('first-why', HTMLElement);
    put(words, 'textContent', why);
    put(words, 'hidden', why === '');
  }

  /** Shares of the scene that the card of the first steps covers, at the right or at the top. */
  room(scene: HTMLElement): [number, number] {
    if (this.#first.hidden) return [0, 0];
    const card = this.#first.getBoundingClientRect();
    if (card.width === 0) return [0, 0];
    const { left, top, width, height } = scene.getBoundingClientRect();
    if (card.top >= top + height) return [0, 0]; // below it
    return card.width > 0.6 * width ? [0, Math.max(0, card.bottom - top) / height] : [Math.max(0, left + width - card.left) / width, 0];
  }

  /** It does not open again. */
  dismiss(): void {
    if (this.#first.hidden) return;
    this.#first.hidden = true;
    this.onGone();
    try { localStorage.setItem(SEEN, '1'); } catch { /* it comes again next time */ }
  }

  #openHelp(): void {
    this.letGo();
    this.#before = document.activeElement;
    this.#help.hidden = false;
    this.#help.scrollTop = 0;
    element('help-close', HTMLButtonElement).focus({ preventScroll: true });
  }

  /** Returns the focus to the element that opened it. @param stopped the arm was stopped, too */
  closeHelp(stopped = false): void {
    if (this.#help.hidden) return;
    const inside = this.#help.contains(document.activeElement);
    this.#help.hidden = true;
    // Enter must reset the arm then, not open this again.
    if (stopped && inside) (document.activeElement as HTMLElement).blur();
    else if (inside && this.#before instanceof HTMLElement) this.#before.focus({ preventScroll: true });
    this.#before = null;
  }
}
