import { element } from './element';

export const TABS = ['drive', 'recordings', 'scene'] as const;
export type Tab = (typeof TABS)[number];

/** The tab that a key selects from this one; null: none. */
export function tabByKey(from: Tab, key: string): Tab | null {
  const at = TABS.indexOf(from), count = TABS.length;
  switch (key) {
    case 'ArrowRight': return TABS[(at + 1) % count]!;
    case 'ArrowLeft': return TABS[(at + count - 1) % count]!;
    case 'Home': return TABS[0];
    case 'End': return TABS[count - 1]!;
    default: return null;
  }
}

/** The controls in tabs, one of which is shown; as the pattern "tabs" of ARIA has them: Tab reaches the one that is shown, arrows the others. */
export class Tabs {
  shown: Tab = 'drive';

  constructor() {
    for (const tab of TABS) {
      const button = this.#button(tab);
      button.onclick = () => {
        this.show(tab);
        // On a phone most of it lies below the window.
        if (matchMedia('(max-width: 60rem)').matches) element(`panel-${tab}`, HTMLElement).scrollIntoView({ block: 'start' });
      };
      button.onkeydown = (event) => {
        const next = tabByKey(tab, event.key);
        if (!next) return;
        event.preventDefault();
        this.show(next);
        this.#button(next).focus();
      };
    }
  }

  #button(tab: Tab): HTMLButtonElement { return element(`tab-${tab}`, HTMLButtonElement); }

  show(tab: Tab): void {
    this.shown = tab;
    for (const each of TABS) {
      const button = this.#button(each), shown = each === tab;
      button.setAttribute('aria-selected', String(shown));
      button.tabIndex = shown ? 0 : -1;
      element(`panel-${each}`, HTMLElement).hidden = !shown;
    }
  }
}
