/** What GET sessions answers (docs/protocol.md). */
export interface RecordedSession {
  name: string;
  duration_s: number;
  bytes: number;
  /** false: being written, or cut short */
  complete: boolean;
  run: Record<string, string>;
  summary: Record<string, string>;
}

/** What GET sessions/NAME/motion answers: when, and where the arm was measured. */
export interface Motion { name: string; t_s: number[]; q: number[][] }

export const clock = (seconds: number): string => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, '0')}`;

/** Length and figures of a session in a line. */
export function figures(session: RecordedSession): string {
  const { summary } = session, words = [clock(session.duration_s)];
  const label = session.run.label;
  if (label) words.push(label);
  const number = (key: string): number => Number.parseFloat(summary[key] ?? '');
  if (Number.isFinite(number('engaged_s'))) words.push(`engaged ${clock(number('engaged_s'))}`);
  if (Number.isFinite(number('latency_p50_ms'))) words.push(`latency ${number('latency_p50_ms').toFixed(0)} ms`);
  if (summary.spilled === 'yes') words.push('spilled');
  words.push(`${(session.bytes / 1e6).toFixed(session.bytes < 1e7 ? 1 : 0)} MB`);
  if (!session.complete) words.push('not closed');
  return words.join(' · ');
}

/** A recorded motion as it plays; knows no DOM. */
export class Player {
  playing = true;
  /** s from its begin. */
  at = 0;
  readonly duration: number;
  readonly #q: Float64Array;
  #near = 0;

  constructor(readonly motion: Motion) {
    if (motion.t_s.length === 0 || motion.q.length !== motion.t_s.length) throw new Error(`${motion.name} holds no motion`);
    this.duration = motion.t_s[motion.t_s.length - 1]! - motion.t_s[0]!;
    this.#q = new Float64Array(motion.q[0]!.length);
  }

  seek(at: number): void { this.at = Math.max(0, Math.min(this.duration, at)); }

  advance(dt: number): void {
    if (!this.playing) return;
    this.seek(this.at + dt);
    if (this.at >= this.duration) this.playing = false;
  }

  toggle(): void {
    if (!this.playing && this.at >= this.duration) this.at = 0;
    this.playing = !this.playing;
  }

  /** rad, at `at`; the same array each time. */
  q(): Float64Array {
    const { t_s: t, q } = this.motion, wanted = t[0]! + this.at;
    if (t[this.#near]! > wanted) this.#near = 0;
    while (this.#near + 2 < t.length && t[this.#near + 1]! <= wanted) ++this.#near;
    const i = this.#near, j = Math.min(i + 1, t.length - 1), span = t[j]! - t[i]!;
    const share = span > 0 ? Math.min(1, Math.max(0, (wanted - t[i]!) / span)) : 0;
    for (let k = 0; k < this.#q.length; ++k) this.#q[k] = q[i]![k]! + share * (q[j]![k]! - q[i]![k]!);
    return this.#q;
  }
}

/** The list of recorded sessions, and the time line of the one that is shown. */
export class Recordings {
  player: Player | null = null;

  /** @param onShown the past is on the screen from now on, or is not */
  constructor(private readonly list: HTMLElement, private readonly line: HTMLElement, private readonly onShown: (shown: boolean) => void) {
    this.#part('past-play', HTMLButtonElement).onclick = () => this.player?.toggle();
    this.#part('past-close', HTMLButtonElement).onclick = () => this.close();
    const range = this.#part('past-at', HTMLInputElement);
    range.oninput = () => {
      if (!this.player) return;
      this.player.playing = false;
      this.player.seek(Number(range.value));
    };
  }

  async refresh(): Promise<void> {
    const answer = await fetch('./sessions').catch(() => null);
    if (!answer?.ok) return this.#say('No list of recordings to be had.');
    const { sessions } = (await answer.json()) as { sessions: RecordedSession[] };
    if (sessions.length === 0) return this.#say('Nothing recorded yet.');
    this.list.replaceChildren(...sessions.slice(0, 50).map((session) => {
      const item = document.createElement('li');
      const words = document.createElement('p');
      words.append(Object.assign(document.createElement('strong'), { textContent: session.name }), figures(session));
      const play = Object.assign(document.createElement('button'), { type: 'button', textContent: 'Replay', onclick: () => void this.open(session.name) });
      const report = Object.assign(document.createElement('a'),
        { href: `./sessions/${encodeURIComponent(session.name)}/report.html`, target: '_blank', rel: 'noopener', textContent: 'Report' });
      play.setAttribute('aria-label', `Replay ${session.name} in the scene`);
      report.setAttribute('aria-label', `Report of ${session.name}, in a new tab`);
      const row = Object.assign(document.createElement('div'), { className: 'row' });
      row.append(play, report);
      item.append(words, row);
      return item;
    }));
  }

  async open(name: string): Promise<void> {
    const answer = await fetch(`./sessions/${encodeURIComponent(name)}/motion`).catch(() => null);
    try {
      if (!answer?.ok) throw new Error(answer ? await answer.text() : 'not connected');
      this.player = new Player((await answer.json()) as Motion);
    } catch (error) {
      return this.#say(String(error instanceof Error ? error.message : error));
    }
    this.line.hidden = false;
    document.body.dataset.past = 'true';
    this.onShown(true);
    this.#part('past-name', HTMLElement).textContent = name;
    this.#part('past-at', HTMLInputElement).max = String(this.player.duration);
    this.#part('past-play', HTMLButtonElement).focus();
  }

  close(): void {
    this.player = null;
    this.line.hidden = true;
    delete document.body.dataset.past;
    this.onShown(false);
  }

  /** A few times a second. */
  draw(): void {
    if (!this.player) return;
    const { at, duration, playing } = this.player;
    this.#part('past-at', HTMLInputElement).value = String(at);
    this.#part('past-at', HTMLInputElement).setAttribute('aria-valuetext', `${clock(at)} of ${clock(duration)}`);
    this.#part('past-time', HTMLElement).textContent = `${clock(at)} / ${clock(duration)}`;
    this.#part('past-play', HTMLButtonElement).textContent = playing ? 'Pause' : 'Play';
  }

  #say(words: string): void {
    const item = document.createElement('li');
    item.textContent = words;
    this.list.replaceChildren(item);
  }

  #part<T extends HTMLElement>(id: string, kind: new () => T): T {
    const found = this.line.querySelector(`#${id}`);
    if (!(found instanceof kind)) throw new Error(`index.html has no ${kind.name} #${id}`);
    return found;
  }
}
