import { made } from '../element';
import { offText, partText, percentText, sloshText } from '../figures';
import { indexAt, type Motion } from './player';

export type Curve = 'slosh' | 'rim' | 'off' | 'speed' | 'height' | 'spilled';
/** A joint of the arm that was recorded. */
export interface Joint { name: string; type?: 'revolute' | 'prismatic' }
/** Times, s, and the values known then. */
export type Measured = readonly [times: readonly number[], values: readonly (number | null)[]];

/** Name and meaning of a plot; its axis reaches at least to `reach`. `least`: small values count. */
export interface Kind { title: string; unit: string; meaning: string; reach: number; write: (value: number) => string; least?: true; byDefault?: true }

/** In the order of the plots. */
export const KINDS: Readonly<Record<Curve, Kind>> = {
  slosh: { title: 'Lateral', unit: 'm/s²', meaning: 'Lateral specific force', reach: 1, write: sloshText, byDefault: true },
  rim: { title: 'To the rim', unit: 'mm', meaning: 'Smallest distance from the liquid to the rim, for each wave', reach: 1, write: offText, least: true, byDefault: true },
  off: { title: 'Error', unit: 'mm', meaning: 'Tracking error: distance from the target to the glass', reach: 1, write: offText, byDefault: true },
  speed: { title: 'Joint speed', unit: 'rad/s', meaning: 'The joint with the highest speed at that time; its name is at the pointer', reach: 0.5, write: sloshText },
  height: { title: 'Height', unit: 'm', meaning: 'Height of the target above the base', reach: 0.1, write: (value) => value.toFixed(3) },
  spilled: { title: 'Spilled', unit: '%', meaning: 'Share of the liquid spilled so far', reach: 1, write: (value) => percentText(value / 100) },
};
export const CURVES = Object.keys(KINDS) as Curve[];

/** s before and after a time that contain a whole wave. */
const WAVE = 0.15;

/** Spilled share of the liquid from which on no wave is visible. */
const EMPTY = 0.995;

/** The least of the known values around each time. */
function leastOfWaves(times: readonly number[], values: readonly (number | null)[]): (number | null)[] {
  let first = 0;
  return values.map((value, i) => {
    if (value === null) return null;
    while (times[first]! < times[i]! - WAVE) ++first;
    let least = value;
    for (let k = first; k < times.length && times[k]! <= times[i]! + WAVE; ++k) least = Math.min(least, values[k] ?? least);
    return Math.max(0, least); // a wave that rises above the rim
  });
}

/**
 * Speed, rad/s, of the joint that turned fastest between successive samples, and its number; sliding joints are left
 * out.
 */
export function fastest({ t_s, q }: Motion, joints: readonly Joint[]): { t_s: number[]; speed: (number | null)[]; joint: number[] } {
  const speed: (number | null)[] = [], joint: number[] = [];
  for (let i = 0; i < t_s.length; ++i) {
    const dt = (t_s[i + 1] ?? NaN) - t_s[i]!;
    let most: number | null = null, which = -1;
    for (let k = 0; dt > 0 && k < q[i]!.length; ++k) {
      const each = Math.abs(q[i + 1]![k]! - q[i]![k]!) / dt;
      if (joints[k]?.type === 'prismatic' || (most !== null && each <= most)) continue;
      most = each;
      which = k;
    }
    speed.push(most);
    joint.push(which);
  }
  return { t_s, speed, joint };
}

/** The joint's name if the recorded arm is like the current one; otherwise its number. */
export const jointText = (joints: readonly Joint[], count: number, k: number): string => (joints.length === count && joints[k] ? partText(joints[k].name) : `joint ${k + 1}`);

/** Name of the joint that was fastest then; empty: not known. @param at s, of the recording's clock */
export function fastestAt(motion: Motion, joints: readonly Joint[], at: number): string {
  const i = indexAt(motion.t_s, at);
  if (i < 0 || i + 1 >= motion.t_s.length) return '';
  const [k] = fastest({ name: '', t_s: motion.t_s.slice(i, i + 2), q: motion.q.slice(i, i + 2) }, joints).joint;
  return k === undefined || k < 0 ? '' : jointText(joints, motion.q[i]!.length, k);
}

/** Times and values of a curve; in old sessions the planned lateral specific force. */
export function measured(motion: Motion, name: Curve, joints: readonly Joint[] = []): Measured {
  const { felt, target, liquid } = motion;
  switch (name) {
    case 'rim': return [liquid?.t_s ?? [], leastOfWaves(liquid?.t_s ?? [], liquid?.freeboard_mm.map((mm, i) => (liquid.spilled_share[i]! < EMPTY ? mm : null)) ?? [])];
    case 'spilled': return [liquid?.t_s ?? [], liquid?.spilled_share.map((share) => 100 * share) ?? []];
    case 'height': return [target?.t_s ?? [], target?.p.map(([, , z]) => z) ?? []];
    case 'speed': { const { t_s, speed } = fastest(motion, joints); return [t_s, speed]; }
    case 'off': return [target?.t_s ?? [], target?.error_mm ?? []];
    case 'slosh': return felt?.t_s.length ? [felt.t_s, felt.largest] : [target?.t_s ?? [], target?.lateral ?? []];
  }
}

const KEPT = 'steadyhand.replay-plots';

/** The curves that the user chose in this browser; without a stored choice the usual ones and `more`. */
export function keptCurves(more: readonly Curve[] = []): Set<Curve> {
  let words: string | null = null;
  try { words = localStorage.getItem(KEPT); } catch { /* the usual ones */ }
  return new Set(words === null ? CURVES.filter((name) => KINDS[name].byDefault || more.includes(name)) : CURVES.filter((name) => words.split(' ').includes(name)));
}

export function keepCurves(chosen: ReadonlySet<Curve>): void {
  try { localStorage.setItem(KEPT, [...chosen].join(' ')); } catch { /* the usual ones come next time */ }
}

/** A checkbox for each plot, in a fold. @param onChange the choice has changed */
export function showChoice(root: HTMLElement, chosen: Set<Curve>, onChange: () => void): void {
  root.replaceChildren(...CURVES.map((name) => {
    const { title, unit, meaning } = KINDS[name], box = made('input', { type: 'checkbox', checked: chosen.has(name) });
    box.dataset.plot = name;
    box.onchange = () => {
      if (box.checked) chosen.add(name); else chosen.delete(name);
      keepCurves(chosen);
      onChange();
    };
    return made('label', { className: 'check', title: meaning }, box, ` ${title}, ${unit}`);
  }));
}
