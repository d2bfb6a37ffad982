import type { StateMessage } from './protocol';

/** s without a sample of a held hand because the page was blocked; and s for which that explains a timeout. */
const TOO_LONG = 0.12, EXPLAINS_FOR = 1.5;
/** s of such a gap that is long enough to release the arm, approximately. */
const LOSES = 0.2;
/** s without another such gap, after which all events of the gap are read: a grip that is still held is known. */
const READ_AFTER = 0.1;

/** The arm got no samples of a hand. */
export const isNotHeard = (state: StateMessage | null): boolean => state?.reason_code === 'no_pose' || (state?.reason_code === 'silent' && state.reason_leader === 'person');

/** Whether the hand timed out because the browser blocked the page. All times are s, of the page's clock. */
export class KeptHand {
  /** Until then the browser blocked the page. */
  #keptUntil = -Infinity;
  /** For so many s. */
  #kept = 0;
  #lostAt = -Infinity;
  #resumedAfter = -Infinity;

  take(before: StateMessage | null, message: StateMessage, now: number): void {
    if (isNotHeard(message) && message.reason_code !== before?.reason_code) this.#lostAt = now;
  }

  /** The page sent a sample of the held hand, `gap` s after the one before. */
  told(gap: number, now: number): void {
    if (gap <= TOO_LONG) return;
    this.#keptUntil = now;
    this.#kept = gap;
  }

  explains(state: StateMessage | null): boolean { return isNotHeard(state) && Math.abs(this.#lostAt - this.#keptUntil) < EXPLAINS_FOR; }

  /** True once for each timeout that the browser caused, soon after it. */
  mayResume(state: StateMessage | null, now: number): boolean {
    const since = now - this.#keptUntil;
    if (state?.state !== 'ready' || !this.explains(state) || this.#kept < LOSES || since < READ_AFTER || since > EXPLAINS_FOR || this.#resumedAfter === this.#keptUntil) return false;
    this.#resumedAfter = this.#keptUntil;
    return true;
  }
}
