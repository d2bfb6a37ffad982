import type { SessionState } from '../protocol';
import { resolved } from '../profiles';
import type { History } from './history';

export const STATES: readonly SessionState[] = ['idle', 'ready', 'engaged', 'holding', 'stopping', 'fault'];
/**
 * Series of the history that a strip draws: the state's number, and 1 where liquid was spilled, a limit was active, a
 * deadline was missed.
 */
export const STATE = 0, SPILLED = 1, LIMITED = 2, MISSED = 3;

/** px of the page */
const BAND = 12, MARK = 5;

/** The last minute's states as bands, and below them marks for spills, active limits and missed deadlines. */
export class Strip {
  readonly canvas = document.createElement('canvas');
  readonly #context = this.canvas.getContext('2d')!;
  #colors: string[] = [];
  #marks: string[] = [];

  constructor() { this.repaint(); }

  /** After a change of theme, which has other colours. */
  repaint(): void {
    this.#colors = STATES.map((state) => resolved(`var(--state-${state})`));
    this.#marks = ['var(--liquid)', 'var(--state-holding)', 'var(--ink)'].map(resolved);
  }

  resize(width: number): void {
    this.canvas.width = Math.max(1, Math.round(width * devicePixelRatio));
    this.canvas.height = Math.round((BAND + 3 * MARK + 2) * devicePixelRatio);
  }

  draw({ times, series, newest, span }: History): void {
    const { width, height } = this.canvas, c = this.#context, unit = devicePixelRatio;
    c.clearRect(0, 0, width, height);
    const x = (t: number): number => width * (1 + (t - newest) / span);
    for (let i = 0; i < times.length; ++i) {
      const from = x(times[i]!), wide = Math.max(unit, (i + 1 < times.length ? x(times[i + 1]!) : width) - from + 0.5);
      const state = series[STATE]![i];
      if (state !== null && state !== undefined) {
        c.fillStyle = this.#colors[state]!;
        c.fillRect(from, 0, wide, BAND * unit);
      }
      for (let k = SPILLED; k <= MISSED; ++k) {
        if (!series[k]![i]) continue;
        c.fillStyle = this.#marks[k - SPILLED]!;
        c.fillRect(from, (BAND + 2 + (k - SPILLED) * MARK) * unit, Math.max(wide, 2 * unit), (MARK - 1) * unit);
      }
    }
  }
}
