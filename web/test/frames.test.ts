import { describe, expect, it } from 'vitest';
import { Object3D, Quaternion, Vector3 } from 'three';
import { conjugate, handFor, heading, multiply, normalize, rotation, SCENE_FROM_ROBOT, toRobot, toRobotRotation, turn } from '../src/frames';
import type { Quat, Vec3 } from '../src/protocol';

// A small generator with a fixed seed, so that every run has the same cases.
function* numbers(seed: number): Generator<number, never> {
  let state = seed;
  for (;;) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state / 2 ** 31 - 1;
  }
}
const source = numbers(7);
const draw = (): number => source.next().value;
const vector = (): Vec3 => [draw(), draw(), draw()];
const quaternion = (): Quat => normalize([draw(), draw(), draw(), draw()]);
const rotate = (q: Quat, v: Vec3): Vec3 => {
  const [x, y, z] = multiply(multiply(q, [v[0], v[1], v[2], 0]), conjugate(q));
  return [x, y, z];
};
const close = (a: readonly number[], b: readonly number[]): void => a.forEach((x, i) => expect(x).toBeCloseTo(b[i]!, 12));

describe('frames', () => {
  it('turns WebXR axes as CONVENTIONS.md says', () => {
    close(toRobot({ x: 0, y: 0, z: -1 }), [1, 0, 0]); // forward
    close(toRobot({ x: -1, y: 0, z: 0 }), [0, 1, 0]); // left
    close(toRobot({ x: 0, y: 1, z: 0 }), [0, 0, 1]);  // up
  });

  it('turns orientations with their axes: R_robot p_robot is (R_xr p_xr) in robot axes', () => {
    for (let i = 0; i < 2000; ++i) {
      const q = quaternion(), v = vector();
      const object = new Object3D();
      object.quaternion.set(...(q as [number, number, number, number]));
      const there = new Vector3(...v).applyQuaternion(object.quaternion);
      close(rotate(toRobotRotation(object.quaternion), toRobot({ x: v[0], y: v[1], z: v[2] })), toRobot(there));
    }
  });

  it("gives three.js the inverse for the scene's group", () => {
    const c = new Quaternion(...(SCENE_FROM_ROBOT as [number, number, number, number]));
    for (let i = 0; i < 100; ++i) {
      const v = vector();
      const scene = new Vector3(...v).applyQuaternion(c);
      close(toRobot(scene), v);
    }
  });

  it("undoes the retargeter's equations", () => {
    for (let i = 0; i < 2000; ++i) {
      const yaw = 3 * draw(), scale = 1.1 + draw();
      const hand0 = { p: vector(), q: quaternion() }, shift = vector(), spin = quaternion();
      const hand = handFor(hand0, shift, spin, scale, yaw);
      // p = p0 + s C (h - h0); R R0' = C (H H0') C'
      close(turn([hand.p[0] - hand0.p[0], hand.p[1] - hand0.p[1], hand.p[2] - hand0.p[2]], yaw).map((x) => scale * x), shift);
      const c = rotation([0, 0, 1], yaw);
      const back = multiply(multiply(c, multiply(hand.q, conjugate(hand0.q))), conjugate(c));
      const sign = Math.sign(back[3] * spin[3]) || 1;
      close(back.map((x) => sign * x), spin);
    }
  });

  it('reads the heading', () => {
    for (let i = 0; i < 100; ++i) {
      const yaw = 3 * draw();
      expect(heading(rotation([0, 0, 1], yaw))).toBeCloseTo(yaw, 12);
    }
  });
});
