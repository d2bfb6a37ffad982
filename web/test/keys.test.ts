import * as THREE from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Hand } from '../src/hand';
import { Keys } from '../src/input/keys';
import { PRESETS } from '../src/scene/presets';
import { LOOKS_THE_SAME, type Session, STAYS_UPRIGHT } from '../src/session';

describe('keys', () => {
  let at: { p: number[]; q: number[] } = { p: [], q: [] };
  let press: (event: object) => void = () => {};
  let heading = 0;
  /** m, base frame, that the target moves within a second of this key; and where its x axis points then. */
  const after = (code: string): { moved: number[]; axis: number[] } => {
    const session = { state: { controls: { scale: 0.5, yaw: 0.7 } } } as unknown as Session; // keys depend on neither
    const hand = new Hand({ send: (message) => { at = structuredClone(message) as unknown as typeof at; return true; } }, () => 0, () => true);
    const keys = new Keys(() => hand, session, () => false, () => heading);
    press({ target: null, code, timeStamp: 0, preventDefault: () => {} });
    keys.update(1);
    const c = Math.cos(0.7), s = Math.sin(0.7), [x, y, z] = [at.p[0]! * 0.5, at.p[1]! * 0.5, (at.p[2]! - 1) * 0.5];
    const turn = new THREE.Quaternion(...(at.q as [number, number, number, number]));
    const axis = new THREE.Vector3(turn.x, turn.y, turn.z).applyAxisAngle(new THREE.Vector3(0, 0, 1), 0.7).normalize();
    return { moved: [c * x - s * y, s * x + c * y, z], axis: axis.toArray() };
  };
  const expectNear = (value: number[], wanted: number[]): void => value.forEach((each, i) => expect(each).toBeCloseTo(wanted[i]!, 9));

  beforeEach(() => {
    vi.stubGlobal('HTMLInputElement', class {});
    vi.stubGlobal('addEventListener', (type: string, act: typeof press) => { if (type === 'keydown') press = act; });
  });
  afterEach(() => { vi.unstubAllGlobals(); });

  it('move along the arm\'s axes for who looks along them', () => {
    heading = 0;
    expectNear(after('KeyW').moved, [0.25, 0, 0]);
    expectNear(after('KeyA').moved, [0, 0.25, 0]);
    expectNear(after('KeyE').moved, [0, 0, 0.25]);
  });

  it('move away from whoever looks, to the left of the picture, and turn about its axes', () => {
    heading = Math.PI / 2;
    expectNear(after('KeyW').moved, [0, 0.25, 0]);
    expectNear(after('KeyD').moved, [0.25, 0, 0]);
    expectNear(after('KeyE').moved, [0, 0, 0.25]);
    expectNear(after('KeyU').axis, [0, 1, 0]);
    expectNear(after('KeyJ').axis, [0, 0, 1]);
  });
});

describe('a key of which nothing can be seen', () => {
  it.each([['KeyJ', true, true, LOOKS_THE_SAME], ['KeyJ', false, true, ''], ['KeyI', true, true, STAYS_UPRIGHT], ['KeyI', true, false, ''], ['KeyW', true, true, '']])('%s, a glass: %s, upright: %s', (code, hasGlass, staysUpright, words) => {
    let press: (event: object) => void = () => {}, hinted = '';
    vi.stubGlobal('addEventListener', (type: string, act: typeof press) => { if (type === 'keydown') press = act; });
    new Keys(() => ({ release: () => {} }) as unknown as Hand, { hasGlass, staysUpright, hint: (told: string) => { hinted = told; } } as unknown as Session, () => false, () => 0);
    vi.stubGlobal('HTMLInputElement', class {});
    press({ target: null, code, timeStamp: 0, preventDefault: () => {} });
    expect(hinted).toBe(words);
    vi.unstubAllGlobals();
  });
});

describe('where a view looks', () => {
  it.each(Object.keys(PRESETS) as (keyof typeof PRESETS)[])('is what keys call ahead: %s', async (preset) => {
    const { View } = await import('../src/scene/view');
    const deaf = { addEventListener: () => {}, removeEventListener: () => {} };
    const view = new View({ ...deaf, getRootNode: () => deaf, ownerDocument: deaf, style: {} } as unknown as HTMLCanvasElement, true);
    view.look(preset);
    view.update(null, 0);
    const h = view.heading, seen = (x: number, y: number): THREE.Vector3 => { // from the base frame to the camera frame
      const { at } = PRESETS[preset];
      return new THREE.Vector3(at[0] - y, at[1], at[2] - x).applyMatrix4(view.camera.matrixWorldInverse);
    };
    const middle = seen(0, 0), ahead = seen(0.1 * Math.cos(h), 0.1 * Math.sin(h)).sub(middle), left = seen(-0.1 * Math.sin(h), 0.1 * Math.cos(h)).sub(middle);
    expect(ahead.x).toBeCloseTo(0, 6);
    expect(preset === 'top' ? ahead.y : -ahead.z).toBeGreaterThan(0.07); // from above, away is up
    expect(left.x).toBeCloseTo(-0.1, 6);
  });
});
