import * as THREE from 'three';
import { describe, expect, it } from 'vitest';
import { Lately } from '../src/scene/lately';

const at = (x: number): THREE.Vector3 => new THREE.Vector3(x, 0, 0);
const near = (x: number) => (place: THREE.Vector3): boolean => Math.abs(place.x - x) < 0.05;

describe('what was seen lately', () => {
  it.each([2, 10, 60, 240])('is known for a moment, at %d pictures a second', (rate) => {
    const lately = new Lately();
    for (let i = 0; i <= 3 * rate; ++i) lately.see(at(i / rate), i / rate); // 1 m/s
    expect(lately.find(near(3), 3)).toBe(true);
    if (rate > 2) expect(lately.find(near(2.45), 3)).toBe(true);
    expect(lately.find(near(2.2), 3)).toBe(false);
    expect(lately.find(near(3), 4)).toBe(false);
  });

  it('is asked from the newest on', () => {
    const lately = new Lately(), asked: number[] = [];
    for (let i = 0; i < 5; ++i) lately.see(at(i), i / 10);
    expect(lately.find(({ x }) => { asked.push(x); return x === 2; }, 0.4)).toBe(true);
    expect(asked).toEqual([4, 3, 2]);
  });

  it('is nothing before the first picture', () => {
    expect(new Lately().find(() => true, 5)).toBe(false);
  });
});
