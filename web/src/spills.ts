import { percentText } from './figures';
import type { Profile, StateMessage, Tool } from './protocol';
import { Swing } from './swing';

/** s before a spill in which a late plan counts as its cause. */
const LATE_BEFORE = 1;
/** Smallest share of the liquid that is shown for a profile if there are several. */
const TOLD_SHARE = 5e-4;

/** Spills of a tool since its glass was full, and their causes. */
export class Spills {
  /** Share of the liquid that was seen to go over the rim under each profile since the glass was full, by index. */
  readonly #under = new Map<number, number>();
  readonly #swing = new Swing();
  /** s, of the session's clock: when a plan, or a command, was late last. */
  #lateAt = -Infinity;
  /** The planner was late just before it spilled. */
  #late = false;
  /** The engaged profile does not prevent spills: a full glass spills again. */
  #anyhow = false;
  /** It spilled while the arm braked, or after its own controller stopped it. */
  #inStop = false;

  constructor(private readonly tool = 0) {}

  /** Adds a spill to the profile whose motion caused it. */
  book(before: StateMessage | null, message: StateMessage): void {
    const { liquid, state } = message.tools[this.tool]!, last = before?.tools[this.tool]?.liquid, profile = this.#swing.of(message.now_s, message.controls.profile, message.controls.no_spill);
    const grew = (name: 'rejected_plans' | 'missed_deadlines'): boolean => before !== null && message[name] > before[name];
    if (message.now_s < this.#lateAt) this.#lateAt = -Infinity; // another session
    if (message.reason_code === 'planner_late' || grew('rejected_plans') || grew('missed_deadlines')) this.#lateAt = message.now_s;
    if (!liquid.spilled) return this.#under.clear();
    if (!last) return;
    if (!last.spilled) {
      this.#under.clear();
      this.#inStop = ['stopping', 'holding', 'fault'].includes(state);
      this.#anyhow = !message.controls.no_spill;
      this.#late = message.controls.no_spill && message.now_s - this.#lateAt < LATE_BEFORE;
    }
    const more = liquid.spilled_share - (last.spilled ? last.spilled_share : 0);
    if (more > 0 || !last.spilled) this.#under.set(profile, (this.#under.get(profile) ?? 0) + Math.max(more, 0));
  }

  /** Text of the spill: how much, under which profiles, and its cause; empty: none. */
  told({ liquid }: Tool, profiles: readonly Profile[] = []): string {
    if (!liquid.spilled) return '';
    const whole = `Spilled ${percentText(liquid.spilled_share)} % of this glass`;
    const parts = [...this.#under].flatMap(([index, share]) => {
      const label = profiles.find((profile) => profile.index === index)?.label;
      return label === undefined ? [] : [{ label, share }];
    });
    const told = parts.length > 1 ? parts.filter(({ share }) => share >= TOLD_SHARE) : parts;
    const why = this.#late ? ': the planner was late' : this.#inStop ? ', in a stop' : this.#anyhow ? ', which does not prevent spills' : '';
    if (told.length > 1) return `${whole}: ${told.map(({ label, share }) => `${percentText(share)} % under ${label}`).join(', ')}`;
    return told.length > 0 ? `${whole} under ${told[0]!.label}${why}` : whole;
  }
}
