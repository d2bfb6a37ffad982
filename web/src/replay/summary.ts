import { clock, meanOffText, percentText, rateText, sloshText, spanText } from '../figures';
import type { Vec3 } from '../protocol';
import { indexAt, type Motion, type Player, type StoryEvent } from './player';

/** s, longest interval without a plan that counts as engaged. */
const GAP = 0.5;

/** Mean and largest of the values at `times`, while engaged. */
function overLed({ led }: Player, times: readonly number[], values: readonly (number | null)[]): { mean: number; most: number; known: boolean } {
  const sum = { weight: 0, value: 0, most: 0 };
  let stretch = 0;
  for (let i = 0; i < times.length; ++i) {
    const t = times[i]!, next = times[i + 1] ?? t, value = values[i] ?? null;
    while (stretch < led.length && led[stretch]!.to <= t) ++stretch;
    if (stretch >= led.length) break;
    if (t < led[stretch]!.from || value === null || next - t > GAP) continue;
    sum.weight += next - t;
    sum.value += (next - t) * value;
    sum.most = Math.max(sum.most, value);
  }
  return { mean: sum.value / sum.weight, most: sum.most, known: sum.weight > 0 };
}

/** Label, value as text, the value if less is better (null: neither better nor worse), and meaning. */
export type Figure = [what: string, text: string, value: number | null, meaning: string];

/** A difference below this share of the larger value is not significant. */
const NOTHING = 0.05;

/** Index of the better of the two; -1: neither. */
export function betterOf([, text, value]: Figure, [, otherText, other]: Figure): number {
  if (value === null || other === null || text === otherText || Math.abs(value - other) <= NOTHING * Math.max(value, other)) return -1;
  return value < other ? 0 : 1;
}

/** Lateral specific force while engaged: the report's figures; in sessions without measurements the planned values. */
function feltOf(player: Player): { mean: number; most: number; known: boolean } {
  const { felt, slosh, target } = player.motion;
  if (felt?.t_s.length) return { mean: slosh?.mean ?? NaN, most: slosh?.largest ?? 0, known: Boolean(slosh) };
  return overLed(player, target?.t_s ?? [], target?.lateral ?? []);
}

const total = (values: readonly number[]): number => values.reduce((all, value) => all + value, 0);

/** Share of one glass, or number of glasses: with refills more than one can be spilled. */
const lostText = (share: number): string => (share < 1.05 ? `${percentText(share)} %` : `${share.toFixed(1)} glasses`);

/** Most spills that are listed with their times. */
const TOLD = 3;

/** When the liquid went over the rim, and how much of it. @param led s, engaged */
function spillText(spills: readonly StoryEvent[], begin: number, led: number): string {
  if (spills.length === 0) return 'no';
  const shares = spills.flatMap(({ amount }) => (amount === undefined ? [] : [amount])), times = spills.map(({ t_s }) => clock(Math.max(0, t_s - begin)));
  const allKnown = shares.length === spills.length;
  const how = allKnown ? `${shares.slice(0, TOLD).map(percentText).join(', ')} % ` : '';
  const often = rateText(spills.length, led);
  if (spills.length > TOLD) return `${often}${allKnown ? `, ${lostText(total(shares))} in all` : ''}`;
  return `${spills.length > 1 ? `${often}: ` : ''}${how}at ${times.join(', ')}`;
}

/**
 * How often an arm that followed, or could have, was stopped: by an operator, by the supervision, or by its
 * controller.
 */
export function stopsOf(events: readonly StoryEvent[]): number {
  let count = 0, runs = true;
  for (const { kind, what } of events) {
    if (kind !== 'state') continue;
    const halts = what === 'stopping' || what === 'fault';
    if (halts && runs) ++count;
    runs = !halts && (runs || what !== 'idle'); // idle on the way out of a fault, which may return
  }
  return count;
}

/** Time engaged, s. */
const ledFor = ({ led }: Player): number => led.reduce((sum, { from, to }) => sum + to - from, 0);

/** Figures of a recorded session, for comparison with another. */
export function summaryOf(player: Player): Figure[] {
  const { motion, duration, begin } = player, events = motion.events ?? [];
  const led = ledFor(player);
  const felt = player.tools.map(feltOf), off = player.tools.map((tool) => tool.motion.off_target_mm ?? null);
  /** Of each tool; the larger one is compared. */
  const each = (values: readonly (number | null)[], write: (value: number) => string): [string, number | null] => {
    const known = values.filter((value) => value !== null);
    return [values.map((value) => (value === null ? '–' : write(value))).join(' / '), known.length > 0 ? Math.max(...known) : null];
  };
  const feltBy = (of: 'mean' | 'most') => each(felt.map((tool) => (tool.known ? tool[of] : null)), sloshText);
  const count = (wanted: string): number => events.filter(({ kind }) => kind === wanted).length, spills = events.filter(({ kind }) => kind === 'spill');
  const lost = total(spills.map(({ amount = 1 }) => amount));
  // Per minute, so that sessions of different lengths can be compared.
  const perMinute = (sum: number): number | null => (led > 0 ? (60 * sum) / led : null);
  return [
    ['Length', clock(duration), null, ''],
    ['Engaged', spanText(led), null, 'Time engaged'],
    ['Lateral mean, m/s²', ...feltBy('mean'), 'Mean lateral specific force while engaged'],
    ['Lateral peak, m/s²', ...feltBy('most'), 'Its largest value'],
    ['Tracking error, mm', ...each(off, meanOffText), 'Mean distance from the target to the glass'],
    ['Spilled', spillText(spills, begin, led), perMinute(lost), 'Number, share and times of spills; the comparison uses the spilled share per minute engaged'],
    ['Active limits', rateText(count('limit'), led), perMinute(count('limit')), 'Number of times that a limit was active; the comparison uses the number per minute engaged'],
    ['Stops', String(stopsOf(events)), null, 'Number of stops'],
  ];
}

/** s between two samples of a hand's path, and the least common time for a comparison. */
const LOOK = 0.1, COMMON = 2;
/** Share of the path's extent: two hands with a smaller mean distance made the same motion. */
const ALIKE = 0.1;

/** Target position, m, at a time (s) after the first engagement, relative to its start; null: no longer engaged. */
function wayOf({ target }: Motion): (after: number) => Vec3 | null {
  const { t_s = [], p = [], engaged = [] } = target ?? {}, first = engaged.indexOf(1);
  return (after) => {
    const t = (t_s[first] ?? NaN) + after, i = indexAt(t_s, t);
    if (i < 0 || !engaged[i] || t > t_s[t_s.length - 1]! || t - t_s[i]! > GAP) return null;
    return [p[i]![0] - p[first]![0], p[i]![1] - p[first]![1], p[i]![2] - p[first]![2]];
  };
}

/**
 * s from their first engagements for which both followed the same motion, as with one recorded hand; 0: they did not;
 * null: too short to decide.
 */
export function alikeFor(one: Player, other: Player): number | null {
  const a = wayOf(one.motion), b = wayOf(other.motion);
  let apart = 0, extent = 0, looks = 0;
  for (;; ++looks) {
    const at = a(looks * LOOK), bt = b(looks * LOOK);
    if (!at || !bt) break;
    apart += Math.hypot(at[0] - bt[0], at[1] - bt[1], at[2] - bt[2]);
    extent = Math.max(extent, Math.hypot(...at), Math.hypot(...bt));
  }
  const seconds = (looks - 1) * LOOK;
  if (seconds < COMMON || extent === 0) return null;
  return apart / looks <= ALIKE * extent ? seconds : 0;
}

/** With a blank that does not break the line. */
const whole = (seconds: number): string => spanText(seconds).replace(' ', '\u00a0');

/** "nothing in 2:28", "once, 74.4 % of a glass, in 2:28", "9 times, 3.2 glasses in all, in 2:28" */
function spilledIn(player: Player): string {
  const spills = (player.motion.events ?? []).filter(({ kind }) => kind === 'spill'), all = total(spills.map(({ amount = NaN }) => amount));
  const often = spills.length === 0 ? 'nothing' : spills.length === 1 ? 'once' : `${spills.length} times`, many = spills.length > 1 ? ' in all' : '';
  const lost = spills.length > 0 && !Number.isNaN(all) ? `, ${lostText(all)}${all < 1.05 ? ' of a glass' : ''}${many},` : '';
  return `${often}${lost} in ${whole(ledFor(player))}`;
}

/** Which of two spilled less for each minute engaged. */
function lessSpilled(players: readonly [Player, Player], names: readonly [string, string], spilled: readonly [Figure, Figure]): string {
  const idle = players.findIndex((player) => ledFor(player) === 0);
  if (idle >= 0) return `“${names[idle]}” was never engaged: there is nothing to compare.`;
  const less = betterOf(...spilled), lost = spilled.map(([, , perMinute]) => perMinute);
  if (less >= 0) return `“${names[less]}” did better: it spilled ${spilledIn(players[less]!)} while engaged. “${names[1 - less]}” spilled ${spilledIn(players[1 - less]!)}.`;
  if (lost.every((each) => each === 0)) return 'Neither spilled.';
  return 'Both spilled about as much per minute engaged.';
}

/** The main result of a comparison. @param names of the two @param figures of each */
export function verdictOf(players: readonly [Player, Player], names: readonly [string, string], figures: readonly [readonly Figure[], readonly Figure[]]): string {
  const spilled = (which: 0 | 1): Figure => figures[which].find(([what]) => what === 'Spilled')!, words = lessSpilled(players, names, [spilled(0), spilled(1)]);
  const alike = alikeFor(...players);
  const motion = alike === null ? '' : alike > 0 ? `Both hands made the same motion for ${whole(alike)} from their first engagement.` : 'The hands moved differently, which may be why.';
  return [words, motion].filter(Boolean).join(' ');
}
