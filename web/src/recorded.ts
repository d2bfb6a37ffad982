import { clock, latencyText, percentText, spanText } from './figures';
import type { Profile } from './protocol';

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

/** Length and figures of a session in a line. @param now s that it has been written for by now, where it is being written @param profiles whose labels are known @param spill tell of it, too */
export function figures(session: RecordedSession, now: number | null = null, profiles: readonly Profile[] = [], spill = true): string {
  const { summary } = session, words = [session.fault ? `the seconds before a fault: ${session.fault}` : clock(now ?? session.duration_s)];
  if (now !== null) words.unshift('being recorded');
  const label = profilesOf(session, profiles);
  if (label) words.push(label);
  const number = (key: string): number => Number.parseFloat(summary[key] ?? '');
  if (number('engaged_s') >= 0.05) words.push(`engaged ${spanText(number('engaged_s'))}`);
  if (number('latency_p50_ms') > 0) words.push(`latency ${latencyText(number('latency_p50_ms'))} ms`);
  if (spill) words.push(...[spillOf(session, profiles)].filter(Boolean));
  words.push(`${(session.bytes / 1e6).toFixed(session.bytes < 1e7 ? 1 : 0)}\u00a0MB`);
  if (!session.complete && now === null) words.push('not closed');
  return words.join(' · ');
}
