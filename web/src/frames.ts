/**
 * WebXR and three.js count x right, y up, z back; robots x forward, y left, z up (CONVENTIONS.md). With C the rotation of
 * that table, p = C p_xr and q = c q_xr c*, which only moves and turns the sign of the quaternion's imaginary part.
 */
import type { Quat, Vec3 } from './protocol';

interface Xyz { x: number; y: number; z: number }
interface Xyzw extends Xyz { w: number }

export const toRobot = (v: Xyz): Vec3 => [-v.z, -v.x, v.y];
export const toRobotRotation = (q: Xyzw): Quat => [-q.z, -q.x, q.y, q.w];

/** c as a quaternion of three.js: what turns a group of robot axes into the scene's. */
export const SCENE_FROM_ROBOT: Quat = [-0.5, 0.5, 0.5, 0.5];

export function multiply(a: Quat, b: Quat): Quat {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

export const conjugate = (q: Quat): Quat => [-q[0], -q[1], -q[2], q[3]];

export function normalize(q: Quat): Quat {
  const n = Math.hypot(...q);
  return n > 0 ? [q[0] / n, q[1] / n, q[2] / n, q[3] / n] : [0, 0, 0, 1];
}

/** Rotation by `angle` about a unit axis. */
export function rotation(axis: Vec3, angle: number): Quat {
  const s = Math.sin(angle / 2);
  return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2)];
}

/** v turned about z. */
export function turn(v: Vec3, yaw: number): Vec3 {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  return [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]];
}

/**
 * Where the hand must be for the tool to move by `shift` (m, base frame) and turn by `spin` (base frame) from where both were at
 * engagement: the retargeter's equations backwards, p = p0 + s C (h - h0), R = C (H H0') C' R0 with C = Rz(yaw).
 */
export function handFor(hand0: { p: Vec3; q: Quat }, shift: Vec3, spin: Quat, scale: number, yaw: number): { p: Vec3; q: Quat } {
  const d = turn(shift, -yaw);
  const c = rotation([0, 0, 1], yaw);
  return {
    p: [hand0.p[0] + d[0] / scale, hand0.p[1] + d[1] / scale, hand0.p[2] + d[2] / scale],
    q: normalize(multiply(multiply(multiply(conjugate(c), spin), c), hand0.q)),
  };
}

/** Direction of x of an orientation in robot axes, as an angle about z. */
export function heading(q: Quat): number {
  const [x, y, z, w] = q;
  return Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
}
