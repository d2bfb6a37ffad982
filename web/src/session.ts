import type { ConnectionStatus } from './connection';
import { offText, partText, percentText, spanText } from './figures';
import { isNotHeard, KeptHand } from './kept_hand';
import { LateCount } from './late_count';
import { ON_PAGE } from './means';
import type { Refusal, ServerMessage, StateMessage, Tool, WelcomeMessage } from './protocol';
import { gripperOf } from './descriptions';
import { Spills } from './spills';

/** s without a state after which the scene greys out: it shows old data. */
export const STALE_AFTER = 0.5;
/**
 * s without a state after which the controls grey out, too: the connection is given up then. A shorter gap keeps the
 * focus.
 */
export const GONE_AFTER = 3;
/**
 * s of a frame after which the page counts as blocked: messages of that time are read before the state counts as old.
 */
const HELD_UP = 0.25;

/** From here on a body's number is that of an object that the tool carries (docs/reference/protocol.md). */
const CARRIED = 128;
/** s for which a refusal is shown. */
const SAID_FOR = 10;
/** rad/s (m/s) below which a joint counts as stationary. */
const AT_REST = 0.005;
/** s for which a refill is shown, and the same if the glass spilled again meanwhile. */
const REFILL_TOLD = 4, REFILL_TOLD_AT_LEAST = 1;
/** rad/s (m/s) above which an arm that is not engaged is still stopping; sensors of a stationary arm measure less. */
const COMES_TO_REST = 0.02;
/** m/s^2; and deg, the smallest lean that is shown. */
const GRAVITY = 9.81, LEAST_LEAN = 0.5;
/** rad, from which on the glass leans with the hand. */
const LEANS = 0.009;
/** s after which a reset has failed if the arm is still in fault. */
const RESET_WITHIN = 0.5;
/** s for which a hint is shown. */
const HINTED_FOR = 4;
/** s within which the server receives and answers a grip. */
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

/** Between two rounds of a demo motion, and after the last one. @param plays it continues by itself */
function demoReason({ reason, reason_code: code }: StateMessage, plays: boolean): string {
  if ((code === 'released' || code === 'profile_waits') && plays) return 'the demo motion starts again';
  if (code === 'silent') return plays ? 'the demo motion was delayed, and continues' : 'the demo motion ended';
  return reason;
}

/** Shown when the operator turns the glass while it does not lean. */
export const STAYS_UPRIGHT = 'The glass does not lean with the hand: raise “Tilt with the hand” to lean it.';

/** Shown when the operator turns a glass about its own axis. */
export const LOOKS_THE_SAME = 'The glass turns about its axis; it is round, so it looks the same.';

/** State of the session from the messages of the server. Uses neither the DOM nor the network. */
export class Session {
  welcome: WelcomeMessage | null = null;
  state: StateMessage | null = null;
  /** Index of the tool that mouse, handles and keys move. */
  active = 0;
  status: ConnectionStatus = 'connecting';
  paired = false;
  holder = 0;
  yours = false;
  /** The server would give this client control: it is free, or the same person has it in another tab. */
  takeable = false;
  /** Number of the client that asks the holder for control; 0: none. */
  asker = 0;
  /** A recording of the past is on the screen in place of the arm: nothing that the operator does may move the arm, but Stop. */
  past = false;
  /** How the operator controls the arm now. */
  means = ON_PAGE;
  /** The last refusal, by the server or by the page. */
  lastError: { code: Refusal; message: string; at?: number } | null = null;
  /** Text: why this page has no session; empty: it has one, or the session is in a program. */
  failure = '';
  statesReceived = 0;
  #refilledAt = -Infinity;
  readonly #spills: Spills[] = [];
  readonly #late = new LateCount();
  readonly #kept = new KeptHand();
  #hint = { words: '', at: -Infinity };
  #stateAt = -Infinity;
  #ended = false;
  /**
   * s, of the page's clock: when this page requested the reset of an arm that is still in fault; infinite: it did not.
   */
  #resetAt = Infinity;
  /** Number of the client that requested the current stop; 0: unknown. */
  #stoppedBy = 0;
  /** A hand of this page has controlled the arm. */
  #hasHeld = false;
  /** s, of the last frame, if the page was blocked in it. */
  #heldUp = 0;
  /** s, of the page's clock: when `asker` gets control if the arm is not engaged until then. NaN: it is engaged now. */
  #grantAt = NaN;

  /** @param ended the program reported its end: its arm has stopped */
  connectionBecame(status: ConnectionStatus, ended = false): void {
    this.status = status;
    this.#ended = ended;
    if (status === 'open') {
      this.failure = '';
      return;
    }
    // Control ended with the connection.
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
        for (let i = 0; i < message.tools.length; ++i) (this.#spills[i] ??= new Spills(i)).book(this.state, message);
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

  /** The page sent the hand, `gap` s after the time before. @param held a source has the hand */
  told(gap: number, held: boolean, now: number): void {
    if (held && this.yours) this.#hasHeld = true;
    if (held) this.#kept.told(gap, now);
  }

  /** The hand timed out because this browser blocked the page. */
  get isLostByBrowser(): boolean { return this.#kept.explains(this.state); }

  /** A hand that is still held may engage again. */
  mayResume(now: number): boolean { return this.#kept.mayResume(this.state, now); }

  /** Plans or commands come late too often. */
  get isLate(): boolean { return this.#late.isLate || this.state?.reason_code === 'planner_late'; }

  /** Text if the program's computer is too slow, with the consequence; empty: it is not. */
  slow(now: number): string {
    if (this.past || this.isStale(now) || !this.#late.isSlow) return '';
    return `The computer is too slow now: ${percentText(this.#late.commands)} % of the commands are late.${this.hasGlass ? ' Any profile may spill.' : ''}`;
  }

  /** A glass that had spilled is full again, or has another level. */
  #isRefilled(before: StateMessage, after: StateMessage): boolean {
    return before.tools.some(({ liquid }, t) => liquid.spilled && !after.tools[t]?.liquid.spilled) || before.controls.fill !== after.controls.fill;
  }

  /** Why an action of the operator had no effect: replaces the advice for a while. */
  hint(words: string, now: number): void { this.#hint = { words, at: now }; }
  /** The operator turns the view; before the first motion, the operator may have meant to move the arm. */
  turnsView(now: number): void {
    if (!this.#hasHeld && this.mayLead(now)) this.hint('That turns the view. To move the arm, drag the glass or an arrow.', now);
  }
  /** This page requests a reset of the arm. */
  resets(now: number): void { this.#resetAt = now; }
  /** A hint was given within this many s. */
  hintedWithin(seconds: number, now: number): boolean { return now - this.#hint.at < seconds; }

  /** Text of the spill: how much, under which profiles, and its cause; empty: none. */
  spill(): string {
    if (this.past) return '';
    return (this.state?.tools ?? []).map((tool, i) => {
      const words = this.isGlass(i) ? this.#spills[i]!.told(tool, this.welcome?.profiles) : '';
      return words && this.hasTwo ? `${this.toolNames[i]}: ${words}` : words;
    }).filter(Boolean).join('; ');
  }

  /** The active tool. */
  get tool(): Tool | undefined { return this.state?.tools[this.active]; }
  /** Their names; none: no robot is known. */
  get toolNames(): string[] { return this.welcome?.robot?.tools?.map(({ name }) => name) ?? []; }
  /** The robot has two arms. */
  get hasTwo(): boolean { return (this.welcome?.robot?.tools?.length ?? 1) > 1; }
  /** A tool holds a glass. */
  isGlass(tool: number): boolean { return !gripperOf(this.welcome?.robot, tool); }
  /** The active tool holds a glass. */
  get hasGlass(): boolean { return this.isGlass(this.active); }
  /** The arm reports its gripper, or its file has one: some controllers report it only after its first motion. */
  get hasGripper(): boolean { return this.isGripper(this.active); }
  isGripper(tool: number): boolean { return typeof this.state?.tools[tool]?.gripper === 'number' || (this.state !== null && !this.isGlass(tool)); }
  /** The glass was refilled a moment ago, and the page should show it. */
  wasRefilled(now: number): boolean {
    return this.hasGlass && now - this.#refilledAt < (this.tool?.liquid.spilled ? REFILL_TOLD_AT_LEAST : REFILL_TOLD);
  }

  /** Text: the reason of the state; without a connection, the age of the last data. */
  reason(now: number): string {
    if (this.past) return '';
    if (this.status !== 'open' || this.isStale(now)) return this.state ? `last data ${spanText(now - this.#stateAt)} ago` : '';
    const { state } = this;
    if (!state) return '';
    // The advice says how to engage; and an operator who watches a recorded hand has nothing to release.
    if (state.reason_code === 'ready') return '';
    if (state.reason_code === 'hand_back' && state.reason_leader === 'person') return 'the hand’s position arrives again';
    if (!this.#hasHeld && isNotHeard(state)) return ''; // whose hand that was is not here
    if (this.isLostByBrowser) return 'this browser was too slow to send the hand’s position';
    return state.reason_leader === 'recording' ? demoReason(state, state.controls.playback >= 0) : state.reason;
  }

  /**
   * mm: height of the liquid above its level at rest, the largest since the glass was filled, and the height of the
   * rim. null: unknown.
   */
  wave(tool = this.active): Wave | null {
    const { state, welcome } = this, { freeboard, least_freeboard, spilled } = state?.tools[tool]?.liquid ?? {};
    if (!this.isGlass(tool) || !state || !welcome || spilled || typeof freeboard !== 'number' || typeof least_freeboard !== 'number') return null;
    return waveOf(1000 * (welcome.glass.height - state.controls.fill), 1000 * freeboard, 1000 * least_freeboard);
  }

  /**
   * deg by which the glass of a stationary arm leans, as after a stop: then gravity alone acts on the liquid.
   * 0: moving, or upright.
   */
  get lean(): number {
    const felt = this.tool?.liquid.lateral ?? 0, angle = (180 / Math.PI) * Math.asin(Math.min(1, felt / GRAVITY));
    return this.hasGlass && this.rests && angle >= LEAST_LEAN ? angle : 0;
  }

  isStale(now: number): boolean { return now - this.#stateAt - this.#heldUp > STALE_AFTER; }
  /** So long without a state that no command would arrive. */
  isGone(now: number): boolean { return this.status !== 'open' || now - this.#stateAt - this.#heldUp > GONE_AFTER; }
  /** A frame took so many s: messages of that time have not been read yet. */
  drew(dt: number): void { this.#heldUp = dt > HELD_UP ? dt : 0; }

  /** Whether this client has control, or would get it. */
  get mayTake(): boolean { return this.yours || this.takeable; }
  /** Whether this client asks another for control. */
  get asks(): boolean { return this.welcome !== null && this.asker === this.welcome.client; }
  /** Whole s until `asker` gets control; NaN while the arm is engaged. */
  grantIn(now: number): number { return Math.max(0, Math.ceil(this.#grantAt - now)); }

  /** Text: why no demo motion can be requested; empty: one can. */
  get whyNoMotion(): string {
    if (this.status !== 'open') return 'There is no connection to the arm.';
    if (!this.paired) return 'You are watching: enter the code from the terminal to control the arm.';
    return this.isAnothers ? 'Another client has control: ask for control first.' : '';
  }

  /** The glass stays upright, however the hand leans. */
  get staysUpright(): boolean { return this.hasGlass && (this.state?.controls.tilt ?? 1) < LEANS; }

  /** Whether a source would move the arm now. */
  mayDrive(now: number): boolean {
    const state = this.state?.state;
    return this.yours && !this.past && !this.isStale(now) && (state === 'ready' || state === 'engaged' || state === 'holding');
  }

  /** Whether a source would move the arm now, or after it took control, which is free. */
  mayLead(now: number): boolean {
    const state = this.state?.state;
    return this.mayTake && this.paired && !this.past && !this.isStale(now) && (state === 'ready' || state === 'engaged' || state === 'holding');
  }

  /** Not while a recording is shown: an operator who resets must see the real arm. */
  get mayReset(): boolean { return !this.past && this.mayResetNow; }
  get mayResetNow(): boolean { return this.mayTake && (this.state?.state === 'stopping' || this.state?.state === 'fault'); }

  /** The arm is not engaged, and its current state shows it stationary. */
  stands(now: number): boolean { return !this.isStale(now) && this.rests && this.state?.state !== 'engaged'; }

  /** No joint moves visibly. */
  get rests(): boolean { return this.state?.dq.every((speed) => Math.abs(speed) < AT_REST) ?? true; }

  get #isMoving(): boolean { return this.state?.dq.some((speed) => Math.abs(speed) > COMES_TO_REST) ?? false; }

  /** Text of the last refusal: until a request is granted or repeated, or it is old and nothing waits for it. */
  refusal(now: number): string {
    const { lastError } = this;
    return lastError && (lastError.at === undefined || lastError.code === 'code' || now - lastError.at < SAID_FOR) ? lastError.message : '';
  }

  /** State of the arm in one or two words. */
  title(now: number): string {
    if (this.status === 'connecting') return 'connecting';
    if (this.status !== 'open') return 'not connected';
    if (this.isStale(now)) return 'no data';
    if (this.past) return 'recording';
    const state = this.state?.state ?? '';
    if (state === 'ready' && this.#isMoving) return 'stopping';
    return this.rests && state === 'stopping' ? 'stopped' : state;
  }

  /** A sentence: what the operator may do now. @param heldFor s for which a source has had the hand */
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

  /** Why the server refused the code of the address, or the typed one; empty: none was refused. */
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

  /** Text while another client asks for control; empty: none does. */
  asked(): string { return this.yours && this.asker ? 'Another client asks for control.' : ''; }
  /** When they get it all the same. */
  askedUntil(now: number): string {
    const left = this.grantIn(now);
    return !this.asked() || Number.isNaN(left) ? '' : `It gets control in ${left} s if the arm is not engaged until then.`;
  }

  /** Text of the active limit; empty: none. */
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
