import type { Profile } from '../protocol';
import { colorOf } from '../profiles';
import { RATE } from './history';

interface Row { row: HTMLTableRowElement; cells: HTMLTableCellElement[] }

/** Means of the last minute, by profile, in a table. */
export class Comparison {
  readonly #rows: Row[];

  constructor(table: HTMLElement, profiles: readonly Profile[]) {
    this.#rows = profiles.map((profile) => {
      const row = document.createElement('tr'), name = document.createElement('th'), color = document.createElement('i');
      name.scope = 'row';
      color.style.background = colorOf(profile);
      name.append(color, profile.label);
      row.append(name);
      row.hidden = true;
      return { row, cells: [0, 1, 2, 3].map(() => row.appendChild(document.createElement('td'))) };
    });
    table.replaceChildren(...this.#rows.map(({ row }) => row));
  }

  /** @param felt m/s^2 and @param errors mm, a series for each profile, with null where another one led */
  draw(felt: readonly (number | null)[][], errors: readonly (number | null)[][]): void {
    for (let i = 0; i < this.#rows.length; ++i) {
      const { row, cells } = this.#rows[i]!;
      let sum = 0, peak = 0, n = 0, off = 0, gripped = 0;
      for (let k = 0; k < felt[i]!.length; ++k) {
        const value = felt[i]![k] ?? null;
        if (value === null) continue;
        sum += value;
        peak = Math.max(peak, value);
        ++n;
        const error = errors[i]![k] ?? null;
        if (error === null) continue;
        off += error;
        ++gripped;
      }
      row.hidden = n === 0;
      if (n === 0) continue;
      cells[0]!.textContent = (sum / n).toFixed(2);
      cells[1]!.textContent = peak.toFixed(1);
      cells[2]!.textContent = gripped > 0 ? (off / gripped).toFixed(0) : '–';
      cells[3]!.textContent = (n / RATE).toFixed(0);
    }
  }
}
