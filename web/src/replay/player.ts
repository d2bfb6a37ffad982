import type { Pose, Quat, Vec3 } from '../protocol';
import type { MutablePose } from '../frames';

/** s, between two samples of the arm in the server's answer; a step moves by one. */
const STEP = 1 / 30;

/** "state", "spill", "refill", "limit", "setting", "missed", "gap" or "rest"; of a state `what` is its name. */
/** `amount`: of a spill the share of the liquid, of missed deadlines how many. */
export interface StoryEvent { t_s: number; kind: string; what: string; why: string; amount?: number }

/** What was recorded of one tool. */
export interface ToolMotion {
  /** Measured, 0 open to 1 closed; null: no gripper. */
  gripper?: (number | null)[];
  target?: { t_s: number[]; p: Vec3[]; q: Quat[]; engaged: number[]; lateral: (number | null)[]; error_mm: (number | null)[] };
  /** Measured lateral specific force, m/s^2: mean and largest of `count` measurements from a time until the next. */
  felt?: { t_s: number[]; mean: (number | null)[]; largest: (number | null)[]; count?: number[] };
  /** m/s^2, measured while engaged, computed as in the report; null: not measured. */
  slosh?: { mean: number; largest: number } | null;
  /** Mean distance from the target to the glass while engaged, computed as in the report; null: never engaged. */
  off_target_mm?: number | null;
  liquid?: { t_s: number[]; tilt: [number, number][]; freeboard_mm: (number | null)[]; spilled: number[]; spilled_share: number[] };
}

/**
 * The answer to GET sessions/NAME/motion: times and measured positions of the arm; the target, the liquid and the
 * events, each with its own times.
 */
export interface Motion extends ToolMotion {
  name: string;
  t_s: number[];
  q: number[][];
  /** Name of the first tool, and the others; absent: there is one. */
  tool?: string;
  other_tools?: ({ name: string } & ToolMotion)[];
  settings?: { t_s: number; profile: string; scale: number; fill: number }[];
  events?: StoryEvent[];
}

/** The recording of each tool by itself, with its events and those of the whole robot. One tool: the recording. */
export function motionsOf(motion: Motion): Motion[] {
  const { other_tools: others = [], ...first } = motion;
  if (others.length === 0) return [motion];
  const each: Motion[] = [first, ...others.map(({ name, ...tool }) => ({ ...first, ...tool, tool: name }))];
  const toolOf = ({ kind, what, why }: StoryEvent): number => each.findIndex(({ tool }) => (kind === 'state' ? why : what).startsWith(`${tool}: `));
  return each.map((of, i) => ({ ...of, ...(of.events && { events: of.events.filter((event) => [-1, i].includes(toolOf(event))) }) }));
}

/** Names of the profiles used while engaged, in the order of their first use. */
export function ledIn(motion: Motion): string[] { return [...new Set(motionsOf(motion).flatMap(ledBy))]; }

function ledBy({ target, settings = [] }: Motion): string[] {
  const names = new Set<string>(), { t_s = [], engaged = [] } = target ?? {};
  for (let i = 0, k = -1; i < t_s.length; ++i) {
    while (k + 1 < settings.length && settings[k + 1]!.t_s <= t_s[i]!) ++k;
    if (engaged[i]) names.add(settings[Math.max(k, 0)]?.profile ?? '');
  }
  names.delete('');
  return [...names];
}

/** Index of the last of rising times that is not after `wanted`; -1: before the first. */
export function indexAt(times: readonly number[], wanted: number): number {
  let low = -1, high = times.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= wanted) low = middle; else high = middle;
  }
  return low;
}

const last = <T extends { t_s: number }>(entries: readonly T[] | undefined, wanted: number, fits: (entry: T) => boolean = () => true): T | undefined => {
  for (let i = (entries?.length ?? 0) - 1; i >= 0; --i) if (entries![i]!.t_s <= wanted && fits(entries![i]!)) return entries![i];
  return undefined;
};

/** Plays a recorded motion; independent of the DOM. */
export class Player {
  playing = false;
  loops = false;
  speed = 1;
  /** s from its start. */
  at = 0;
  readonly duration: number;
  readonly begin: number;
  /** A player of each tool, at the same time; one tool: this player. */
  readonly tools: readonly Player[];
  readonly #q: Float64Array;
  readonly #target: MutablePose = { p: [0, 0, 0], q: [0, 0, 0, 1] };
  readonly #tilt: [number, number] = [0, 0];

  constructor(readonly motion: Motion) {
    if (motion.t_s.length === 0 || motion.q.length !== motion.t_s.length) throw new Error(`${motion.name} holds no motion`);
    this.begin = motion.t_s[0]!;
    this.duration = motion.t_s[motion.t_s.length - 1]! - this.begin;
    this.#q = new Float64Array(motion.q[0]!.length);
    const tools = motionsOf(motion);
    this.tools = tools.length > 1 ? tools.map((tool) => new Player(tool)) : [this];
  }

  seek(at: number): void {
    this.at = Math.max(0, Math.min(this.duration, at));
    for (const tool of this.tools) tool.at = this.at;
  }

  advance(dt: number): void {
    if (!this.playing) return;
    this.seek(this.at + dt * this.speed);
    if (this.at < this.duration) return;
    if (this.loops && this.duration > 0) this.seek(0); else this.playing = false;
  }

  toggle(): void {
    if (!this.playing && this.at >= this.duration) this.seek(0);
    this.playing = !this.playing;
  }

  /** Moves by this many samples, forward or back. */
  step(count: number): void {
    this.playing = false;
    this.seek(this.at + count * STEP);
  }

  /** When the arm first followed, s from the start: two sessions are aligned at this time. */
  get firstGrip(): number {
    const grip = this.motion.events?.find(({ kind, what }) => kind === 'state' && what === 'engaged');
    return grip ? Math.max(0, grip.t_s - this.begin) : 0;
  }

  /** s, of the recording's clock. */
  get now(): number { return this.begin + this.at; }

  /** rad; the same array each time. @param at s from its start */
  q(at = this.at): Float64Array {
    const { t_s: t, q } = this.motion, wanted = this.begin + at;
    const i = Math.max(0, indexAt(t, wanted)), j = Math.min(i + 1, t.length - 1), span = t[j]! - t[i]!;
    const share = span > 0 ? Math.min(1, Math.max(0, (wanted - t[i]!) / span)) : 0;
    for (let k = 0; k < this.#q.length; ++k) this.#q[k] = q[i]![k]! + share * (q[j]![k]! - q[i]![k]!);
    return this.#q;
  }

  /** 0 open to 1 closed; null: no gripper. */
  get gripper(): number | null { return this.motion.gripper?.[Math.max(0, indexAt(this.motion.t_s, this.now))] ?? null; }

  /** Target of the glass; null: not recorded. The same pose each time. */
  target(): Pose | null {
    const target = this.motion.target, i = target ? indexAt(target.t_s, this.now) : -1;
    if (!target || i < 0) return null;
    const { p, q } = this.#target;
    for (let k = 0; k < 3; ++k) p[k] = target.p[i]![k]!;
    for (let k = 0; k < 4; ++k) q[k] = target.q[i]![k]!;
    return this.#target;
  }

  /** rad, of the liquid's surface about the glass's x and y; the same array each time. */
  tilt(): [number, number] {
    const liquid = this.motion.liquid, i = liquid ? indexAt(liquid.t_s, this.now) : -1;
    this.#tilt[0] = i < 0 ? 0 : liquid!.tilt[i]![0];
    this.#tilt[1] = i < 0 ? 0 : liquid!.tilt[i]![1];
    return this.#tilt;
  }

  /** m/s^2, lateral, as measured; older sessions recorded the planned value; null: not known. */
  get felt(): number | null {
    const { felt, target } = this.motion, [times, values] = felt?.t_s.length ? [felt.t_s, felt.largest] : [target?.t_s ?? [], target?.lateral ?? []];
    return values[indexAt(times, this.now)] ?? null;
  }

  /** mm, from the target to the glass; null: not engaged. */
  get off(): number | null {
    const { target } = this.motion, i = target ? indexAt(target.t_s, this.now) : -1;
    return i < 0 || this.state !== 'engaged' ? null : (target!.error_mm[i] ?? null);
  }

  /** mm to the rim, now and the least since the glass was filled; null: not known. */
  freeboard(): { now: number; least: number } | null {
    const { liquid } = this.motion, at = liquid ? indexAt(liquid.t_s, this.now) : -1, now = liquid?.freeboard_mm[at] ?? null;
    if (now === null) return null;
    const filled = last(this.motion.events, this.now, ({ kind, what }) => kind === 'refill' || (kind === 'state' && what === 'engaged'))?.t_s ?? -Infinity;
    let least = now;
    for (let i = at; i >= 0 && liquid!.t_s[i]! >= filled; --i) least = Math.min(least, liquid!.freeboard_mm[i] ?? least);
    return { now, least };
  }

  /** Intervals in which the arm, or one of two, was engaged, s of the recording's clock. */
  get led(): { from: number; to: number }[] {
    if (this.tools.length > 1) {
      const all = this.tools.flatMap(({ led }) => led).sort((a, b) => a.from - b.from), merged: { from: number; to: number }[] = [];
      for (const each of all) {
        const before = merged.at(-1);
        if (before && each.from <= before.to) before.to = Math.max(before.to, each.to);
        else merged.push({ ...each });
      }
      return merged;
    }
    const states = (this.motion.events ?? []).filter(({ kind }) => kind === 'state'), end = this.begin + this.duration;
    return states.flatMap(({ t_s, what }, i) => (what === 'engaged' ? [{ from: t_s, to: Math.min(end, states[i + 1]?.t_s ?? end) }] : []));
  }

  /** Share of the liquid. */
  get spilledShare(): number {
    const { liquid } = this.motion, i = liquid ? indexAt(liquid.t_s, this.now) : -1;
    return liquid?.spilled_share[i] ?? 0;
  }

  get spilled(): boolean {
    const liquid = this.motion.liquid, i = liquid ? indexAt(liquid.t_s, this.now) : -1;
    return i >= 0 && liquid!.spilled[i] === 1;
  }

  /** Of two arms: engaged, or else holding, if one is. */
  get state(): string {
    const own = this.tools.length > 1 ? this.tools.map(({ state }) => state) : [];
    return own.find((state) => state === 'engaged') ?? own.find((state) => state === 'holding') ?? last(this.motion.events, this.now, ({ kind }) => kind === 'state')?.what ?? '';
  }
  get profile(): string { return last(this.motion.settings, this.now)?.profile ?? ''; }
  get scale(): number | undefined { return last(this.motion.settings, this.now)?.scale; }
  /** m; 0: not recorded. */
  get fill(): number { return last(this.motion.settings, this.now)?.fill ?? 0; }
}
