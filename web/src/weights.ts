import type { Term } from './protocol';

/** Positions of a slider, 0 to this. */
export const STEPS = 200;

type Range = Term['range'];

/** The weight at a slider's position. */
export function weightAt({ min, max, logarithmic }: Range, position: number): number {
  if (!logarithmic) return Number((min + ((max - min) * position) / STEPS).toPrecision(6));
  return position <= 0 ? 0 : Number((min * (max / min) ** ((position - 1) / (STEPS - 1))).toPrecision(2));
}

/** The slider's position that is nearest to a weight. */
export function positionOf({ min, max, logarithmic }: Range, weight: number): number {
  const share = logarithmic
    ? weight <= 0 ? -1 : 1 + (STEPS - 1) * (Math.log(weight / min) / Math.log(max / min))
    : (STEPS * (weight - min)) / (max - min);
  return Math.min(STEPS, Math.max(logarithmic && weight > 0 ? 1 : 0, Math.round(share)));
}

/** As text, with as many digits as in the report. */
export const weightText = (weight: number): string => String(Number(weight.toPrecision(3)));

/** Relative difference above which two weights differ: the server sends rounded values. */
const OTHER = 1e-3;

/** Whether a profile's weights differ from its defaults. */
export const areChanged = (own: readonly number[], now: readonly number[]): boolean => own.some((weight, i) => Math.abs(weight - (now[i] ?? weight)) > OTHER * Math.max(weight, now[i] ?? weight));

/** Label of a weight's slider, and the effects of its ends. */
export interface Words { label: string; low: string; high: string }

const PLAIN: Readonly<Record<string, Words>> = {
  lateral: { label: 'Weight of lateral specific force', low: '0: lets it slosh', high: 'calm, follows late' },
  vertical: { label: 'Weight of vertical specific force', low: '0: moves freely', high: 'calm, follows late' },
};

/** Terms that the page does not know keep their label. */
export const plain = (term: Term): Words => PLAIN[term.name] ?? { label: term.label, low: '0: does not count', high: 'counts more' };

/** Text of a weight for a screen reader: without a unit that cannot be read aloud. */
export function spokenWeight(range: Range, weight: number, { low, high }: Words): string {
  const share = positionOf(range, weight) / STEPS;
  return `${weightText(weight)}, ${share === 0 ? low.replace(/^0: /, '') : `${Math.round(100 * share)} % of the way to: ${high}`}`;
}

/** "s^3/m^2" with superscripts. */
export const unitText = (unit: string): string => unit.replace(/\^(-?\d)/g, (_, digits: string) => [...digits].map((c) => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)]!).join(''));
