import { element, made } from './element';
import type { Player } from './replay/player';
import { betterOf, summaryOf, verdictOf, type Figure } from './replay/summary';

/**
 * The figures of the recording that plays and of the one compared with it, a column each.
 * @param names as in the list @param titles with the profiles that controlled the arm
 */
export function compare(both: readonly [Player, Player], names: readonly string[], titles: readonly string[]): void {
  const cell = (tag: 'th' | 'td', textContent: string, more: Partial<HTMLTableCellElement> = {}): HTMLTableCellElement => made(tag, { textContent, ...more });
  const figures = [summaryOf(both[0]), summaryOf(both[1])] as const, better = figures[0]!.map((figure, i) => betterOf(figure, figures[1]![i]!));
  const value = (which: number, i: number): HTMLTableCellElement => {
    const is = cell('td', figures[which]![i]![1], { className: which === 0 ? '' : 'other' });
    if (better[i] === which) {
      is.classList.add('better');
      is.append(made('span', { className: 'unseen' }, ' (better)'));
    }
    return is;
  };
  const what = ([name, , , title]: Figure): HTMLTableCellElement => cell('th', name, { scope: 'row', title });
  const title = (which: number): HTMLTableCellElement => cell('th', titles[which]!, { scope: 'col', className: which === 0 ? '' : 'other' });
  element('past-verdict', HTMLParagraphElement).textContent = verdictOf(both, [names[0]!, names[1]!], figures);
  element('past-figures', HTMLTableElement).replaceChildren(made('tr', {}, cell('th', 'Compared', { scope: 'col' }), title(0), title(1)),
    ...figures[0]!.map((figure, i) => made('tr', {}, what(figure), value(0, i), value(1, i))));
}
