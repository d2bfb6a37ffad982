import { clock, latencyText, percentText, spanText } from './figures';
import type { Profile } from './protocol';

/** An entry of the answer to GET sessions (docs/reference/protocol.md). */
export interface RecordedSession {
  name: string;
  duration_s: number;
  bytes: number;
  /** false: being written, or cut short */
  complete: boolean;
  /** Its title for people. */
  label?: string;
  run: Record<string, string>;
  summary: Record<string, string>;
  /** Why the arm stopped, if these are the seconds before a fault. */
  fault?: string;
}

/** When a session started, as text, from the file's default name; other names are returned unchanged. */
export function titleOf(name: string, now: Date): string {
  const [, day, hour, minute, second, place] = /^(\d{4}-\d\d-\d\d)_(\d\d)-(\d\d)-(\d\d)(?:_(\d+))?/.exec(name) ?? [];
  if (!day) return name;
  const began = new Date(`${day}T00:00:00`), midnight = new Date(now).setHours(0, 0, 0, 0), ago = Math.round((midnight - began.getTime()) / 86_400_000);
  const when = ago === 0 ? 'Today' : ago === 1 ? 'Yesterday' : began.toLocaleDateString('en-GB', { day: 'numeric', month: 'long', ...(began.getFullYear() === now.getFullYear() ? {} : { year: 'numeric' }) });
  return `${when} ${hour}:${minute}:${second}${place ? ` (${place})` : ''}`; // the program names its files so
}

const NOT = /not \S+/g, NOT_OR_WORD = /not \S+|\S+/g;
/** Whether the text of a session (`told`) has all words of the search (`wanted`). */
export function isFound(told: string, wanted: string): boolean {
  const all = told.toLowerCase(), said = all.replace(NOT, ' ');
  // "not spilled" is not found by "spilled", nor the other way round.
  return (wanted.toLowerCase().match(NOT_OR_WORD) ?? []).every((word) => word === 'not' || (word.startsWith('not ') ? all.includes(word) : said.includes(word)));
}

/** Its title: each of several files of a program has its own start time, in the order of the list. */
export function wordsOf({ name, run = {} }: { name: string; run?: Record<string, string> }, now: Date): string {
  const named = titleOf(name, now);
  return named !== name && run.recorded ? titleOf(run.recorded.replace(/ UTC$/, ''), now) : named;
}

export type Order = 'newest' | 'oldest' | 'spilled' | 'led' | 'name';
/** The list in the chosen order. Equal ones keep their order, the newest first. */
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

/** When it started, if its title does not say so; empty: it does, or that is unknown. */
export function beganOf(session: RecordedSession, now: Date): string {
  const { name, label, run } = session, named = wordsOf(session, now), known = named !== name;
  if (known) return label ? named : '';
  return run.recorded || run.started ? `${label ? `${name} · ` : ''}${titleOf((run.recorded || run.started!).replace(/ UTC$/, ''), now)}` : label ? name : '';
}

/**
 * s: the length of the session being recorded, never shorter.
 * @param told the last one sent, `age` s ago @param before the last one shown
 */
export const grown = (told: number, age: number, before: number): number => Math.max(told + age, before);

/** The profiles engaged in it, the longest first; if that is not recorded, the one it started with; empty: unknown. */
export function profilesOf({ run, summary }: RecordedSession, profiles: readonly Profile[]): string {
  const led = (summary.profiles ?? '').split(', ').filter(Boolean);
  return led.length > 0 ? led.map((name) => profiles.find((profile) => profile.name === name)?.label ?? name).join(', ') : (run.label ?? '');
}

/** The largest single spill, and under which profile; empty: none, or unknown. */
export function spillOf(session: RecordedSession, profiles: readonly Profile[] = []): string {
  const { summary } = session;
  if (summary.spilled !== 'yes') return '';
  const share = Number.parseFloat(summary.spilled_share ?? ''), often = Number.parseInt(summary.spills ?? '', 10) > 1 ? `${summary.spills} ×, at most ` : '', name = summary.spilled_profile;
  // Older sessions do not record the profile of a spill: a single profile is certain.
  const profile = name ? (profiles.find((each) => each.name === name)?.label ?? name) : /^[^,]+$/.test(summary.profiles ?? '') ? profilesOf(session, profiles) : '';
  return `${share > 0 ? `spilled ${often}${percentText(share)} %` : 'spilled, share not recorded'}${profile ? `${share > 0 ? '' : ','} under ${profile}` : ''}`;
}

/**
 * Length and figures of a session in a line. @param now s for which it has been recorded, while it is being recorded
 * @param profiles with their labels @param spill whether to include the spill
 */
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
