import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { element, made, onResize, plotRow, put } from '../element';
import type { Measure, Profile, StateMessage } from '../protocol';
import { colorOf, resolved } from '../profiles';
import { latencyText, offText, planningText, sloshText } from '../figures';
import { COLUMNS, Comparison, Moment } from './comparison';
import { History, RATE } from './history';
import { Runs } from './runs';
import { LIMITED, MISSED, SPILLED, STATE, STATES, Strip } from './strip';
import { Swing } from '../swing';

/** px, height of a row's plot, and of the time axis below the last one. */
const HEIGHT = 40, TIMES = 21;
/** px, of the value axis; the strip of states is indented as much. */
const AXIS = 34;

interface Line { label: string; color: string; dash?: number[] }
/**
 * `width`: px, 0 if hidden; stored, because reading it while drawing would make the browser compute the layout of the
 * page.
 */
interface Row { history: History; plot: uPlot; box: HTMLElement; values: HTMLElement; lines: Line[]; height: number; width: number; write(value: Measure | undefined): string }

/** A value of 0 means that nothing was measured yet. */
const milli = (value: Measure): number | null => (value ? value / 1000 : null);

/** The last minute on one time axis: states, lateral specific force and tracking error; each profile has a colour. */
export class Plots {
  readonly #rows: Record<string, Row> = {};
  readonly #inTurn: Row[];
  readonly #strip = new Strip();
  readonly #events = new History(4);
  readonly #comparison: Comparison;
  readonly #moment = new Moment();
  readonly #swing = new Swing();
  readonly #runs = new Runs();
  readonly #led = new History(COLUMNS);
  readonly #own: (number | null)[];
  readonly #event: (number | null)[] = [0, 0, 0, 0];
  #turn = 0;
  /** The table was updated last time: every second time is enough. */
  #told = false;
  #next = 0;
  #missed = -1;
  /** s, negative, at the pointer; null: no pointer. */
  #pointed: number | null = null;

  /** @param motions names of the recorded motions */
  constructor(private readonly root: HTMLElement, table: HTMLElement, private readonly profiles: Profile[], motions: readonly string[]) {
    this.#own = profiles.map(() => null);
    this.#comparison = new Comparison(table, element('compare-note', HTMLElement), profiles, motions);
    root.replaceChildren();
    const strip = this.#frame('states', 'States', '', 'States as the lamp shows them; below: spills, active limits, missed deadlines');
    strip.append(this.#strip.canvas);
    strip.previousElementSibling!.append(made('output', {}, ...['spill', 'limit', 'late'].map((name) => made('span', { className: `mark ${name}` }, name))));
    this.#strip.canvas.style.marginLeft = `${AXIS}px`;
    const perProfile = profiles.map((profile) => ({ label: profile.label, color: colorOf(profile) }));
    const spread = [{ label: 'median', color: 'var(--ink)' }, { label: 'p99', color: 'var(--muted)', dash: [3, 3] }];
    this.#make('lateral', 'Lateral', 'm/s²', 'Lateral specific force on the liquid', perProfile, 2, sloshText);
    this.#make('error', 'Error', 'mm', 'Tracking error: distance from the target to the glass', perProfile, 50, offText);
    this.#make('latency', 'Latency', 'ms', 'Time from hand motion to command: median, and p99 dashed', spread, 10, latencyText);
    this.#make('solve', 'Planning', 'ms', 'Solve time of a plan: median, and p99 dashed', spread, 0.2, planningText, true);
    this.#inTurn = Object.values(this.#rows);
    for (const { box } of this.#inTurn) onResize(box, () => this.resize());
    this.resize();
  }

  #frame(name: string, title: string, unit: string, meaning: string): HTMLElement {
    const box = plotRow(this.root, title, unit, meaning);
    box.parentElement!.dataset.chart = name;
    return box;
  }

  /** @param least extent of the axis even if all values are smaller @param write formats a value */
  #make(name: string, title: string, unit: string, meaning: string, lines: Line[], least: number, write: Row['write'], last = false): void {
    const box = this.#frame(name, title, unit, meaning), history = new History(lines.length), height = HEIGHT + (last ? TIMES : 0);
    const values = box.previousElementSibling!.appendChild(document.createElement('output'));
    const ink = (): string => resolved('var(--muted)');
    const axis = { stroke: ink, grid: { stroke: 'rgba(128,140,155,0.22)', width: 1 }, ticks: { show: false, size: 0 }, font: '10px system-ui' };
    const plot = new uPlot({
      width: Math.max(120, box.clientWidth), height, padding: [4, 14, last ? 0 : 4, 0],
      scales: { x: { time: false, range: () => [-history.span, 0] }, y: { range: (_u, _low, high) => [0, Math.max(high ?? 0, least) * 1.08] } },
      axes: [
        { ...axis, size: last ? TIMES : 0, gap: 6, space: 60, values: (_u, ticks) => ticks.map((t) => (!last ? '' : t === 0 ? 'now' : `${+t.toFixed(1)} s`)) },
        { ...axis, size: AXIS, gap: 3, space: 16 },
      ],
      cursor: { y: false, points: { size: 5 }, sync: { key: 'minute' }, drag: { x: false, y: false } },
      legend: { show: false },
      hooks: { setCursor: [(u) => { this.#pointed = u.cursor.idx ?? null; }] },
      series: [{}, ...lines.map(({ label, color, dash }) => ({ label, stroke: () => resolved(color), width: 1.5, points: { show: false }, ...(dash && { dash }) }))],
    }, history.data as uPlot.AlignedData, box);
    this.#rows[name] = { history, plot, box, values, lines, height, write, width: 0 };
  }

  take(state: StateMessage): void {
    const error = state.tracking_error === null ? null : state.tracking_error * 1e3;
    if (this.#moment.profile >= 0 && this.#moment.profile !== state.controls.profile) this.#led.push(state.now_s, this.#moment.end());
    this.#moment.take(state.now_s, state.controls.profile, state.state === 'engaged', state.liquid.lateral, error, state.liquid.spilled_share,
      this.#swing.of(state.now_s, state.controls.profile, state.controls.no_spill));
    this.#runs.take(state, error);
    if (state.now_s < this.#next && state.now_s > this.#next - 1) return;
    this.#next = state.now_s + 1 / RATE;
    const lateral = this.#moment.largest;
    this.#led.push(state.now_s, this.#moment.end());
    const before = this.#moment.endBefore();
    if (before) this.#led.push(state.now_s, before);
    const t = state.now_s, rows = this.#rows;
    rows.lateral!.history.push(t, this.#ofProfile(lateral, state.controls.profile));
    rows.error!.history.push(t, this.#ofProfile(error, state.controls.profile));
    rows.solve!.history.push(t, [milli(state.solve_us.p50), milli(state.solve_us.p99)]);
    rows.latency!.history.push(t, [milli(state.latency_us.p50), milli(state.latency_us.p99)]);
    this.#event[STATE] = STATES.indexOf(state.state);
    this.#event[SPILLED] = Number(state.liquid.spilled);
    this.#event[LIMITED] = Number(state.constraint.kind !== 'none');
    this.#event[MISSED] = Number(this.#missed >= 0 && state.missed_deadlines > this.#missed);
    this.#missed = state.missed_deadlines;
    this.#events.push(t, this.#event);
  }

  /** A row with one profile's value; the same array each time. */
  #ofProfile(value: number | null, index: number): readonly (number | null)[] {
    for (let i = 0; i < this.#own.length; ++i) this.#own[i] = this.profiles[i]!.index === index ? value : null;
    return this.#own;
  }

  /** One row for each call, so that no frame waits for all of them; states with the first. */
  drawNext(): void {
    const row = this.#inTurn[this.#turn]!;
    if (row.width > 0) row.plot.setData(row.history.data as uPlot.AlignedData);
    if (this.#turn === 0) this.#strip.draw(this.#events);
    this.#turn = (this.#turn + 1) % this.#inTurn.length;
  }

  /** Updates values and table together with all other texts, so that the browser computes the layout once. */
  tell(): void {
    for (const row of this.#inTurn) if (row.width > 0) this.#tell(row);
    if ((this.#told = !this.#told)) this.#comparison.draw(this.#led, this.#runs);
  }

  /** The values at the pointer, or else the newest ones. */
  #tell({ history, values, lines, write }: Row): void {
    const at = this.#pointed ?? history.times.length - 1;
    const shown = lines.flatMap(({ label, dash }, i) => { const value = history.series[i]![at]; return value === null || value === undefined ? [] : [`${dash ? `${label} ` : ''}${write(value)}`]; }).join(', ');
    put(values, 'textContent', shown);
  }

  /** After a change of theme. */
  repaint(): void {
    this.#strip.repaint();
    for (const { plot } of this.#inTurn) plot.redraw(false);
  }

  resize(): void {
    let changed = false;
    for (const row of this.#inTurn) {
      const { clientWidth } = row.box;
      if (clientWidth === row.width) continue;
      row.width = clientWidth;
      changed = true;
      if (clientWidth > 0) row.plot.setSize({ width: clientWidth, height: row.height });
    }
    if (!changed) return;
    const width = Math.max(...this.#inTurn.map((row) => row.width)) - AXIS - 14; // an arm without a glass hides one
    if (width > 0) {
      this.#strip.canvas.style.width = `${width}px`;
      this.#strip.resize(width);
    }
  }
}
