import { describe, expect, it } from 'vitest';
import { COARSEST, Pace } from '../src/scene/pace';

/** Draws for so many seconds; the time of a frame may depend on the level. */
function draw(pace: Pace, seconds: number, time: (level: number) => number): number {
  for (let t = 0; t < seconds; t += time(pace.level)) pace.take(time(pace.level));
  return pace.level;
}

describe('Pace', () => {
  it('leaves what is fast enough as it is', () => {
    expect(draw(new Pace(0), 60, () => 1 / 60)).toBe(0);
  });

  it('coarsens until the picture comes in time, and no further', () => {
    const times = [0.05, 0.035, 0.016, 0.01];
    expect(draw(new Pace(0), 60, (level) => times[level]!)).toBe(2);
  });

  it('ends at the coarsest, within seconds where a picture takes long', () => {
    const times = [1.6, 0.9, 0.4, 0.1];
    expect(draw(new Pace(0), 20, (level) => times[level]!)).toBe(COARSEST);
  });

  it('takes back a step that did not help, and does not try again and again', () => {
    const pace = new Pace(0), seen = new Set<number>();
    draw(pace, 4, (level) => { seen.add(level); return 1 / 30; });
    expect([...seen]).toEqual([0, 1]);
    expect(draw(pace, 60, (level) => { seen.add(level); return 1 / 30; })).toBe(0);
    expect(seen.has(2)).toBe(false);
  });

  it('forgives hiccups, and the time that a page was hidden', () => {
    const pace = new Pace(0);
    for (let i = 0; i < 50; ++i) {
      pace.take(i % 2 ? 0.4 : 3600);
      draw(pace, 1, () => 1 / 60);
    }
    expect(pace.level).toBe(0);
  });

  it('judges anew after a restart', () => {
    const pace = new Pace(0);
    draw(pace, 10, () => 1 / 30);
    pace.restart();
    expect(draw(pace, 10, (level) => (level === 0 ? 1 / 30 : 1 / 60))).toBe(1);
  });
});
