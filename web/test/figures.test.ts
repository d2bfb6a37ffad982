import { describe, expect, it } from 'vitest';
import { clock, latencyText, meanOffText, offText, partText, scaleText, secondsText, sloshText, spanText, wholeText } from '../src/figures';
import { COLUMNS, FELT, LED, Moment, MOST, noteOf, OFF, totalsOf } from '../src/plots/comparison';
import { History } from '../src/plots/history';
import { Runs } from '../src/plots/runs';
import type { StateMessage, Tool } from '../src/protocol';

describe('figures', () => {
  it('are written alike wherever they stand, and as a dash where they are not known', () => {
    expect([sloshText(5.084), offText(4.99), meanOffText(4.99), latencyText(2.44), scaleText(0.15), scaleText(1)]).toEqual(['5.08', '5', '5.0', '2.4', '0.15', '1']);
    expect([wholeText(-0.4), wholeText(-1.4), wholeText(NaN), secondsText(9.9), secondsText(9.97), secondsText(38.6)]).toEqual(['0', '-1', 'NaN', '9.9', '10', '39']);
    expect([sloshText(null), offText(undefined), latencyText(NaN)]).toEqual(['–', '–', '–']);
    expect([spanText(2.06), spanText(59.96), spanText(75.2), clock(605.9)]).toEqual(['2.1 s', '1:00', '1:15', '10:05']);
  });
});

describe('parts of an arm', () => {
  it('are called as people call them', () => {
    const names = ['forearm_5', 'gripper_body', 'gripper_fingers', 'wrist_3_joint', 'wrist_1_0', 'upper_arm_2', 'glass_bottom', 'base_link_0', 'joint_7', 'shoulder_pan_joint', 'finger_1'];
    expect(names.map(partText)).toEqual(['forearm', 'gripper', 'gripper fingers', 'wrist 3', 'wrist 1', 'upper arm', 'glass', 'base', 'joint 7', 'shoulder pan', 'finger 1']);
  });
});

describe('the last minute', () => {
  /** States 60 times a second, a row of the history after every fourth. @param led whether the arm is engaged then */
  function minute(seconds: number, led: (t: number) => boolean, profile: (t: number) => number = () => 0): History {
    const history = new History(COLUMNS), moment = new Moment();
    for (let k = 0; k <= 60 * seconds; ++k) {
      const t = k / 60;
      if (moment.profile >= 0 && moment.profile !== profile(t)) history.push(t, moment.end());
      moment.take(t, profile(t), led(t), t < 2 ? 3 : 0.1, led(t) ? 20 : null);
      if (k % 4 === 0) history.push(t, moment.end());
    }
    return history;
  }

  it('counts the time that the hand led, and none that was idle', () => {
    const { led, felt, most, off } = totalsOf(minute(48, (t) => t < 2), 0);
    expect(led).toBeCloseTo(2, 1);
    expect(felt).toBeCloseTo(3, 6);
    expect(most).toBe(3);
    expect(off).toBeCloseTo(20, 6);
    expect(totalsOf(minute(10, () => false), 0).led).toBe(0);
  });

  it('gives each profile its own time', () => {
    const history = minute(4, () => true, (t) => (t < 1 ? 0 : 1));
    expect(totalsOf(history, 0).led).toBeCloseTo(1, 1);
    expect(totalsOf(history, 1).led).toBeCloseTo(2, 1); // the first second is as the other left it
  });

  it('books what went over the rim by another profile\'s swing on that one', () => {
    const history = new History(COLUMNS), moment = new Moment();
    for (const [t, out, by] of [[0, 0, 1], [0.1, 0.2, 0], [0.2, 0.5, 1]] as const) {
      moment.take(t, 1, true, 1, 1, out, by);
      history.push(t, moment.end());
      const before = moment.endBefore();
      if (before) history.push(t, before);
    }
    expect([totalsOf(history, 0).spilt, totalsOf(history, 1).spilt]).toEqual([expect.closeTo(0.2), expect.closeTo(0.3)]);
    expect([totalsOf(history, 0).led, totalsOf(history, 1).led]).toEqual([0, expect.closeTo(0.2)]);
  });

  it('books what went over the rim on who led then', () => {
    const history = new History(COLUMNS), moment = new Moment();
    const at = (t: number, profile: number, out: number) => {
      if (moment.profile >= 0 && moment.profile !== profile) history.push(t, moment.end());
      moment.take(t, profile, true, 1, 1, out);
      history.push(t, moment.end());
    };
    [0, 0.1, 0.1, 0, 0.3].forEach((out, i) => at(0.1 * i, i < 2 ? 0 : 1, out));
    expect([totalsOf(history, 0).spilt, totalsOf(history, 1).spilt]).toEqual([expect.closeTo(0.1), expect.closeTo(0.3)]);
  });

  it('keeps the largest of what came between two rows', () => {
    const moment = new Moment();
    for (const [t, felt] of [[0, 1], [0.01, 7], [0.02, 2]] as const) moment.take(t, 0, true, felt, 10);
    expect(moment.largest).toBe(7);
    const row = [...moment.end()];
    expect([row[LED], row[FELT], row[MOST], row[OFF]]).toEqual([expect.closeTo(0.02), expect.closeTo(4.5), 7, expect.closeTo(10)]);
    expect(moment.largest).toBeNull();
  });
});

describe('whole demo motions', () => {
  /** A demo motion of 2 s, with this profile from its start or from 1 s on, as states 10 times a second. */
  class Shown {
    readonly runs = new Runs();
    #t = 0;
    say(state: string, profile: number, reason_code = 'gripped', playback = 0, out = 0): void {
      this.#t += 0.1;
      const tool = { state, reason_code, reason_leader: 'recording', liquid: { lateral: 2 + profile, spilled_share: out } };
      this.runs.take({ now_s: this.#t, controls: { playback, profile } } as StateMessage, tool as unknown as Tool, 10);
    }
    run(profile: number, first = profile, end = 'released'): void {
      this.say('ready', first);
      for (let i = 0; i < 20; ++i) this.say('engaged', i < 10 ? first : profile, 'gripped', 0, i < 5 ? 0 : 0.1 * profile);
      this.say('ready', profile, end, 0, 0.1 * profile);
    }
  }
  const name = (profile: number): string => ['Carry', 'Tracking'][profile]!, title = (): string => 'Carrying';

  it('are compared once several profiles led all of one', () => {
    const shown = new Shown();
    shown.run(0);
    expect(shown.runs.compared).toBeNull();
    expect(noteOf(null, [0, 1], shown.runs, name, title)).toContain('Complete so far: Carry: Carrying; Tracking: none.');
    expect(noteOf(null, [0], shown.runs, name, title)).toBe('');
    expect(noteOf(null, [], shown.runs, name, title)).toBe('The arm was not engaged in the last minute.');
    shown.run(1, 0);
    shown.run(1, 1, 'silent');
    expect(shown.runs.compared).toBeNull();
    shown.run(1);
    expect(shown.runs.compared).toBe(0);
    expect(noteOf(0, [0, 1], shown.runs, name, title)).toBe('Each profile over its last complete run of the demo motion Carrying.');
    const { led, felt, off, spilt } = shown.runs.of(0, 1)!;
    expect([led, felt, off, spilt]).toEqual([expect.closeTo(2, 5), expect.closeTo(3, 5), expect.closeTo(10, 5), expect.closeTo(0.1, 5)]);
    for (let i = 0; i < 700; ++i) shown.say('ready', 1, 'released', -1);
    expect(shown.runs.compared).toBeNull(); // long ago
  });
});

describe('the plots of a young session', () => {
  it('draws no line over a time of which nothing is known', () => {
    const history = new History(1);
    for (const t of [0, 0.5, 1, 9, 9.5]) history.push(t, [1]);
    expect(history.series[0]).toEqual([1, 1, 1, null, 1, 1]);
    expect(history.times[3]).toBeLessThan(1.2);
  });

  it('grow with it to a minute', () => {
    const history = new History(1), spans: number[] = [];
    for (let t = 100; t <= 200; ++t) {
      history.push(t, [0]);
      if (t % 10 === 5) spans.push(history.span);
    }
    expect(spans).toEqual([10, 20, 30, 40, 50, 60, 60, 60, 60, 60]);
  });
});
