/** The element of index.html with this id. */
export function element<T extends HTMLElement>(id: string, kind: new () => T): T {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`index.html has no ${kind.name} #${id}`);
  return found;
}

/** Acts with the picture after the element has got another size: what it changes may change sizes, too, and Firefox calls that an error. */
export function onResize(of: Element, act: () => void): void {
  new ResizeObserver(() => requestAnimationFrame(act)).observe(of);
}
