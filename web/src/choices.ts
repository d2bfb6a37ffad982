/** s for which a control shows what was chosen; then, what the server says. */
const ANSWER_WITHIN = 1;

/** When each control of the page was used last. */
export class Choices {
  readonly #chosenAt = new Map<EventTarget, number>();

  constructor() {
    for (const kind of ['input', 'change']) {
      addEventListener(kind, (event) => { if (event.target) this.#chosenAt.set(event.target, performance.now() / 1000); }, { capture: true });
    }
  }

  /** Whether the server's word may replace what this control shows. */
  isAnswered(control: EventTarget, now: number): boolean { return now - (this.#chosenAt.get(control) ?? -Infinity) > ANSWER_WITHIN; }
}
