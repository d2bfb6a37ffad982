import { clock } from './clock';
import type { Player } from './player';

/** s, of a stretch without a plan that is not counted as driven. */
const GAP = 0.5;

/** A recorded session in figures that two sessions may be compared by: what, and its value in words. */
export function summaryOf({ motion, duration, begin }: Player): [string, string][] {
  const target = motion.target, events = motion.events ?? [];
  let led = 0, felt = 0, most = 0, off = 0;
  for (let i = 0; target && i + 1 < target.t_s.length; ++i) {
    const dt = target.t_s[i + 1]! - target.t_s[i]!, lateral = target.lateral[i] ?? null, error = target.error_mm[i] ?? null;
    if (!target.engaged[i] || dt > GAP || lateral === null || error === null) continue;
    led += dt;
    felt += dt * lateral;
    off += dt * error;
    most = Math.max(most, lateral);
  }
  const count = (wanted: string): number => events.filter(({ kind }) => kind === wanted).length, spill = events.find(({ kind }) => kind === 'spill');
  const mean = (sum: number, digits: number): string => (led > 0 ? (sum / led).toFixed(digits) : '–');
  return [
    ['Length', clock(duration)],
    ['Led', clock(led)],
    ['Slosh mean, m/s²', mean(felt, 2)],
    ['Slosh peak, m/s²', led > 0 ? most.toFixed(1) : '–'],
    ['Off target, mm', mean(off, 0)],
    ['Spilled', spill ? `at ${clock(Math.max(0, spill.t_s - begin))}` : 'no'],
    ['Limits', String(count('limit'))],
    ['Stops', String(events.filter(({ kind, what }) => kind === 'state' && what === 'stopping').length)],
  ];
}
