import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { element, made, onResize, plotRow, put } from '../element';
import type { Measure, Profile, StateMessage } from '../protocol';
import { colorOf, resolved } from '../profiles';
import { latencyText, offText, planningText, sloshText } from '../figures';
import { Comparison } from './comparison';
import type { History } from './history';
import { Minute } from './minute';
import { Strip } from './strip';

/** px, height of a row's plot, and of the time axis below the last one. */
const HEIGHT = 40, TIMES = 21;
/** px, of the value axis; the strip of states is indented as much. */
const AXIS = 34;

interface Line { label: string; color: string; dash?: number[] }
/**
 * `width`: px, 0 if hidden; stored, because reading it while drawing would make the browser compute the layout of the
 * page.
 */
interface Row { name: string; plot: uPlot; box: HTMLElement; values: HTMLElement; lines: Line[]; height: number; width: number; write(value: Measure | undefined): string }

/** The last minute of the active tool on one time axis: states, lateral specific force and tracking error; each profile has a colour. */
export class Plots {
  readonly #rows: Record<string, Row> = {};
  readonly #inTurn: Row[];
  readonly #strip = new Strip();
  readonly #comparison: Comparison;
  /** Of each tool. */
  readonly #minutes: Minute[];
  /** Index of the tool that is shown. */
  active = 0;
  #turn = 0;
  /** The table was updated last time: every second time is enough. */
  #told = false;
  /** s, negative, at the pointer; null: no pointer. */
  #pointed: number | null = null;

  /** @param motions names of the recorded motions */
  constructor(private readonly root: HTMLElement, table: HTMLElement, private readonly profiles: Profile[], motions: readonly string[]) {
    this.#minutes = [new Minute(profiles)];
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
    const box = this.#frame(name, title, unit, meaning), height = HEIGHT + (last ? TIMES : 0);
    const values = box.previousElementSibling!.appendChild(document.createElement('output'));
    const ink = (): string => resolved('var(--muted)');
    const axis = { stroke: ink, grid: { stroke: 'rgba(128,140,155,0.22)', width: 1 }, ticks: { show: false, size: 0 }, font: '10px system-ui' };
    const plot = new uPlot({
      width: Math.max(120, box.clientWidth), height, padding: [4, 14, last ? 0 : 4, 0],
      scales: { x: { time: false, range: () => [-this.#history(name).span, 0] }, y: { range: (_u, _low, high) => [0, Math.max(high ?? 0, least) * 1.08] } },
      axes: [
        { ...axis, size: last ? TIMES : 0, gap: 6, space: 60, values: (_u, ticks) => ticks.map((t) => (!last ? '' : t === 0 ? 'now' : `${+t.toFixed(1)} s`)) },
        { ...axis, size: AXIS, gap: 3, space: 16 },
      ],
      cursor: { y: false, points: { size: 5 }, sync: { key: 'minute' }, drag: { x: false, y: false } },
      legend: { show: false },
      hooks: { setCursor: [(u) => { this.#pointed = u.cursor.idx ?? null; }] },
      series: [{}, ...lines.map(({ label, color, dash }) => ({ label, stroke: () => resolved(color), width: 1.5, points: { show: false }, ...(dash && { dash }) }))],
    }, this.#history(name).data as uPlot.AlignedData, box);
    this.#rows[name] = { name, plot, box, values, lines, height, write, width: 0 };
  }

  take(state: StateMessage): void {
    for (let i = 0; i < state.tools.length; ++i) (this.#minutes[i] ??= new Minute(this.profiles)).take(state, state.tools[i]!);
  }

  get #minute(): Minute { return this.#minutes[this.active] ?? this.#minutes[0]!; }
  #history(name: string): History { return this.#minute.histories[name]!; }

  /** One row for each call, so that no frame waits for all of them; states with the first. */
  drawNext(): void {
    const row = this.#inTurn[this.#turn]!;
    if (row.width > 0) row.plot.setData(this.#history(row.name).data as uPlot.AlignedData);
    if (this.#turn === 0) this.#strip.draw(this.#minute.events);
    this.#turn = (this.#turn + 1) % this.#inTurn.length;
  }

  /** Updates values and table together with all other texts, so that the browser computes the layout once. */
  tell(): void {
    for (const row of this.#inTurn) if (row.width > 0) this.#tell(row);
    if ((this.#told = !this.#told)) this.#comparison.draw(this.#minute.led, this.#minute.runs);
  }

  /** The values at the pointer, or else the newest ones. */
  #tell({ name, values, lines, write }: Row): void {
    const history = this.#history(name);
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
