import { Arms } from './arms';
import { isTyped, takesEnter } from './input/shortcuts';
import type { Connection } from './connection';
import { Choices } from './choices';
import { element, made, put } from './element';
import { latencyText, offText } from './figures';
import { motionText, motionTitle } from './demo_motions';
import { policyText } from './policy';
import { colorOf, inOrder, purposeOf } from './profiles';
import type { Measure, Profile, RequestKind, RequestMessage, StateMessage, WelcomeMessage } from './protocol';
import type { Hand } from './hand';
import type { Session } from './session';
import { Peak } from './peak';
import { Sliders } from './sliders';
import { areChanged } from './weights';

const write = (node: HTMLElement, text: string): void => put(node, 'textContent', text);
/** Shows the element while there is text, which is in `words`. */
function tell(id: string, text: string, words = id): void {
  put(element(id, HTMLElement), 'hidden', text === '');
  write(element(words, HTMLElement), text);
}

/** A number with its unit. */
class Reading {
  constructor(private readonly node: HTMLElement, private readonly factor: number, private readonly text: (value: Measure | undefined) => string, private readonly unit: string) {}

  show(value: Measure | undefined): void {
    write(this.node, value === null || value === undefined ? '–' : `${this.text(value * this.factor)} ${this.unit}`);
  }
}

const button = (id: string) => element(id, HTMLButtonElement);
const input = (id: string) => element(id, HTMLInputElement);

/** Hz, of the planner, that are offered in addition to the current one. */
const RATES = [50, 100, 250, 500];

/** Closes all folds that open over other things. @param around except those that contain this */
export function foldAll(around: Node | null = null): void {
  for (const fold of document.querySelectorAll<HTMLDetailsElement>('.over[open]')) if (!fold.contains(around)) fold.open = false;
}

/** A list is folded until its line is pressed, and folds again with the choice of a mouse, a finger or Enter; arrow keys go through it. */
function folds(list: HTMLSelectElement): void {
  const fold = (): void => {
    const line = list.closest('details');
    if (line) line.open = false;
  };
  list.onclick = fold;
  list.onkeydown = (event) => {
    if (event.key !== 'Enter') return;
    fold();
    list.closest('details')?.querySelector('summary')?.focus();
  };
}

/** Shows all of a list at once: a list in its own window takes the keys, and Space would not get through. */
function show(list: HTMLSelectElement, options: HTMLOptionElement[]): void {
  list.replaceChildren(...options);
  list.size = Math.max(2, options.length);
}

/** null: nothing was measured yet, which is sent as 0. */
export const known = (value: Measure | undefined): Measure => value || null;

/** s for which the text shows the top of a wave: text that changes with every swing cannot be read. */
const WAVE_HELD = 1.2;
/** Of the room to the rim: a wave that came so high is worth a warning. */
const NEAR_THE_RIM = 0.9;
/** s between two updates of the planner's counters. */
const COUNTERS_EVERY = 1;
/** s for which Reset calls for attention. */
const CALLED_FOR = 1.2;

/** Why the controls cannot be used, and what to do; empty: they can. */
function whyDisabled(session: Session, reached: boolean): string {
  if (session.past) return 'A recording is shown, so grey controls are off. “Back to now” enables them.';
  if (!reached) return 'There is no connection to the arm, so grey controls are off.';
  if (!session.paired) return 'You are watching. To use the grey controls, enter the code from the terminal.';
  return session.mayTake ? '' : 'Another client has control. To use the grey controls, ask for control.';
}

/**
 * Hint for objects.
 * @param chosen the one that the buttons act on; empty: none @param plays a demo motion controls the arm
 */
function objectsHint(chosen: string, carried: boolean, plays: boolean): string {
  if (carried) return `The arm carries ${chosen} and keeps its distance from other obstacles.${plays ? ' To put it down, end the demo motion first.' : ''}`;
  if (plays) return 'Drag obstacles over the floor; the arm keeps its distance. To take one up or put it down, end the demo motion first.';
  return `Drag obstacles over the floor; the arm keeps its distance. ${chosen ? `The buttons act on ${chosen}.` : 'Add or drag one, to take or remove it.'}`;
}

/** The fields of a request in addition to its kind. */
type Asked = { text?: string; value?: number; to?: string; success?: boolean; notes?: string };

/** Controls and texts of the page. A choice shows the server's state as soon as the server can have answered. */
export class Panel {
  readonly #choices = new Choices();
  readonly #arms: Arms;
  readonly #sliders: Sliders;
  readonly #latency = new Reading(element('latency', HTMLElement), 1e-3, latencyText, 'ms');
  readonly #error = new Reading(element('error-now', HTMLElement), 1e3, offText, 'mm');
  readonly #clearance = new Reading(element('clearance', HTMLElement), 1e3, offText, 'mm');
  #profiles: HTMLInputElement[] = [];
  readonly #peak = new Peak(WAVE_HELD);
  #unfocused: HTMLElement | null = null;
  #countersAt = -Infinity;
  #chosen = '';
  #plays = false;
  #objectsHint = objectsHint('', false, false);
  #carried = false;
  /** Name of the last demo motion that controlled the arm; undefined: none has. */
  #played: string | undefined;

  constructor(private readonly session: Session, private readonly connection: Connection, private readonly hands: readonly Hand[], activate: (tool: number) => void) {
    this.#arms = new Arms(element('arms', HTMLElement), session, activate);
    button('reset').onclick = () => this.reset();
    button('lease').onclick = () => this.#askLease();
    for (const grant of [true, false]) button(grant ? 'grant' : 'keep').onclick = () => this.connection.send({ type: 'answer', grant });
    document.querySelector('#pairing')!.addEventListener('submit', (event) => {
      event.preventDefault();
      this.session.lastError = null;
      this.connection.pair(input('code').value.trim().toLowerCase());
      input('code').value = '';
    });
    button('policy').onclick = () => this.command('policy', { value: this.session.state?.controls.policy_turn ? 0 : 1 });
    button('unchange').onclick = () => this.command('profile', { text: this.#led()?.name ?? '' });
    button('refill').onclick = () => this.command('refill', {});
    element('playback', HTMLSelectElement).onchange = (event) => {
      this.takeLease();
      this.ask('playback', { text: (event.target as HTMLSelectElement).value });
    };
    this.#sliders = new Sliders(session, this.#choices, { command: (kind, more) => this.command(kind, more), grip: (closed) => this.#grip(closed) });
    input('record').onchange = () => this.command('record', { value: input('record').checked ? 1 : 0 });
    element('rate', HTMLSelectElement).onchange = (event) => this.command('rate', { value: Number((event.target as HTMLSelectElement).value) });
    button('play-again').onclick = ({ currentTarget }) => {
      this.takeLease();
      this.ask('playback', { text: (currentTarget as HTMLButtonElement).value });
    };
    for (const id of ['playback', 'rate']) folds(element(id, HTMLSelectElement));
    addEventListener('pointerdown', ({ target }) => foldAll(target as Node), { capture: true });
    addEventListener('keydown', (event) => {
      if (event.code !== 'KeyG' || event.repeat || event.ctrlKey || event.metaKey || event.altKey || isTyped(event.target)) return;
      const { tool, mayTake, past } = this.session;
      if (!this.session.hasGripper || !mayTake || past) return;
      this.#grip((this.#hand.gripper ?? tool?.gripper ?? 0) > 0.5 ? 0 : 1);
    });
  }

  /** A trigger moved: 0 open to 1 closed. Does not request control, as it may be touched by accident. */
  squeeze(closed: number, tool: number): void {
    if (this.session.isGripper(tool) && this.session.yours && !this.session.past) this.hands[tool]!.gripper = closed;
  }

  /** Of the active tool. */
  get #hand(): Hand { return this.hands[this.session.active]!; }

  /** 0 open to 1 closed. */
  #grip(value: number): void {
    this.takeLease();
    this.#hand.gripper = value;
  }

  stop(): void { this.ask('stop'); }
  reset(): void {
    if (!this.session.mayReset) return;
    this.takeLease();
    this.session.resets(performance.now() / 1000);
    this.ask('reset');
  }

  #askLease(): void {
    const { yours, asks, mayTake } = this.session;
    this.connection.send({ type: yours || asks ? 'release' : mayTake ? 'take' : 'ask' });
  }

  /**
   * Requests control if it is free; the server decides. New control ends a recording that moves the arm, so this starts
   * it again. Returns whether control was requested.
   */
  takeLease(): boolean {
    const { yours, mayTake, welcome, state } = this.session;
    if (yours || !mayTake) return false;
    this.connection.send({ type: 'take' });
    const text = welcome?.recordings[state?.controls.playback ?? -1];
    if (text !== undefined) this.ask('playback', { text });
    return true;
  }

  /** Starts the first recorded hand. */
  playFirst(): void {
    const text = this.session.welcome?.recordings[0];
    if (text === undefined) return;
    this.takeLease();
    this.ask('playback', { text });
  }

  /**
   * The operator's own hand starts: requests control and ends the recording that moves the arm. Returns whether control
   * was requested.
   */
  takeOver(): boolean {
    if (this.session.past) return false;
    const takes = this.takeLease();
    if (this.session.mayTake && (this.session.state?.controls.playback ?? -1) >= 0) this.ask('playback', { text: '' });
    return takes;
  }

  ask(kind: RequestKind, more: Asked = {}): void {
    this.connection.send({ type: 'request', kind, ...more } as RequestMessage);
  }

  /** Sends a request that needs control. */
  command(kind: RequestKind, more: Asked): void {
    this.takeLease();
    this.ask(kind, more);
  }

  /** Shows the choices that the server offers. */
  offer(welcome: WelcomeMessage): void {
    document.body.dataset.glass = String(!welcome.robot?.tools?.every(({ gripper }) => gripper));
    document.body.dataset.two = String(this.session.hasTwo);
    this.#arms.offer(this.session.toolNames);
    this.#sliders.offer(welcome);
    const box = element('profiles', HTMLFieldSetElement);
    box.querySelectorAll('label').forEach((label) => label.remove());
    this.#profiles = [];
    for (const profile of inOrder(welcome.profiles)) {
      const choice = made('input', { type: 'radio', name: 'profile', value: profile.name, onchange: () => this.command('profile', { text: profile.name }) }), color = made('i');
      color.style.background = colorOf(profile);
      box.append(made('label', {}, choice, made('span', {}, profile.label, made('small', {}, purposeOf(profile))), color));
      this.#profiles[profile.index] = choice;
    }
    const list = element('playback', HTMLSelectElement);
    show(list, [new Option('none: you control the arm', ''), ...welcome.recordings.map((name) => new Option(motionText(name), name))]);
  }

  /** The active profile. */
  #led(): Profile | undefined {
    const { state, welcome } = this.session;
    return welcome?.profiles.find(({ index }) => index === state?.controls.profile);
  }

  /** That its weights are no longer its own. */
  #showChanged(state: StateMessage, mayChoose: boolean): void {
    const led = this.#led();
    tell('changed', led && areChanged(led.weights, state.controls.weights) ? `${led.label}, with other weights` : '', 'changed-words');
    put(button('unchange'), 'disabled', !mayChoose);
  }

  /** A button for the last demo motion, which a stop or a hand has ended. */
  #showAgain(disabled: boolean): void {
    const { welcome, state } = this.session, plays = state?.controls.playback ?? -1;
    if (plays >= 0) this.#played = welcome?.recordings[plays];
    const again = button('play-again');
    if (plays >= 0 && document.activeElement === again) (again.parentElement?.querySelector('summary') as HTMLElement).focus({ preventScroll: true });
    put(again, 'hidden', plays >= 0 || this.#played === undefined);
    put(again, 'disabled', disabled);
    if (again.hidden || this.#played === again.value) return;
    again.value = this.#played!;
    again.title = `${motionTitle(this.#played!)}, from the beginning`;
    again.setAttribute('aria-label', `${motionTitle(this.#played!)} again`);
  }

  #showRate({ planner_rate_hz: rate, planner_rate_automatic: automatic }: StateMessage, mayChoose: boolean, now: number): void {
    write(element('rate-now', HTMLOutputElement), `${rate.toFixed(0)} Hz${automatic ? ', automatic' : ''}`);
    const list = element('rate', HTMLSelectElement);
    put(list, 'disabled', !mayChoose);
    const chosen = automatic ? 0 : rate;
    if (!this.#choices.isAnswered(list, now) || list.value === String(chosen)) return;
    const rates = [...new Set([0, ...RATES, chosen])].sort((a, b) => a - b);
    show(list, rates.map((hz) => new Option(hz ? `${hz.toFixed(0)} Hz` : 'automatic', String(hz), false, hz === chosen)));
  }

  /** Height of the liquid compared with the rim, and the largest height since the glass was filled. */
  #showWave(present: boolean): void {
    const wave = present ? this.session.wave() : null;
    put(element('wave', HTMLElement), 'hidden', !wave);
    if (!wave) return;
    const high = this.#peak.of(wave.now, performance.now() / 1000);
    put(element('wave-level', HTMLMeterElement), 'value', Math.round((100 * high) / wave.room) / 100);
    put(element('wave-most', HTMLElement).style, 'left', `${Math.round((100 * wave.most) / wave.room)}%`);
    write(element('wave-words', HTMLElement), `Wave ${offText(high)} of ${offText(wave.room)} mm`);
    put(element('wave', HTMLElement).dataset, 'near', String(wave.most > NEAR_THE_RIM * wave.room));
    const { lean } = this.session;
    write(element('wave-held', HTMLElement), `largest ${offText(wave.most)} mm${lean > 0 ? `, leans ${lean.toFixed(1)}°` : ''}`);
  }

  /** The connected policy, and what controls the arm during its turn. */
  #showPolicy(state: StateMessage | null | undefined, mayChoose: boolean): void {
    const { policy = '', policy_turn: turn = false } = state?.controls ?? {};
    put(element('policy-line', HTMLElement), 'hidden', policy === '');
    const halted = state?.state === 'stopping' || state?.state === 'fault'; // commands of that time are not done later
    const leader = state?.tools.map((tool) => tool.leader).find(Boolean) ?? null;
    if (leader === 'policy' || halted) for (const hand of this.hands) hand.leaveGripper();
    const choice = button('policy');
    put(choice, 'disabled', !mayChoose || (!turn && state?.state !== 'ready'));
    if (choice.getAttribute('aria-pressed') !== String(turn)) choice.setAttribute('aria-pressed', String(turn));
    write(choice, turn ? 'End the policy’s turn' : 'The policy’s turn');
    write(element('policy-words', HTMLElement), policyText(policy, turn, leader));
  }

  /**
   * A greyed-out element that had the focus gets it back once it is enabled.
   * @param before had the focus before this frame
   */
  #keepFocus(before: Element | null): void {
    if (before instanceof HTMLElement && before.matches(':disabled')) this.#unfocused = before;
    else if (document.activeElement !== document.body) this.#unfocused = null;
    if (!this.#unfocused || this.#unfocused.matches(':disabled')) return;
    this.#unfocused.focus();
    this.#unfocused = null;
  }

  /** Shows who has control or may have it, and the button Reset. */
  #showLease(now: number): void {
    const { session } = this;
    const reset = button('reset');
    put(reset, 'hidden', !session.mayReset);
    put(reset.dataset, 'call', String(session.mayReset && session.hintedWithin(CALLED_FOR, now)));
    put(reset.querySelector('kbd')!, 'hidden', document.activeElement !== reset && takesEnter(document.activeElement));
    put(button('stop'), 'disabled', session.status !== 'open');
    const lease = button('lease');
    write(lease, session.yours ? 'Give up control' : session.asks ? 'Cancel request' : session.mayTake || !session.holder ? 'Take control' : 'Ask for control');
    put(button('mode'), 'disabled', session.past);
    put(lease, 'disabled', session.past || !session.paired || (!session.mayTake && session.asker !== 0 && !session.asks));
    put(lease.dataset, 'call', String(!session.yours && session.mayTake && !session.past));
    tell('asked', session.asked(), 'asked-words');
    write(element('asked-until', HTMLElement), session.askedUntil(now));
  }

  /** Enables the choices that are possible now. */
  #showChoices(mayChoose: boolean, why: string, chosen: string, carried: boolean): void {
    const { session } = this, { state } = session;
    put(element('playback', HTMLSelectElement), 'disabled', session.past || !session.mayTake);
    this.#showAgain(session.past || !session.mayTake || state?.state === 'stopping' || state?.state === 'fault');
    put(input('record'), 'disabled', !mayChoose);
    put(button('add-box'), 'disabled', !mayChoose);
    const plays = (state?.controls.playback ?? -1) >= 0;
    put(button('carry-object'), 'disabled', !mayChoose || chosen === '' || plays);
    put(button('remove-object'), 'disabled', !mayChoose || chosen === '');
    for (const choice of this.#profiles) put(choice, 'disabled', !mayChoose);
    tell('why-disabled', why);
    if (chosen !== this.#chosen || carried !== this.#carried || plays !== this.#plays) { // makes these texts again only on a change
      this.#objectsHint = objectsHint(this.#chosen = chosen, this.#carried = carried, this.#plays = plays);
      button('carry-object').textContent = carried ? 'Put down' : 'Take up';
    }
    write(element('objects-hint', HTMLElement), why || this.#objectsHint);
  }

  /** A few times a second; now in s of performance.now(). @param chosen the object that the buttons for one act on; empty: none @param carried the tool has it */
  draw(now: number, chosen: string, carried: boolean): void {
    const focused = document.activeElement;
    this.#draw(now, chosen, carried);
    this.#keepFocus(focused);
  }

  #draw(now: number, chosen: string, carried: boolean): void {
    const { session } = this;
    const state = session.state;
    const live = session.status === 'open' && !session.isStale(now), present = live && !session.past, reached = !session.isGone(now) && !session.past;
    put(document.body.dataset, 'state', session.status === 'open' ? (state?.state ?? 'none') : 'none');
    put(document.body.dataset, 'stale', String(!live));
    put(document.body.dataset, 'yours', String(session.yours));
    write(element('state', HTMLElement), session.title(now));
    write(element('reason', HTMLElement), session.reason(now));
    write(element('advice', HTMLElement), session.advice(now, Math.max(...this.hands.map(({ heldFor }) => heldFor))));
    tell('held', present ? session.constraint() : '');
    tell('slow', session.slow(now));
    tell('spill', session.spill(), 'spill-words');
    put(button('refill'), 'hidden', !reached || !session.mayTake);
    tell('refilled', !session.past && session.wasRefilled(now) ? 'Full glass again' : '');
    this.#showWave(present && !session.hasTwo);
    this.#arms.draw(present);
    put(element('gripper-line', HTMLElement), 'hidden', !session.hasGripper);
    this.#showPolicy(session.past ? undefined : state, reached && session.mayTake);
    tell('refusal', session.refusal(now));
    // Old values are not shown as current.
    this.#latency.show(live ? known(state?.latency_us.p50) : null);
    this.#error.show(live ? session.tool?.tracking_error : null);
    this.#clearance.show(live ? state?.clearance : null);

    this.#showLease(now);
    put(element('pairing', HTMLFormElement), 'hidden', session.paired || session.status !== 'open');
    const mayChoose = reached && session.mayTake;
    this.#showChoices(mayChoose, whyDisabled(session, reached), chosen, carried);
    this.#sliders.draw(mayChoose, now);
    if (!state) return;
    const profile = this.#profiles[state.controls.profile];
    if (profile && this.#profiles.every((choice) => this.#choices.isAnswered(choice, now))) put(profile, 'checked', true);
    if (this.#choices.isAnswered(input('record'), now)) put(input('record'), 'checked', state.recording);
    this.#showRate(state, mayChoose, now);
    this.#showChanged(state, mayChoose);
    const list = element('playback', HTMLSelectElement);
    if (this.#choices.isAnswered(list, now)) list.value = session.welcome?.recordings[state.controls.playback] ?? '';
    write(element('playback-now', HTMLOutputElement), list.value === '' ? (session.yours ? 'none: you control the arm' : 'none') : motionTitle(list.value));
    if (now < this.#countersAt) return; // these figures are in a paragraph and need no fast updates
    this.#countersAt = now + COUNTERS_EVERY;
    const trip = Number.isFinite(this.connection.roundTrip) ? `${(this.connection.roundTrip * 1000).toFixed(0)} ms` : '–';
    write(element('counters', HTMLElement),
      `${state.plans} plans, ${state.rejected_plans} late; ${state.cycles} commands, ${state.missed_deadlines} late. Network round trip ${trip}.`);
  }
}
