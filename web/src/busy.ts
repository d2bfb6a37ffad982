/** s after which a button shows for how long its action has run. */
const LONG = 2;

/** Text of a button, so many whole s after it was pressed. */
export const busyWords = (words: string, seconds: number): string => (seconds < LONG ? words : `${words} ${seconds} s`);

/** @param seconds for which it has been busy; null: it is not */
const show = (made: HTMLElement, seconds: number | null): void => {
  const { idle = '', label = '', words = '' } = made.dataset, busy = seconds !== null;
  made.textContent = busy ? busyWords(words, seconds) : idle;
  if (busy) made.setAttribute('aria-busy', 'true'); else made.removeAttribute('aria-busy');
  if (label) made.setAttribute('aria-label', busy ? `${words} ${label}` : label);
};

/**
 * Actions that take a while, each once at a time. The pressed button shows it until they are done, even if it is made
 * again.
 */
export class Busy {
  /** Whole s for which each has run. */
  readonly #running = new Map<string, number>();

  /** @param root in which the buttons are */
  constructor(private readonly root: ParentNode) {}

  isRunning(key: string): boolean { return this.#running.has(key); }

  /** The button, or link, of this action. @param words its text meanwhile */
  sign<T extends HTMLElement>(made: T, key: string, words: string): T {
    Object.assign(made.dataset, { act: key, words, idle: made.textContent ?? '', label: made.getAttribute('aria-label') ?? '' });
    if (this.#running.has(key)) show(made, this.#running.get(key)!);
    return made;
  }

  /** A second call before the first is done has no effect. */
  async run(key: string, act: () => Promise<unknown>): Promise<void> {
    if (this.#running.has(key)) return;
    const begin = performance.now(), mark = (): void => {
      this.#running.set(key, Math.floor((performance.now() - begin) / 1000));
      this.#mark(key);
    };
    mark();
    const timer = setInterval(mark, 1000);
    try {
      await act();
    } finally {
      clearInterval(timer);
      this.#running.delete(key);
      this.#mark(key);
    }
  }

  #mark(key: string): void {
    for (const made of this.root.querySelectorAll<HTMLElement>('[data-act]')) if (made.dataset.act === key) show(made, this.#running.get(key) ?? null);
  }
}

/** s after which a page counts as open, whether it has loaded or not. */
const PATIENCE = 120;

/** Opens an address of this server in a new tab. @return done when it is there, or gone; null: the browser opens none for a script */
export function openTab(href: string): Promise<void> | null {
  const tab = window.open(href, '_blank'), until = performance.now() + 1000 * PATIENCE;
  if (!tab) return null;
  const there = (): boolean => {
    try {
      return tab.closed || performance.now() > until || (tab.location.href !== 'about:blank' && tab.document.readyState !== 'loading');
    } catch {
      return true; // it shows a page of another origin
    }
  };
  return new Promise((done) => {
    const timer = setInterval(() => {
      if (!there()) return;
      clearInterval(timer);
      done();
    }, 200);
  });
}
