import type { Profile } from '../protocol';
import { colorOf } from '../profiles';
import { put } from '../element';
import { meanOffText, secondsText, sloshText } from '../figures';
import type { History } from './history';

interface Row { row: HTMLTableRowElement; cells: HTMLTableCellElement[]; index: number }

/** What a moment of the hand's leading came to: columns of the history that the table is made of. */
export const PROFILE = 0, LED = 1, FELT = 2, MOST = 3, OFF = 4, COLUMNS = 5;

/** Of one profile: s that it led, means of slosh (m/s^2) and distance (mm), and the largest slosh. */
export interface Totals { led: number; felt: number; most: number; off: number }

/** Over all moments in which the hand led by this profile; idle time does not count. */
export function totalsOf({ series, times }: Pick<History, 'series' | 'times'>, profile: number): Totals {
  const sum: Totals = { led: 0, felt: 0, most: 0, off: 0 };
  for (let i = 0; i < times.length; ++i) {
    const led = series[LED]![i] ?? 0;
    if (series[PROFILE]![i] !== profile || led <= 0) continue;
    sum.led += led;
    sum.felt += led * (series[FELT]![i] ?? 0);
    sum.off += led * (series[OFF]![i] ?? 0);
    sum.most = Math.max(sum.most, series[MOST]![i] ?? 0);
  }
  if (sum.led > 0) {
    sum.felt /= sum.led;
    sum.off /= sum.led;
  }
  return sum;
}

/** What the profiles came to in the last minute, while the hand led, in a table. */
export class Comparison {
  readonly #rows: Row[];

  /** @param note stands where several profiles led */
  constructor(table: HTMLElement, private readonly note: HTMLElement, profiles: readonly Profile[]) {
    this.#rows = profiles.map((profile) => {
      const row = document.createElement('tr'), name = document.createElement('th'), color = document.createElement('i');
      name.scope = 'row';
      color.style.background = colorOf(profile);
      name.append(color, profile.label);
      row.append(name);
      row.hidden = true;
      return { row, cells: [0, 1, 2, 3].map(() => row.appendChild(document.createElement('td'))), index: profile.index };
    });
    table.replaceChildren(...this.#rows.map(({ row }) => row));
  }

  draw(history: History): void {
    let shown = 0;
    for (const { row, cells, index } of this.#rows) {
      const { led, felt, most, off } = totalsOf(history, index);
      put(row, 'hidden', led <= 0);
      if (row.hidden) continue;
      ++shown;
      [sloshText(felt), sloshText(most), meanOffText(off), secondsText(led)].forEach((text, i) => put(cells[i]!, 'textContent', text));
    }
    put(this.note, 'hidden', shown < 2);
  }
}

/** Gathers what comes between two rows of the history. */
export class Moment {
  readonly values: (number | null)[] = Array<number | null>(COLUMNS).fill(null);
  /** The largest of all states, led or not; null: not known. */
  largest: number | null = null;
  #led = 0;
  #felt = 0;
  #off = 0;
  #most = 0;
  #before = NaN;
  /** That led last; -1: none so far. Before another one leads the moment ends. */
  profile = -1;

  /** @param now s @param led the hand leads @param felt m/s^2 @param off mm */
  take(now: number, profile: number, led: boolean, felt: number | null, off: number | null): void {
    if (felt !== null) this.largest = Math.max(this.largest ?? 0, felt);
    const dt = now - this.#before;
    this.#before = now;
    this.profile = profile;
    if (!led || !(dt > 0 && dt < 0.5)) return;
    this.#led += dt;
    this.#felt += dt * (felt ?? 0);
    this.#off += dt * (off ?? 0);
    this.#most = Math.max(this.#most, felt ?? 0);
  }

  /** Of the time since the last call, as a row; the same array each time. */
  end(): readonly (number | null)[] {
    const { values } = this, led = this.#led;
    values[PROFILE] = this.profile;
    values[LED] = led;
    values[FELT] = led > 0 ? this.#felt / led : null;
    values[OFF] = led > 0 ? this.#off / led : null;
    values[MOST] = led > 0 ? this.#most : null;
    this.#led = this.#felt = this.#off = this.#most = 0;
    this.largest = null;
    return values;
  }
}
