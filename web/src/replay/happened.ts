import { made } from '../element';
import type { Player, StoryEvent } from './player';

/** Most events in the list: the most serious kinds come first. */
const LISTED = 1000;
const GRAVE = ['spill', 'missed', 'limit', 'gap', 'refill', 'setting', 'state', 'rest'];
/** Most limits listed by default; more would hide the other kinds. */
const FEW = 20;
/** Name of a kind of event. */
export const kindText = (kind: string): string => (kind === 'missed' ? 'deadlines' : kind);

/** With tenths. */
export const fine = (seconds: number, decimals = 1): string => {
  const all = Number(seconds.toFixed(decimals)), minutes = Math.floor(all / 60);
  return `${minutes}:${(all - 60 * minutes).toFixed(decimals).padStart(3 + decimals, '0')}`;
};

/** s from the start, in hundredths, at which an event at `t_s` is visible. */
export const seenAt = (t_s: number, begin: number): number => Math.ceil(Math.max(0, t_s - begin) * 100) / 100;

/** The spill with the largest loss; the first of several equal ones. */
export function worstSpill(events: readonly StoryEvent[] | undefined): StoryEvent | undefined {
  return events?.filter(({ kind }) => kind === 'spill').reduce<StoryEvent | undefined>((worst, each) => (worst && (worst.amount ?? 0) >= (each.amount ?? 0) ? worst : each), undefined);
}

/** s for which a spill is shown while the list of events is out of sight. */
const TOLD_FOR = 2;

/** What spilled just before `now`, and why; empty: nothing. @param now s, of the recording's clock */
export function spillAt(events: readonly StoryEvent[], now: number): string {
  let words = '';
  for (const { kind, t_s, what, why } of events) if (kind === 'spill' && t_s <= now + 1e-6 && now - t_s < TOLD_FOR) words = `${what}: ${why}`;
  return words;
}

/** Number of events of each kind, as text: "18 of 105" if only some are listed. */
export function countsOf(events: readonly StoryEvent[], listed: readonly StoryEvent[]): Map<string, string> {
  const count = (of: readonly StoryEvent[], wanted: string): number => of.filter(({ kind }) => kind === wanted).length;
  return new Map([...new Set(events.map(({ kind }) => kind))].map((kind) => {
    const all = count(events, kind), seen = count(listed, kind);
    return [kind, seen === all ? `${all}` : `${seen} of ${all}`];
  }));
}

/** Whether there are so many limits that they would hide all other events. */
export function hidesLimits(events: readonly StoryEvent[]): boolean {
  return events.filter(({ kind }) => kind === 'limit').length > FEW;
}

/** An entry of the list, in order of time: the text includes the number of similar events at once. */
export interface Told { event: StoryEvent; words: string }

/** Two events that alternate, as when a client times out and reconnects, become one entry from the third time on. */
export function folded(events: readonly StoryEvent[]): Told[] {
  const alike = (i: number, j: number): boolean => events[i]?.kind === events[j]?.kind && events[i]?.what === events[j]?.what && events[i]?.why === events[j]?.why;
  const words = ({ what, why }: StoryEvent): string => (why ? `${what}: ${why}` : what), told: Told[] = [];
  for (let i = 0; i < events.length; ++i) {
    let end = i + 2;
    while (end + 1 < events.length && alike(i, end) && alike(i + 1, end + 1)) end += 2;
    const event = events[i]!, times = (end - i) / 2;
    if (times < 3) {
      told.push({ event, words: words(event) });
    } else {
      told.push({ event, words: `${words(event)}, then ${words(events[i + 1]!)}, ${times} ×` });
      i = end - 1;
    }
  }
  return told;
}

/** The last visible entry that is not after `at`, of entries in order of time; -1: none. */
export function currentOf(entries: readonly { at: number; kind: string }[], hidden: ReadonlySet<string>, at: number): number {
  for (let i = entries.length - 1; i >= 0; --i) if (entries[i]!.at <= at + 1e-6 && !hidden.has(entries[i]!.kind)) return i;
  return -1;
}

/** The events of a recording, in a list that follows its time; kinds can be hidden. */
export class Happened {
  readonly #hidden = new Set<string>();
  /** The user has chosen which kinds are listed. */
  #isChosen = false;
  #entries: { item: HTMLLIElement; at: number; kind: string }[] = [];
  #current = -1;

  /** @param address of a recording by its name: the start of links to times */
  constructor(private readonly list: HTMLElement, private readonly kinds: HTMLElement, private readonly address: (name: string) => string) {}

  show({ motion, begin }: Player): void {
    const listed = [...(motion.events ?? [])].sort((a, b) => GRAVE.indexOf(a.kind) - GRAVE.indexOf(b.kind)).slice(0, LISTED).sort((a, b) => a.t_s - b.t_s);
    this.#entries = folded(listed).map(({ event: { t_s, kind, what }, words }) => {
      const at = seenAt(t_s, begin), link = made('a', { href: `${this.address(motion.name)}t=${at.toFixed(2)}` }, fine(Math.max(0, t_s - begin)));
      const item = made('li', { className: kind === 'state' || kind === 'spill' ? '' : 'minor', title: words }, link, ` ${words}`); // minor ones are not printed
      item.dataset.kind = kind === 'state' ? what : kind;
      return { item, at, kind };
    });
    if (!this.#isChosen) {
      this.#hidden.clear();
      if (hidesLimits(motion.events ?? [])) this.#hidden.add('limit');
    }
    this.#current = -1;
    this.list.replaceChildren(...this.#entries.map(({ item }) => item));
    this.list.scrollTop = 0;
    const counts = countsOf(motion.events ?? [], listed);
    this.kinds.hidden = counts.size < 2;
    this.kinds.replaceChildren(...[...counts].map(([kind, count]) => {
      const box = made('input', { type: 'checkbox', checked: !this.#hidden.has(kind) });
      box.onchange = () => {
        this.#isChosen = true;
        if (box.checked) this.#hidden.delete(kind); else this.#hidden.add(kind);
        this.#hide();
      };
      return made('label', { className: 'check' }, box, ` ${kindText(kind)} (${count})`);
    }));
    this.#hide();
  }

  #hide(): void {
    for (const { item, kind } of this.#entries) item.hidden = this.#hidden.has(kind);
    this.#mark(-1);
  }

  /** A few times a second. @param at s from the start */
  follow(at: number): void {
    const now = currentOf(this.#entries, this.#hidden, at);
    if (now !== this.#current) this.#mark(now);
  }

  /** Marks the current entry and scrolls the list to it; the page does not scroll. */
  #mark(now: number): void {
    this.#entries[this.#current]?.item.removeAttribute('aria-current');
    this.#current = now;
    const item = this.#entries[now]?.item;
    if (!item) return;
    item.setAttribute('aria-current', 'true');
    const row = item.getBoundingClientRect(), { list } = this, frame = list.getBoundingClientRect();
    if (row.top < frame.top || row.bottom > frame.bottom) list.scrollTop += row.top - frame.top - (frame.height - row.height) / 2;
  }
}
