const show = (made: HTMLElement, busy: boolean): void => {
  const { idle = '', label = '', words = '' } = made.dataset;
  made.textContent = busy ? words : idle;
  if (busy) made.setAttribute('aria-busy', 'true'); else made.removeAttribute('aria-busy');
  if (label) made.setAttribute('aria-label', busy ? `${words} ${label}` : label);
};

/** Actions that take a while, each once at a time; what was pressed says so until they are done, also where it is made anew meanwhile. */
export class Busy {
  readonly #running = new Set<string>();

  /** @param root in which the buttons are */
  constructor(private readonly root: ParentNode) {}

  isRunning(key: string): boolean { return this.#running.has(key); }

  /** The button, or link, of this action. @param words that stand on it meanwhile */
  sign<T extends HTMLElement>(made: T, key: string, words: string): T {
    Object.assign(made.dataset, { act: key, words, idle: made.textContent ?? '', label: made.getAttribute('aria-label') ?? '' });
    if (this.#running.has(key)) show(made, true);
    return made;
  }

  /** Nothing comes of a second call before the first is done. */
  async run(key: string, act: () => Promise<unknown>): Promise<void> {
    if (this.#running.has(key)) return;
    this.#running.add(key);
    this.#mark(key);
    try {
      await act();
    } finally {
      this.#running.delete(key);
      this.#mark(key);
    }
  }

  #mark(key: string): void {
    for (const made of this.root.querySelectorAll<HTMLElement>('[data-act]')) if (made.dataset.act === key) show(made, this.#running.has(key));
  }
}

/** s, after which nobody waits for a page any more. */
const PATIENCE = 120;

/** Opens an address of this server in a new tab. @return done when it is there, or gone; null: the browser opens none for a script */
export function openTab(href: string): Promise<void> | null {
  const tab = window.open(href, '_blank'), until = performance.now() + 1000 * PATIENCE;
  if (!tab) return null;
  const there = (): boolean => {
    try {
      return tab.closed || performance.now() > until || (tab.location.href !== 'about:blank' && tab.document.readyState !== 'loading');
    } catch {
      return true; // it shows what is of another origin
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
