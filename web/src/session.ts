import type { ConnectionStatus } from './connection';
import { offText, partText, percentText, spanText } from './figures';
import { isNotHeard, KeptHand } from './kept_hand';
import { LateCount } from './late_count';
import { ON_PAGE } from './means';
import type { Refusal, ServerMessage, StateMessage, WelcomeMessage } from './protocol';
import { Spills } from './spills';

/** s without a state after which the scene greys out: what is seen is old. */
export const STALE_AFTER = 0.5;
/** s without a state after which the controls grey out, too: a connection is given up then. A short gap takes the focus from nobody. */
export const GONE_AFTER = 3;
/** s of a picture from which on the page itself was held up: what came meanwhile is read before the news are called old. */
const HELD_UP = 0.25;

/** From here on a body's number is that of an object that the tool carries (docs/reference/protocol.md). */
const CARRIED = 128;
/** s for which a refusal stands. */
const SAID_FOR = 10;
/** rad/s (m/s) below which a joint counts as at rest. */
const AT_REST = 0.005;
/** s for which a refill is told, and where it spilled again meanwhile. */
const REFILL_TOLD = 4, REFILL_TOLD_AT_LEAST = 1;
/** rad/s (m/s) above which an arm that nobody leads is still coming to rest; sensors of an arm that stands say less. */
const COMES_TO_REST = 0.02;
/** m/s^2; and deg, of a lean that is told. */
const GRAVITY = 9.81, LEAST_LEAN = 0.5;
/** rad, from which on the glass leans with the hand. */
const LEANS = 0.009;
/** s after which an arm that is at fault was not mended by its reset. */
const RESET_WITHIN = 0.5;
/** s for which a hint stands. */
const HINTED_FOR = 4;
/** s in which a grip is heard and answered. */
const HEARD_AFTER = 0.4;

/** mm */
export interface Wave { now: number; most: number; room: number }

/** @param room from the level at rest to the rim @param freeboard to the rim now, and the least, mm */
export function waveOf(room: number, freeboard: number, least: number): Wave | null {
  const high = (left: number): number => Math.min(Math.max(room - left, 0), room);
  return room > 0 ? { now: high(freeboard), most: high(least), room } : null;
}

/** In a line. */
export const waveText = ({ now, most, room }: Wave): string => `wave ${offText(now)} of ${offText(room)} mm, largest ${offText(most)}`;

/** Between two rounds of a demo motion, and after the last one. @param plays it goes on by itself */
function demoReason({ reason, reason_code: code }: StateMessage, plays: boolean): string {
  if ((code === 'released' || code === 'profile_waits') && plays) return 'the demo motion starts again';
  if (code === 'silent') return plays ? 'the demo motion was delayed, and continues' : 'the demo motion ended';
  return reason;
}

/** To who turns the glass while it does not lean. */
export const STAYS_UPRIGHT = 'The glass does not lean with the hand: raise “Tilt with the hand” to lean it.';

/** To who turns a glass about its own axis. */
export const LOOKS_THE_SAME = 'The glass turns about its axis; it is round, so it looks the same.';

/** What the page knows of the session; messages in, facts out. Knows neither the DOM nor the network. */
export class Session {
  welcome: WelcomeMessage | null = null;
  state: StateMessage | null = null;
  status: ConnectionStatus = 'connecting';
  paired = false;
  holder = 0;
  yours = false;
  /** The server would give this client the lease: nobody has it, or the same person in another tab. */
  takeable = false;
  /** Who asks the holder for the lease; 0: nobody. */
  asker = 0;
  /** A recording of the past is on the screen in place of the arm: nothing that the operator does may move the arm, but Stop. */
  past = false;
  /** How the operator leads now. */
  means = ON_PAGE;
  /** What was refused last; the page, too, may say so. */
  lastError: { code: Refusal; message: string; at?: number } | null = null;
  /** Why there is no session in this page, in words for people; empty: there is one, or it is elsewhere. */
  failure = '';
  statesReceived = 0;
  #refilledAt = -Infinity;
  readonly #spills = new Spills();
  readonly #late = new LateCount();
  readonly #kept = new KeptHand();
  #hint = { words: '', at: -Infinity };
  #stateAt = -Infinity;
  #ended = false;
  /** s, of the page's clock: when this page asked to reset the arm that has been at fault since; infinite: it did not. */
  #resetAt = Infinity;
  /** Number of the client that asked for the stop that the arm is in, or comes to; 0: nobody is known to have. */
  #stoppedBy = 0;
  /** A hand of this page has led. */
  #hasHeld = false;
  /** s, of the last picture, if the page was held up in it. */
  #heldUp = 0;
  /** s, of the page's clock: then `asker` gets the lease if nothing leads the arm until then. NaN: something does now. */
  #grantAt = NaN;

  /** @param ended the program ended, and said so: its arm has come to rest */
  connectionBecame(status: ConnectionStatus, ended = false): void {
    this.status = status;
    this.#ended = ended;
    if (status === 'open') {
      this.failure = '';
      return;
    }
    // Whatever was true of the lease ended with the connection.
    this.paired = false;
    this.yours = this.takeable = false;
    this.holder = this.asker = this.#stoppedBy = 0;
  }

  take(message: ServerMessage, now: number): void {
    switch (message.type) {
      case 'welcome': this.welcome = message; break;
      case 'cell': if (this.welcome) this.welcome = { ...this.welcome, cell: message.cell }; break;
      case 'state':
        if (this.state && this.#isRefilled(this.state, message)) this.#refilledAt = now;
        this.#spills.book(this.state, message);
        if (this.state?.state === 'stopping' && message.state !== 'stopping') {
          this.#hint.at = -Infinity;
          this.#stoppedBy = 0;
        }
        if (message.state !== 'fault' && message.state !== 'idle') this.#resetAt = Infinity;
        this.#late.count(message);
        this.#kept.take(this.state, message, now);
        this.state = message;
        this.#stateAt = now;
        ++this.statesReceived;
        break;
      case 'paired':
        this.paired = true;
        this.lastError = null;
        break;
      case 'lease':
        this.holder = message.holder;
        this.yours = message.yours;
        this.takeable = message.takeable;
        this.asker = message.asker;
        this.#grantAt = message.grant_s === null ? NaN : now + message.grant_s;
        if (message.yours) this.lastError = null;
        break;
      case 'error': this.lastError = { code: message.code, message: message.message, at: now }; break;
      case 'stopped': // the first to stop it counts
        if (this.state?.state !== 'stopping' || this.#stoppedBy === 0) this.#stoppedBy = message.client;
        break;
      case 'pong': break;
    }
  }

  /** The page told of the hand, `gap` s after the time before. @param held a way in has the hand */
  told(gap: number, held: boolean, now: number): void {
    if (held && this.yours) this.#hasHeld = true;
    if (held) this.#kept.told(gap, now);
  }

  /** The arm lost the hand since this browser did not come to tell of it. */
  get isLostByBrowser(): boolean { return this.#kept.explains(this.state); }

  /** Whoever holds on may lead on. */
  mayResume(now: number): boolean { return this.#kept.mayResume(this.state, now); }

  /** Plans or commands come late too often. */
  get isLate(): boolean { return this.#late.isLate || this.state?.reason_code === 'planner_late'; }

  /** That the computer of the program cannot keep up, and what that means; empty: it can. */
  slow(now: number): string {
    if (this.past || this.isStale(now) || !this.#late.isSlow) return '';
    return `The computer is too slow now: ${percentText(this.#late.commands)} % of the commands are late.${this.hasGlass ? ' Any profile may spill.' : ''}`;
  }

  /** A glass that had spilled is full again, or has another level. */
  #isRefilled(before: StateMessage, after: StateMessage): boolean {
    return (before.liquid.spilled && !after.liquid.spilled) || before.controls.fill !== after.controls.fill;
  }

  /** What the operator tried, and why nothing came of it: stands in the advice's place for a while. */
  hint(words: string, now: number): void { this.#hint = { words, at: now }; }
  /** The operator turns the view; before a hand of this page has led, that may have been meant to. */
  turnsView(now: number): void {
    if (!this.#hasHeld && this.mayLead(now)) this.hint('That turns the view. To move the arm, drag the glass or an arrow.', now);
  }
  /** This page asks to reset the arm. */
  resets(now: number): void { this.#resetAt = now; }
  /** A hint was given within this many s. */
  hintedWithin(seconds: number, now: number): boolean { return now - this.#hint.at < seconds; }

  /** What was spilled, under which profiles, and of what where the computer was too slow; empty: nothing. */
  spill(): string {
    return this.past || !this.hasGlass || !this.state ? '' : this.#spills.told(this.state, this.welcome?.profiles);
  }

  /** The tool holds a glass. */
  get hasGlass(): boolean { return !this.welcome?.robot?.gripper; }
  /** The arm tells where its gripper is, or has one by its file: behind some controllers it is not told before it moved. */
  get hasGripper(): boolean { return typeof this.state?.gripper === 'number' || (this.state !== null && !this.hasGlass); }
  /** The glass was filled anew a moment ago, and somebody should hear of it. */
  wasRefilled(now: number): boolean {
    return this.hasGlass && now - this.#refilledAt < (this.state?.liquid.spilled ? REFILL_TOLD_AT_LEAST : REFILL_TOLD);
  }

  /** Why it does what it does; of a connection that is gone, since when. */
  reason(now: number): string {
    if (this.past) return '';
    if (this.status !== 'open' || this.isStale(now)) return this.state ? `last data ${spanText(now - this.#stateAt)} ago` : '';
    const { state } = this;
    if (!state) return '';
    // The advice says how to take hold; and nobody who watches a recorded hand has anything to release.
    if (state.reason_code === 'ready') return '';
    if (state.reason_code === 'hand_back' && state.reason_leader === 'person') return 'the hand’s position arrives again';
    if (!this.#hasHeld && isNotHeard(state)) return ''; // whose hand that was is not here
    if (this.isLostByBrowser) return 'this browser was too slow to send the hand’s position';
    return state.reason_leader === 'recording' ? demoReason(state, state.controls.playback >= 0) : state.reason;
  }

  /** mm: how high the liquid stands above its level at rest, how high at most since the glass was filled, and what the rim allows. null: nobody can say. */
  wave(): Wave | null {
    const { state, welcome } = this, { freeboard, least_freeboard, spilled } = state?.liquid ?? {};
    if (!this.hasGlass || !state || !welcome || spilled || typeof freeboard !== 'number' || typeof least_freeboard !== 'number') return null;
    return waveOf(1000 * (welcome.glass.height - state.controls.fill), 1000 * freeboard, 1000 * least_freeboard);
  }

  /** deg by which the glass of an arm that rests leans, as a stop left it: all that the liquid feels then. 0: it moves, or stands upright. */
  get lean(): number {
    const felt = this.state?.liquid.lateral ?? 0, angle = (180 / Math.PI) * Math.asin(Math.min(1, felt / GRAVITY));
    return this.hasGlass && this.rests && angle >= LEAST_LEAN ? angle : 0;
  }

  isStale(now: number): boolean { return now - this.#stateAt - this.#heldUp > STALE_AFTER; }
  /** So long without news that a control would reach nobody. */
  isGone(now: number): boolean { return this.status !== 'open' || now - this.#stateAt - this.#heldUp > GONE_AFTER; }
  /** A picture took so many s: what came meanwhile waits to be read. */
  drew(dt: number): void { this.#heldUp = dt > HELD_UP ? dt : 0; }

  /** Whether this client has the lease, or would get it. */
  get mayTake(): boolean { return this.yours || this.takeable; }
  /** Whether this client asks another for the lease. */
  get asks(): boolean { return this.welcome !== null && this.asker === this.welcome.client; }
  /** Whole s until `asker` gets the lease; NaN while something leads the arm. */
  grantIn(now: number): number { return Math.max(0, Math.ceil(this.#grantAt - now)); }

  /** Why no demo motion can be asked for; empty: one can. */
  get whyNoMotion(): string {
    if (this.status !== 'open') return 'There is no connection to the arm.';
    if (!this.paired) return 'You are watching: enter the code from the terminal to control the arm.';
    return this.isAnothers ? 'Another client has control: ask for control first.' : '';
  }

  /** The glass stays upright, however the hand leans. */
  get staysUpright(): boolean { return this.hasGlass && (this.state?.controls.tilt ?? 1) < LEANS; }

  /** Whether a way in would move the arm now. */
  mayDrive(now: number): boolean {
    const state = this.state?.state;
    return this.yours && !this.past && !this.isStale(now) && (state === 'ready' || state === 'engaged' || state === 'holding');
  }

  /** Whether a way in would move the arm now, or would if it took the lease, which is free. */
  mayLead(now: number): boolean {
    const state = this.state?.state;
    return this.mayTake && this.paired && !this.past && !this.isStale(now) && (state === 'ready' || state === 'engaged' || state === 'holding');
  }

  /** Not while a recording is shown: who resets must see the arm as it is. */
  get mayReset(): boolean { return !this.past && this.mayResetNow; }
  get mayResetNow(): boolean { return this.mayTake && (this.state?.state === 'stopping' || this.state?.state === 'fault'); }

  /** Nothing leads the arm, and it is seen to be at rest. */
  stands(now: number): boolean { return !this.isStale(now) && this.rests && this.state?.state !== 'engaged'; }

  /** No joint moves so that anybody would see it. */
  get rests(): boolean { return this.state?.dq.every((speed) => Math.abs(speed) < AT_REST) ?? true; }

  get #isMoving(): boolean { return this.state?.dq.some((speed) => Math.abs(speed) > COMES_TO_REST) ?? false; }

  /** What was refused, for people: until something is granted or tried anew, or it is old and nothing waits for it. */
  refusal(now: number): string {
    const { lastError } = this;
    return lastError && (lastError.at === undefined || lastError.code === 'code' || now - lastError.at < SAID_FOR) ? lastError.message : '';
  }

  /** What the arm does, in a word or two. */
  title(now: number): string {
    if (this.status === 'connecting') return 'connecting';
    if (this.status !== 'open') return 'not connected';
    if (this.isStale(now)) return 'no data';
    if (this.past) return 'recording';
    const state = this.state?.state ?? '';
    if (state === 'ready' && this.#isMoving) return 'stopping';
    return this.rests && state === 'stopping' ? 'stopped' : state;
  }

  /** What the operator may do now, in a sentence. @param heldFor s for which a way in has had the hand */
  advice(now: number, heldFor = 0): string {
    const words = this.#advice(now, heldFor);
    return this.hasGlass ? words : words.replace('the glass', 'the gripper');
  }

  #advice(now: number, heldFor: number): string {
    const { means } = this;
    if (this.status === 'refused') return this.lastError?.message ?? 'This page is of another version: reload it.';
    if (this.failure) return this.failure;
    if (this.status !== 'open' && this.#ended) return 'The program has ended with the arm stationary. Start it again, and this page continues.';
    if (this.status !== 'open') return 'Not connected: you cannot stop the arm from here, and it may move. Trying again…';
    if (this.isStale(now)) return 'No data from the arm. The view is outdated, and the arm may move.';
    const stops = this.state?.state === 'stopping', itself = stops && this.rests ? 'stopped' : this.state?.state ?? 'elsewhere';
    if (this.past) return `You see a recording. The arm itself is ${itself}; ${this.mayResetNow ? '“Back to now” has its Reset.' : 'only Stop acts on it.'}`;
    if (!this.paired) return `${this.holder ? 'You are watching another operator.' : 'You are watching.'} ${stops ? 'The operator can reset the arm. ' : ''}${this.#codeRefused || means.pair}`;
    if (this.asks) return `You asked for control. ${this.#granted(now)}`;
    if (this.isAnothers) return 'Another client has control. You are watching; you can stop the arm.';
    if (now - this.#hint.at < HINTED_FOR) return this.#hint.words;
    const plays = (this.state?.controls.playback ?? -1) >= 0, takeOver = `A demo motion controls the arm. ${means.takeOver}`;
    switch (this.state?.state) {
      case 'idle': return 'The arm does not follow yet.';
      case 'ready':
        if (plays) return takeOver;
        if (this.yours && heldFor > HEARD_AFTER) return `${this.isLostByBrowser ? 'The arm was released, because this browser is too slow.' : 'You have control.'} ${means.again}`;
        return this.yours ? means.lead : `No operator. ${means.lead}`;
      case 'engaged':
        if (plays) return takeOver;
        return this.yours ? 'The arm follows. Release to stop it.' : 'The arm follows a hand from elsewhere.';
      case 'holding': return plays ? takeOver : `The arm holds. ${means.again}`;
      case 'stopping':
        if (!this.rests) return 'The arm stops.';
        return `${this.#isStoppedByAnother ? 'Another client stopped the arm' : 'Stopped'}: ${means.reset}.`;
      case 'fault': return now - this.#resetAt > RESET_WITHIN ? `The fault remains: remove its cause, then ${means.reset}.` : `Fault. Look at the arm, then ${means.reset}.`;
      default: return '';
    }
  }

  /** Why the code that came with the address, or was typed, lets nobody in; empty: none was refused. */
  get #codeRefused(): string {
    if (this.lastError?.code !== 'code') return '';
    const { message } = this.lastError;
    return `${message.charAt(0).toUpperCase()}${message.slice(1)}.`;
  }

  get #isStoppedByAnother(): boolean { return this.#stoppedBy !== 0 && this.#stoppedBy !== this.welcome?.client; }

  /** Another one has the arm, and does not give it by itself. */
  get isAnothers(): boolean { return !this.yours && this.holder !== 0 && !this.takeable; }

  #granted(now: number): string {
    const left = this.grantIn(now);
    return Number.isNaN(left) ? 'The arm is engaged now.' : `If the arm is not engaged until then, you get control in ${left} s.`;
  }

  /** That somebody asks this client for the arm; empty: nobody does. */
  asked(): string { return this.yours && this.asker ? 'Another client asks for control.' : ''; }
  /** When they get it all the same. */
  askedUntil(now: number): string {
    const left = this.grantIn(now);
    return !this.asked() || Number.isNaN(left) ? '' : `It gets control in ${left} s if the arm is not engaged until then.`;
  }

  /** Which limit holds the arm back, for people; empty: none. */
  constraint(): string {
    const c = this.state?.constraint;
    if (!c) return '';
    const joint = partText(this.welcome?.robot?.joints[c.first]?.name ?? `joint ${c.first + 1}`);
    const bodies = this.welcome?.robot?.bodies, objects = this.welcome?.cell?.objects;
    // Behind the arm's bodies come the objects that the tool carries.
    const solid = (i: number): string => (i < CARRIED ? partText(bodies?.[i]?.name ?? `${i}`) : objects?.[i - CARRIED]?.name ?? `${i}`);
    switch (c.kind) {
      case 'none': return '';
      case 'position': return `${joint} is at its position limit`;
      case 'velocity': return `${joint} is at its top speed`;
      case 'acceleration': return `${joint} is at its top acceleration`;
      case 'self_collision': return `${solid(c.first)} is close to ${solid(c.second)}`;
      case 'obstacle': return `${solid(c.first)} is close to ${objects?.[c.second]?.name ?? `object ${c.second}`}`;
      case 'reach': return 'the target is out of reach';
    }
  }
}
