import type { StateMessage, Tool } from '../protocol';
import type { Totals } from './comparison';

/** s for which whole runs are shown after the last one ended. */
const TOLD_FOR = 60;

/** Whole demo motions, each with one profile from start to end: these can be compared. */
export class Runs {
  /** The last run for each demo motion and profile. */
  readonly #whole = new Map<number, Map<number, Totals>>();
  #now: (Totals & { motion: number; profile: number }) | null = null;
  #state = '';
  #hasEnded = false;
  #out = NaN;
  #at = NaN;
  #newest: { motion: number; at: number } | null = null;

  /** @param off mm, from the target to the glass */
  take({ now_s, controls: { playback, profile } }: Pick<StateMessage, 'now_s' | 'controls'>, { state, reason_code: code, reason_leader: leader, liquid }: Tool, off: number | null): void {
    const dt = now_s - this.#at, before = this.#state, hadEnded = this.#hasEnded;
    const ends = leader === 'recording' && (code === 'released' || code === 'profile_waits'), isHeldUp = leader === 'recording' && code === 'silent';
    const spilt = Math.max(0, liquid.spilled_share - this.#out) || 0;
    this.#at = now_s;
    this.#state = state;
    this.#hasEnded = ends;
    this.#out = liquid.spilled_share;
    if (!(dt >= 0 && dt < 1)) this.#now = null; // another session, or a gap
    const run = this.#now;
    if (run && ends && !hadEnded && run.motion === playback && run.profile === profile) this.#keep(run, now_s);
    if (playback < 0 || ends || isHeldUp || state === 'stopping' || state === 'fault') this.#now = null;
    else if (run && (run.profile !== profile || run.motion !== playback)) this.#now = null;
    else if (!run && state === 'engaged' && before === 'ready') this.#now = { motion: playback, profile, led: 0, felt: 0, most: 0, off: 0, spilt: 0 };
    if (!this.#now || !(dt > 0)) return;
    this.#now.spilt += spilt;
    if (state !== 'engaged') return;
    this.#now.led += dt;
    this.#now.felt += dt * (liquid.lateral ?? 0);
    this.#now.most = Math.max(this.#now.most, liquid.lateral ?? 0);
    this.#now.off += dt * (off ?? 0);
  }

  #keep({ motion, profile, led, felt, most, off, spilt }: Totals & { motion: number; profile: number }, at: number): void {
    if (led <= 0) return;
    const of = this.#whole.get(motion) ?? new Map<number, Totals>();
    of.set(profile, { led, felt: felt / led, most, off: off / led, spilt });
    this.#whole.set(motion, of);
    this.#newest = { motion, at };
  }

  /** The last demo motion, if several profiles completed it recently; null: none. */
  get compared(): number | null {
    if (!this.#newest || (this.#whole.get(this.#newest.motion)?.size ?? 0) < 2) return null;
    return this.#at - this.#newest.at < TOLD_FOR && this.#at >= this.#newest.at ? this.#newest.motion : null;
  }

  of(motion: number, profile: number): Totals | undefined { return this.#whole.get(motion)?.get(profile); }

  /** Demo motions that this profile completed. */
  motionsOf(profile: number): number[] { return [...this.#whole].flatMap(([motion, by]) => (by.has(profile) ? [motion] : [])); }
}
