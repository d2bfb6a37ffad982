import type { StateMessage } from './protocol';

/** s over which late commands are counted, and their share above which the computer is too slow. */
const COUNTED_OVER = 5, TOO_MANY_LATE = 0.01;
/** Share of late plans above which the page leaves them the processor. */
const TOO_MANY_LATE_PLANS = 0.02;

/** How many commands and plans come late, a few seconds at a time. */
export class LateCount {
  /** The first state of the window that is counted. */
  #counted: StateMessage | null = null;
  /** Share of the commands that were late in the window before. */
  commands = 0;
  #plans = 0;

  get isSlow(): boolean { return this.commands >= TOO_MANY_LATE; }
  get isLate(): boolean { return this.commands > TOO_MANY_LATE || this.#plans > TOO_MANY_LATE_PLANS; }

  count(message: StateMessage): void {
    const since = message.now_s - (this.#counted?.now_s ?? NaN);
    if (since >= 0 && since < COUNTED_OVER) return;
    const cycles = message.cycles - (this.#counted?.cycles ?? NaN);
    // After a restart of the program, or a gap between states, nothing is known.
    this.commands = since < 2 * COUNTED_OVER && cycles > 0 ? (message.missed_deadlines - this.#counted!.missed_deadlines) / cycles : 0;
    const plans = message.plans - (this.#counted?.plans ?? NaN);
    this.#plans = since < 2 * COUNTED_OVER && plans > 0 ? (message.rejected_plans - this.#counted!.rejected_plans) / plans : 0;
    this.#counted = message;
  }
}
