import { beforeEach, describe, expect, it } from 'vitest';
import { Connection, type ConnectionStatus, type Surroundings } from '../src/connection';
import { Hand } from '../src/hand';
import type { ClientMessage, ServerMessage } from '../src/protocol';
import { motionTitle } from '../src/demo_motions';
import { Peak } from '../src/peak';
import { IN_EMULATOR, IN_HEADSET } from '../src/means';
import { Session, STALE_AFTER, waveOf, waveText } from '../src/session';
import { server, stateWith as state } from './server_messages';

class FakeSocket {
  readyState = 1;
  bufferedAmount = 0;
  sent: ClientMessage[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | null = null;
  onclose: ((event?: { code: number }) => void) | null = null;
  closed = false;
  close(): void { this.closed = true; }
  send(text: string): void { this.sent.push(JSON.parse(text) as ClientMessage); }
  says(message: object): void { this.onmessage?.({ data: JSON.stringify(message) }); }
}

class FakeSurroundings implements Surroundings {
  time = 10;
  sockets: FakeSocket[] = [];
  timers = new Map<number, { at: number; act: () => void }>();
  token = '';
  #last = 0;
  open(): WebSocket {
    this.sockets.push(new FakeSocket());
    return this.socket as unknown as WebSocket;
  }
  get socket(): FakeSocket { return this.sockets.at(-1)!; }
  now(): number { return this.time; }
  after(seconds: number, act: () => void): number { this.timers.set(++this.#last, { at: this.time + seconds, act }); return this.#last; }
  cancel(timer: number): void { this.timers.delete(timer); }
  readonly patience = 3;
  readToken(): string { return this.token; }
  keepToken(token: string): void { this.token = token; }
  pass(seconds: number): void {
    this.time += seconds;
    for (const [id, { at, act }] of [...this.timers]) if (at <= this.time && this.timers.delete(id)) act();
  }
}

describe('words of a session', () => {
  const open = (): Session => {
    const session = new Session();
    session.connectionBecame('open');
    session.take(server.welcome!, 0);
    return session;
  };
  const liquid = (spilled: boolean) => ({ tilt: [0, 0], freeboard: 0.01, spilled, spilled_share: spilled ? 0.1 : 0, least_freeboard: 0, lateral: 0 });

  it('say that a reset did not end the fault, as long as it has not', () => {
    const session = open();
    for (const message of [server.paired!, server.lease!, state({ state: 'fault' })]) session.take(message, 1);
    expect(session.advice(1)).toBe('Fault. Look at the arm, then press “Reset”.');
    session.resets(1);
    session.take(state({ state: 'idle' }), 1.1);
    expect(session.advice(1.1)).toContain('does not follow yet');
    session.take(state({ state: 'fault' }), 1.7);
    expect(session.advice(1.7)).toBe('The fault remains: remove its cause, then press “Reset”.');
    session.take(state({ state: 'ready' }), 2);
    session.take(state({ state: 'fault' }), 3);
    expect(session.advice(3)).toBe('Fault. Look at the arm, then press “Reset”.');
  });

  it('tell who turns the view before they ever led how to lead', () => {
    const session = open();
    for (const message of [server.paired!, server.lease!, state({ state: 'ready' })]) session.take(message, 1);
    session.turnsView(1);
    expect(session.advice(1.1)).toContain('turns the view');
    session.told(0.01, true, 20);
    session.turnsView(20);
    expect(session.advice(20)).not.toContain('turns the view');
  });

  it('say that a spilled glass is full again, for a while', () => {
    const session = open();
    session.take(state({ liquid: liquid(true) }), 1);
    expect(session.wasRefilled(1)).toBe(false);
    session.take(state({ liquid: liquid(false) }), 2);
    expect([session.wasRefilled(2), session.wasRefilled(7)]).toEqual([true, false]);
  });
  it('hold the largest wave of what the rim allows, and know none in a glass that spilled', () => {
    const session = open(), welcome = server.welcome as { glass: { height: number } }, { controls } = server.state as { controls: { fill: number } };
    const fill = welcome.glass.height - 0.01;
    session.take(state({ controls: { ...controls, fill }, liquid: { ...liquid(false), freeboard: 0.008, least_freeboard: 0.003 } }), 1);
    expect(waveText(session.wave()!)).toBe('wave 2 of 10 mm, largest 7');
    session.take(state({ controls: { ...controls, fill }, liquid: liquid(true) }), 2);
    expect(session.wave()).toBeNull();
    expect(waveOf(0, 1, 1)).toBeNull();
  });
  it('say of a demo motion what is true of it, and how old the news are', () => {
    const session = open(), reason = 'the device stopped sending: release and engage again', { controls } = server.state as { controls: object };
    session.yours = true;
    session.told(0.01, true, 0);
    session.take(state({ reason, reason_code: 'silent', controls: { ...controls, playback: -1 } }), 1);
    expect(session.reason(1)).toBe(reason);
    session.take(state({ reason, reason_code: 'silent', controls: { ...controls, playback: 0 } }), 2);
    expect(session.reason(2)).toBe(reason);
    const demo = (reason_code: string, playback: number) => { session.take(state({ reason: 'in its words', reason_code, reason_leader: 'recording', controls: { ...controls, playback } }), 2); return session.reason(2); };
    expect(demo('released', -1)).toBe('in its words');
    for (const code of ['released', 'profile_waits']) expect(demo(code, 0)).toBe('the demo motion starts again');
    expect(demo('silent', 0)).toBe('the demo motion was delayed, and continues');
    expect(demo('silent', -1)).toBe('the demo motion ended');
    expect(demo('gripped', 0)).toBe('in its words');
    session.connectionBecame('lost');
    expect(session.reason(6.04)).toBe('last data 4.0 s ago');
  });
  it('say under which profile the liquid went over the rim, also after another was chosen', () => {
    const session = open(), { controls } = server.state as { controls: object }, { profiles } = server.welcome as { profiles: { index: number; label: string }[] };
    const under = (profile: number, spilled: boolean, t: number) => session.take(state({ now_s: 2 * t, state: 'engaged', controls: { ...controls, profile }, liquid: liquid(spilled) }), t);
    under(0, true, 1);
    expect(session.spill()).toBe('Spilled 10.0 % of this glass'); // before this page looked
    under(0, false, 2);
    expect(session.spill()).toBe('');
    under(1, false, 2.5);
    under(1, true, 3);
    under(0, true, 4);
    const label = (of: number): string => profiles.find(({ index }) => index === of)!.label;
    expect(session.spill()).toBe(`Spilled 10.0 % of this glass under ${label(1)}`);
    session.take(state({ now_s: 10, controls: { ...controls, profile: 0 }, liquid: { ...liquid(true), spilled_share: 0.9 } }), 4.5);
    expect(session.spill()).toBe(`Spilled 90.0 % of this glass: 10.0 % under ${label(1)}, 80.0 % under ${label(0)}`);
    under(0, false, 5);
    const at = (now_s: number, profile: number, no_spill: boolean, spilled_share: number) => session.take(state({ now_s, state: 'engaged', controls: { ...controls, profile, no_spill }, liquid: { ...liquid(true), spilled_share } }), now_s);
    at(100, 1, false, 0.5);
    at(100.1, 0, true, 0.6);
    expect(session.spill()).toBe(`Spilled 60.0 % of this glass under ${label(1)}, which does not prevent spills`); // a swing that the other profile took over
    under(0, false, 101);
    session.take(state({ state: 'stopping', liquid: liquid(true) }), 6);
    expect(session.spill()).toMatch(/, in a stop$/);
    session.take(state({ liquid: liquid(false) }), 7);
    session.take(state({ state: 'fault', liquid: liquid(true) }), 8);
    expect(session.spill()).toMatch(/, in a stop$/);
  });
  it('call a planner that was late what a spill came of, where the profile would have kept the liquid in', () => {
    const { controls, plans, rejected_plans, now_s } = server.state as { controls: object; plans: number; rejected_plans: number; now_s: number };
    const spillOf = (no_spill: boolean, late: number, passed: number): string => {
      const session = open(), at = (t: number, more: object) => session.take(state({ now_s: now_s + t, controls: { ...controls, no_spill }, ...more }), t);
      at(0, { liquid: liquid(false) });
      at(0.1, { liquid: liquid(false), rejected_plans: rejected_plans + late });
      at(0.1 + passed, { liquid: liquid(true), rejected_plans: rejected_plans + late, plans: plans + 1 });
      return session.spill();
    };
    expect(spillOf(true, 1, 0.5)).toMatch(/: the planner was late$/);
    expect([spillOf(false, 1, 0.5), spillOf(true, 0, 0.5), spillOf(true, 1, 2)].join()).not.toContain('late');
  });
  it('tell a program that ended from one that is not to be reached', () => {
    const session = open();
    session.take(state({}), 1);
    session.connectionBecame('lost');
    expect(session.advice(2)).toContain('it may move');
    session.connectionBecame('lost', true);
    expect(session.advice(2)).toMatch(/program has ended with the arm stationary/);
    session.connectionBecame('open');
    expect(session.advice(2)).not.toContain('ended');
  });
  it('tell why the liquid feels something at rest: the glass leans', () => {
    const session = open(), still = Array<number>(6).fill(0), felt = (lateral: number, dq: number[]): number => {
      session.take(state({ dq, liquid: { ...liquid(false), lateral } }), 1);
      return session.lean;
    };
    expect(felt(0.39, still)).toBeCloseTo(2.28, 2);
    expect(felt(0.39, [0.1, 0, 0, 0, 0, 0])).toBe(0);
    expect(felt(0.02, still)).toBe(0);
  });
  it('of an emulated headset are those of a headset, and say which key or button of this page is meant', () => {
    const bare = (words: string): string => words.replace(/ \([^)]*\)/g, '');
    for (const [what, words] of Object.entries(IN_EMULATOR)) expect(bare(words)).toBe(IN_HEADSET[what as keyof typeof IN_HEADSET]);
    expect([IN_EMULATOR.lead, IN_EMULATOR.again, IN_EMULATOR.reset].every((words) => /mouse|Enter/.test(words))).toBe(true);
  });
  it('tell a newcomer nothing of a hand that was not theirs', () => {
    const session = open(), reason = 'the device stopped sending: release and engage again';
    session.take(state({ state: 'ready', reason, reason_code: 'silent' }), 1);
    expect(session.reason(1)).toBe('');
    session.yours = true;
    session.told(0.01, true, 1.1);
    expect(session.reason(1.1)).toBe(reason);
  });
  it('call a browser that did not come to tell of the hand so, and let who holds on lead on, once', () => {
    const session = open(), lost = 'in words that may change';
    session.yours = true;
    session.take(state({ state: 'engaged', reason: '', reason_code: 'gripped' }), 1);
    session.told(0.4, true, 2);
    session.take(state({ state: 'ready', reason: lost, reason_code: 'silent' }), 2.01);
    expect(session.reason(2.05)).toContain('browser was too slow');
    expect([session.mayResume(2.05), session.mayResume(2.15), session.mayResume(2.2)]).toEqual([false, true, false]);
    session.take(state({ state: 'engaged', reason: '', reason_code: 'gripped' }), 2.5);
    session.told(0.13, true, 2.6); // too short to have lost it
    session.take(state({ state: 'ready', reason: lost, reason_code: 'silent' }), 2.6);
    expect([session.reason(2.8), session.mayResume(2.8)]).toEqual([expect.stringContaining('too slow'), false]);
    session.take(state({ state: 'engaged', reason: '', reason_code: 'gripped' }), 3);
    session.told(0.4, false, 4.2); // the hand was released
    session.take(state({ state: 'ready', reason: lost, reason_code: 'silent' }), 5);
    expect([session.reason(5), session.mayResume(5.2)]).toEqual([lost, false]);
    session.take(state({ state: 'stopping', reason_code: 'stop_asked' }), 6);
    session.told(0.4, true, 6);
    expect(session.mayResume(6.2)).toBe(false);
  });
  it('know of plans that are late', () => {
    const session = open(), at = (t: number, plans: number, rejected_plans: number) => session.take(state({ now_s: t, plans, rejected_plans, missed_deadlines: 0, cycles: 500 * t }), t);
    at(0, 0, 0);
    at(6, 3000, 10);
    expect(session.isLate).toBe(false);
    at(12, 6000, 310);
    expect(session.isLate).toBe(true);
    at(18, 9000, 311);
    expect(session.isLate).toBe(false);
    session.take(state({ now_s: 18.1, reason_code: 'planner_late' }), 18);
    expect(session.isLate).toBe(true);
  });
  it('are old after half a second, and lost after three; while the page was held up they are not yet called so', () => {
    const session = open();
    session.take(state({}), 10);
    expect([session.isStale(10.4), session.isStale(10.6), session.isGone(10.6), session.isGone(13.1)]).toEqual([false, true, false, true]);
    session.drew(0.9);
    expect([session.isStale(10.9), session.isStale(11.5)]).toEqual([false, true]);
    session.drew(0.016);
    expect(session.isStale(10.9)).toBe(true);
    session.connectionBecame('lost');
    expect(session.isGone(10.1)).toBe(true);
  });
  it('tell what nothing came of, for a while or until the state is another', () => {
    const session = open();
    session.paired = session.yours = true;
    session.take(state({ state: 'stopping' }), 1);
    session.hint('reset first', 1);
    expect([session.advice(1.2), session.hintedWithin(1, 1.2)]).toEqual(['reset first', true]);
    session.take(state({ state: 'ready' }), 1.3);
    expect(session.advice(1.4)).not.toBe('reset first');
    session.hint('no tilt', 2);
    session.take(state({ state: 'ready' }), 6.4);
    expect(session.advice(6.5)).not.toBe('no tilt');
  });
  it('call an arm that nobody leads and that still moves what it is', () => {
    const session = open(), still = Array<number>(6).fill(0);
    session.take(state({ state: 'ready', dq: [0.1, 0, 0, 0, 0, 0], reason: 'released', reason_code: 'released' }), 1);
    expect([session.title(1), session.reason(1)]).toEqual(['stopping', 'released']);
    session.take(state({ state: 'ready', dq: still, reason: 'engage to move the arm', reason_code: 'ready' }), 1.1);
    expect([session.title(1.1), session.reason(1.1)]).toEqual(['ready', '']); // the advice explains it
  });
  it('say in the scene why a code lets nobody in, and why no motion can be asked for', () => {
    const session = open();
    session.take(state({}), 1);
    expect(session.advice(1)).toContain('enter the code');
    session.take({ type: 'error', code: 'code', message: 'this code is used up; the terminal shows the next one' }, 1);
    expect(session.advice(1)).toBe('You are watching. This code is used up; the terminal shows the next one.');
    expect(session.whyNoMotion).toContain('enter the code');
    session.take(state({ state: 'stopping' }), 1);
    expect(session.advice(1)).toContain('The operator can reset');
    session.past = true;
    session.take(state({ state: 'stopping', dq: Array<number>(6).fill(0) }), 1);
    expect(session.advice(1)).toContain('The arm itself is stopped; only Stop acts on it');
    session.take(server.lease! as ServerMessage, 1);
    expect(session.advice(1)).toContain('The arm itself is stopped; “Back to now” has its Reset');
    session.past = false;
    session.take(server.paired!, 1);
    session.take({ type: 'lease', holder: 7, yours: false, takeable: false, asker: 0, grant_s: null }, 1);
    expect(session.whyNoMotion).toContain('Another client has control');
    session.take({ type: 'lease', holder: 0, yours: false, takeable: true, asker: 0, grant_s: null }, 1);
    expect(session.whyNoMotion).toBe('');
  });
  it('name demo motions as people write', () => {
    expect(['carrying', 'physics-demo-laser', 'mouse-demo-recording', 'demo'].map(motionTitle)).toEqual(['Carrying', 'Physics laser', 'Mouse', 'Demo']);
  });
  it('hold the top of a wave for a moment', () => {
    const peak = new Peak(1);
    expect([[3, 0], [1, 0.2], [3, 0.4], [1, 0.7], [1, 1], [1, 1.3], [2, 1.4]].map(([value, at]) => peak.of(value!, at!))).toEqual([3, 3, 3, 3, 3, 1, 2]);
    expect(peak.of(0, 9)).toBe(0);
  });
  it('are of a gripper where the tool is one', () => {
    const session = open(), welcome = server.welcome as { robot: object };
    session.take({ ...server.welcome!, robot: { ...welcome.robot, tools: [{ gripper: { closes_in: 0.6 } }] } } as ServerMessage, 1);
    session.paired = session.yours = true;
    session.take(state({ state: 'ready', controls: { ...(server.state as { controls: object }).controls, playback: -1 } }), 1);
    expect([session.hasGlass, session.advice(1)]).toEqual([false, 'Drag the gripper, or hold a key, to move the arm.']);
  });
});

describe('connection', () => {
  let around: FakeSurroundings, statuses: ConnectionStatus[], connection: Connection;
  beforeEach(() => {
    around = new FakeSurroundings();
    statuses = [];
    connection = new Connection(around, 'h7dk2m9x4c', () => {}, (status) => statuses.push(status));
    connection.start();
    around.socket.onopen?.();
  });

  it('greets, then pairs with its code, once', () => {
    expect(around.socket.sent[0]).toEqual({ type: 'hello', version: 3 });
    around.socket.says(server.welcome!);
    expect(around.socket.sent.at(-1)).toEqual({ type: 'pair', code: 'h7dk2m9x4c' });
    around.socket.says(server.paired!);
    around.socket.onclose?.();
    around.pass(0.3);
    around.socket.onopen?.();
    around.socket.says(server.welcome!);
    expect(around.socket.sent[0]).toEqual({ type: 'hello', version: 3, token: (server.paired as { token: string }).token });
    expect(around.socket.sent.some((message) => message.type === 'pair')).toBe(false);
  });

  it('knows a program that ended in order, until there is one again', () => {
    around.socket.says(server.welcome!);
    around.socket.onclose?.({ code: 1006 });
    expect(connection.ended).toBe(false);
    around.pass(0.3);
    around.socket.onclose?.({ code: 1001 });
    around.pass(1);
    around.socket.onclose?.({ code: 1006 }); // no server answers
    expect(connection.ended).toBe(true);
    around.pass(2.1);
    around.socket.says(server.welcome!);
    expect(connection.ended).toBe(false);
  });

  it('comes back by itself, ever more patiently, and stops pinging in between', () => {
    for (let i = 0; i < 6; ++i) {
      around.socket.onclose?.();
      expect(around.timers.size).toBe(1);
      around.pass(2.1);
    }
    expect(around.sockets.length).toBe(7);
    expect(statuses).toEqual(['lost']);
  });

  it('gives up a connection that fell silent, also one that never opened, and listens to it no more', () => {
    around.socket.says(server.welcome!);
    around.pass(2.9);
    expect(statuses).toEqual(['open']);
    for (let i = 0; i < 8; ++i) around.pass(0.5);
    expect(statuses).toEqual(['open', 'lost']);
    expect(around.sockets[0]!.closed).toBe(true);
    expect(around.sockets[0]!.onmessage).toBeNull();
    expect(around.sockets.length).toBe(2);
    for (let i = 0; i < 8; ++i) around.pass(0.5); // this one never opens
    expect(around.sockets.length).toBe(3);
    expect(statuses).toEqual(['open', 'lost']);
  });

  it('that was held up itself reads what waits before it judges the far end', () => {
    around.socket.says(server.welcome!);
    around.pass(4); // the page was blocked, and the messages of that time are not read yet
    expect(statuses).toEqual(['open']);
    around.socket.says({ type: 'pong', t_s: around.time, now_s: 1 });
    around.pass(0.5);
    expect(statuses).toEqual(['open']);
    around.pass(4);
    around.pass(0.5); // nothing was waiting
    expect(statuses).toEqual(['open', 'lost']);
  });

  it('keeps a connection that says anything at all', () => {
    for (let i = 0; i < 20; ++i) {
      around.pass(0.5);
      around.socket.says({ type: 'pong', t_s: around.time, now_s: 1 });
    }
    expect(around.sockets.length).toBe(1);
  });

  it('hands pictures on as they came, and counts them as words', () => {
    const seen: ArrayBuffer[] = [], picture = new ArrayBuffer(20);
    connection.onPicture = (message) => seen.push(message);
    for (let i = 0; i < 20; ++i) {
      around.pass(0.5);
      around.socket.onmessage?.({ data: picture });
    }
    expect([seen.length, seen[0] === picture, connection.bytesReceived, around.sockets.length]).toEqual([20, true, 400, 1]);
  });

  it('does not come back to a server of another version', () => {
    around.socket.says({ type: 'error', code: 'version', message: 'reload' });
    around.socket.onclose?.();
    around.pass(10);
    expect(around.sockets.length).toBe(1);
    expect(statuses).toEqual(['refused']);
  });

  it('echoes the newest state so that the server can measure the round trip', () => {
    around.socket.says(server.state!);
    around.pass(0.5);
    expect(around.socket.sent.at(-1)).toEqual({ type: 'ping', t_s: 10.5, echo_s: 81.5, held_s: 0.5 });
  });

  it('drops samples rather than queueing them behind a slow network', () => {
    const sample = { type: 'sample', sequence: 1, t_s: 0, p: [0, 0, 1], q: [0, 0, 0, 1], clutch: true, tracked: true, emulated: false } as const;
    around.socket.bufferedAmount = 100_000;
    expect(connection.send(sample)).toBe(false);
    expect(connection.send({ type: 'request', kind: 'stop' })).toBe(true);
    around.socket.bufferedAmount = 0;
    expect(connection.send(sample)).toBe(true);
  });
});

describe('hand', () => {
  let sent: Extract<ClientMessage, { type: 'sample' }>[], hand: Hand, allowed: boolean, time: number;
  const still = [[0, 0, 0], [0, 0, 0, 1], 1, 0] as const;
  const clutches = () => sent.map((sample) => sample.clutch);
  beforeEach(() => {
    sent = [];
    time = 5;
    hand = new Hand({ send: (message) => { if (message.type === 'sample') sent.push(structuredClone(message)); return true; } }, () => time, () => allowed);
    allowed = true;
  });

  it('belongs to one way in at a time', () => {
    expect(hand.grab('drag')).toBe(true);
    expect(hand.grab('keys')).toBe(false);
    const before = sent.length;
    hand.lead('keys', [1, 0, 0], [0, 0, 0, 1], 1, 0);
    hand.release('keys');
    expect(sent.length).toBe(before);
    expect(hand.source).toBe('drag');
    hand.letGo();
    expect(hand.source).toBeNull();
  });

  it('says that it was open before it closes, opens when it lets go, and goes on from where it was', () => {
    hand.grab('drag');
    hand.lead('drag', [0.2, 0, 0], [0, 0, 0, 1], 0.5, 0);
    hand.release('drag');
    expect(clutches()).toEqual([false, true, false]);
    expect(sent[1]!.p[0]).toBeCloseTo(0.4);
    hand.grab('keys');
    hand.lead('keys', [0, 0, 0], [0, 0, 0, 1], 0.5, 0);
    expect(sent[4]!.p).toEqual(sent[2]!.p);
    expect(sent.map((s) => s.sequence)).toEqual([1, 2, 3, 4, 5]);
  });

  it('says again and again that it let go, for a while, and not into the next grip', () => {
    hand.grab('drag');
    hand.lead('drag', ...still);
    hand.release('drag');
    for (let i = 0; i < 100; ++i) {
      time += 0.011;
      hand.repeat();
    }
    const repeated = sent.length - 3;
    expect(repeated).toBeGreaterThan(20);
    expect(repeated).toBeLessThan(30);
    expect(clutches().slice(2).some(Boolean)).toBe(false);
    hand.grab('keys');
    hand.lead('keys', ...still);
    hand.release('keys');
    hand.grab('keys');
    const before = sent.length;
    hand.repeat();
    expect(sent.length).toBe(before);
  });

  it('never makes up an open clutch: a grip from before it was allowed leads nothing, however long it lasts', () => {
    allowed = false;
    hand.grab('drag');
    hand.lead('drag', [0.1, 0, 0], [0, 0, 0, 1], 1, 0);
    allowed = true;
    hand.lead('drag', [0.2, 0, 0], [0, 0, 0, 1], 1, 0);
    time += 0.5;
    expect(hand.heldFor).toBeCloseTo(0.5);
    hand.release('drag');
    expect(sent).toEqual([]);
    hand.grab('drag');
    hand.lead('drag', ...still);
    expect(clutches()).toEqual([false, true]);
  });

  it('begins a grip anew that is still held, and none that is not', () => {
    const sent: { clutch: boolean }[] = [];
    let allowed = true;
    const hand = new Hand({ send: (message: ClientMessage) => { sent.push(message as never); return true; } }, () => 1, () => allowed), clutches = (): boolean[] => sent.splice(0).map(({ clutch }) => clutch);
    hand.resume();
    expect(clutches()).toEqual([]);
    hand.grab('drag');
    hand.lead('drag', [0, 0, 0], [0, 0, 0, 1], 1, 0);
    clutches();
    hand.resume();
    hand.lead('drag', [0, 0, 0], [0, 0, 0, 1], 1, 0);
    expect(clutches()).toEqual([false, true]);
    allowed = false;
    hand.resume();
    expect(clutches()).toEqual([]);
  });
  it('counts a grip that took the lease itself, from when that came, if it came at once', () => {
    for (const [after, counts] of [[0.3, true], [1.5, false]] as const) {
      sent.length = 0;
      allowed = false;
      hand.grab('keys', true);
      hand.lead('keys', [0.1, 0, 0], [0, 0, 0, 1], 1, 0);
      expect(sent).toEqual([]);
      time += after;
      allowed = true;
      for (let i = 0; i < 2; ++i) hand.lead('keys', [0.2, 0, 0], [0, 0, 0, 1], 1, 0);
      expect(clutches()).toEqual(counts ? [false, true] : []);
      allowed = false;
      hand.lead('keys', ...still);
      allowed = true;
      hand.lead('keys', ...still);
      hand.release('keys');
      expect(clutches()).toEqual(counts ? [false, true] : []);
    }
  });

  it('never goes on with a grip during which it was not allowed', () => {
    hand.grab('keys');
    hand.lead('keys', ...still);
    allowed = false;
    hand.lead('keys', ...still);
    allowed = true;
    hand.lead('keys', ...still);
    expect(clutches()).toEqual([false, true]);
    expect(hand.clutch).toBe(false);
  });

  it('says when a device has lost its pose, and keeps the last one', () => {
    hand.grab('headset');
    hand.report('headset', { p: [1, 2, 3], q: [0, 0, 0, 2] }, true, 0.02);
    hand.report('headset', null, false);
    expect(sent.map((s) => [s.clutch, s.tracked, s.emulated])).toEqual([[false, true, false], [true, true, true], [true, false, false]]);
    expect(sent[2]!.p).toEqual([1, 2, 3]);
    expect(sent.map((s) => s.lead_s)).toEqual([undefined, 0.02, undefined]);
    expect(sent[1]!.q).toEqual([0, 0, 0, 1]);
  });
});

describe('session', () => {
  it('says that the computer is too slow while commands come late, and not of one that began anew', () => {
    const session = new Session(), state = server.state as { now_s: number };
    session.connectionBecame('open');
    let now = 0;
    const goOn = (late: number): string => {
      for (let i = 0; i < 21; ++i) {
        now += 0.5;
        session.take({ ...state, now_s: state.now_s + now, cycles: 500 * now, missed_deadlines: late * 500 * now } as unknown as ServerMessage, now);
      }
      return session.slow(now);
    };
    expect(goOn(0)).toBe('');
    expect(goOn(0.05)).toMatch(/^The computer is too slow now: \d+\.\d % of the commands/);
    expect(session.slow(now + 2 * STALE_AFTER)).toBe('');
    session.take({ ...state, now_s: 0, cycles: 0, missed_deadlines: 0 } as unknown as ServerMessage, now);
    expect(session.slow(now)).toBe('');
  });

  it('lets nobody drive without the lease, with old news, or when stopped', () => {
    const session = new Session();
    session.connectionBecame('open');
    session.take(server.state!, 1);
    expect(session.mayDrive(1)).toBe(false);
    session.take(server.lease!, 1);
    expect(session.mayDrive(1)).toBe(true);
    expect(session.mayDrive(1 + 2 * STALE_AFTER)).toBe(false);
    session.take(state({ state: 'stopping' }), 2);
    expect(session.mayDrive(2)).toBe(false);
    expect(session.advice(2)).toContain('watching'); // has control, but is not paired in this test
  });

  it('says who leads the arm, and how to take it in hand', () => {
    const session = new Session();
    session.connectionBecame('open');
    session.take(server.paired!, 1);
    const advice = (name: string, playback: number, lease: object): string => {
      session.take(state({ state: name, controls: { playback } }), 1);
      session.take({ type: 'lease', ...lease } as ServerMessage, 1);
      return session.advice(1);
    };
    const none = { asker: 0, grant_s: null };
    const nobody = { holder: 0, yours: false, takeable: true, ...none }, another = { holder: 7, yours: false, takeable: false, ...none }, me = { holder: 3, yours: true, takeable: false, ...none };
    expect(advice('engaged', 0, nobody)).toContain('demo motion controls');
    expect(advice('engaged', 0, me)).toContain('demo motion controls');
    expect(advice('engaged', 0, another)).toContain('Another client has control');
    expect(advice('engaged', -1, me)).toContain('Release');
    expect(advice('engaged', -1, nobody)).not.toContain('Release');
    expect(advice('ready', -1, nobody)).toContain('No operator');
    expect(advice('stopping', -1, nobody)).toContain('The arm stops');
    session.take(state({ state: 'stopping', dq: [0, 0, 0, 0, 0, 0] }), 1);
    expect([session.title(1), session.advice(1)]).toEqual(['stopped', 'Stopped: press “Reset”.']);
  });

  it('tells of a stop that somebody else asked for, and of none after it', () => {
    const session = new Session(), rests = { dq: [0, 0, 0, 0, 0, 0], controls: { playback: -1 } };
    const become = (...states: string[]) => states.forEach((name) => session.take(state({ ...rests, state: name }), 1));
    const stop = (client: number) => session.take({ type: 'stopped', client }, 1);
    session.connectionBecame('open');
    for (const message of [server.welcome!, server.paired!, server.lease!]) session.take(message as ServerMessage, 1);
    const me = session.welcome!.client;
    become('engaged');
    stop(me + 1);
    become('stopping');
    expect(session.advice(1)).toBe('Another client stopped the arm: press “Reset”.');
    stop(me); // once more does not make it theirs
    expect(session.advice(1)).toContain('Another client');
    become('ready');
    stop(me);
    become('stopping');
    stop(me + 1);
    expect(session.advice(1)).toBe('Stopped: press “Reset”.');
    become('ready', 'stopping'); // by a pedal, or by the program
    expect(session.advice(1)).toBe('Stopped: press “Reset”.');
  });

  it('tells whose grip came before the lease to let go', () => {
    const session = new Session();
    session.connectionBecame('open');
    for (const message of [server.paired!, server.lease!, state({ state: 'ready', controls: { playback: -1 } })]) session.take(message as ServerMessage, 1);
    expect(session.advice(1, 0.1)).toContain('Drag the glass');
    expect(session.advice(1, 1)).toContain('Release');
    session.means = IN_HEADSET;
    expect(session.advice(1)).toContain('Squeeze');
  });

  it('shows the past alone: nobody drives, nothing resets, and the words say so', () => {
    const session = new Session();
    session.connectionBecame('open');
    for (const message of [server.paired!, server.lease!, state({ state: 'stopping' })]) session.take(message as ServerMessage, 1);
    expect([session.mayReset, session.title(1)]).toEqual([true, 'stopping']);
    session.past = true;
    session.take(state({ state: 'ready' }), 1);
    expect([session.mayReset, session.mayDrive(1), session.title(1)]).toEqual([false, false, 'recording']);
    expect(session.advice(1)).toContain('only Stop');
    session.past = false;
    expect(session.mayDrive(1)).toBe(true);
  });

  it('says what was refused, until something is granted or it is old', () => {
    const session = new Session();
    session.take({ type: 'error', code: 'code', message: 'wrong' }, 1);
    expect([session.refusal(1), session.refusal(100)]).toEqual(['wrong', 'wrong']); // until another is typed
    session.take(server.paired!, 1);
    expect(session.refusal(1)).toBe('');
    session.take({ type: 'error', code: 'late', message: 'late' }, 1);
    expect([session.refusal(5), session.refusal(20)]).toEqual(['late', '']);
  });

  it('tells who asks for the arm, and when they get it', () => {
    const session = new Session();
    session.connectionBecame('open');
    const lease = (more: object) => session.take({ type: 'lease', holder: 7, yours: false, takeable: false, asker: 0, grant_s: null, ...more } as ServerMessage, 20);
    for (const message of [server.welcome!, server.paired!, server.state!]) session.take(message, 20);
    const own = session.welcome!.client;
    lease({ asker: own, grant_s: null });
    expect([session.asks, session.mayTake]).toEqual([true, false]);
    expect(session.advice(20)).toContain('is engaged now');
    lease({ asker: own, grant_s: 7.5 });
    expect(session.advice(20.2)).toContain('you get control in 8 s');
    expect(session.asked()).toBe('');
    lease({ holder: own, yours: true, asker: 5, grant_s: 3 });
    expect([session.asks, session.asked()]).toEqual([false, 'Another client asks for control.']);
    expect(session.askedUntil(21.5)).toContain('in 2 s');
    lease({ holder: own, yours: true, asker: 5 });
    expect(session.askedUntil(21.5)).toBe('');
    lease({ takeable: true });
    expect(session.mayTake).toBe(true);
    session.connectionBecame('lost');
    expect([session.mayTake, session.asks]).toEqual([false, false]);
  });

  it('forgets the lease with the connection', () => {
    const session = new Session();
    session.connectionBecame('open');
    session.take(server.lease!, 1);
    session.connectionBecame('lost');
    expect(session.yours).toBe(false);
    expect(session.advice(1)).toContain('it may move'); // another client may move it
  });

  it('says what holds the arm back by name', () => {
    const session = new Session();
    session.take(server.state!, 1);
    session.take({ ...(server.welcome as object), robot: { joints: [], bodies: Array.from({ length: 30 }, (_, i) => ({ name: `s${i}` })) } } as unknown as ServerMessage, 1);
    expect(session.constraint()).toBe('s4 is close to s27');
  });
});
