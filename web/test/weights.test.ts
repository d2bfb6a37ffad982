import { describe, expect, it } from 'vitest';
import { STEPS, areChanged, positionOf, spokenWeight, weightAt, weightText } from '../src/weights';

const even = { min: 0, max: 20, logarithmic: false }, factors = { min: 0.01, max: 1000, logarithmic: true };

describe('weights', () => {
  it('are even between the ends', () => {
    expect(weightAt(even, 0)).toBe(0);
    expect(weightAt(even, 3)).toBe(0.3);
    expect(weightAt(even, STEPS)).toBe(20);
  });

  it('go by factors, from 0', () => {
    expect(weightAt(factors, 0)).toBe(0);
    expect(weightAt(factors, 1)).toBe(0.01);
    expect(weightAt(factors, STEPS)).toBe(1000);
    expect(weightAt(factors, 2) / weightAt(factors, 1)).toBeLessThan(1.2);
  });

  it('come back from where the slider stands', () => {
    for (const range of [even, factors]) {
      for (let position = 0; position <= STEPS; ++position) expect(Math.abs(positionOf(range, weightAt(range, position)) - position)).toBeLessThanOrEqual(1);
      for (const end of [0, STEPS]) expect(positionOf(range, weightAt(range, end))).toBe(end);
    }
  });

  it('are another profile\'s, or somebody\'s own', () => {
    expect(areChanged([0, 0.4, 1500], [0, 0.4000001, 1500])).toBe(false);
    expect([areChanged([0, 0.4], [0.01, 0.4]), areChanged([0, 0.4], [0, 0]), areChanged([0, 0.4], [0, 0.41])]).toEqual([true, true, true]);
    expect(areChanged([1], [])).toBe(false);
  });

  it('beyond the ends stand at the ends, and are told as they are', () => {
    expect(positionOf(even, 500)).toBe(STEPS);
    expect(positionOf(factors, 1e-9)).toBe(1);
    expect(weightText(500)).toBe('500');
    expect(weightText(0.012345)).toBe('0.0123');
    expect(weightText(0)).toBe('0');
    const words = { label: 'Weight of lateral specific force', low: '0: ignores the liquid', high: 'calm, follows late' };
    expect(spokenWeight(factors, 0, words)).toBe('0, ignores the liquid');
    expect(spokenWeight(even, 500, words)).toMatch(/^500, \d+ % of the way to: calm, follows late$/);
  });
});
