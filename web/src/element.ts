/** The element of index.html with this id. */
export function element<T extends HTMLElement>(id: string, kind: new () => T): T {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`index.html has no ${kind.name} #${id}`);
  return found;
}

/** Sets a value only if it changes: the browser computes styles and layout again even for the same value. */
export function put<T extends object, K extends keyof T>(of: T, key: K, value: T[K]): void {
  if (of[key] !== value) of[key] = value;
}

/** Acts in the frame after a change of size: the action may change sizes again, which Firefox reports as an error. */
export function onResize(of: Element, act: () => void): void {
  new ResizeObserver(() => requestAnimationFrame(act)).observe(of);
}

/** An element with its children. */
export function made<K extends keyof HTMLElementTagNameMap>(tag: K, properties: Partial<HTMLElementTagNameMap[K]> = {}, ...inside: (Node | string)[]): HTMLElementTagNameMap[K] {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
}

/** A row of plots: its title, and the box for its plot. */
export function plotRow(root: HTMLElement, title: string, unit: string, meaning: string): HTMLElement {
  const box = made('div');
  root.append(made('figure', {}, made('figcaption', { title: meaning }, made('strong', {}, title), made('span', {}, unit)), box));
  return box;
}

/** A button. @param ariaLabel its action, for users who cannot see its place */
export const press = (textContent: string, ariaLabel: string, onclick: () => void): HTMLButtonElement => made('button', { type: 'button', textContent, ariaLabel, onclick });
