import { describe, expect, it } from 'vitest';
import { clock, latencyText, meanOffText, offText, scaleText, sloshText, spanText } from '../src/figures';
import { FELT, LED, Moment, MOST, OFF, totalsOf } from '../src/plots/comparison';
import { History } from '../src/plots/history';

describe('figures', () => {
  it('are written alike wherever they stand, and as a dash where they are not known', () => {
    expect([sloshText(5.084), offText(4.99), meanOffText(4.99), latencyText(2.44), scaleText(0.15), scaleText(1)]).toEqual(['5.08', '5', '5.0', '2.4', '0.15', '1']);
    expect([sloshText(null), offText(undefined), latencyText(NaN)]).toEqual(['–', '–', '–']);
    expect([spanText(2.06), spanText(59.96), spanText(75.2), clock(605.9)]).toEqual(['2.1 s', '1:00', '1:15', '10:05']);
  });
});

describe('the last minute', () => {
  /** States 60 times a second, a row of the history after every fourth. @param led whether the hand leads then */
  function minute(seconds: number, led: (t: number) => boolean, profile: (t: number) => number = () => 0): History {
    const history = new History(5), moment = new Moment();
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
    expect(totalsOf(history, 1).led).toBeCloseTo(3, 1);
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
