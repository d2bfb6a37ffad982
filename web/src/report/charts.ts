import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { onResize } from '../element';
import { resolved } from '../profiles';
import type { Span } from '../replay/track';
import type { Times, Values } from './data';

/** A curve with its own times. */
export interface Curve { t: Times; values: Values }
export interface Series {
  label: string;
  /** Its name in files. */
  title?: string | undefined;
  color: string;
  /** Index of its profile. */
  profile?: number;
  dash?: number[] | undefined;
  fill?: string;
  width?: number;
  value?: (u: uPlot, value: number | null, series: number, at: number | null) => string;
}
export interface ChartSpec {
  figure: HTMLElement;
  columns: () => uPlot.AlignedData;
  series: readonly Series[];
  unit?: string;
  plugins?: uPlot.Plugin[];
  /** Of the y axis. */
  range?: Range;
  log?: boolean;
  gridOnTop?: boolean;
  /** If present, the chart shares no time, cursor and zoom with the others. */
  x?: { label: string; name: string; range: Range; value: (value: number | null) => string };
}
type Range = (u: uPlot, min: number, max: number) => [number, number];

/** s between the ticks of a time axis: steps that are round in m:ss. */
const TIME_STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 1800, 3600];
/** uPlot's name for a null that also covers the other curves' times around it. */
const EXPAND_NULLS = 2;
/** uPlot declares these as an enumeration that does not exist at run time. */
const ON_TOP = ['series', 'axes'] as unknown as uPlot.DrawOrderKey[];
const FONT = '11px system-ui, sans-serif';

export function format(value: number | null | undefined, unit = '', digits = 3): string {
  if (value === null || value === undefined) return '–';
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.max(Math.abs(value), 10 ** (1 - digits)))));
  return value.toFixed(Math.min(decimals, digits)) + (unit ? `\u00a0${unit}` : '');
}

/** m:ss on an axis, with as many decimals as its steps need. */
export function clockTicks(ticks: readonly number[]): string[] {
  const step = ticks.length > 1 ? ticks[1]! - ticks[0]! : 1, decimals = Math.min(3, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return ticks.map((tick) => {
    const units = Math.round(tick * 10 ** decimals), minute = 60 * 10 ** decimals, rest = ((units % minute) / 10 ** decimals).toFixed(decimals);
    return units < 0 ? '' : `${Math.floor(units / minute)}:${rest.padStart(decimals > 0 ? decimals + 3 : 2, '0')}`;
  });
}

/**
 * Joins curves with different times into the columns of one plot. A value is undefined where a curve has none at
 * another curve's time, and the line passes over it; null stays and breaks the line.
 */
export function columns(curves: readonly Curve[]): uPlot.AlignedData {
  const tables = curves.map(broken);
  return uPlot.join(tables, tables.map((table) => table.map(() => EXPAND_NULLS)));
}

/** With a null where nothing was planned for a while, so that no line joins the parts before and after. */
function broken({ t, values }: Curve): uPlot.AlignedData {
  const steps = t.slice(1).map((at, k) => at - t[k]!).sort((a, b) => a - b), gap = Math.max(0.5, 5 * (steps[steps.length >> 1] ?? 0));
  const times: number[] = [], kept: (number | null)[] = [];
  t.forEach((at, k) => {
    if (k > 0 && at - t[k - 1]! > gap) {
      times.push((at + t[k - 1]!) / 2);
      kept.push(null);
    }
    times.push(at);
    kept.push(values[k] ?? null);
  });
  return [times, kept];
}

/** Draws over a plot, clipped to it. */
export const overlay = (paint: (u: uPlot) => void): uPlot.Plugin => ({
  hooks: {
    draw: (u) => {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      paint(u);
      ctx.restore();
    },
  },
});

/** A horizontal line with its name. */
export const lineMark = (at: number, text: string, color: string): uPlot.Plugin => overlay((u) => {
  const { ctx, bbox } = u, ratio = uPlot.pxRatio, y = Math.round(u.valToPos(at, 'y', true));
  if (y < bbox.top - 1 || y > bbox.top + bbox.height + 1) return;
  ctx.font = `${11 * ratio}px system-ui, sans-serif`;
  ctx.textAlign = 'right';
  ctx.strokeStyle = ctx.fillStyle = resolved(color);
  ctx.lineWidth = ratio;
  ctx.setLineDash([5 * ratio, 4 * ratio]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  const place = [text, bbox.left + bbox.width - 4 * ratio, y + (y - bbox.top > 16 * ratio ? -4 : 13) * ratio] as const;
  ctx.setLineDash([]);
  ctx.strokeStyle = resolved('var(--panel)');
  ctx.lineWidth = 4 * ratio;
  ctx.strokeText(...place);
  ctx.fillText(...place);
});

/** A range with space above and below that includes `values`. */
export const including = (...values: number[]): Range => (_u, min, max) => {
  const low = Math.min(min, ...values), high = Math.max(max, ...values);
  const room = Math.max(0.06 * (high - low), 1e-3 * Math.max(Math.abs(low), Math.abs(high))) || 1; // no ticks for differences by rounding
  return [low === 0 ? 0 : low - room, high + room];
};
/** A range with space above and below, and at least `span`: small changes need no ticks. */
export const atLeast = (span: number): Range => (_u, min, max) => {
  const room = Math.max(0.56 * (max - min), 0.5 * span), middle = 0.5 * (min + max);
  return [middle - room, middle + room];
};
/** 0.09 for 0.0954: uPlot's logarithmic ticks never end if the axis begins with a number that is not round. */
const roundDown = (value: number): number => {
  const exponent = Math.floor(Math.log10(value));
  return Number(`${Math.floor(value / 10 ** exponent)}e${exponent}`);
};
/** A logarithmic axis cannot show zero, and without data it has no ends. */
export const logRange = (...values: number[]): Range => (_u, min, max) => {
  const seen = [min, max, ...values].filter((value) => value > 0 && value < Infinity);
  return seen.length > 0 ? [roundDown(0.8 * Math.min(...seen)), 1.3 * Math.max(...seen)] : [0.1, 1];
};

const plain = (tick: number | null): string => (tick === null ? '' : String(Number(tick.toPrecision(2))));
const oneTwoFive = (tick: number): number | null => (/^[125]e/.test(Number(tick.toPrecision(6)).toExponential()) ? tick : null);
const LOG_AXIS: Partial<uPlot.Axis> = { values: (_u, ticks) => ticks.map(plain), filter: (_u, ticks) => ticks.map(oneTwoFive) };
/** px, largest distance from the pointer to a value that is shown: profiles used at other times show none. */
const nearby = (u: uPlot, _series: number, _k: number, t: number): number => Math.max(12, u.valToPos(t + 0.5, 'x') - u.valToPos(t, 'x'));

function inner(figure: HTMLElement): number {
  const style = getComputedStyle(figure);
  return Math.max(0, Math.floor(figure.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight)));
}
const height = (width: number): number => (width < 420 ? 190 : 230);

/** All plots of a report, those over time on one axis. */
export class Charts {
  readonly #charts: { spec: ChartSpec; plot: uPlot }[] = [];
  /** By profile; false: hidden. */
  readonly #shown: boolean[];
  #span: Span | null = null;
  #looks = false;
  #marked: number | null = null;
  /** Another interval is shown; null: all. */
  onLook: (span: Span | null) => void = () => {};
  /** The pointer is at this time in a plot; null: it has left the plot. */
  onPoint: (t: number | null) => void = () => {};

  /** @param whole s, the first interval of plots over time; null: each plot shows all its data */
  constructor(profiles: number, private readonly whole: Span | null, private readonly time: (value: number | null) => string) {
    this.#shown = Array<boolean>(profiles).fill(true);
  }

  get count(): number { return this.#charts.length; }

  add(spec: ChartSpec): void {
    const chart = { spec, plot: this.#plot(spec) };
    this.#charts.push(chart);
    spec.figure.setAttribute('role', 'group');
    spec.figure.setAttribute('aria-label', `Plot: ${spec.figure.querySelector('h3')?.textContent ?? ''}`);
    onResize(spec.figure, () => {
      const width = inner(spec.figure);
      if (width > 0 && width !== chart.plot.width) chart.plot.setSize({ width, height: height(width) });
    });
  }

  /** After a change of theme, or with other values. @param which plots; all if omitted */
  rebuild(which: (spec: ChartSpec) => boolean = () => true): void {
    for (const chart of this.#charts) {
      if (!which(chart.spec)) continue;
      const off = chart.plot.series.map(({ show }) => show === false);
      chart.plot.destroy();
      chart.plot = this.#plot(chart.spec, off);
    }
  }

  show(profile: number, shown: boolean): void {
    this.#shown[profile] = shown;
    for (const { plot, spec } of this.#charts) spec.series.forEach((series, k) => series.profile === profile && plot.setSeries(k + 1, { show: shown }));
  }

  isShown(profile: number | undefined): boolean { return profile === undefined || this.#shown[profile]!; }

  /** All plots over time show this interval; null: all of it. */
  look(span: Span | null): void {
    if (this.#looks) return;
    this.#looks = true;
    this.#span = span;
    for (const plot of this.#overTime) {
      const times = plot.data[0], [min, max] = span ?? [times[0]!, times[times.length - 1]!];
      plot.setScale('x', { min, max });
    }
    this.onLook(span);
    this.#looks = false;
    this.#place();
  }

  /** Draws a line at this time in all plots over time. */
  mark(t: number): void {
    this.#marked = t;
    this.#place();
  }

  #place(): void {
    if (this.#marked === null) return;
    requestAnimationFrame(() => { // scales change with the next frame
      for (const plot of this.#overTime) plot.setCursor({ left: plot.valToPos(this.#marked!, 'x'), top: 0 }, false);
    });
  }

  get #overTime(): uPlot[] { return this.#charts.filter(({ spec }) => !spec.x).map(({ plot }) => plot); }

  /** From the start to the end of the recording, even if a plot has values of only a part of it. */
  readonly #range: Range = (u, min, max) => {
    const times = u.data[0], all = min === times[0] && max === times[times.length - 1];
    return all && this.whole ? [Math.min(min, this.whole[0]), Math.max(max, this.whole[1])] : [min, max];
  };

  #plot(spec: ChartSpec, off: readonly boolean[] = []): uPlot {
    const { figure, x, log = false, unit } = spec, time = !x, width = inner(figure), stroke = resolved('var(--muted)'), grid = resolved('var(--grid)');
    const axis: uPlot.Axis = { stroke, font: FONT, labelFont: FONT, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1, size: 4 } };
    const hooks: uPlot.Hooks.Arrays = time ? { ready: [(u) => this.#tell(u)], setScale: [(u, key) => this.#follow(u, key)] } : {};
    const plot = new uPlot({
      width, height: height(width), padding: [8, 10, 0, 0], ...(spec.gridOnTop && { drawOrder: ON_TOP }), plugins: spec.plugins ?? [], hooks,
      cursor: { y: false, points: { size: 7 }, drag: { x: true, y: false }, ...(time && { sync: { key: 'time' }, hover: { prox: nearby } }) },
      scales: { x: { time: false, ...(x && { distr: 3 }), range: x?.range ?? this.#range }, y: { ...(log && { distr: 3 }), ...(spec.range && { range: spec.range }) } },
      axes: [
        { ...axis, label: x?.label ?? 'time, m:ss', labelSize: 16, labelGap: 0, size: 26, space: 60, ...(x && LOG_AXIS), ...(time && { incrs: TIME_STEPS, values: (_u, ticks) => clockTicks(ticks) }) },
        { ...axis, size: 46, space: 34, ...(log && LOG_AXIS) },
      ],
      series: [
        { label: x?.name ?? 'time', value: (_u, value) => (x?.value ?? this.time)(value) },
        ...spec.series.map((series, i): uPlot.Series => ({
          label: series.label, stroke: resolved(series.color), width: series.width ?? 1.6, points: { show: false }, show: !off[i + 1] && this.isShown(series.profile),
          ...(series.dash && { dash: series.dash }), ...(series.fill && { fill: resolved(series.fill) }),
          value: series.value ?? ((_u, value) => format(value, unit)),
        })),
      ],
      legend: { markers: { width: 0, fill: (_u, i) => { const series = spec.series[i - 1]; return series ? resolved(series.fill ?? series.color) : 'transparent'; } } },
    }, spec.columns(), figure);
    plot.root.querySelectorAll<HTMLElement>('.u-series').forEach((row, i) => { row.title = spec.series[i - 1]?.title ?? ''; });
    if (time && this.#span) plot.setScale('x', { min: this.#span[0], max: this.#span[1] });
    return plot;
  }

  /** Zooming one plot zooms all. */
  #follow(u: uPlot, key: string): void {
    const { min, max } = u.scales.x ?? {}, times = u.data[0];
    if (key !== 'x' || this.#looks || min === undefined || max === undefined || min === null || max === null || !u.status) return;
    const all = min <= times[0]! && max >= times[times.length - 1]!;
    if (all ? this.#span !== null : min !== this.#span?.[0] || max !== this.#span?.[1]) this.look(all ? null : [min, max]);
  }

  #tell({ over, posToVal }: uPlot): void {
    over.addEventListener('mousemove', ({ offsetX }) => this.onPoint(posToVal(offsetX, 'x')));
    over.addEventListener('mouseleave', () => this.onPoint(null));
  }
}
