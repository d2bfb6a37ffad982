import { motionTitle } from '../demo_motions';
import type { Profile } from '../protocol';
import { colorOf } from '../profiles';
import { made, put } from '../element';
import { meanOffText, percentText, secondsText, sloshText } from '../figures';
import { SETTLING } from '../swing';
import type { History } from './history';
import type { Runs } from './runs';

interface Row { row: HTMLTableRowElement; cells: HTMLTableCellElement[]; index: number }

/** One interval while engaged: columns of the history from which the table is computed. */
export const PROFILE = 0, LED = 1, FELT = 2, MOST = 3, OFF = 4, SPILT = 5, COLUMNS = 6;

/**
 * Of one profile: s engaged, means of lateral specific force (m/s^2) and distance (mm), the largest lateral specific
 * force, and the share of the liquid spilled.
 */
export interface Totals { led: number; felt: number; most: number; off: number; spilt: number }

/** Over all intervals engaged with this profile; idle time does not count. */
export function totalsOf({ series, times }: Pick<History, 'series' | 'times'>, profile: number): Totals {
  const sum: Totals = { led: 0, felt: 0, most: 0, off: 0, spilt: 0 };
  for (let i = 0; i < times.length; ++i) {
    const led = series[LED]![i] ?? 0;
    if (series[PROFILE]![i] !== profile) continue;
    sum.spilt += series[SPILT]![i] ?? 0;
    if (led <= 0) continue;
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

/** A table of the profiles' results in the last minute, while engaged. */
export class Comparison {
  readonly #rows: Row[];

  /** @param note is shown if several profiles were used */
  constructor(table: HTMLElement, private readonly note: HTMLElement, private readonly profiles: readonly Profile[], private readonly motions: readonly string[]) {
    this.#rows = profiles.map((profile) => {
      const color = made('i'), cells = [0, 1, 2, 3, 4].map(() => made('td'));
      color.style.background = colorOf(profile);
      const name = made('th', { scope: 'row' }, color, profile.label.replace(/ \(.*\)$/, '')); // the number would break the line
      return { row: made('tr', { hidden: true }, name, ...cells), cells, index: profile.index };
    });
    table.replaceChildren(...this.#rows.map(({ row }) => row));
  }

  /** @param runs whole demo motions; these replace the minute if several profiles completed one */
  draw(history: History, runs: Runs): void {
    const motion = runs.compared, last = this.#rows.map(({ index }) => totalsOf(history, index));
    const led = this.#rows.flatMap(({ index }, i) => (last[i]!.led > 0 ? [index] : []));
    for (const [i, { row, cells, index }] of this.#rows.entries()) {
      const totals = motion === null ? last[i]! : runs.of(motion, index);
      put(row, 'hidden', !totals || totals.led <= 0);
      if (!totals || row.hidden) continue;
      const { led: s, felt, most, off, spilt } = totals;
      put(cells[3]!, 'title', spilt > 1 ? `${spilt.toFixed(1)} glasses, with refills` : '');
      [sloshText(felt), sloshText(most), meanOffText(off), spilt > 0 ? percentText(Math.min(spilt, 1)).replace('less than ', '< ') : '0', secondsText(s)].forEach((text, k) => put(cells[k]!, 'textContent', text));
    }
    const name = (wanted: number): string => this.profiles.find(({ index }) => index === wanted)?.label ?? '';
    const words = noteOf(motion, led, runs, name, (index) => motionTitle(this.motions[index] ?? ''));
    put(this.note, 'textContent', words);
    put(this.note, 'hidden', words === '');
  }
}

/**
 * Origin of the figures; if they are not all of one motion, what is missing; or that there are none. Empty: only one
 * profile was used.
 */
export function noteOf(motion: number | null, led: readonly number[], runs: Runs, name: (profile: number) => string, title: (motion: number) => string): string {
  if (motion !== null) {
    const missing = led.filter((profile) => !runs.of(motion, profile));
    return `Each profile over its last complete run of the demo motion ${title(motion)}.${missing.length > 0 ? ` ${missing.map(name).join(', ')}: no complete run yet.` : ''}`;
  }
  if (led.length === 0) return 'The arm was not engaged in the last minute.';
  if (led.length === 1) return '';
  const whole = (profile: number): string => `${name(profile)}: ${runs.motionsOf(profile).map(title).join(', ') || 'none'}`;
  return `To compare, play one demo motion to its end under each profile. Complete so far: ${led.map(whole).join('; ')}.`;
}

/** Collects the values between two rows of the history. */
export class Moment {
  readonly values: (number | null)[] = Array<number | null>(COLUMNS).fill(null);
  /** The largest of all states, engaged or not; null: not known. */
  largest: number | null = null;
  #led = 0;
  #felt = 0;
  #off = 0;
  #most = 0;
  #spilt = 0;
  /** Spilled by the wave of the previous profile; and the index of that profile. */
  #spiltBefore = 0;
  #former = -1;
  /** Share of the liquid outside the glass. */
  #out = NaN;
  #before = NaN;
  /** s, since when the current profile is used. */
  #since = -Infinity;
  /** The last profile used; -1: none so far. The interval ends before another profile is used. */
  profile = -1;

  /**
   * @param now s
   * @param led whether the arm is engaged
   * @param felt lateral specific force, m/s^2
   * @param off distance, mm
   * @param out share of the liquid outside the glass
   * @param by the profile that caused the wave
   */
  take(now: number, profile: number, led: boolean, felt: number | null, off: number | null, out = 0, by = profile): void {
    if (out > this.#out) {
      if (by === profile) this.#spilt += out - this.#out;
      else this.#spiltBefore += out - this.#out;
    }
    if (by !== profile) this.#former = by;
    this.#out = out;
    if (felt !== null) this.largest = Math.max(this.largest ?? 0, felt);
    const dt = now - this.#before;
    this.#before = now;
    if (this.profile >= 0 && this.profile !== profile) this.#since = now;
    else if (now < this.#since) this.#since = -Infinity; // another session
    this.profile = profile;
    if (!led || !(dt > 0 && dt < 0.5) || now - this.#since < SETTLING) return;
    this.#led += dt;
    this.#felt += dt * (felt ?? 0);
    this.#off += dt * (off ?? 0);
    this.#most = Math.max(this.#most, felt ?? 0);
  }

  /** Values since the last call, as a row; the same array each time. */
  end(): readonly (number | null)[] {
    const { values } = this, led = this.#led;
    values[PROFILE] = this.profile;
    values[LED] = led;
    values[FELT] = led > 0 ? this.#felt / led : null;
    values[OFF] = led > 0 ? this.#off / led : null;
    values[MOST] = led > 0 ? this.#most : null;
    values[SPILT] = this.#spilt;
    this.#led = this.#felt = this.#off = this.#most = this.#spilt = 0;
    this.largest = null;
    return values;
  }

  /**
   * What spilled by the wave of the previous profile, as a separate row; null: nothing. The same array as `end`
   * returns.
   */
  endBefore(): readonly (number | null)[] | null {
    if (this.#spiltBefore === 0) return null;
    const { values } = this;
    values.fill(null);
    values[PROFILE] = this.#former;
    values[LED] = 0;
    values[SPILT] = this.#spiltBefore;
    this.#spiltBefore = 0;
    return values;
  }
}
