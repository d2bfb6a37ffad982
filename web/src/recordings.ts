import { Busy, openTab } from './busy';
import { editForm, editOf, surely, type Change, type Edit } from './edit_form';
import { element, onResize, put } from './element';
import { KeptRecordings, type KeptRecording } from './kept';
import type { Profile } from './protocol';
import { clock, latencyText, percentText, spanText } from './figures';
import { seenAt, worstSpill } from './replay/happened';
import { isTyped } from './input/shortcuts';
import { ledIn, Player, type Motion } from './replay/player';
import { Replay } from './replay/replay';
import { betterOf, summaryOf, verdictOf, type Figure } from './replay/summary';

/** What GET sessions answers (docs/reference/protocol.md). */
export interface RecordedSession {
  name: string;
  duration_s: number;
  bytes: number;
  /** false: being written, or cut short */
  complete: boolean;
  /** What people call it. */
  label?: string;
  run: Record<string, string>;
  summary: Record<string, string>;
  /** Why the arm stopped, if these are the seconds before a fault. */
  fault?: string;
}

/** Sessions that are listed at first, so many more with each press, and the most that need no press. */
const SHOWN = 6, MORE = 20, FEW = 2;
/** How often the list is asked for what came of a change. */
const TRIES = 20;
/** s, after which the list is asked for again while a session is written. */
const ANEW = 10;

/** When a session began, as people say it, of the name that it got then; other names stay. */
export function titleOf(name: string, now: Date): string {
  const [, day, hour, minute, second, place] = /^(\d{4}-\d\d-\d\d)_(\d\d)-(\d\d)-(\d\d)(?:_(\d+))?/.exec(name) ?? [];
  if (!day) return name;
  const began = new Date(`${day}T00:00:00`), midnight = new Date(now).setHours(0, 0, 0, 0), ago = Math.round((midnight - began.getTime()) / 86_400_000);
  const when = ago === 0 ? 'Today' : ago === 1 ? 'Yesterday' : began.toLocaleDateString('en-GB', { day: 'numeric', month: 'long', ...(began.getFullYear() === now.getFullYear() ? {} : { year: 'numeric' }) });
  return `${when} ${hour}:${minute}:${second}${place ? ` (${place})` : ''}`; // so many files of one program
}

const NOT = /not \S+/g, NOT_OR_WORD = /not \S+|\S+/g;
/** Whether all words of what is looked for are in what is told of a session. */
export function isFound(told: string, wanted: string): boolean {
  const all = told.toLowerCase(), said = all.replace(NOT, ' ');
  // "not spilled" is not found by "spilled", nor the other way round.
  return (wanted.toLowerCase().match(NOT_OR_WORD) ?? []).every((word) => word === 'not' || (word.startsWith('not ') ? all.includes(word) : said.includes(word)));
}

/** Its name in words: of several files of a program each says when it began itself, as the list is ordered. */
export function wordsOf({ name, run = {} }: { name: string; run?: Record<string, string> }, now: Date): string {
  const named = titleOf(name, now);
  return named !== name && run.recorded ? titleOf(run.recorded.replace(/ UTC$/, ''), now) : named;
}

export type Order = 'newest' | 'oldest' | 'spilled' | 'led' | 'name';
/** As people want to see them. Equal ones stay as they came, the newest first. */
export function ordered(sessions: readonly RecordedSession[], order: Order): RecordedSession[] {
  const figure = (key: string) => ({ summary }: RecordedSession): number => Number.parseFloat(summary[key] ?? '') || 0;
  const largest = (of: (session: RecordedSession) => number): RecordedSession[] => [...sessions].sort((a, b) => of(b) - of(a));
  switch (order) {
    case 'newest': return [...sessions];
    case 'oldest': return [...sessions].reverse();
    case 'spilled': return largest((session) => session.summary.spilled === 'yes' ? 1 + figure('spilled_share')(session) : 0);
    case 'led': return largest(figure('engaged_s'));
    case 'name': return [...sessions].sort((a, b) => (a.label || a.name).localeCompare(b.label || b.name));
  }
}

/** When it began, where its title does not say so; empty: it does, or nobody knows. */
export function beganOf(session: RecordedSession, now: Date): string {
  const { name, label, run } = session, named = wordsOf(session, now), known = named !== name;
  if (known) return label ? named : '';
  return run.recorded || run.started ? `${label ? `${name} · ` : ''}${titleOf((run.recorded || run.started!).replace(/ UTC$/, ''), now)}` : label ? name : '';
}

/** s: the length of what is being written, which never shrinks. @param told by the server, `age` s ago @param before as it was shown last */
export const grown = (told: number, age: number, before: number): number => Math.max(told + age, before);

/** The profiles that led in it, the longest first; of a session that does not say so the one that it began with; empty: not known. */
export function profilesOf({ run, summary }: RecordedSession, profiles: readonly Profile[]): string {
  const led = (summary.profiles ?? '').split(', ').filter(Boolean);
  return led.length > 0 ? led.map((name) => profiles.find((profile) => profile.name === name)?.label ?? name).join(', ') : (run.label ?? '');
}

/** How much went over the rim at once, at most, and under which profile; empty: nothing, or nobody knows. */
export function spillOf(session: RecordedSession, profiles: readonly Profile[] = []): string {
  const { summary } = session;
  if (summary.spilled !== 'yes') return '';
  const share = Number.parseFloat(summary.spilled_share ?? ''), often = Number.parseInt(summary.spills ?? '', 10) > 1 ? `${summary.spills} ×, at most ` : '', name = summary.spilled_profile;
  // Sessions of before that was recorded: one profile alone leaves no doubt.
  const profile = name ? (profiles.find((each) => each.name === name)?.label ?? name) : /^[^,]+$/.test(summary.profiles ?? '') ? profilesOf(session, profiles) : '';
  return `${share > 0 ? `spilled ${often}${percentText(share)} %` : 'spilled, share not recorded'}${profile ? `${share > 0 ? '' : ','} under ${profile}` : ''}`;
}

/** Length and figures of a session in a line. */
/** @param now s that it has been written for by now, where it is being written */
/** @param profiles whose labels are known */
/** @param spill tell of it, too */
export function figures(session: RecordedSession, now: number | null = null, profiles: readonly Profile[] = [], spill = true): string {
  const { summary } = session, words = [session.fault ? `the seconds before a fault: ${session.fault}` : clock(now ?? session.duration_s)];
  if (now !== null) words.unshift('being recorded');
  const label = profilesOf(session, profiles);
  if (label) words.push(label);
  const number = (key: string): number => Number.parseFloat(summary[key] ?? '');
  if (number('engaged_s') >= 0.05) words.push(`led ${spanText(number('engaged_s'))}`);
  if (number('latency_p50_ms') > 0) words.push(`latency ${latencyText(number('latency_p50_ms'))} ms`);
  if (spill) words.push(...[spillOf(session, profiles)].filter(Boolean));
  words.push(`${(session.bytes / 1e6).toFixed(session.bytes < 1e7 ? 1 : 0)}\u00a0MB`);
  if (!session.complete && now === null) words.push('not closed');
  return words.join(' · ');
}

const button = (textContent: string, label: string, onclick: () => void): HTMLButtonElement => {
  const made = Object.assign(document.createElement('button'), { type: 'button', textContent, onclick });
  made.setAttribute('aria-label', label);
  return made;
};

/** The list of recorded sessions, and the one that is shown: its time line, its events, and another one beside it. */
export class Recordings {
  readonly replay = new Replay((name) => `#replay=${encodeURIComponent(name)}&`);
  /** Of the session whose name and label are being changed. */
  #edit: Edit | null = null;
  #sessions: RecordedSession[] = [];
  #most = SHOWN;
  /** Where no program has them. */
  readonly kept = new KeptRecordings(() => this.#showKept());
  #keptShown = '';
  /** s, of the page's clock, when the list that is shown was asked for, and the last one. */
  #listedAt = 0;
  #askedAt = 0;
  /** s, that the one that is being written was last said to be long. */
  #told = { name: '', length: 0 };
  readonly #busy: Busy;
  /** Whether the session of now is written to a file. */
  #writes = false;
  #line: HTMLElement | null = null;
  /** When that began, in words. */
  #began = '';

  /** @param onShown the past is on the screen from now on, or is not @param change asks the server; what came of it is seen in the next list @param refusal why nothing came of it; empty: nobody said so @param token of who is paired; empty: nobody is */
  constructor(private readonly list: HTMLElement, private readonly line: HTMLElement, private readonly onShown: (shown: boolean) => void,
              private readonly change: (kind: Change, name: string, to?: string) => void, private readonly refusal: () => string = () => '',
              private readonly token: () => string = () => '') {
    this.#busy = new Busy(list);
    const press = (id: string, act: () => void): void => { element(id, HTMLButtonElement).onclick = act; };
    press('past-compared', () => this.#seeFigures());
    press('past-alone', () => { this.replay.lay(null); this.#layOut(); });
    press('past-close', () => this.close());
    onResize(this.line, () => this.#measure());
    element('recordings-find', HTMLInputElement).oninput = () => this.#showList();
    element('recordings-order', HTMLSelectElement).onchange = () => this.#showList();
    addEventListener('hashchange', () => void this.follow());
  }

  get player(): Player | null { return this.replay.player; }
  get other(): Player | null { return this.replay.other; }
  get profiles(): readonly Profile[] { return this.replay.profiles; }

  /** What the address says: #replay=NAME, and &t=S from its begin. */
  async follow(): Promise<void> {
    const asked = new URLSearchParams(location.hash.slice(1)), name = asked.get('replay'), at = Number(asked.get('t') ?? NaN);
    if (!name) return;
    if (this.#sessions.length === 0) await this.refresh(); // which knows what people call it
    if (this.player?.motion.name !== name) await this.open(name);
    if (!this.player || !Number.isFinite(at)) return;
    this.player.playing = false;
    this.player.seek(at);
  }

  /** Only paired clients may read recordings. Links cannot show the token: they bring the cookie that the answer sets. */
  #ask(path: string): Promise<Response | null> {
    const token = this.token();
    return fetch(path, token ? { headers: { Authorization: `Bearer ${token}` } } : {}).catch(() => null);
  }

  async refresh(): Promise<void> {
    const asked = this.#askedAt = performance.now() / 1000;
    if (!this.token()) {
      this.#sessions = [];
      return this.#say('Enter the code from the terminal to see recordings.');
    }
    const answer = await this.#ask('./sessions');
    if (!answer?.ok) return this.#say('The list of recordings is not available.');
    this.#sessions = ((await answer.json()) as { sessions: RecordedSession[] }).sessions;
    this.#listedAt = asked;
    if (this.#sessions.length === 0) return this.#say('Nothing recorded yet.');
    this.#showList();
  }

  /** The one that is being written: the newest that is not closed. */
  get #written(): RecordedSession | undefined { return this.#writes ? this.#sessions.find(({ complete }) => !complete) : undefined; }

  /** A few times a second: what is being written grows, and now and then the list is asked for. @param writes whether the session of now is recorded @param moves the arm does, or may soon: Space stops it */
  grow(writes: boolean, moves: boolean): void {
    const warning = this.list.querySelector<HTMLElement>('.edit .space');
    if (warning) put(warning, 'hidden', !moves || !isTyped(document.activeElement) || !this.list.contains(document.activeElement));
    if (writes !== this.#writes) {
      this.#writes = writes;
      if (this.#sessions.length > 0) this.#showList();
    }
    const session = this.#written, age = performance.now() / 1000 - this.#listedAt;
    if (!writes || document.hidden) return;
    if (session && this.#line) {
      const words = this.#tell(session, age, this.#began);
      if (this.#line.textContent !== words) this.#line.textContent = words;
    }
    if (performance.now() / 1000 - this.#askedAt < ANEW || this.#edit || this.list.contains(document.activeElement)) return; // who works with the list keeps it
    void this.refresh();
  }

  #tell(session: RecordedSession, age: number, began: string): string {
    let length: number | null = null;
    if (session === this.#written) {
      length = grown(session.duration_s, age, this.#told.name === session.name ? this.#told.length : 0);
      this.#told = { name: session.name, length };
    }
    return [...(began ? [began] : []), figures(session, length, this.profiles, false)].join(' · ');
  }

  #showList(): void {
    this.#line = null;
    element('compare-hint', HTMLElement).hidden = this.#sessions.length < 2;
    const find = element('recordings-find', HTMLInputElement), wanted = find.value.trim();
    element('recordings-finder', HTMLParagraphElement).hidden = this.#sessions.length < 4 && wanted === '';
    const order = element('recordings-order', HTMLSelectElement).value as Order;
    const found = ordered(this.#sessions, order).filter((session) => wanted === '' || isFound([session.label, wordsOf(session, new Date()), session.name, figures(session, null, this.profiles), session.summary.spilled === 'no' ? 'not spilled' : ''].join(' '), wanted));
    const all = (): void => {
      find.value = '';
      this.#showList();
    };
    const hidden = this.#sessions.length - found.length, more = found.length - this.#most, rest = more > FEW ? more : 0;
    const notes = [
      ...(found.length === 0 ? [this.#note('No recording matches.', 'Show all', all)] : hidden > 0 ? [this.#note(`${hidden} hidden by Find.`, 'Show all', all)] : []),
      ...(rest > 0 ? [this.#note(`${rest} more.`, 'Show more', () => { this.#most += MORE; this.#showList(); })] : []),
    ];
    this.list.replaceChildren(...found.slice(0, rest > 0 ? this.#most : found.length).map((session) => {
      const { name } = session, item = document.createElement('li'), words = document.createElement('p'), row = document.createElement('div');
      const began = beganOf(session, new Date()), told = Object.assign(document.createElement('span'), { textContent: this.#tell(session, performance.now() / 1000 - this.#listedAt, began) });
      const called = this.#calledOf(name), title = Object.assign(document.createElement('strong'), { textContent: called }), spilled = spillOf(session, this.profiles);
      words.append(title, told);
      if (spilled) {
        const pill = this.#slow('replay', 'Reading…', name, spilled, `${spilled}: replay ${called} at this spill`, () => this.#openAtSpill(name));
        pill.className = 'spilled';
        words.append(pill);
      }
      if (session === this.#written) {
        this.#line = told;
        this.#began = began;
      }
      const report = Object.assign(document.createElement('a'), { href: `./sessions/${encodeURIComponent(name)}/report.html`, target: '_blank', rel: 'noopener', textContent: 'Report' });
      report.setAttribute('aria-label', `Report of ${called}, in a new tab`);
      this.#busy.sign(report, `report ${name}`, 'Making…');
      report.onclick = (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        const opened = this.#busy.isRunning(`report ${name}`) ? Promise.resolve() : openTab(report.href);
        if (!opened) return; // then the link itself does it
        event.preventDefault();
        void this.#busy.run(`report ${name}`, () => opened);
      };
      if (this.player?.motion.name === name) item.dataset.shown = 'first';
      if (this.other?.motion.name === name) item.dataset.shown = 'other';
      item.title = name;
      row.className = 'row';
      row.append(this.#slow('replay', 'Reading…', name, 'Replay', `Replay ${called} in the scene`, () => this.open(name)), report);
      if (this.player && this.player.motion.name !== name) row.append(this.#slow('compare', 'Reading…', name, 'Compare', `Compare: show ${called} beside the one that plays`, () => this.compare(name)));
      row.append(this.#busy.sign(button('Edit', `Edit ${called}: label, rename, delete or download it`, () => {
        if (this.#busy.isRunning(`change ${name}`)) return;
        this.#edit = this.#edit?.name === name ? null : editOf(name, session.label);
        this.#showList();
        this.list.querySelector('.edit')?.scrollIntoView({ block: 'nearest' });
        this.list.querySelector<HTMLInputElement>('.edit input')?.focus({ preventScroll: true });
      }), `change ${name}`, 'Changing…'));
      item.append(words, row);
      if (this.#edit?.name === name) item.append(this.#editor(this.#edit, session));
      return item;
    }), ...notes);
  }

  /** A button of what takes a while. */
  #slow(kind: string, words: string, name: string, text: string, label: string, act: () => Promise<unknown>): HTMLButtonElement {
    const key = `${kind} ${name}`;
    return this.#busy.sign(button(text, label, () => void this.#busy.run(key, act)), key, words);
  }

  /** A line beneath the sessions, and what it offers. */
  #note(words: string, act: string, press: () => void): HTMLElement {
    const item = document.createElement('li');
    item.className = 'note';
    item.append(`${words} `, button(act, act, press));
    return item;
  }

  /** While one is written only its size changes. */
  #showKept(): void {
    const { list } = this.kept, shown = JSON.stringify(list.map(({ name, state, downloaded }) => [name, state, downloaded]));
    if (shown !== this.#keptShown) {
      this.#keptShown = shown;
      if (list.length === 0) return this.#say('Nothing recorded yet.');
      this.list.replaceChildren(...list.map((recording) => this.#keptItem(recording)));
    }
    for (const [i, { size }] of list.entries()) this.list.children[i]!.querySelector('span')!.textContent = `${(size / 1e6).toFixed(1)} MB`;
  }

  #keptItem(recording: KeptRecording): HTMLElement {
    const { name, state, downloaded } = recording, item = document.createElement('li'), words = document.createElement('p'), row = document.createElement('div');
    words.append(Object.assign(document.createElement('strong'), { textContent: name }),
      document.createElement('span'), ` · ${downloaded ? 'downloaded' : { open: 'being written', complete: 'gone with this page unless you download it', 'cut short': 'cut short; gone with this page unless you download it' }[state]}`);
    row.className = 'row';
    row.append(button('Download', `Download ${name} as MCAP`, () => this.kept.download(recording)));
    if (state !== 'open') row.append(surely(name, { sure: false }, () => this.kept.forget(recording)));
    item.append(words, row);
    return item;
  }

  #editor(edit: Edit, { name, label = '' }: RecordedSession): HTMLElement {
    return editForm(edit, label, this.#calledOf(name), this.#busy, {
      save: (changes) => this.#do(name, ...changes),
      remove: () => this.#do(name, ['delete', '']),
      cancel: () => {
        this.#edit = null;
        this.#showList();
      },
    });
  }

  /** The disk may take a moment: until the list has it, or it was refused. The form stays until it is done. */
  #do(name: string, ...changes: [kind: Change, to: string][]): void {
    const to = changes.find(([kind]) => kind === 'rename')?.[1] ?? name, has = (wanted: string) => this.#sessions.find((each) => each.name === wanted);
    const isDone = ([kind, value]: [Change, string]): boolean => {
      if (kind === 'delete') return !has(name);
      if (kind === 'rename') return has(value) !== undefined && !has(name);
      return ((has(to) ?? has(name))?.label ?? '') === value;
    };
    for (const [kind, value] of changes) this.change(kind, name, kind === 'delete' ? undefined : value);
    void this.#busy.run(`change ${name}`, async () => {
      for (let i = 0; i < TRIES && (i === 0 || !changes.every(isDone)) && !(i > 1 && this.refusal()); ++i) {
        await new Promise((done) => setTimeout(done, 300));
        await this.refresh();
      }
      if (to !== name && has(to)) this.#follow(name, to);
      if (changes.some(([kind]) => kind === 'delete') && !has(name)) {
        if (this.player?.motion.name === name) this.close();
        if (this.other?.motion.name === name) this.replay.lay(null);
      }
      if (this.#edit?.name === name) {
        if (changes.every(isDone)) this.#edit = null;
        else this.#edit.refusal = `Not changed: ${this.refusal() || 'the program did not answer'}.`;
      }
      this.#layOut();
    });
    this.#showList();
  }

  /** What is shown has another name now. */
  #follow(name: string, to: string): void {
    for (const shown of [this.player, this.other]) if (shown?.motion.name === name) shown.motion.name = to;
    if (this.#edit?.name === name) this.#edit.name = to;
    if (location.hash.startsWith(`#replay=${encodeURIComponent(name)}`)) history.replaceState(null, '', `#replay=${encodeURIComponent(to)}`);
  }

  async #load(name: string): Promise<Player | null> {
    const answer = await this.#ask(`./sessions/${encodeURIComponent(name)}/motion`);
    try {
      if (!answer?.ok) throw new Error(answer ? await answer.text() : 'not connected');
      return new Player((await answer.json()) as Motion);
    } catch (error) {
      this.#say(String(error instanceof Error ? error.message : error));
      return null;
    }
  }

  async open(name: string): Promise<void> {
    const player = await this.#load(name);
    if (!player) return;
    this.line.hidden = false;
    document.body.dataset.past = 'true';
    this.onShown(true);
    this.replay.open(player);
    this.#layOut();
    element('past-play', HTMLButtonElement).focus();
    if (matchMedia('(max-width: 60rem)').matches) scrollTo({ top: 0 }); // what happened and its plots come before the list
  }

  /** Where it lost most. */
  async #openAtSpill(name: string): Promise<void> {
    if (this.player?.motion.name !== name) await this.open(name);
    const { player } = this, spill = player?.motion.name === name ? worstSpill(player.motion.events) : undefined;
    if (!player || !spill) return;
    player.playing = false;
    player.seek(seenAt(spill.t_s, player.begin));
  }

  async compare(name: string): Promise<void> {
    const other = await this.#load(name);
    if (!other || !this.player) return;
    this.replay.lay(other);
    this.#layOut();
    this.#seeFigures();
  }

  #seeFigures(): void {
    this.#measure();
    element('past-compare', HTMLElement).scrollIntoView({ block: 'start' });
  }

  /** On a phone what is scrolled to stands beneath the bar, however many lines that has. */
  #measure(): void { document.documentElement.style.setProperty('--past-height', `${this.line.offsetHeight}px`); }

  #layOut(): void {
    const { player, other } = this;
    if (!player) return this.#showList();
    element('past-name', HTMLElement).textContent = this.#calledOf(player.motion.name);
    element('past-name', HTMLElement).title = player.motion.name;
    element('past-other', HTMLElement).textContent = other ? `beside ${this.#calledOf(other.motion.name)}` : '';
    element('past-alone', HTMLButtonElement).hidden = element('past-compared', HTMLButtonElement).hidden = !other;
    this.#showFigures(player, other);
    this.#showList();
  }

  /** Of the one that plays, and of the other beside it, a column each. */
  #showFigures(player: Player, other: Player | null): void {
    const table = element('past-figures', HTMLTableElement);
    element('past-compare', HTMLElement).hidden = !other;
    if (!other) return table.replaceChildren();
    const cell = (tag: 'th' | 'td', textContent: string, more: Partial<HTMLTableCellElement> = {}): HTMLTableCellElement => Object.assign(document.createElement(tag), { textContent, ...more });
    const row = (...cells: HTMLTableCellElement[]): HTMLTableRowElement => {
      const made = document.createElement('tr');
      made.append(...cells);
      return made;
    };
    const both = [player, other] as const, figures = [summaryOf(player), summaryOf(other)] as const, better = figures[0]!.map((figure, i) => betterOf(figure, figures[1]![i]!));
    const value = (which: number, i: number): HTMLTableCellElement => {
      const [, text] = figures[which]![i]!, made = cell('td', text, { className: which === 0 ? '' : 'other' });
      if (better[i] === which) {
        made.classList.add('better');
        made.append(Object.assign(document.createElement('span'), { className: 'unseen', textContent: ' (better)' }));
      }
      return made;
    };
    const what = ([name, , , title]: Figure): HTMLTableCellElement => cell('th', name, { scope: 'row', title });
    const title = (which: number): HTMLTableCellElement => cell('th', this.#titleOf(both[which]!.motion), { scope: 'col', className: which === 0 ? '' : 'other' });
    element('past-verdict', HTMLParagraphElement).textContent = verdictOf(both, [this.#calledOf(player.motion.name), this.#calledOf(other.motion.name)], figures);
    const corner = cell('th', 'Compared', { scope: 'col' });
    table.replaceChildren(row(corner, title(0), title(1)), ...figures[0]!.map((figure, i) => row(what(figure), value(0, i), value(1, i))));
  }

  /** As in the list. */
  #calledOf(name: string): string {
    const session: Partial<RecordedSession> & { name: string } = this.#sessions.find((each) => each.name === name) ?? { name };
    return session.label || wordsOf(session, new Date());
  }

  /** What people call it, and every profile that led. */
  #titleOf(motion: Motion): string {
    const session = this.#sessions.find((each) => each.name === motion.name), names = ledIn(motion);
    const told = names.map((name) => this.profiles.find((profile) => profile.name === name)?.label ?? name).join(', ') || (session ? profilesOf(session, this.profiles) : '');
    return `${this.#calledOf(motion.name)}${told ? ` · ${told}` : ''}`;
  }

  close(): void {
    this.replay.close();
    this.line.hidden = true;
    element('past-compare', HTMLElement).hidden = true;
    delete document.body.dataset.past;
    if (location.hash.startsWith('#replay=')) history.replaceState(null, '', location.pathname + location.search);
    this.onShown(false);
    this.#showList();
  }

  #say(words: string): void {
    const item = document.createElement('li');
    item.textContent = words;
    this.list.replaceChildren(item);
  }
}
