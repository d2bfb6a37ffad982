import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import type { Measure, Profile, StateMessage } from './protocol';

const SPAN = 60;    // s shown
const RATE = 15;    // points a second
const POINTS = SPAN * RATE;
export const PROFILE_COLORS = ['#2f7fd0', '#d1561c', '#138a68', '#8a4fbf', '#a87a00'];

/** Newest POINTS rows of several series, the first one times. */
class History {
  readonly times: number[] = [];
  readonly series: (number | null)[][];
  readonly #ages: number[] = [];
  readonly #data: uPlot.AlignedData;

  constructor(series: number) {
    this.series = Array.from({ length: series }, () => []);
    this.#data = [this.#ages, ...this.series];
  }

  push(time: number, values: readonly (number | null)[]): void {
    const { times, series } = this;
    // A session that began anew has no past.
    if (time < times[times.length - 1]!) for (const row of [times, ...series]) row.length = 0;
    times.push(time);
    for (let i = 0; i < series.length; ++i) series[i]!.push(values[i] ?? null);
    while (times.length > POINTS || time - times[0]! > SPAN) {
      times.shift();
      for (const row of series) row.shift();
    }
  }

  /** With seconds before the newest row in place of the session's clock; the same arrays each time. */
  get data(): uPlot.AlignedData {
    const { times } = this, newest = times[times.length - 1] ?? 0;
    this.#ages.length = times.length;
    for (let i = 0; i < times.length; ++i) this.#ages[i] = times[i]! - newest;
    return this.#data;
  }
}

/** px, of a plot without its legend. */
const HEIGHT = 96;

interface Chart { history: History; plot: uPlot; box: HTMLElement }

/** What the table tells of a profile. */
interface Compared { row: HTMLTableRowElement; cells: HTMLTableCellElement[] }

const milli = (value: Measure): number | null => (value === null ? null : value / 1000);

function comparison(profile: Profile): Compared {
  const row = document.createElement('tr'), name = document.createElement('th'), color = document.createElement('i');
  color.style.background = PROFILE_COLORS[profile.index % PROFILE_COLORS.length]!;
  name.append(color, profile.label);
  row.append(name);
  row.hidden = true;
  return { row, cells: [0, 1, 2, 3].map(() => row.appendChild(document.createElement('td'))) };
}

/** The last minute; profiles have a colour each, so that two of them can be compared as they alternate. */
export class Plots {
  readonly #charts: Record<string, Chart> = {};
  readonly #profiles: Profile[];
  readonly #compared: Compared[];
  readonly #own: (number | null)[];
  readonly #inTurn: Chart[];
  #turn = 0;
  #next = 0;
  #missed = -1;

  constructor(private readonly root: HTMLElement, table: HTMLElement, profiles: Profile[]) {
    this.#profiles = profiles;
    this.#own = profiles.map(() => null);
    this.#compared = profiles.map(comparison);
    table.replaceChildren(...this.#compared.map(({ row }) => row));
    root.replaceChildren();
    const perProfile = profiles.map((p, i) => ({ label: p.name, color: PROFILE_COLORS[i % PROFILE_COLORS.length]! }));
    const spread = [{ label: 'p50', color: '#2f7fd0' }, { label: 'p99', color: '#d1561c' }];
    this.#make('lateral', 'Lateral specific force, m/s²', perProfile, 2);
    this.#make('error', 'Target to glass, mm', perProfile, 50);
    this.#make('solve', 'Solve time, ms', spread, 0.2);
    this.#make('latency', 'Hand to command, ms', spread, 10);
    this.#make('missed', 'Missed deadlines a second', [{ label: 'missed', color: '#c62828' }], 1);
    this.#inTurn = Object.values(this.#charts);
    new ResizeObserver(() => this.resize()).observe(root);
  }

  /** @param least what the axis shows even when all values are smaller */
  #make(name: string, title: string, series: { label: string; color: string }[], least: number): void {
    const box = document.createElement('figure');
    box.dataset.chart = name;
    const caption = document.createElement('figcaption');
    caption.textContent = title;
    // Profiles have their colours in the table.
    if (series[0]!.label === 'p50') {
      for (const { label, color } of series) caption.append(' ', Object.assign(document.createElement('b'), { textContent: label, style: `color: ${color}` }));
    }
    box.append(caption);
    this.root.append(box);
    const history = new History(series.length);
    const ink = () => getComputedStyle(this.root).color;
    const axis = { stroke: ink, grid: { stroke: 'rgba(128,140,155,0.25)', width: 1 }, ticks: { show: false, size: 0 }, font: '10px system-ui' };
    const plot = new uPlot({
      width: Math.max(120, box.clientWidth), height: HEIGHT,
      scales: { x: { time: false, range: [-SPAN, 0] }, y: { range: (_u, _low, high) => [0, Math.max(high ?? 0, least) * 1.08] } },
      axes: [{ ...axis, size: 18, gap: 2, space: 60, values: (_u, ticks) => ticks.map((t) => (t === 0 ? 'now' : `${t.toFixed(0)} s`)) }, { ...axis, size: 34, gap: 2, space: 24 }],
      cursor: { y: false }, legend: { live: true },
      series: [{ label: 's', value: (_u: uPlot, t: number | null) => (t === null ? '–' : t.toFixed(1)) }, ...series.map((s) => ({ label: s.label, stroke: s.color, width: 1.5, points: { show: false }, value: (_u: uPlot, v: number | null) => (v === null ? '–' : v.toFixed(v < 10 ? 2 : 0)) }))],
    }, history.data, box);
    this.#charts[name] = { history, plot, box };
  }

  take(state: StateMessage): void {
    if (state.now_s < this.#next && state.now_s > this.#next - 1) return;
    this.#next = state.now_s + 1 / RATE;
    const [x, y] = state.local_acceleration;
    const lateral = x === null || y === null ? null : Math.hypot(x, y);
    const error = milli(state.tracking_error === null ? null : state.tracking_error * 1e6);
    const t = state.now_s;
    this.#charts.lateral!.history.push(t, this.#ofProfile(lateral, state.controls.profile));
    this.#charts.error!.history.push(t, this.#ofProfile(error, state.controls.profile));
    this.#charts.solve!.history.push(t, [milli(state.solve_us.p50), milli(state.solve_us.p99)]);
    this.#charts.latency!.history.push(t, [milli(state.latency_us.p50), milli(state.latency_us.p99)]);
    const missed = this.#missed < 0 ? 0 : Math.max(0, state.missed_deadlines - this.#missed) * RATE;
    this.#missed = state.missed_deadlines;
    this.#charts.missed!.history.push(t, [missed]);
  }

  /** A row with one profile's value; the same array each time. */
  #ofProfile(value: number | null, index: number): readonly (number | null)[] {
    for (let i = 0; i < this.#own.length; ++i) this.#own[i] = this.#profiles[i]!.index === index ? value : null;
    return this.#own;
  }

  /** One chart at a time, so that no picture waits for all of them; the table with the first. */
  drawNext(): void {
    const chart = this.#inTurn[this.#turn]!;
    if (chart.box.offsetParent !== null) chart.plot.setData(chart.history.data);
    if (this.#turn === 0) this.#compare();
    this.#turn = (this.#turn + 1) % this.#inTurn.length;
  }

  /** Means of the last minute, by profile. */
  #compare(): void {
    const lateral = this.#charts.lateral!.history.series, error = this.#charts.error!.history.series;
    for (let i = 0; i < this.#compared.length; ++i) {
      const felt = lateral[i]!, off = error[i]!, { row, cells } = this.#compared[i]!;
      let sum = 0, peak = 0, n = 0, errors = 0, gripped = 0;
      for (let k = 0; k < felt.length; ++k) {
        const value = felt[k] ?? null;
        if (value === null) continue;
        sum += value;
        peak = Math.max(peak, value);
        ++n;
        const error = off[k] ?? null;
        if (error === null) continue;
        errors += error;
        ++gripped;
      }
      row.hidden = n === 0;
      if (n === 0) continue;
      cells[0]!.textContent = (sum / n).toFixed(2);
      cells[1]!.textContent = peak.toFixed(1);
      cells[2]!.textContent = gripped > 0 ? (errors / gripped).toFixed(0) : '–';
      cells[3]!.textContent = (n / RATE).toFixed(0);
    }
  }

  resize(): void {
    for (const { plot, box } of this.#inTurn) {
      if (box.clientWidth > 0) plot.setSize({ width: box.clientWidth, height: HEIGHT });
    }
  }
}
