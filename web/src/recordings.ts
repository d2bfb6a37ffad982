import { Busy, openTab } from './busy';
import { editForm, editOf, surely, type Change, type Edit } from './edit_form';
import { compare } from './compared';
import { element, made, onResize, press, put } from './element';
import { KeptRecordings, type KeptRecording } from './kept';
import type { Profile } from './protocol';
import { beganOf, figures, grown, isFound, ordered, profilesOf, spillOf, wordsOf, type Order, type RecordedSession } from './recorded';
import { seenAt, worstSpill } from './replay/happened';
import { isTyped } from './input/shortcuts';
import { ledIn, Player, type Motion } from './replay/player';
import { Replay } from './replay/replay';

/** Sessions that are listed at first, so many more with each press, and the most that need no press. */
const SHOWN = 6, MORE = 20, FEW = 2;
/** How many times the list is requested for the result of a change. */
const TRIES = 20;
/** s after which the list is requested again while a session is recorded. */
const ANEW = 10;

/**
 * The list of recorded sessions, and the one that is shown: its time line, its events, and another one compared with
 * it.
 */
export class Recordings {
  readonly replay = new Replay((name) => `#replay=${encodeURIComponent(name)}&`);
  /** The edit of the session whose name and label are being changed. */
  #edit: Edit | null = null;
  #sessions: RecordedSession[] = [];
  #most = SHOWN;
  /** Where no program has them. */
  readonly kept = new KeptRecordings(() => this.#showKept());
  #keptShown = '';
  /** s, of the page's clock: when the list that is shown, and when the last one, was requested. */
  #listedAt = 0;
  #askedAt = 0;
  /** The last shown length, s, of the session being recorded. */
  #told = { name: '', length: 0 };
  readonly #busy: Busy;
  /** Whether the current session is being recorded. */
  #writes = false;
  #line: HTMLElement | null = null;
  /** When that started, as text. */
  #began = '';

  /**
   * @param onShown a recording is shown from now on, or is not
   * @param change sends the change to the server; the next list shows its result
   * @param refusal why the server refused it; empty: not refused
   * @param token of a paired client; empty: not paired
   */
  constructor(private readonly list: HTMLElement, private readonly line: HTMLElement, private readonly onShown: (shown: boolean) => void,
              private readonly change: (kind: Change, name: string, to?: string) => void, private readonly refusal: () => string = () => '',
              private readonly token: () => string = () => '') {
    this.#busy = new Busy(list);
    const when = (id: string, act: () => void): void => { element(id, HTMLButtonElement).onclick = act; };
    when('past-compared', () => this.#seeFigures());
    when('past-alone', () => { this.replay.lay(null); this.#layOut(); });
    when('past-close', () => this.close());
    onResize(this.line, () => this.#measure());
    element('recordings-find', HTMLInputElement).oninput = () => this.#showList();
    element('recordings-order', HTMLSelectElement).onchange = () => this.#showList();
    addEventListener('hashchange', () => void this.follow());
  }

  get player(): Player | null { return this.replay.player; }
  get other(): Player | null { return this.replay.other; }
  get profiles(): readonly Profile[] { return this.replay.profiles; }

  /** Opens the recording of the address: #replay=NAME, and &t=S from its start. */
  async follow(): Promise<void> {
    const asked = new URLSearchParams(location.hash.slice(1)), name = asked.get('replay'), at = Number(asked.get('t') ?? NaN);
    if (!name) return;
    if (this.#sessions.length === 0) await this.refresh(); // which has its title
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

  /**
   * Call it a few times a second: updates the length of the session being recorded, and sometimes requests the list.
   * @param writes whether the current session is recorded @param moves the arm moves, or may soon: Space stops it
   */
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
    if (performance.now() / 1000 - this.#askedAt < ANEW || this.#edit || this.list.contains(document.activeElement)) return; // does not replace a list that is in use
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
      const { name } = session, called = this.#calledOf(name), spilled = spillOf(session, this.profiles), began = beganOf(session, new Date());
      const told = made('span', {}, this.#tell(session, performance.now() / 1000 - this.#listedAt, began)), words = made('p', {}, made('strong', {}, called), told);
      if (spilled) {
        const pill = this.#slow('replay', 'Reading…', name, spilled, `${spilled}: replay ${called} at this spill`, () => this.#openAtSpill(name));
        pill.className = 'spilled';
        words.append(pill);
      }
      if (session === this.#written) {
        this.#line = told;
        this.#began = began;
      }
      const report = made('a', { href: `./sessions/${encodeURIComponent(name)}/report.html`, target: '_blank', rel: 'noopener', ariaLabel: `Report of ${called}, in a new tab` }, 'Report');
      this.#busy.sign(report, `report ${name}`, 'Making…');
      report.onclick = (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        const opened = this.#busy.isRunning(`report ${name}`) ? Promise.resolve() : openTab(report.href);
        if (!opened) return; // then the link itself does it
        event.preventDefault();
        void this.#busy.run(`report ${name}`, () => opened);
      };
      const row = made('div', { className: 'row' }, this.#slow('replay', 'Reading…', name, 'Replay', `Replay ${called} in the scene`, () => this.open(name)), report);
      if (this.player && this.player.motion.name !== name) row.append(this.#slow('compare', 'Reading…', name, 'Compare', `Compare: show ${called} next to the current replay`, () => this.compare(name)));
      row.append(this.#busy.sign(press('Edit', `Edit ${called}: label, rename, delete or download it`, () => {
        if (this.#busy.isRunning(`change ${name}`)) return;
        this.#edit = this.#edit?.name === name ? null : editOf(name, session.label);
        this.#showList();
        this.list.querySelector('.edit')?.scrollIntoView({ block: 'nearest' });
        this.list.querySelector<HTMLInputElement>('.edit input')?.focus({ preventScroll: true });
      }), `change ${name}`, 'Changing…'));
      const item = made('li', { title: name }, words, row, ...(this.#edit?.name === name ? [this.#editor(this.#edit, session)] : []));
      if (this.player?.motion.name === name) item.dataset.shown = 'first';
      if (this.other?.motion.name === name) item.dataset.shown = 'other';
      return item;
    }), ...notes);
  }

  /** A button whose action takes a while. */
  #slow(kind: string, words: string, name: string, text: string, label: string, act: () => Promise<unknown>): HTMLButtonElement {
    const key = `${kind} ${name}`;
    return this.#busy.sign(press(text, label, () => void this.#busy.run(key, act)), key, words);
  }

  /** A line below the sessions, with a button. */
  #note(words: string, act: string, onclick: () => void): HTMLElement {
    return made('li', { className: 'note' }, `${words} `, press(act, act, onclick));
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
    const { name, state, downloaded } = recording;
    const words = made('p', {}, made('strong', {}, name), made('span'), ` · ${downloaded ? 'downloaded' : { open: 'being written', complete: 'gone with this page unless you download it', 'cut short': 'cut short; gone with this page unless you download it' }[state]}`);
    const row = made('div', { className: 'row' }, press('Download', `Download ${name} as MCAP`, () => this.kept.download(recording)));
    if (state !== 'open') row.append(surely(name, { sure: false }, () => this.kept.forget(recording)));
    return made('li', {}, words, row);
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

  /** The recording that is shown has a new name. */
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
    if (matchMedia('(max-width: 60rem)').matches) scrollTo({ top: 0 }); // its events and plots are before the list
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

  /** Sets the height of the bar, so that a phone scrolls to below it, however many lines it has. */
  #measure(): void { document.documentElement.style.setProperty('--past-height', `${this.line.offsetHeight}px`); }

  #layOut(): void {
    const { player, other } = this;
    if (!player) return this.#showList();
    element('past-name', HTMLElement).textContent = this.#calledOf(player.motion.name);
    element('past-name', HTMLElement).title = player.motion.name;
    element('past-other', HTMLElement).textContent = other ? `beside ${this.#calledOf(other.motion.name)}` : '';
    element('past-alone', HTMLButtonElement).hidden = element('past-compared', HTMLButtonElement).hidden = !other;
    element('past-compare', HTMLElement).hidden = !other;
    if (other) compare([player, other], [player, other].map(({ motion }) => this.#calledOf(motion.name)), [player, other].map(({ motion }) => this.#titleOf(motion)));
    this.#showList();
  }

  /** As in the list. */
  #calledOf(name: string): string {
    const session: Partial<RecordedSession> & { name: string } = this.#sessions.find((each) => each.name === name) ?? { name };
    return session.label || wordsOf(session, new Date());
  }

  /** Its title for people, and every profile that was engaged. */
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
    this.list.replaceChildren(made('li', {}, words));
  }
}
