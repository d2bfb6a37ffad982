import type { Measure, Profile, StateMessage, Tool } from '../protocol';
import { Swing } from '../swing';
import { COLUMNS, Moment } from './comparison';
import { History, RATE } from './history';
import { Runs } from './runs';
import { LIMITED, MISSED, SPILLED, STATE, STATES } from './strip';

/** A value of 0 means that nothing was measured yet. */
const milli = (value: Measure): number | null => (value ? value / 1000 : null);

/** The last minute of one tool: all that the plots and the table show of it. */
export class Minute {
  /** Of the rows of plots, by their names. */
  readonly histories: Readonly<Record<string, History>>;
  readonly events = new History(4);
  readonly led = new History(COLUMNS);
  readonly runs = new Runs();
  readonly #moment = new Moment();
  readonly #swing = new Swing();
  readonly #own: (number | null)[];
  readonly #event: (number | null)[] = [0, 0, 0, 0];
  #next = 0;
  #missed = -1;

  constructor(private readonly profiles: readonly Profile[]) {
    this.#own = profiles.map(() => null);
    this.histories = { lateral: new History(profiles.length), error: new History(profiles.length), latency: new History(2), solve: new History(2) };
  }

  take(state: StateMessage, tool: Tool): void {
    const { liquid } = tool, error = tool.tracking_error === null ? null : tool.tracking_error * 1e3;
    if (this.#moment.profile >= 0 && this.#moment.profile !== state.controls.profile) this.led.push(state.now_s, this.#moment.end());
    this.#moment.take(state.now_s, state.controls.profile, tool.state === 'engaged', liquid.lateral, error, liquid.spilled_share,
      this.#swing.of(state.now_s, state.controls.profile, state.controls.no_spill));
    this.runs.take(state, tool, error);
    if (state.now_s < this.#next && state.now_s > this.#next - 1) return;
    this.#next = state.now_s + 1 / RATE;
    const lateral = this.#moment.largest;
    this.led.push(state.now_s, this.#moment.end());
    const before = this.#moment.endBefore();
    if (before) this.led.push(state.now_s, before);
    const t = state.now_s, { histories } = this;
    histories.lateral!.push(t, this.#ofProfile(lateral, state.controls.profile));
    histories.error!.push(t, this.#ofProfile(error, state.controls.profile));
    histories.solve!.push(t, [milli(state.solve_us.p50), milli(state.solve_us.p99)]);
    histories.latency!.push(t, [milli(state.latency_us.p50), milli(state.latency_us.p99)]);
    this.#event[STATE] = STATES.indexOf(tool.state);
    this.#event[SPILLED] = Number(liquid.spilled);
    this.#event[LIMITED] = Number(state.constraint.kind !== 'none');
    this.#event[MISSED] = Number(this.#missed >= 0 && state.missed_deadlines > this.#missed);
    this.#missed = state.missed_deadlines;
    this.events.push(t, this.#event);
  }

  /** A row with one profile's value; the same array each time. */
  #ofProfile(value: number | null, index: number): readonly (number | null)[] {
    for (let i = 0; i < this.#own.length; ++i) this.#own[i] = this.profiles[i]!.index === index ? value : null;
    return this.#own;
  }
}
