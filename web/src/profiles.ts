import type { Profile } from './protocol';

/**
 * Purpose of each profile of the project, in a line; P1 to P3 are those of the paper. A user's profiles have only a
 * name.
 */
const PURPOSE: Readonly<Record<string, string>> = {
  tracking: 'Follows the hand as closely as the arm can; ignores the liquid, and spills.',
  'anti-slosh': 'Keeps the liquid almost still; follows late.',
  waiter: 'Little lateral force, more vertical; follows less late.',
  carry: 'Follows as closely as possible without spilling; a stop may spill.',
  follow: 'Closer than Tracking, and rougher; ignores the liquid.',
};

export const purposeOf = (profile: Profile): string => PURPOSE[profile.name] ?? '';

/** P1, P2, P3 first, in their order; then the others as the server has them. */
export function inOrder(profiles: readonly Profile[]): Profile[] {
  const place = ({ label }: Profile): number => Number(/\(P(\d+)\)/.exec(label)?.[1] ?? Infinity);
  return [...profiles].sort((a, b) => (place(a) === place(b) ? a.index - b.index : place(a) - place(b)));
}

/** How many colours style.css has for profiles that it does not know by name. */
const OTHERS = 3;

/** For style sheets: the profile's colour, the same on the page and in every report. */
export function colorOf({ name, index }: Profile): string {
  const other = `var(--profile-other-${(index % OTHERS) + 1})`;
  return /^[\w-]+$/.test(name) ? `var(--profile-${name}, ${other})` : other;
}

let probe: HTMLElement | null = null;
/** Reading a style makes the browser compute all of them: each colour is read once in a theme. */
const known = new Map<string, string>();
/** After another theme. */
export const forgetColors = (): void => known.clear();

/** Current value of a colour of the style sheet, for a canvas, which has no CSS variables. */
export function resolved(color: string): string {
  let found = known.get(color);
  if (found === undefined) known.set(color, found = ask(color));
  return found;
}

function ask(color: string): string {
  if (!probe) {
    probe = document.createElement('i');
    probe.hidden = true;
    document.body.append(probe);
  }
  probe.style.color = color;
  return getComputedStyle(probe).color;
}
