import uPlot from 'uplot';
import { onResize, plotRow } from '../element';
import type { Profile } from '../protocol';
import { colorOf, resolved } from '../profiles';
import { clock, offText, sloshText } from '../figures';
import { CURVES, fastestAt, KINDS, measured, type Curve, type Joint } from './curves';
import { fine } from './happened';
import { indexAt, type Motion, type Player } from './player';

/**
 * px: height of a plot, of its time axis, width of the value axis, height of the bands of states and profiles, and of
 * the marks.
 */
const HEIGHT = 50, TIMES = 21, AXIS = 34, BAND = 12, MARK = 7;
/** px from the pointer to the values shown there. */
const BESIDE = 10;
/** px to the right of a plot, for the second half of its last time label. */
const RIGHT = 16;
/** uPlot's name for a null that also covers the other curve's times around it. */
const EXPAND_NULLS = 2;
/** Most points of a curve: more are not visible, and a session of hours has more. */
const POINTS = 3000;

/** s: longer intervals have these steps (s). */
const IN_SECONDS = 120, STEPS = [15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200];

/** The same for shorter intervals, and the shortest interval. */
const FINE_STEPS = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20], CLOSEST = 0.5;
/** Factor of the interval for a step of the wheel; for a button or a key. */
const ZOOM = 1.25;
export const PRESSED = ZOOM ** 3;

/** s from the start, the interval that is shown. */
export type Span = readonly [from: number, to: number];

/** The interval multiplied by `factor`, with `about` at the same place; limited to the recording. */
export function zoomed([from, to]: Span, about: number, factor: number, duration: number): Span {
  const length = Math.min(duration, Math.max(Math.min(CLOSEST, duration), (to - from) * factor));
  return shifted([about - ((about - from) / (to - from)) * length, length], duration);
}

/** The interval from there on, moved into the recording. */
function shifted([from, length]: readonly [number, number], duration: number): Span {
  const begin = Math.max(0, Math.min(duration - length, from));
  return [begin, begin + length];
}

/** An interval that contains this time: it is centred there if the time would be out of sight. */
export function holding(span: Span, at: number, duration: number): Span {
  const [from, to] = span;
  return at >= from && at <= to ? span : shifted([at - (to - from) / 2, to - from], duration);
}

/** s after a point of a curve for which its value is shown. */
const KNOWN_FOR = 1;

/** Below the bands. */
export const MARKS: Readonly<Record<string, string>> = { spill: 'var(--liquid)', limit: 'var(--state-holding)', missed: 'var(--ink)', gap: 'var(--muted)' };

/** Limit, as a multiple of the first distance to the rim: after a spill the distance would hide the rest. */
const TO_RIM = 1.6;

/**
 * A curve over s from the start, thinned to its significant points, and broken where nothing was known for half a
 * second.
 */
export function curveOf(motion: Motion, name: Curve, begin: number, joints: readonly Joint[] = []): [number[], (number | null)[]] {
  const [at, what] = measured(motion, name, joints), isLeast = KINDS[name].least === true, times: number[] = [], values: (number | null)[] = [];
  const stride = Math.max(1, Math.ceil(at.length / POINTS));
  for (let i = 0; i < at.length; i += stride) {
    const t = at[i]! - begin, before = times[times.length - 1];
    if (before !== undefined && t - before > Math.max(0.5, 3 * stride * 0.05)) {
      times.push((t + before) / 2);
      values.push(null);
    }
    let most: number | null = null;
    for (let k = i; k < Math.min(at.length, i + stride); ++k) {
      const value = what[k] ?? null;
      if (value !== null && (most === null || (value > most) !== isLeast)) most = value;
    }
    times.push(t);
    values.push(most);
  }
  return [times, values];
}

/** A curve of a tool. @property of its recording @property late s; null: of the recording that plays @property label its name and a blank; empty: there is one tool */
interface Line { of: Player; late: number | null; label: string; curve: [number[], (number | null)[]]; color: string; dash?: number[] }

/** Value of a curve at this time; null: not known. */
export function valueAt([times, values]: [readonly number[], readonly (number | null)[]], at: number): number | null {
  const i = indexAt(times, at);
  return i < 0 || at - times[i]! > KNOWN_FOR ? null : values[i]!;
}

/** Main values of a curve and their times as text, for screen readers. */
export function told([times, values]: [readonly number[], readonly (number | null)[]], write: (value: number) => string, unit: string, least = false): string {
  let most = -1;
  for (let i = 0; i < values.length; ++i) if (values[i] !== null && (most < 0 || (values[i]! > values[most]!) !== least)) most = i;
  return most < 0 ? 'not recorded' : `at ${least ? 'least' : 'most'} ${write(values[most]!)} ${unit}, at ${clock(times[most]!)}`;
}

/** States and profiles of a recording in order, as text. */
export function statesTold(player: Player): string {
  if (player.tools.length > 1) return player.tools.map((tool) => `${tool.motion.tool}: ${statesTold(tool)}`).join('; ');
  const { motion, begin, duration } = player;
  const spent = new Map<string, number>(), states = (motion.events ?? []).filter(({ kind }) => kind === 'state');
  states.forEach(({ t_s, what }, i) => spent.set(what, (spent.get(what) ?? 0) + Math.max(0, (states[i + 1]?.t_s ?? begin + duration) - Math.max(begin, t_s))));
  const profiles = new Set((motion.settings ?? []).map(({ profile }) => profile));
  return [...[...spent].map(([state, s]) => `${state} for ${s.toFixed(1)} s`), ...(profiles.size ? [`profiles ${[...profiles].join(', ')}`] : [])].join('; ') || 'no states recorded';
}

/** The whole recording on one time axis: states, profiles, lateral specific force and tracking error; a click seeks. */
export class Track {
  readonly #bands = document.createElement('canvas');
  readonly #plots: uPlot[] = [];
  readonly #boxes: HTMLElement[] = [];
  readonly #cursor = document.createElement('i');
  /** Values of the curves at the pointer. */
  readonly #tip = document.createElement('span');
  readonly #told: ((at: number) => string)[] = [];
  #held = false;
  /** The interval that is shown. */
  #span: Span;
  #seen = -1;

  /**
   * @param other laid over it, later by so many s
   * @param chosen plots that are drawn
   * @param joints of the arm, for their names
   * @param onLook another interval is shown
   */
  constructor(private readonly root: HTMLElement, readonly player: Player, private readonly profiles: readonly Profile[], private readonly other: Player | null, private readonly late: number,
              chosen: ReadonlySet<Curve>, private readonly joints: readonly Joint[], private readonly onLook: (span: Span) => void) {
    root.replaceChildren();
    this.#span = this.#whole;
    const bands = this.#frame('State', 'and profile', statesTold(player));
    this.#bands.style.marginLeft = `${AXIS}px`;
    bands.append(this.#bands);
    const knowsLiquid = player.tools.some(({ motion: { liquid } }) => liquid?.freeboard_mm.some((value) => value !== null) ?? false);
    const drawn = CURVES.filter((name) => chosen.has(name) && (knowsLiquid || (name !== 'rim' && name !== 'spilled')));
    for (const name of drawn) this.#make(name, name === drawn[drawn.length - 1]);
    this.#cursor.className = 'cursor';
    Object.assign(this.#tip, { className: 'tip', hidden: true, ariaHidden: 'true' }); // for pointers only: the figures are elsewhere, too
    root.append(this.#cursor, this.#tip);
    root.onpointerdown = (event) => { this.#held = true; this.#seek(event); };
    root.onpointermove = (event) => {
      this.#point(event);
      if (this.#held && event.buttons) this.#seek(event);
    };
    root.onpointerleave = () => { this.#tip.hidden = true; };
    root.onwheel = (event) => {
      // On a page that scrolls, the wheel still scrolls it, except with Ctrl, which is also a pinch of two fingers.
      if (document.documentElement.scrollHeight > innerHeight && !event.ctrlKey) return;
      const all = this.#isWhole && event.deltaY >= 0;
      if (event.deltaY === 0 || all) return;
      event.preventDefault();
      this.zoom(ZOOM ** Math.sign(event.deltaY), this.#timeOf(event));
      this.#point(event);
    };
    root.ondblclick = () => this.zoom(Infinity);
    root.onpointerup = root.onpointercancel = () => { this.#held = false; };
    onResize(root, () => this.resize());
    this.resize();
  }

  /** @param words text for screen readers */
  #frame(title: string, unit: string, words: string): HTMLElement {
    const meaning = 'The wheel over the plots zooms about the pointer (with Ctrl where the page scrolls); double click shows all. Keys: + and − about the time that is shown, 0 for all.';
    const box = Object.assign(plotRow(this.root, title, unit, meaning), { role: 'img', ariaLabel: `${title}: ${words}` });
    this.#boxes.push(box);
    return box;
  }

  /** Of each tool, also of the recording that is laid over this one. */
  #linesOf(name: Curve): Line[] {
    const both: [Player, number | null][] = [[this.player, null], ...(this.other ? [[this.other, this.late] as [Player, number]] : [])];
    return both.flatMap(([of, late]) => (name === 'speed' ? [of] : of.tools).map(({ motion }, i): Line => {
      const [times, values] = curveOf(motion, name, of.begin, this.joints), label = name !== 'speed' && motion.tool !== undefined ? `${motion.tool} ` : '';
      if (late === null) return { of, late, label, curve: [times, values], color: i === 0 ? 'var(--ink)' : 'var(--tool-2)' };
      return { of, late, label, curve: [times.map((t) => t - late), values], color: 'var(--past)', dash: i === 0 ? [4, 3] : [1, 3] };
    }));
  }

  #make(name: Curve, last: boolean): void {
    const { joints } = this, { title, unit, write, least, reach } = KINDS[name], lines = this.#linesOf(name), curves = lines.map(({ curve }) => curve);
    const box = this.#frame(title, unit, lines.filter(({ late }) => late === null).map(({ curve, label }) => `${label}${told(curve, write, unit, least)}`).join('; '));
    const full = name === 'rim' ? TO_RIM * Math.max(1, curves[0]![1].find((value) => value !== null) ?? Infinity) : Infinity;
    if (lines.some(({ label }) => label)) box.previousElementSibling!.append(...lines.filter(({ late }) => late === null).map(({ label, color }) => Object.assign(document.createElement('small'), { textContent: label, style: `color: ${color}` })));
    // The joint is known for the time itself, not for a point that represents several times.
    const joint = ({ of, late }: Line, at: number): string => {
      const words = name === 'speed' ? fastestAt(of.motion, joints, of.begin + at + (late ?? 0)) : '';
      return words && ` (${words})`;
    };
    this.#told.push((at) => `${title.toLowerCase()} ${lines.map((line) => { const value = valueAt(line.curve, at); return `${line.late === null ? '' : 'the other '}${line.label}${value === null ? '–' : `${write(value)}${joint(line, at)}`}`; }).join(', ')} ${unit}`);
    const ink = (): string => resolved('var(--muted)');
    const axis = { stroke: ink, grid: { stroke: 'rgba(128,140,155,0.22)', width: 1 }, ticks: { show: false, size: 0 }, font: '10px system-ui' };
    this.#plots.push(new uPlot({
      width: 300, height: HEIGHT + (last ? TIMES : 0), padding: [4, RIGHT, last ? 0 : 5, 0],
      scales: { x: { time: false, range: () => [...this.#span] }, y: { range: (_u, low, high) => [Math.min(0, name === 'height' ? (low ?? 0) : 0), Math.min(full, Math.max(high ?? 0, reach) * 1.08)] } },
      axes: [{ ...axis, size: last ? TIMES : 0, gap: 6, space: 60, incrs: () => (this.#isLong ? STEPS : FINE_STEPS), values: (_u, ticks) => ticks.map((t) => (last ? this.#timeText(t) : '')) }, { ...axis, size: AXIS, gap: 3, space: 18 }],
      cursor: { show: false }, legend: { show: false },
      series: [{}, ...lines.map(({ color, dash }) => ({ stroke: () => resolved(color), width: 1.5, points: { show: false }, ...(dash && { dash }) }))],
    }, uPlot.join(curves.map(([times, values]) => [times, values.map((value) => (value === null ? null : Math.min(value, full)))] as uPlot.AlignedData), curves.map((curve) => curve.map(() => EXPAND_NULLS))), box));
  }

  /** px from the track's left to the start of its times, and their width. */
  get #place(): [number, number] {
    const box = this.#boxes[0]!.getBoundingClientRect(), left = box.left - this.root.getBoundingClientRect().left + AXIS;
    return [left, Math.max(1, box.width - AXIS - RIGHT)];
  }

  /** s from the start, at the pointer. */
  #timeOf(event: MouseEvent): number {
    const [left, width] = this.#place, [from, to] = this.#span;
    return from + ((event.clientX - this.root.getBoundingClientRect().left - left) / width) * (to - from);
  }

  #seek(event: PointerEvent): void {
    this.player.playing = false;
    this.player.seek(this.#timeOf(event));
  }

  #point(event: MouseEvent): void {
    const at = this.#timeOf(event), [from, to] = this.#span;
    this.#tip.hidden = !(at >= from && at <= to);
    this.#tip.textContent = [fine(Math.max(0, at)), ...this.#told.map((tell) => tell(at))].join('\n');
    const x = this.x(at), { offsetWidth } = this.#tip; // next to the pointer, and within the plots
    this.#tip.style.left = `${Math.max(this.x(from), Math.min(this.x(to) - offsetWidth, at < (from + to) / 2 ? x + BESIDE : x - BESIDE - offsetWidth))}px`;
  }

  /** px from the left, of a time in s from the start. */
  x(at: number): number {
    const [left, width] = this.#place, [from, to] = this.#span;
    return left + (width * (at - from)) / (to - from);
  }

  get span(): Span { return this.#span; }
  get #whole(): Span { return [0, Math.max(0.1, this.player.duration)]; }
  get #isWhole(): boolean { return this.#span[1] - this.#span[0] >= this.#whole[1]; }
  get #isLong(): boolean { return this.#span[1] - this.#span[0] > IN_SECONDS; }

  #timeText(t: number): string {
    const decimals = [0, 1].find((count) => Math.abs(t * 10 ** count - Math.round(t * 10 ** count)) < 1e-6) ?? 2;
    return decimals === 0 ? clock(t) : fine(t, decimals);
  }

  /**
   * Multiplies the interval by `factor`; Infinity: the whole recording.
   * @param about s, of the time that keeps its place
   */
  zoom(factor: number, about = this.player.at): void { this.look(zoomed(this.#span, about, factor, this.#whole[1])); }

  look(span: Span): void {
    this.#span = span;
    for (const plot of this.#plots) plot.setScale('x', { min: span[0], max: span[1] });
    this.resize();
    this.#putCursor();
    this.onLook(span);
  }

  draw(): void {
    const { at } = this.player;
    if (at !== this.#seen) {
      this.#seen = at;
      const span = holding(this.#span, at, this.#whole[1]);
      if (span !== this.#span) return this.look(span);
    }
    this.#putCursor();
  }

  #putCursor(): void {
    const { at } = this.player, [from, to] = this.#span;
    this.#cursor.hidden = at < from || at > to;
    this.#cursor.style.left = `${this.x(at)}px`;
  }

  resize(): void {
    const [, width] = this.#place, [begins, ends] = this.#span;
    this.#boxes.slice(1).forEach((box, i) => { if (box.clientWidth > 0) this.#plots[i]!.setSize({ width: box.clientWidth, height: this.#plots[i]!.height }); });
    this.#bands.width = Math.round(width * devicePixelRatio);
    const { tools } = this.player, marks = (tools.length + 1) * (BAND + 2); // below a band of states for each tool and one of profiles
    this.#bands.height = Math.round((marks + MARK) * devicePixelRatio);
    this.#bands.style.width = `${width}px`;
    const { motion, begin, duration } = this.player, c = this.#bands.getContext('2d')!, scale = this.#bands.width / (ends - begins);
    const band = (entries: { t_s: number }[], colors: string[], top: number): void => entries.forEach(({ t_s }, i) => {
      const from = Math.max(0, t_s - begin), to = (entries[i + 1]?.t_s ?? begin + duration) - begin;
      c.fillStyle = resolved(colors[i]!);
      c.fillRect((from - begins) * scale, top * devicePixelRatio, Math.max(1, (to - from) * scale), BAND * devicePixelRatio);
    });
    tools.forEach((tool, i) => {
      const states = (tool.motion.events ?? []).filter(({ kind }) => kind === 'state');
      band(states, states.map(({ what }) => `var(--state-${what})`), i * (BAND + 2));
    });
    const settings = motion.settings ?? [];
    for (const { t_s, kind } of motion.events ?? []) {
      if (!(kind in MARKS)) continue;
      c.fillStyle = resolved(MARKS[kind]!);
      c.fillRect((t_s - begin - begins) * scale - devicePixelRatio, marks * devicePixelRatio, 3 * devicePixelRatio, MARK * devicePixelRatio);
    }
    for (const { t_s, kind } of this.other?.motion.events ?? []) {
      if (kind !== 'spill') continue;
      c.fillStyle = resolved('var(--past)'); // the colour of its curves
      c.fillRect((t_s - this.other!.begin - this.late - begins) * scale - devicePixelRatio, marks * devicePixelRatio, 3 * devicePixelRatio, MARK * devicePixelRatio);
    }
    band(settings, settings.map(({ profile }) => { const known = this.profiles.find(({ name }) => name === profile); return known ? colorOf(known) : 'var(--profile-other-1)'; }), tools.length * (BAND + 2));
  }

  /** Values of the curves at the time that is shown. */
  values(): string {
    return this.player.tools.map(({ felt, off, motion: { tool } }) => {
      const words = [felt !== null && `lateral ${sloshText(felt)} m/s²`, off !== null && `tracking error ${offText(off)} mm`].filter(Boolean).join(', ');
      return words && tool !== undefined ? `${tool}: ${words}` : words;
    }).filter(Boolean).join(', ');
  }
}
