/** The element of index.html with this id. */
export function element<T extends HTMLElement>(id: string, kind: new () => T): T {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`index.html has no ${kind.name} #${id}`);
  return found;
}

/** Sets what is another than before: the browser computes styles and lays out anew also for a value that is the same. */
export function put<T extends object, K extends keyof T>(of: T, key: K, value: T[K]): void {
  if (of[key] !== value) of[key] = value;
}

/** Acts with the picture after the element has got another size: what it changes may change sizes, too, and Firefox calls that an error. */
export function onResize(of: Element, act: () => void): void {
  new ResizeObserver(() => requestAnimationFrame(act)).observe(of);
}

/** An element with what is in it. */
export function made<K extends keyof HTMLElementTagNameMap>(tag: K, properties: Partial<HTMLElementTagNameMap[K]> = {}, ...inside: (Node | string)[]): HTMLElementTagNameMap[K] {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
}

/** A row of plots: what it is called, and the box for its plot. */
export function plotRow(root: HTMLElement, title: string, unit: string, meaning: string): HTMLElement {
  const box = made('div');
  root.append(made('figure', {}, made('figcaption', { title: meaning }, made('strong', {}, title), made('span', {}, unit)), box));
  return box;
}

/** A button. @param ariaLabel what it does, for who cannot see where it stands */
export const press = (textContent: string, ariaLabel: string, onclick: () => void): HTMLButtonElement => made('button', { type: 'button', textContent, ariaLabel, onclick });
