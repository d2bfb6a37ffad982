import { describe, expect, it } from 'vitest';
import { Busy } from '../src/busy';
import { beganOf, figures, grown, isFound, ordered, spillOf, titleOf, wordsOf } from '../src/recorded';
import { clock, percentText, rateText } from '../src/figures';
import { alikeFor, betterOf, stopsOf, summaryOf, verdictOf } from '../src/replay/summary';
import { indexAt, ledIn, Player, type Motion } from '../src/replay/player';
import type { StoryEvent } from '../src/replay/player';
import { countsOf, currentOf, fine, folded, hidesLimits, seenAt, spillAt, worstSpill } from '../src/replay/happened';
import { CURVES, fastest, fastestAt, keepCurves, keptCurves, KINDS } from '../src/replay/curves';
import { curveOf, holding, statesTold, told, valueAt, zoomed } from '../src/replay/track';

const motion: Motion = { name: 'a', t_s: [5, 5.1, 5.3], q: [[0, 1], [1, 1], [1, -1]] };

describe('a recording', () => {
  it('tells every profile by which a hand led, and no other', () => {
    const settings = ['carry', 'follow', 'tracking'].map((profile, i) => ({ t_s: 2 * i, profile, scale: 1, fill: 0 }));
    const target = { t_s: [0, 1, 3, 4, 5], p: [], q: [], engaged: [0, 1, 0, 1, 1], lateral: [], error_mm: [] };
    expect(ledIn({ ...motion, settings, target })).toEqual(['carry', 'tracking']);
    expect(ledIn(motion)).toEqual([]);
  });
});

describe('a recording of two arms', () => {
  const event = (t_s: number, what: string, why: string, kind = 'state') => ({ t_s, kind, what, why });
  const two: Motion = {
    ...motion, tool: 'left', off_target_mm: 1, liquid: { t_s: [5], tilt: [[0.1, 0]], freeboard_mm: [9], spilled: [0], spilled_share: [0] },
    target: { t_s: [5, 5.1, 5.2], p: [[0, 0, 1], [0, 0, 1], [0, 0, 1]], q: [], engaged: [0, 0, 0], lateral: [], error_mm: [2, 2, 2] },
    other_tools: [{
      name: 'right', off_target_mm: 3, liquid: { t_s: [5], tilt: [[0.2, 0]], freeboard_mm: [null], spilled: [1], spilled_share: [0.5] },
      target: { t_s: [5, 5.1, 5.2], p: [[0, 0, 2], [0, 0, 2], [0, 0, 2]], q: [], engaged: [0, 1, 0], lateral: [], error_mm: [4, 4, 4] },
    }],
    settings: [{ t_s: 0, profile: 'carry', scale: 1, fill: 0 }],
    events: [event(5, 'ready', 'the arm takes commands'), event(5.1, 'engaged', 'right: gripped'), event(5.15, 'engaged', 'left: gripped'), event(5.2, 'ready', 'right: released'),
      event(5.25, 'right: 50 % spilled', 'in a stop', 'spill')],
  };
  it('has each with its states, its liquid and its spills, and is engaged while one is', () => {
    const player = new Player(two), seen = (at: number) => { player.seek(at); return [player.state, ...player.tools.map(({ state }) => state)]; };
    expect([seen(0.05), seen(0.12), seen(0.18), seen(0.22)]).toEqual([['ready', 'ready', 'ready'], ['engaged', 'ready', 'engaged'], ['engaged', 'engaged', 'engaged'], ['engaged', 'engaged', 'ready']]);
    expect(player.led.map(({ from, to }) => [from, to])).toEqual([[5.1, 5.3]]);
    expect(player.tools.map((tool) => [tool.motion.tool, tool.tilt()[0], tool.spilled, tool.off])).toEqual([['left', 0.1, false, 2], ['right', 0.2, true, null]]);
    expect(player.tools.map(({ motion: { events } }) => events!.filter(({ kind }) => kind === 'spill').length)).toEqual([0, 1]);
    expect([ledIn(two), ledIn(motion), new Player(motion).tools.length]).toEqual([['carry'], [], 1]);
    expect(summaryOf(player).find(([what]) => what === 'Tracking error, mm')!.slice(1, 3)).toEqual(['1.0 / 3.0', 3]);
    expect(statesTold(player)).toMatch(/^left: ready for 0\.[12] s; engaged for 0\.[12] s; profiles carry; right: ready/);
  });
});

describe('events', () => {
  it('are counted as the report does, also where not all are listed', () => {
    const event = (kind: string) => ({ t_s: 0, kind, what: '', why: '' }), events = ['state', 'spill', 'state'].map(event);
    expect([...countsOf(events, events)]).toEqual([['state', '2'], ['spill', '1']]);
    expect([...countsOf(events, events.slice(1))]).toEqual([['state', '1 of 2'], ['spill', '1']]);
  });
  it('fold what comes and goes, from the third time on, at the time of the first', () => {
    const event = (t_s: number, what: string) => ({ t_s, kind: 'state', what, why: what === 'holding' ? 'no pose came' : '' });
    const flicker = (times: number) => Array.from({ length: 2 * times }, (_, i) => event(i, i % 2 ? 'engaged' : 'holding'));
    expect(folded([...flicker(3), event(9, 'stopping')]).map(({ event: { t_s }, words }) => [t_s, words])).toEqual([[0, 'holding: no pose came, then engaged, 3 ×'], [9, 'stopping']]);
    expect(folded([event(-1, 'engaged'), ...flicker(2)]).map(({ words }) => words)).toEqual(['engaged', 'holding: no pose came', 'engaged', 'holding: no pose came', 'engaged']);
    expect(folded([])).toEqual([]);
  });
});

describe('player', () => {
  it('is where the arm was, in between too, whichever way it seeks', () => {
    const player = new Player(motion);
    const at = (t: number) => { player.seek(t); return [...player.q()]; };
    expect(at(0)).toEqual([0, 1]);
    expect(at(0.05)[0]).toBeCloseTo(0.5);
    expect(at(0.2)[1]).toBeCloseTo(0);
    expect(at(9)).toEqual([1, -1]);
    expect(at(0.025)[0]).toBeCloseTo(0.25);
  });

  it('stops at its end and begins anew', () => {
    const player = new Player(motion);
    player.toggle();
    player.advance(0.2);
    expect(player.at).toBeCloseTo(0.2);
    player.advance(5);
    expect([player.at, player.playing]).toEqual([player.duration, false]);
    player.toggle();
    expect([player.at, player.playing]).toEqual([0, true]);
  });

  it('stands at its begin until it is to play', () => {
    const player = new Player(motion);
    player.advance(0.1);
    expect(player.at).toBe(0);
  });

  it('takes a single look, and refuses none', () => {
    expect([...new Player({ name: 'b', t_s: [3], q: [[0.5]] }).q()]).toEqual([0.5]);
    expect(() => new Player({ name: 'c', t_s: [], q: [] })).toThrow('c holds no motion');
  });
});

describe('what happened', () => {
  const story: Motion = {
    ...motion, target: { t_s: [5, 5.1, 6.2, 6.3], p: [[0, 0, 1], [0, 0, 2], [0, 0, 3], [0, 0, 4]], q: Array(4).fill([0, 0, 0, 1]) as [number, number, number, number][], engaged: [0, 1, 1, 1], lateral: [1, 3, null, 2], error_mm: [null, 5, 6, 7] },
    liquid: { t_s: [5, 5.15], tilt: [[0.1, 0], [0.2, 0]], freeboard_mm: [9, 8], spilled: [0, 1], spilled_share: [0, 0.25] },
    settings: [{ t_s: 4, profile: 'tracking', scale: 0.5, fill: 0.09 }, { t_s: 5.2, profile: 'carry', scale: 1, fill: 0.09 }],
    events: [{ t_s: 5, kind: 'state', what: 'ready', why: '' }, { t_s: 5.1, kind: 'state', what: 'engaged', why: 'grip' }, { t_s: 5.15, kind: 'spill', what: 'spilled', why: '' }],
  };

  it('is told of the time that is shown: target, liquid, state, profile', () => {
    const player = new Player(story);
    player.seek(0.05);
    expect([player.target()!.p[2], player.tilt()[0], player.spilled, player.spilledShare, player.state, player.profile, player.scale]).toEqual([1, 0.1, false, 0, 'ready', 'tracking', 0.5]);
    player.seek(0.25);
    expect([player.target()!.p[2], player.tilt()[0], player.spilled, player.spilledShare, player.state, player.profile, player.scale]).toEqual([2, 0.2, true, 0.25, 'engaged', 'carry', 1]);
    expect(player.firstGrip).toBeCloseTo(0.1);
    expect(new Player(motion).target()).toBeNull();
  });

  it('is drawn with a gap where nothing was planned', () => {
    const [times, values] = curveOf(story, 'slosh', 5);
    expect(values).toEqual([1, 3, null, null, 2]);
    expect(times[2]).toBeCloseTo(0.65);
    expect(curveOf(motion, 'slosh', 5)).toEqual([[], []]);
  });

  it('plays at any speed, again and again, and steps', () => {
    const player = new Player(motion);
    player.toggle();
    player.speed = 2;
    player.advance(0.1);
    expect(player.at).toBeCloseTo(0.2);
    player.loops = true;
    player.advance(1);
    expect([player.at, player.playing]).toEqual([0, true]);
    player.step(1);
    expect([player.at, player.playing]).toEqual([1 / 30, false]);
    player.step(-5);
    expect(player.at).toBe(0);
  });

  it('finds the entry of a time', () => {
    expect([-1, 0, 1, 2.5, 9].map((t) => indexAt([0, 1, 2, 3], t))).toEqual([-1, 0, 1, 2, 3]);
    expect(indexAt([], 1)).toBe(-1);
  });
});

describe('list', () => {
  it('says length and figures, and what is missing it leaves out', () => {
    expect(clock(605.4)).toBe('10:05');
    const session = { name: 'x', duration_s: 61, bytes: 2_340_000, complete: true, run: { label: 'Waiter' }, summary: { engaged_s: '59.2', latency_p50_ms: '9.6', spilled: 'no' } };
    expect(figures(session)).toBe('1:01 · Waiter · engaged 59.2 s · latency 9.6 ms · 2.3\u00a0MB');
    const profiles = [{ index: 0, name: 'tracking', label: 'Tracking (P1)', weights: [] }];
    expect(figures({ ...session, summary: { profiles: 'tracking, own' } }, null, profiles)).toBe('1:01 · Tracking (P1), own · 2.3\u00a0MB');
    expect(figures({ ...session, summary: { spilled: 'yes', spilled_share: '0.744' } })).toBe('1:01 · Waiter · spilled 74.4 % · 2.3\u00a0MB');
    expect(figures({ ...session, summary: { spilled: 'yes' } })).toBe('1:01 · Waiter · spilled, share not recorded · 2.3\u00a0MB');
    expect(figures({ ...session, summary: { spilled: 'yes', spilled_share: '0.744' } }, null, [], false)).toBe('1:01 · Waiter · 2.3\u00a0MB');
    expect([spillOf({ ...session, summary: { spilled: 'yes', spilled_share: '0.744' } }), spillOf({ ...session, summary: { spilled: 'yes', spilled_share: '0.744', spills: '3' } }), spillOf(session)]).toEqual(['spilled 74.4 %', 'spilled 3 ×, at most 74.4 %', '']);
    expect(figures({ ...session, complete: false, run: {}, summary: {} })).toBe('1:01 · 2.3\u00a0MB · not closed');
    expect(figures({ ...session, summary: {}, fault: 'emergency button' })).toBe('the seconds before a fault: emergency button · Waiter · 2.3\u00a0MB');
    expect(figures({ ...session, complete: false, run: {}, summary: {} }, 75)).toBe('being recorded · 1:15 · 2.3\u00a0MB');
  });
});

describe('a spill in the list', () => {
  const session = { name: 'x', duration_s: 61, bytes: 2_340_000, complete: true, run: { label: 'Waiter' }, summary: {} as Record<string, string> };
  const profiles = [{ index: 0, name: 'tracking', label: 'Tracking (P1)', weights: [] }];
  it('says under which profile, where that is known', () => {
    const of = (summary: Record<string, string>) => spillOf({ ...session, summary: { spilled: 'yes', ...summary } }, profiles);
    expect(of({ spilled_share: '1', spilled_profile: 'tracking', profiles: 'carry, tracking' })).toBe('spilled 100 % under Tracking (P1)');
    expect(of({ spilled_share: '0.036', profiles: 'tracking' })).toBe('spilled 3.6 % under Tracking (P1)');
    expect(of({ spilled_share: '0.0001', profiles: 'carry, tracking' })).toBe('spilled less than 0.1 %');
    expect([percentText(0), percentText(0.9996), percentText(0.9994)]).toEqual(['0.0', '100', '99.9']);
  });
  it('is the largest, and seen at the time that is opened', () => {
    const spill = (t_s: number, amount: number) => ({ t_s, kind: 'spill', what: '', why: '', amount });
    expect(worstSpill([spill(1, 0.2), spill(2, 1), { t_s: 3, kind: 'refill', what: '', why: '' }, spill(4, 1)])?.t_s).toBe(2);
    expect(worstSpill([])).toBeUndefined();
    expect(seenAt(7.123, 5)).toBeCloseTo(2.13, 9);
    expect(seenAt(4, 5)).toBe(0);
  });
});

describe('the list of events', () => {
  it('tells a spill for two seconds where the list is out of sight', () => {
    const events = [{ t_s: 5, kind: 'spill', what: 'spilled 40.0 % of the liquid', why: 'under Carry' }, { t_s: 6, kind: 'limit', what: 'reach', why: '' }];
    expect([4.9, 5, 6.9, 7].map((now) => spillAt(events, now))).toEqual(['', 'spilled 40.0 % of the liquid: under Carry', 'spilled 40.0 % of the liquid: under Carry', '']);
  });
  it('leaves out limits at first where all else would drown in them', () => {
    const limits = (count: number): StoryEvent[] => Array.from({ length: count }, (_, i) => ({ t_s: i, kind: 'limit', what: 'reach', why: '' }));
    expect([hidesLimits(limits(20)), hidesLimits(limits(21))]).toEqual([false, true]);
  });
  it('goes along with the time, and leaves out what is not wanted', () => {
    const entries = [{ at: 0, kind: 'state' }, { at: 1, kind: 'limit' }, { at: 2, kind: 'spill' }];
    expect([-1, 0, 1.5, 9].map((at) => currentOf(entries, new Set(), at))).toEqual([-1, 0, 1, 2]);
    expect([1.5, 9].map((at) => currentOf(entries, new Set(['limit', 'spill']), at))).toEqual([0, 0]);
  });
});

describe('what takes a while', () => {
  it('runs once at a time, and its button says so meanwhile', async () => {
    const attributes = new Map<string, string>([['aria-label', 'Replay x']]);
    const made = {
      dataset: {} as Record<string, string>, textContent: 'Replay', getAttribute: (name: string) => attributes.get(name) ?? null,
      setAttribute: (name: string, value: string) => attributes.set(name, value), removeAttribute: (name: string) => attributes.delete(name),
    } as unknown as HTMLElement;
    const busy = new Busy({ querySelectorAll: () => [made] } as unknown as ParentNode);
    let runs = 0, done = (): void => {};
    busy.sign(made, 'replay x', 'Reading…');
    const act = (): Promise<void> => { ++runs; return new Promise((resolve) => { done = resolve; }); };
    const first = busy.run('replay x', act);
    await busy.run('replay x', act);
    expect([runs, made.textContent, attributes.get('aria-busy'), attributes.get('aria-label')]).toEqual([1, 'Reading…', 'true', 'Reading… Replay x']);
    done();
    await first;
    expect([made.textContent, attributes.has('aria-busy'), attributes.get('aria-label'), busy.isRunning('replay x')]).toEqual(['Replay', false, 'Replay x', false]);
  });
});

describe('names', () => {
  it('do not replace the date', () => {
    const now = new Date(2026, 10, 25, 0, 20), session = { name: '2026-11-25_00-10-07', duration_s: 1, bytes: 1, complete: true, run: { started: '2026-11-24_23-00-00 UTC' }, summary: {} };
    expect(beganOf(session, now)).toBe('');
    expect(beganOf({ ...session, label: 'calm' }, now)).toBe('Today 00:10:07');
    expect(beganOf({ ...session, name: 'short' }, now)).toBe('Yesterday 23:00:00');
    expect(beganOf({ ...session, name: 'short', run: {} }, now)).toBe('');
    expect(wordsOf({ name: '2026-11-25_00-10-07_2', run: { recorded: '2026-11-25_00-30-00 UTC' } }, now)).toBe('Today 00:30:00');
    expect(wordsOf({ name: 'short', run: { recorded: '2026-11-25_00-30-00 UTC' } }, now)).toBe('short');
  });
  it('and the length of what is being written never shrinks', () => {
    expect(grown(589, 3, 637)).toBe(637);
    expect(grown(640, 3, 637)).toBe(643);
  });
  it('say when a session began, as people say it', () => {
    const now = new Date(2026, 10, 25, 0, 20);
    expect(titleOf('2026-11-25_00-10-07', now)).toBe('Today 00:10:07');
    expect(titleOf('2026-11-24_23-59-01_2', now)).toBe('Yesterday 23:59:01 (2)');
    expect(titleOf('2026-11-03_08-00-00', now)).toBe('3 November 08:00:00');
    expect(titleOf('2025-12-31_08-00-00', now)).toBe('31 December 2025 08:00:00');
    expect(titleOf('short', now)).toBe('short');
  });
  it('come in the order that is chosen', () => {
    const session = (name: string, summary: Record<string, string>, label?: string) => ({ name, duration_s: 1, bytes: 1, complete: true, run: {}, summary, ...(label === undefined ? {} : { label }) });
    const sessions = [session('c', { spilled: 'yes', engaged_s: '2' }), session('b', { spilled: 'no', spilled_share: '9', engaged_s: '30' }, 'a first try'), session('d', {}, ''), session('a', { spilled: 'yes', spilled_share: '0.4', engaged_s: '4.5' }, 'best')];
    const names = (order: Parameters<typeof ordered>[1]) => ordered(sessions, order).map(({ name }) => name).join('');
    expect([names('newest'), names('oldest'), names('spilled'), names('led'), names('name')]).toEqual(['cbda', 'adbc', 'acbd', 'bacd', 'bacd']);
    expect(sessions.map(({ name }) => name).join('')).toBe('cbda');
  });
  it('are found by all words of what is looked for', () => {
    const told = 'Yesterday 13:02:11 2026-11-24_13-02-11 0:31 · Carry · led 16.9 s · spilled';
    expect([isFound(told, 'yesterday spilled'), isFound(told, 'today'), isFound(told, 'CARRY'), isFound(told, 'yesterday tracking')]).toEqual([true, false, true, false]);
    const dry = 'Today Carry not spilled', wet = 'Today spilled 3 % not closed';
    expect(['spilled', 'not spilled', 'not', 'not closed', 'today not spilled'].map((wanted) => [isFound(dry, wanted), isFound(wet, wanted)])).toEqual([[false, true], [true, false], [true, true], [false, true], [true, false]]);
  });
});

describe('figures of a session', () => {
  const some = (engaged: number[]): Motion => ({
    ...motion, t_s: [5, 15], q: [[0], [1]],
    target: { t_s: [5, 5.1, 5.2, 9, 9.1], p: [], q: [], engaged, lateral: [1, 3, 9, 4, null], error_mm: [10, 30, 90, 20, 20] }, off_target_mm: 20,
    events: [{ t_s: 5, kind: 'state', what: engaged[0] ? 'engaged' : 'ready', why: '' }, { t_s: 6, kind: 'spill', what: 'spilled', why: '' }, { t_s: 7, kind: 'limit', what: 'reach', why: '' }],
  });
  it('are means over the time that was led, gaps left out', () => {
    const figures = new Map(summaryOf(new Player(some([1, 1, 1, 1, 1]))).map(([what, text]) => [what, text]));
    expect(figures.get('Length')).toBe('0:10');
    expect(Number(figures.get('Lateral mean, m/s²'))).toBeCloseTo((1 + 3 + 4) / 3, 2);
    expect(figures.get('Lateral peak, m/s²')).toBe('4.00');
    expect(figures.get('Tracking error, mm')).toBe('20.0');
    expect(figures.get('Engaged')).toBe('10.0 s');
    expect(figures.get('Spilled')).toBe('at 0:01');
    expect(figures.get('Active limits')).toBe('1 ×, 6.0 a minute');
  });
  it('are of what was measured, where that was recorded', () => {
    const measured: Motion = { ...some([1, 1, 1, 1, 1]), felt: { t_s: [5, 5.1, 5.2, 5.3], mean: [0.5, 1, 1.5, 1], largest: [1, 2, 6, 3] }, slosh: { mean: 1.2, largest: 6 } };
    const figures = new Map(summaryOf(new Player(measured)).map(([what, text]) => [what, text])), player = new Player(measured);
    expect(figures.get('Lateral mean, m/s²')).toBe('1.20');
    expect(figures.get('Lateral peak, m/s²')).toBe('6.00');
    player.seek(0.25);
    expect(player.felt).toBe(6);
    expect(curveOf(measured, 'slosh', 5)[1]).toEqual([1, 2, 6, 3]);
  });
  it('are the report\'s of what was measured, not counted anew from times that are rounded', () => {
    const felt = { t_s: [5, 6.0001], mean: [2, 90], largest: [2, 90], count: [1, 1] };
    const of = (slosh: NonNullable<Motion['slosh']> | null) => new Map(summaryOf(new Player({ ...some([1, 1, 1, 1, 1]), felt, slosh })).map(([what, text]) => [what, text]));
    expect(['mean', 'peak'].map((what) => of({ mean: 5.684, largest: 12.3 }).get(`Lateral ${what}, m/s²`))).toEqual(['5.68', '12.30']);
    expect(['mean', 'peak'].map((what) => of(null).get(`Lateral ${what}, m/s²`))).toEqual(['–', '–']);
  });
  it('tell each spill with how much, and which of two did better', () => {
    const spilling = (...spills: [number, number][]): Player => new Player({ ...some([1]), events: [{ t_s: 5, kind: 'state', what: 'engaged', why: '' }, ...spills.map(([t_s, amount]) => ({ t_s, kind: 'spill', what: '', why: '', amount }))] });
    const of = (player: Player) => summaryOf(player).find(([what]) => what === 'Spilled')!;
    expect([spilling(), spilling([7, 0.744]), spilling([7, 0.5], [9, 1]), spilling([6, 0.1], [7, 0.2], [8, 0.3], [9, 0.05])].map((player) => of(player)[1]))
      .toEqual(['no', '74.4 % at 0:02', '2 ×, 12.0 a minute: 50.0, 100 % at 0:02, 0:04', '4 ×, 24.0 a minute, 65.0 % in all']);
    expect([betterOf(of(spilling([7, 1])), of(spilling())), betterOf(of(spilling()), of(spilling([7, 0.1]))), betterOf(of(spilling()), of(spilling()))]).toEqual([1, 0, -1]);
    expect(betterOf(['Length', '0:10', null, ''], ['Length', '0:12', null, ''])).toBe(-1);
  });
  it('are compared by the minute that was led, not by counts', () => {
    const led = (seconds: number, limits: number): Player => new Player({ ...motion, t_s: [0, seconds], q: [[0], [1]], events: [{ t_s: 0, kind: 'state', what: 'engaged', why: '' }, ...Array.from({ length: limits }, (_, i) => ({ t_s: i, kind: 'limit', what: 'reach', why: '' }))] });
    const held = [led(196, 124), led(796, 467)].map((player) => summaryOf(player).find(([what]) => what === 'Active limits')!);
    expect(held.map(([, text]) => text)).toEqual(['124 ×, 38.0 a minute', '467 ×, 35.2 a minute']);
    expect(betterOf(held[0]!, held[1]!)).toBe(1);
    expect(rateText(2, 0)).toBe('2 ×');
  });
  it('say first which of two spilled less, and whether both made the same motion', () => {
    // A circle, 10 times a second, once around in 6.3 s, `late` after the begin; `size` in m.
    const led = (size: number, late: number, events: Motion['events'] = [], speed = 1): Player => {
      const t_s = Array.from({ length: 80 }, (_, i) => 0.1 * i), angle = (t: number): number => speed * Math.max(0, t - late);
      return new Player({ ...motion, t_s: [0, 8], q: [[0], [1]], events: [{ t_s: late, kind: 'state', what: 'engaged', why: '' }, ...events],
        target: { t_s, p: t_s.map((t) => [0.4 + size * Math.cos(angle(t)), size * Math.sin(angle(t)), 0.3]), q: [], engaged: t_s.map((t) => (t >= late ? 1 : 0)), lateral: [], error_mm: [] } });
    };
    expect(alikeFor(led(0.2, 0), led(0.2, 1.5))).toBeCloseTo(6.4, 0);
    expect(alikeFor(led(0.2, 0), led(0.1, 0))).toBe(0);
    expect(alikeFor(led(0.2, 0), led(0.2, 0, [], 1.5))).toBe(0);
    expect([alikeFor(led(0.2, 0), led(0.2, 7)), alikeFor(led(0, 0), led(0, 0)), alikeFor(led(0.2, 0), new Player(motion))]).toEqual([null, null, null]);
    const spill = [{ t_s: 3, kind: 'spill', what: '', why: '', amount: 0.4 }];
    const told = (one: Player, other: Player): string => verdictOf([one, other], ['First', 'Second'], [summaryOf(one), summaryOf(other)]);
    expect(told(led(0.2, 0, spill), led(0.2, 0))).toBe('“Second” did better: it spilled nothing in 8.0\u00a0s while engaged. “First” spilled once, 40.0 % of a glass, in 8.0\u00a0s. Both hands made the same motion for 7.9\u00a0s from their first engagement.');
    const idle = new Player({ ...some([0, 0, 0, 0, 0]), off_target_mm: null });
    expect(told(led(0.2, 0, spill), idle)).toBe('“Second” was never engaged: there is nothing to compare.');
    expect(summaryOf(idle).every(([, , value]) => value === null)).toBe(true);
    expect(told(led(0.2, 0), led(0.1, 0))).toBe('Neither spilled. The hands moved differently, which may be why.');
    expect(told(led(0.2, 0, spill), led(0.2, 0, [...spill, ...spill]))).toMatch(/^“First” did better: it spilled once, 40\.0 % of a glass, in 8\.0\u00a0s .* “Second” spilled 2 times, 80\.0 % of a glass in all, in 8\.0\u00a0s\./);
    expect(told(led(0.2, 0, spill), led(0.2, 0, spill))).toMatch(/^Both spilled about as much/);
  });
  it('are told in words to who cannot see the curves', () => {
    const player = new Player(some([1, 1, 1, 1, 1]));
    expect(statesTold(player)).toBe('engaged for 10.0 s');
    expect(told(curveOf(player.motion, 'slosh', 5), (value) => value.toFixed(2), 'm/s²')).toBe('at most 9.00 m/s², at 0:00');
    expect(told([[], []], String, 'mm')).toBe('not recorded');
  });
  it('keep the least of what is left to the rim', () => {
    const at = Array.from({ length: 9000 }, (_, i) => 5 + i / 1000), freeboard_mm = at.map((_, i) => (i === 3601 ? 2 : 10));
    const zeros = at.map(() => 0), curve = curveOf({ ...motion, liquid: { t_s: at, tilt: zeros.map(() => [0, 0]), freeboard_mm, spilled: zeros, spilled_share: zeros } }, 'rim', 5);
    expect(curve[1]).toHaveLength(3000);
    expect(Math.min(...curve[1] as number[])).toBe(2);
    expect(told(curve, String, 'mm', true)).toBe('at least 2 mm, at 0:03');
    const emptied = curveOf({ ...motion, liquid: { t_s: [5, 5.1], tilt: [[0, 0], [0, 0]], freeboard_mm: [4, 0], spilled: [0, 1], spilled_share: [0, 1] } }, 'rim', 5);
    expect(emptied[1]).toEqual([4, null]); // an empty glass has no wave
  });
  it('are told at a time, where it is known', () => {
    const curve: [number[], (number | null)[]] = [[0, 0.1, 2, 2.1], [3, 4, null, 5]];
    expect([-0.1, 0, 0.05, 0.1, 0.9, 1.5, 2, 2.2].map((at) => valueAt(curve, at))).toEqual([null, 3, 3, 4, 4, null, null, 5]);
    expect([fine(59.96), fine(59.94), fine(119.996, 2), fine(32.033, 2), fine(0)]).toEqual(['1:00.0', '0:59.9', '2:00.00', '0:32.03', '0:00.0']);
  });
  it('tell the joint that turned fastest, by its name where the arm is like the one of now', () => {
    const moved: Motion = { name: 'd', t_s: [5, 5.1, 5.2, 5.2], q: [[0, 0, 0], [0.1, -0.2, 9], [0.2, -0.2, 9], [0.2, -0.2, 9]] };
    const joints = [{ name: 'elbow_joint' }, { name: 'wrist_3_joint' }, { name: 'rail', type: 'prismatic' as const }];
    const { speed, joint } = fastest(moved, joints);
    expect(speed.map((value) => value && Number(value.toFixed(6)))).toEqual([2, 1, null, null]);
    expect(joint).toEqual([1, 0, -1, -1]);
    expect([4.9, 5.05, 5.15, 5.3].map((at) => fastestAt(moved, joints, at))).toEqual(['', 'wrist 3', 'elbow', '']);
    expect(fastestAt(moved, [], 5.05)).toBe('joint 3');
  });
  it('are those that were chosen in this browser, and the usual three where it keeps nothing', () => {
    const usual = CURVES.filter((name) => KINDS[name].byDefault);
    expect(usual).toEqual(['slosh', 'rim', 'off']);
    const before = Object.getOwnPropertyDescriptor(globalThis, 'localStorage'), kept = new Map<string, string>();
    const become = (storage: unknown): unknown => Object.defineProperty(globalThis, 'localStorage', { value: storage, configurable: true });
    try {
      become({ getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, value: string) => kept.set(key, value) });
      expect([...keptCurves()]).toEqual(usual);
      keepCurves(new Set(['speed', 'slosh']));
      expect([...keptCurves()]).toEqual(['slosh', 'speed']);
      keepCurves(new Set());
      expect([...keptCurves()]).toEqual([]);
      const refuse = (): never => { throw new Error('a private window'); };
      become({ getItem: refuse, setItem: refuse });
      keepCurves(new Set(['speed']));
      expect([...keptCurves()]).toEqual(usual);
    } finally {
      if (before) Object.defineProperty(globalThis, 'localStorage', before); else Reflect.deleteProperty(globalThis, 'localStorage');
    }
  });
  it('hold the largest wave since the glass was filled', () => {
    const events = [{ t_s: 5, kind: 'state', what: 'engaged', why: '' }, { t_s: 8, kind: 'refill', what: 'a full glass', why: '' }];
    const player = new Player({ ...some([1]), events, liquid: { t_s: [5, 6, 7, 8, 9], tilt: Array(5).fill([0, 0]) as [number, number][], freeboard_mm: [10, 2, 9, 10, 8], spilled: [0, 1, 1, 0, 0], spilled_share: [0, 0.5, 0.5, 0, 0] } });
    player.seek(2.5);
    expect(player.freeboard()).toEqual({ now: 9, least: 2 });
    player.seek(4.5);
    expect(player.freeboard()).toEqual({ now: 8, least: 8 });
  });
  it('count a stop once, by whomever, also where a reset did not end the fault', () => {
    const states = (...whats: string[]) => whats.map((what, i) => ({ t_s: 5 + i, kind: 'state', what, why: '' }));
    expect(stopsOf(states('ready', 'engaged', 'stopping', 'fault', 'idle', 'fault', 'idle', 'ready', 'engaged', 'fault'))).toBe(2);
    expect(stopsOf(states('stopping', 'ready'))).toBe(1);
    expect(stopsOf(states('idle', 'ready', 'engaged', 'holding'))).toBe(0);
  });
  it('are none where nobody led', () => {
    const of = (player: Player, wanted: string) => summaryOf(player).find(([what]) => what === wanted)![1];
    expect(of(new Player(some([0, 0, 0, 0, 0])), 'Lateral mean, m/s²')).toBe('–');
    expect(of(new Player(motion), 'Spilled')).toBe('no');
  });
});

describe('the zoom of the time line', () => {
  it('keeps what is under the pointer, within the recording and its closest look', () => {
    expect(zoomed([0, 10], 5, 0.5, 10)).toEqual([2.5, 7.5]);
    expect(zoomed([0, 10], 0, 0.5, 10)).toEqual([0, 5]);
    expect(zoomed([2.5, 7.5], 7.5, 1.5, 10)).toEqual([0, 7.5]);
    expect(zoomed([2.5, 7.5], 5, Infinity, 10)).toEqual([0, 10]);
    expect(zoomed([0, 10], 5, 1e-9, 10)).toEqual([4.75, 5.25]);
    expect(zoomed([0, 0.2], 0.1, 0.5, 0.2)).toEqual([0, 0.2]);
  });
  it('goes along where the time leaves it', () => {
    expect(holding([2, 4], 3, 10)).toEqual([2, 4]);
    expect(holding([2, 4], 5, 10)).toEqual([4, 6]);
    expect(holding([2, 4], 9.9, 10)).toEqual([8, 10]);
  });
});
