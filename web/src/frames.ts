/**
 * WebXR and three.js count x right, y up, z back; robots x forward, y left, z up (CONVENTIONS.md). With C the rotation of
 * that table, p = C p_xr and q = c q_xr c*, which only moves and turns the sign of the quaternion's imaginary part.
 * Results go into `out`, which may be one of the arguments; without it they are new objects.
 */
import type { Pose, Quat, Vec3 } from './protocol';

export type MutableVec3 = [number, number, number];
export type MutableQuat = [number, number, number, number];
export interface MutablePose { p: MutableVec3; q: MutableQuat }

interface Xyz { x: number; y: number; z: number }
interface Xyzw extends Xyz { w: number }

function set3(out: MutableVec3, x: number, y: number, z: number): MutableVec3 {
  out[0] = x;
  out[1] = y;
  out[2] = z;
  return out;
}

function set4(out: MutableQuat, x: number, y: number, z: number, w: number): MutableQuat {
  out[0] = x;
  out[1] = y;
  out[2] = z;
  out[3] = w;
  return out;
}

export const toRobot = (v: Xyz, out: MutableVec3 = [0, 0, 0]): MutableVec3 => set3(out, -v.z, -v.x, v.y);
export const toRobotRotation = (q: Xyzw, out: MutableQuat = [0, 0, 0, 1]): MutableQuat => set4(out, -q.z, -q.x, q.y, q.w);

/** c as a quaternion of three.js: rotates a group with robot axes into the scene's axes. */
export const SCENE_FROM_ROBOT: Quat = [-0.5, 0.5, 0.5, 0.5];

export function multiply(a: Quat, b: Quat, out: MutableQuat = [0, 0, 0, 1]): MutableQuat {
  return set4(out,
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]);
}

export const conjugate = (q: Quat, out: MutableQuat = [0, 0, 0, 1]): MutableQuat => set4(out, -q[0], -q[1], -q[2], q[3]);

export function normalize(q: Quat, out: MutableQuat = [0, 0, 0, 1]): MutableQuat {
  const n = Math.hypot(q[0], q[1], q[2], q[3]);
  return n > 0 ? set4(out, q[0] / n, q[1] / n, q[2] / n, q[3] / n) : set4(out, 0, 0, 0, 1);
}

/** Rotation by `angle` about a unit axis. */
export function rotation(axis: Vec3, angle: number, out: MutableQuat = [0, 0, 0, 1]): MutableQuat {
  const s = Math.sin(angle / 2);
  return set4(out, axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2));
}

/** v turned about z. */
export function turn(v: Vec3, yaw: number, out: MutableVec3 = [0, 0, 0]): MutableVec3 {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  return set3(out, c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]);
}

const Z: Vec3 = [0, 0, 1];
const shifted: MutableVec3 = [0, 0, 0];
const yawed: MutableQuat = [0, 0, 0, 1];
const spun: MutableQuat = [0, 0, 0, 1];

/**
 * Where the hand must be for the tool to move by `shift` (m, base frame) and turn by `spin` (base frame) from where both were at
 * engagement: the retargeter's equations backwards, p = p0 + s C (h - h0), R = C (H H0') C' R0 with C = Rz(yaw).
 */
export function handFor(hand0: Pose, shift: Vec3, spin: Quat, scale: number, yaw: number,
                        out: MutablePose = { p: [0, 0, 0], q: [0, 0, 0, 1] }): MutablePose {
  const d = turn(shift, -yaw, shifted), c = rotation(Z, yaw, yawed);
  set3(out.p, hand0.p[0] + d[0] / scale, hand0.p[1] + d[1] / scale, hand0.p[2] + d[2] / scale);
  multiply(multiply(conjugate(c, spun), spin, spun), c, spun);
  normalize(multiply(spun, hand0.q, spun), out.q);
  return out;
}

/** Direction of x of an orientation in robot axes, as an angle about z. */
export function heading([x, y, z, w]: Quat): number {
  return Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
}
