import * as THREE from 'three';
import { TransformControls } from 'three/examples/jsm/controls/TransformControls.js';
import { describe, expect, it } from 'vitest';
import { clearTheMiddle, sizeOf } from '../src/input/handles';
import { View } from '../src/scene/view';

/** An element without events. */
const deaf = { addEventListener: () => {}, removeEventListener: () => {} };
const canvas = (): HTMLCanvasElement => ({ ...deaf, getRootNode: () => deaf, ownerDocument: deaf, style: {}, clientWidth: 400, clientHeight: 300 }) as unknown as HTMLCanvasElement;

describe('the view', () => {
  it('glides to another middle where a card goes, and begins in the right one', () => {
    const view = new View(canvas(), false), offset = (): number => (view.camera.view?.enabled ? view.camera.view.offsetX : 0);
    view.resize(2, [0.4, 0]);
    const begin = offset();
    expect(begin).toBeCloseTo(0.4);
    view.resize(2, [0, 0]);
    expect(offset()).toBe(begin);
    view.update(null, 0.05);
    expect(offset()).toBeLessThan(begin);
    expect(offset()).toBeGreaterThan(0.5 * begin);
    for (let i = 0; i < 60; ++i) view.update(null, 0.05);
    expect(offset()).toBe(0);
  });

  it('is as before once a recording is gone, but for who chose another meanwhile', () => {
    const view = new View(canvas(), false), { position } = view.camera, before = position.clone();
    view.shows(true);
    position.multiplyScalar(2);
    view.shows(true); // the next recording
    view.shows(false);
    expect(position.toArray()).toEqual(before.toArray());
    view.shows(true);
    view.look('top');
    const chosen = position.clone();
    view.shows(false);
    expect(position.toArray()).toEqual(chosen.toArray());
  });

  it('steps back until the target\'s upper handle is clear of the cards, but stays while a handle is held', () => {
    const view = new View(canvas(), false), target = new THREE.Vector3(0, 1.1, -0.95);
    view.resize(1.6);
    view.cover(0.6, 0.2);
    view.update(target, 0.05);
    const begin = view.camera.position.clone();
    expect(view.isCovered).toBe(false);
    target.y = 1.35;
    view.orbit.enabled = false; // as while a handle is held
    view.update(target, 0.05);
    expect([view.isCovered, view.camera.position.equals(begin)]).toEqual([true, true]);
    view.orbit.enabled = true;
    for (let i = 0; i < 60; ++i) view.update(target, 0.05);
    expect(view.isCovered).toBe(false);
    const handle = target.clone();
    handle.y += 0.18;
    expect(handle.project(view.camera).y).toBeLessThan(0.6);
    for (let i = 0; i < 60; ++i) view.update(target, 0.05);
    const back = view.camera.position.distanceTo(view.orbit.target);
    for (let i = 0; i < 60; ++i) view.update(target, 0.05);
    expect(view.camera.position.distanceTo(view.orbit.target)).toBeCloseTo(back, 6); // it is stationary, without oscillation
    target.y = 1.1;
    for (let i = 0; i < 100; ++i) view.update(target, 0.05);
    expect(view.camera.position.distanceTo(begin)).toBeLessThan(1e-3);
  });

  it('leaves a finger 44 px of the glass, however small the picture', () => {
    const camera = new THREE.PerspectiveCamera(56, 1, 0.05, 30), at = new THREE.Vector3(0, 0, -2);
    for (const height of [200, 300, 600]) {
      const scale = (2 * Math.min(1.9 * Math.tan((Math.PI * camera.fov) / 360), 7) * sizeOf(camera, at, true, height)) / 4; // as TransformControls has it
      const pixels = ((0.3 * scale) / 2 / Math.tan((Math.PI * camera.fov) / 360)) * (height / 2);
      expect(2 * pixels).toBeGreaterThanOrEqual(44);
    }
  });
});

describe('the glass', () => {
  it('is a handle also where it is elsewhere than the target, as under a demo motion', () => {
    const camera = new THREE.PerspectiveCamera(50, 1, 0.1, 10), target = new THREE.Object3D(), controls = new TransformControls(camera);
    camera.position.z = 2;
    camera.updateMatrixWorld();
    const glass = clearTheMiddle(controls);
    new THREE.Scene().add(target);
    controls.attach(target);
    const at = (x: number): string | null => {
      controls.getHelper().updateMatrixWorld();
      const { x: left, y: up } = new THREE.Vector3(x, -0.2, 0).project(camera);
      controls.pointerHover({ x: left, y: up, button: -1 } as PointerEvent);
      return controls.axis;
    };
    expect(at(-0.3)).toBeNull();
    glass.matrixWorld.setPosition(-0.3, -0.2, 0);
    expect(at(-0.3)).toBe('XYZ');
    expect(at(-0.5)).toBeNull();
  });
});
