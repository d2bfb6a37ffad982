/** s for which a control shows the operator's choice; after that, the server's state. */
const ANSWER_WITHIN = 1;

/** When each control of the page was used last. */
export class Choices {
  readonly #chosenAt = new Map<EventTarget, number>();

  constructor() {
    for (const kind of ['input', 'change']) {
      addEventListener(kind, (event) => { if (event.target) this.#chosenAt.set(event.target, performance.now() / 1000); }, { capture: true });
    }
  }

  /** Whether the server's state may replace the value that this control shows. */
  isAnswered(control: EventTarget, now: number): boolean { return now - (this.#chosenAt.get(control) ?? -Infinity) > ANSWER_WITHIN; }
}
