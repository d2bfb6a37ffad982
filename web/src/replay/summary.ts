import { clock, meanOffText, sloshText, spanText } from '../figures';
import type { Player } from './player';

/** s, of a stretch without a plan that is not counted as driven. */
const GAP = 0.5;

/** Mean and largest of what comes in `times`, over the time that a hand led. */
function overLed(player: Player, times: readonly number[], means: readonly (number | null)[], largest: readonly (number | null)[]): { mean: number; most: number; known: boolean } {
  const { led } = player, sum = { weight: 0, value: 0, most: 0 };
  let stretch = 0;
  for (let i = 0; i < times.length; ++i) {
    const t = times[i]!, next = times[i + 1] ?? t, mean = means[i] ?? null;
    while (stretch < led.length && led[stretch]!.to <= t) ++stretch;
    if (stretch >= led.length) break;
    if (t < led[stretch]!.from || mean === null || next - t > GAP) continue;
    sum.weight += next - t;
    sum.value += (next - t) * mean;
    sum.most = Math.max(sum.most, largest[i] ?? mean);
  }
  return { mean: sum.value / sum.weight, most: sum.most, known: sum.weight > 0 };
}

/** A recorded session in figures that two sessions may be compared by: what, and its value in words. */
export function summaryOf(player: Player): [string, string][] {
  const { motion, duration, begin } = player, { target, felt: measured } = motion, events = motion.events ?? [];
  const led = player.led.reduce((sum, { from, to }) => sum + to - from, 0);
  const felt = measured?.t_s.length ? overLed(player, measured.t_s, measured.mean, measured.largest) : overLed(player, target?.t_s ?? [], target?.lateral ?? [], target?.lateral ?? []);
  const off = overLed(player, target?.t_s ?? [], target?.error_mm ?? [], target?.error_mm ?? []);
  const count = (wanted: string): number => events.filter(({ kind }) => kind === wanted).length, spill = events.find(({ kind }) => kind === 'spill');
  return [
    ['Length', clock(duration)],
    ['Led', spanText(led)],
    ['Slosh mean, m/s²', felt.known ? sloshText(felt.mean) : '–'],
    ['Slosh peak, m/s²', felt.known ? sloshText(felt.most) : '–'],
    ['Off target, mm', off.known ? meanOffText(off.mean) : '–'],
    ['Spilled', spill ? `at ${clock(Math.max(0, spill.t_s - begin))}` : 'no'],
    ['Limits', String(count('limit'))],
    ['Stops', String(events.filter(({ kind, what }) => kind === 'state' && what === 'stopping').length)],
  ];
}
