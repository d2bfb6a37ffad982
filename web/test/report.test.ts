import { describe, expect, it } from 'vitest';
import { chain } from '../src/report/arm';
import { atLeast, clockTicks, columns, format, including, logRange } from '../src/report/charts';
import type { Result, Session } from '../src/report/data';
import { compared, dateOf, noteOf, rowsOf, spillsText, timeText, titleOf, toldSpills } from '../src/report/head';
import { stacked } from '../src/report/plots';

describe('the head of a report', () => {
  it('says what people call it and when it was made', () => {
    expect(dateOf('2026-11-25_15-20-10')).toBe('25 November 2026, 15:20:10');
    expect(dateOf('2026-11-25_15-20-10_2')).toBe('25 November 2026, 15:20:10 (2)');
    expect([dateOf('2026-13-25_15-20-10'), dateOf('hand.csv')]).toEqual(['', '']);
    const title = (recording: string, label = '', recorded = '') => titleOf({ recording, title: label, recorded });
    expect(title('2026-11-25_15-20-10')).toBe('25 November 2026, 15:20:10');
    expect(title('2026-11-25_15-20-10', '', '2026-11-25_16-00-00 UTC')).toBe('25 November 2026, 16:00:00');
    expect(title('2026-11-25_15-20-10', 'a <label>')).toBe('a <label>, 25 November 2026, 15:20:10');
    expect(title('renamed', 'a label')).toBe('a label');
    expect(title('renamed', 'a label', '2026-11-26_01-02-03 UTC')).toBe('a label, 26 November 2026, 01:02:03 UTC');
    expect(title('renamed')).toBe('renamed');
  });

  it('names the worst spills first, and folds the others and all traces', () => {
    const spill = (amount: number, i = 0) => ({ t_s: i, kind: 'spill', what: '', why: '', amount });
    const { first, rest, words } = toldSpills([0.002, 0.0001, 0.036, 1, 0.007, 0.006, 0.9996].map(spill));
    expect([first, rest].map((list) => list.map(({ amount }) => amount))).toEqual([[1, 0.9996, 0.036, 0.007, 0.006], [0.002, 0.0001]]);
    expect(words).toBe('2 more, of at most 0.2 %');
    expect(toldSpills([spill(0.036), spill(0.0001)]).words).toBe('1 more, of less than 0.1 %');
    expect(toldSpills([spill(0.0001)]).first.length).toBe(1);
  });

  it('says spills in a line', () => {
    expect([spillsText(0, 0), spillsText(1, 0.744), spillsText(2, 1e-4), spillsText(3, 0.036)]).toEqual(['0', 'once, 74.4 %', '2 ×, each less than 0.1 %', '3 ×, at most 3.6 %']);
  });

  it('compares each profile with the first, but not one that hardly led', () => {
    expect([compared(13, 100, 'P1'), compared(26, 10, 'P1'), compared(1e4, 10, 'P1'), compared(null, 1, 'P1'), compared(1, 0, 'P1')]).toEqual(['13 % of P1', '2.6 × P1', '', '', '']);
  });

  it('has no slosh of a gripper, and no spills where nobody knows', () => {
    const metrics = { spills: null, spilled_share: null, spills_per_minute: null, lateral_mean: 1, lateral_max: 2, position_mean: 0.01, position_rms: 0.02, solve_mean: 50 };
    const result = { metrics, led_s: 61.5 } as Result, session = { has_glass: true } as Session;
    const rows = (of: Result, during?: Session) => rowsOf({ profiles: [of], ...(during && { session: during }) }, of).map(([what, value]) => `${what}: ${value}`);
    expect(rows(result)).toEqual(['lateral specific force, mean: 1.00', 'tracking error, RMS: 20.0', 'solve time, mean: 50']);
    expect(rows(result, session)).toEqual(['engaged: 1:01.50', 'lateral specific force, mean: 1.00', 'lateral specific force, peak: 2.00', 'tracking error, mean: 10.0', 'solve time, mean: 50']);
    expect(rows(result, { ...session, has_glass: false })).toEqual(['engaged: 1:01.50', 'tracking error, mean: 10.0', 'solve time, mean: 50']);
    const spilled = { ...result, metrics: { ...metrics, spills: 2, spilled_share: 0.5, spills_per_minute: 1.95 } };
    expect(rows(spilled, session).slice(1, 3)).toEqual(['spilled: 2 ×, at most 50.0 %', 'spills per minute engaged: 1.95']);
  });

  it('says how curves came about', () => {
    expect(noteOf({ steps_per_point: 1, commands_per_point: 1 })).toBe('The figures in the tables use every sample that was recorded.');
    expect(noteOf({ steps_per_point: 3, commands_per_point: 4 })).toMatch(/3 planning steps.*4 commands/);
  });
});

describe('plots of a report', () => {
  it('have times as the rest of the page', () => {
    expect([[58, 60, 62], [-0.5, 0, 0.5], [700, 700.02, 700.04]].map(clockTicks)).toEqual([['0:58', '1:00', '1:02'], ['', '0:00.0', '0:00.5'], ['11:40.00', '11:40.02', '11:40.04']]);
    expect([timeText(65.432), timeText(-1), timeText(null)]).toEqual(['1:05.43', '0:00.00', '–']);
  });

  it('break where nothing was planned for a while', () => {
    const t = [0, 0.05, 0.1, 2, 2.05], [times, values] = columns([{ t, values: [1, 2, 3, 4, 5] }]);
    expect([...times!]).toEqual([0, 0.05, 0.1, 1.05, 2, 2.05]);
    expect([...values!]).toEqual([1, 2, 3, null, 4, 5]);
  });

  it('stack terms so that the first column is their sum, in % if so wanted', () => {
    const profile = { t: [0, 0.05], shares: [[1, 0], [3, 0]] };
    expect(stacked(profile, false).slice(1).map((column) => [...column!])).toEqual([[4, 0], [1, 0]]);
    expect(stacked(profile, true).slice(1).map((column) => [...column!])).toEqual([[100, 0], [25, 0]]);
  });

  it('have round logarithmic ends, which are never zero', () => {
    const range = (min: number, max: number, ...more: number[]) => logRange(...more)(null as never, min, max);
    for (let exponent = -3; exponent < 3; exponent += 0.01) {
      const [low] = range(10 ** exponent, 30 * 10 ** exponent);
      expect(Number(low.toPrecision(1))).toBe(low);
    }
    expect(range(0, 0)).toEqual([0.1, 1]);
    expect(range(0, 5, 20)[1]).toBe(26);
  });

  it('have room above and below', () => {
    expect(including(0)(null as never, 1, 2)).toEqual([0, 2.12]);
    expect(atLeast(0.1)(null as never, 1, 1)).toEqual([0.95, 1.05]);
    expect([format(0.012345, 'm'), format(123.456), format(null)]).toEqual(['0.012\u00a0m', '123', '–']);
  });
});

describe('the arm of a report', () => {
  it('stands where its joints put it, turning and sliding', () => {
    const origin = (x: number) => [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
    const robot = { joints: [{ name: 'a', origin: origin(0), axis: [0, 0, 1] as [number, number, number] }, { name: 'b', type: 'prismatic' as const, origin: origin(1), axis: [1, 0, 0] as [number, number, number] }], tools: [{ name: 't', link: 2, origin: origin(0.5) }] };
    const tool = chain(robot, [Math.PI / 2, 0.25]).points.at(-1)!;
    [0, 1.75, 0].forEach((expected, i) => expect(tool[i]).toBeCloseTo(expected));
  });
});
