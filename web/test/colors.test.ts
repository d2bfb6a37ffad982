import page from '../src/colors.css?raw';
import pageStyle from '../src/style.css?raw';
import { describe, expect, it } from 'vitest';
import { inOrder } from '../src/profiles';

const colorsOf = (style: string, prefix: string): Record<string, string> =>
  Object.fromEntries([...style.matchAll(new RegExp(`--(${prefix}-[\\w-]+): (#[0-9a-f]{6});`, 'g'))].map(([, name, color]) => [name!, color!]));

describe('colours', () => {
  it('of the button that deletes can be read, whatever else colours the buttons of the list', () => {
    const rule = /#recordings button\[data-sure\] \{ background: var\(--(state-\w+)\); color: #fff; \}/.exec(pageStyle), channels = (hex: string): number[] => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
    const light = (hex: string): number => channels(hex).map((c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i]!, 0);
    const { [rule?.[1] ?? '']: background } = colorsOf(page, 'state');
    expect(1.05 / (light(background!) + 0.05)).toBeGreaterThan(4.5);
  });

  it('have one meaning each', () => {
    const all = [...Object.values(colorsOf(page, 'profile')), ...Object.values(colorsOf(page, 'state'))];
    expect(new Set(all).size).toBe(all.length);
  });
});

describe('profiles', () => {
  it('come as P1, P2, P3, then the others as the server has them', () => {
    const labels = ['Anti-slosh (P2)', 'Carry', 'Follow', 'Tracking (P1)', 'Waiter (P3)'];
    const profiles = labels.map((label, index) => ({ index, label, name: label, weights: [] }));
    expect(inOrder(profiles).map(({ label }) => label)).toEqual(['Tracking (P1)', 'Anti-slosh (P2)', 'Waiter (P3)', 'Carry', 'Follow']);
  });
});
