import * as THREE from 'three';
import { RoundedBoxGeometry } from 'three/examples/jsm/geometries/RoundedBoxGeometry.js';
import type { Body } from '../protocol';

const QUARTER = Math.PI / 2;

/** From the four rows of a pose. */
export function toMatrix(rows: number[][]): THREE.Matrix4 {
  const r = rows.flat() as Parameters<THREE.Matrix4['set']>;
  return new THREE.Matrix4().set(...r);
}

/** The surface of a body in its own frame, where capsules and cylinders lie along z (in three.js along y). */
export function geometryOf(body: Body): THREE.BufferGeometry {
  switch (body.shape) {
    case 'sphere': return new THREE.SphereGeometry(body.radius, 32, 20);
    case 'capsule': return new THREE.CapsuleGeometry(body.radius, body.length, 10, 32).rotateX(QUARTER);
    case 'cylinder': return new THREE.CylinderGeometry(body.radius, body.radius, body.length, 32).rotateX(QUARTER);
    case 'box': return body.rounding > 0 ? new RoundedBoxGeometry(...body.size, 3, body.rounding) : new THREE.BoxGeometry(...body.size);
  }
}
