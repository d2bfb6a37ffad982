import type { StateMessage } from './protocol';

/** s without a word of a held hand that the page itself was held up for; and for how long that explains that it was lost. */
const TOO_LONG = 0.12, EXPLAINS_FOR = 1.5;
/** s of such a gap that alone had the arm let go, near enough. */
const LOSES = 0.2;
/** s without another such gap, after which all is read that happened in it: what is held still is held. */
const READ_AFTER = 0.1;

/** The arm did not hear of a hand. */
export const isNotHeard = (state: StateMessage | null): boolean => state?.reason_code === 'no_pose' || (state?.reason_code === 'silent' && state.reason_leader === 'person');

/** Whether the arm lost the hand since the browser kept the page from telling of it. All times are s, of the page's clock. */
export class KeptHand {
  /** The browser kept the page until then. */
  #keptUntil = -Infinity;
  /** For so many s. */
  #kept = 0;
  #lostAt = -Infinity;
  #resumedAfter = -Infinity;

  take(before: StateMessage | null, message: StateMessage, now: number): void {
    if (isNotHeard(message) && message.reason_code !== before?.reason_code) this.#lostAt = now;
  }

  /** The page told of the held hand, `gap` s after the time before. */
  told(gap: number, now: number): void {
    if (gap <= TOO_LONG) return;
    this.#keptUntil = now;
    this.#kept = gap;
  }

  explains(state: StateMessage | null): boolean { return isNotHeard(state) && Math.abs(this.#lostAt - this.#keptUntil) < EXPLAINS_FOR; }

  /** Once for each time that the browser lost the hand, soon after it. */
  mayResume(state: StateMessage | null, now: number): boolean {
    const since = now - this.#keptUntil;
    if (state?.state !== 'ready' || !this.explains(state) || this.#kept < LOSES || since < READ_AFTER || since > EXPLAINS_FOR || this.#resumedAfter === this.#keptUntil) return false;
    this.#resumedAfter = this.#keptUntil;
    return true;
  }
}
