import { made } from '../element';
import { fine, kindText, seenAt } from '../replay/happened';
import { meanOffText, percentText, sloshText } from '../figures';
import type { StoryEvent } from '../replay/player';
import { MARKS } from '../replay/track';
import type { FigureRow, Report, Result } from './data';
import { profileColor, profileDash } from './plots';

/** m:ss.ss */
export const timeText = (seconds: number | null): string => (seconds === null ? '–' : fine(Math.max(0, seconds), 2));
const hasGlass = ({ session }: Pick<Report, 'session'>): boolean => session?.has_glass ?? true;
export const toolOf = (report: Report): string => (hasGlass(report) ? 'glass' : 'gripper');

const MONTHS = ['January', 'February', 'March', 'April', 'May', 'June', 'July', 'August', 'September', 'October', 'November', 'December'];
/** "25 November 2026, 15:20:10" from a default name; empty for other names. */
export function dateOf(name: string): string {
  const [, year, month, day, time, rest = ''] = /^(\d{4})-(\d\d)-(\d\d)_(\d\d-\d\d-\d\d)(.*)$/.exec(name) ?? [], called = MONTHS[Number(month) - 1];
  if (!year || !called) return '';
  return `${Number(day)} ${called} ${year}, ${time!.replaceAll('-', ':')}${rest.startsWith('_') ? ` (${rest.slice(1)})` : rest}`; // "_2": of the same program
}

/** The title, and the date if it is known. */
export function titleOf({ recording, title, recorded }: Pick<Report, 'recording' | 'title' | 'recorded'>): string {
  const named = dateOf(recording), began = dateOf(named ? recorded.replace(/ UTC$/, '') : recorded); // several files of a program have one name
  return [title || (named ? '' : recording), began || named].filter(Boolean).join(', ');
}

/** Most spills listed by default; spills of less than TRACE of the liquid are listed only if they are the largest. */
const MOST_TOLD = 5, TRACE = 0.0005;

/** The largest first; `rest` is folded under `words`. */
export function toldSpills(spills: readonly StoryEvent[]): { first: StoryEvent[]; rest: StoryEvent[]; words: string } {
  const share = ({ amount = 0 }: StoryEvent): number => amount, sorted = [...spills].sort((a, b) => share(b) - share(a)), traces = sorted.findIndex((spill, i) => i > 0 && share(spill) < TRACE);
  const count = Math.min(traces < 0 ? sorted.length : traces, MOST_TOLD), rest = sorted.slice(count), most = rest[0] ? share(rest[0]) : 0;
  return { first: sorted.slice(0, count), rest, words: `${rest.length} more, of ${most < TRACE ? '' : 'at most '}${percentText(most)} %` };
}

/** Whether liquid was spilled, how much, and why: the main result of a session. */
export function verdictOf(spills: readonly StoryEvent[], zero: number): HTMLElement {
  if (spills.length === 0) return made('p', { className: 'verdict' }, 'Nothing spilled.');
  const { first, rest, words } = toldSpills(spills);
  // Of two arms it says which: "left: spilled 100 % ...".
  const line = ({ amount = 0, t_s, what, why }: StoryEvent): HTMLElement => made('li', {}, made('b', {}, `${/^.+: (?=spilled)/.exec(what)?.[0] ?? ''}${percentText(amount)} %`), ' ', made('a', { href: `#t=${seenAt(t_s, zero).toFixed(2)}` }, `at ${timeText(t_s - zero)}`), `: ${why}`);
  const more = rest.length > 0 ? [made('li', {}, made('details', {}, made('summary', {}, words), made('ul', {}, ...rest.map(line))))] : [];
  return made('div', { className: 'verdict spilled' }, made('p', {}, `Spilled ${spills.length === 1 ? 'once' : `${spills.length} times`}.`), made('ul', {}, ...first.map(line), ...more));
}

/** Meaning of the colours that occur in the time line. */
export function legendOf(events: readonly StoryEvent[]): HTMLElement[] {
  const states = new Set(events.flatMap(({ kind, what }) => (kind === 'state' ? [what] : []))), marks = new Set(events.flatMap(({ kind }) => (kind in MARKS ? [kind] : [])));
  const sign = (tag: 'i' | 'b', color: string, name: string): HTMLElement => {
    const swatch = made(tag);
    swatch.style.background = color;
    return made('span', {}, swatch, ` ${name}`);
  };
  return [...[...states].map((state) => sign('i', `var(--state-${state})`, state)), ...[...marks].map((kind) => sign('b', MARKS[kind]!, kindText(kind)))];
}

/** "13 % of P1 tracking" or "2.6 × P1 tracking"; empty: nothing to compare, or a profile that was hardly used. */
export function compared(value: number | null, first: number | null, label: string): string {
  const ratio = (value ?? NaN) / (first || NaN);
  if (!(ratio < 100)) return '';
  return `${ratio < 1 ? `${(100 * ratio).toFixed(0)} % of` : `${ratio.toFixed(1)} ×`} ${label}`;
}

/** "2 ×, at most 74.4 %", "once, 3.6 %", or "0". */
export function spillsText(count: number, most: number): string {
  if (count === 0) return '0';
  const share = `${percentText(most)} %`;
  return count === 1 ? `once, ${share}` : `${count} ×, ${share.startsWith('less') ? 'each' : 'at most'} ${share}`;
}

export type Row = [what: string, value: string, unit: string, number?: number | null, first?: number | null];
export function rowsOf(report: Pick<Report, 'profiles' | 'session' | 'tools'>, { metrics, led_s, other_tools: others = [] }: Result): Row[] {
  const first = report.profiles[0]!, solve: Row = ['solve time, mean', (metrics.solve_mean ?? 0).toFixed(0), 'µs', metrics.solve_mean, first.metrics.solve_mean];
  const tools = [metrics, ...others.map((tool) => tool.metrics)].flatMap((of, t) => toolRows(report, of, t === 0 ? first.metrics : (first.other_tools?.[t - 1]?.metrics ?? of))
    .map(([what, ...row]): Row => [others.length > 0 && report.tools ? `${report.tools[t]}: ${what}` : what, ...row]));
  return report.session ? [['engaged', timeText(led_s), ''], ...tools, solve] : [...tools, solve];
}

function toolRows(report: Pick<Report, 'profiles' | 'session'>, m: Result['metrics'], first: Result['metrics']): Row[] {
  const slosh: Row = ['lateral specific force, mean', sloshText(m.lateral_mean), 'm/s²', m.lateral_mean, first.lateral_mean];
  if (!report.session) return [slosh, ['tracking error, RMS', (1e3 * (m.position_rms ?? 0)).toFixed(1), 'mm', m.position_rms, first.position_rms]];
  const known = (of: (each: Result['metrics']) => boolean): boolean => report.profiles.some(({ metrics }) => of(metrics));
  return [ // same words and figures as on the operator's page
    ...(known(({ spills }) => spills !== null) ? [['spilled', spillsText(m.spills ?? 0, m.spilled_share ?? 0), ''] as Row] : []),
    ...(known(({ spills }) => (spills ?? 0) > 0) ? [['spills per minute engaged', sloshText(m.spills_per_minute), '', m.spills_per_minute, first.spills_per_minute] as Row] : []),
    ...(hasGlass(report) ? [slosh, ['lateral specific force, peak', sloshText(m.lateral_max), 'm/s²', m.lateral_max, first.lateral_max] as Row] : []),
    ['tracking error, mean', meanOffText(1e3 * (m.position_mean ?? NaN)), 'mm', m.position_mean, first.position_mean],
  ];
}

/** A card for each profile. @param onChoice a profile is hidden in the plots, or shown again */
export function cardsOf(report: Report, onChoice: (profile: number, shown: boolean) => void): HTMLElement[] {
  return report.profiles.map((profile, i) => {
    const rows = rowsOf(report, profile), box = made('input', { type: 'checkbox', checked: true });
    box.dataset.profile = String(i);
    box.onchange = () => onChoice(i, box.checked);
    const card = made('article', { className: 'card' }, made('h3', {}, made('label', {}, box, ` ${profile.label}`)), made('p', { className: 'weights' }, ...profile.weights.flatMap(({ name, text }, k) => [k > 0 ? ', ' : '', ...(name ? [made('span', { title: name }, name.replaceAll('_', ' ')), ' '] : []), text])),
      made('dl', {}, ...rows.map(([what, value, unit, number, first]) => {
        const words = i > 0 && number !== undefined ? compared(number, first ?? null, report.profiles[0]!.label) : '';
        return made('div', {}, made('dt', {}, what), made('dd', {}, made('b', {}, value), ` ${unit}`, ...(words ? [made('small', {}, words)] : [])));
      })));
    card.style.setProperty('--color', profileColor(report, i));
    card.style.setProperty('--rows', String(2 + rows.length));
    if (profileDash(report, i)) card.style.borderTopStyle = 'dashed';
    return card;
  });
}

/** One table per group of rows. */
export function tablesOf(report: Report): HTMLElement[] {
  const groups = new Map<string, FigureRow[]>();
  for (const row of report.figures) groups.set(row.group, [...(groups.get(row.group) ?? []), row]);
  return [...groups].map(([name, rows]) => {
    const group = name === 'Glass' && !hasGlass(report) ? 'Gripper' : name;
    const heads = report.profiles.map(({ label }, i) => {
      const head = made('th', { scope: 'col' }, made('span', {}, label));
      head.style.setProperty('--color', profileColor(report, i));
      return head;
    });
    const table = made('table', {}, made('thead', {}, made('tr', {}, made('th', { scope: 'col' }, group), ...heads)), made('tbody', {}, ...rows.map((row) => made('tr', {},
      made('th', { scope: 'row' }, row.label, ...(row.unit ? [' ', made('span', { className: 'unit' }, row.unit)] : [])),
      ...row.texts.map((text, i) => (i === row.best ? made('td', { className: 'best' }, text, made('span', { className: 'unseen' }, ' (best)')) : made('td', {}, text)))))));
    table.dataset.group = group;
    return table;
  });
}

export const meaningsOf = (report: Report): HTMLElement[] => report.figures.flatMap(({ label, meaning }) => [made('dt', {}, label), made('dd', {}, meaning)]);

/** How the curves and figures are computed. */
export function noteOf({ session, steps_per_point: steps, commands_per_point: commands }: Pick<Report, 'session' | 'steps_per_point' | 'commands_per_point'>): string {
  return [
    session && 'Curves of the motion show the plans. The time line, times engaged and lateral specific forces are measured.',
    steps > 1 && `A point of a curve represents ${steps} planning steps: the worst of them, or the first if none is worse.`,
    commands > 1 && `A point of a joint's speed is the largest of ${commands} commands.`,
    'The figures in the tables use every sample that was recorded.',
  ].filter(Boolean).join(' ');
}
