import { MeshoptSimplifier } from 'meshoptimizer/simplifier';
import * as THREE from 'three';

/** m, largest error of a surface. */
const OFF = 0.001;
/** Cosine of the angle between two triangles above which their edge stays sharp: 35 degrees. */
const EDGE = 0.82;

/**
 * Meshes for software rendering: a sixth of the triangles, and a simpler lighting model. If it fails the meshes stay
 * unchanged.
 */
export async function coarsen(root: THREE.Object3D): Promise<void> {
  await MeshoptSimplifier.ready;
  root.updateMatrixWorld();
  const matte = new Map<THREE.Material, THREE.Material>(), scale = new THREE.Vector3(), parts: THREE.Mesh[] = [];
  root.traverse((part) => { if (part instanceof THREE.Mesh) parts.push(part); });
  for (const part of parts) {
    thin(part.geometry as THREE.BufferGeometry, OFF / part.getWorldScale(scale).x);
    const shiny = part.material as THREE.MeshStandardMaterial;
    if (!matte.has(shiny)) matte.set(shiny, new THREE.MeshLambertMaterial({ color: shiny.color.clone().multiplyScalar(1 - shiny.metalness) }));
    part.material = matte.get(shiny)!;
    await new Promise((go) => setTimeout(go)); // keys and messages are handled in between
  }
}

/** @param off largest error of the surface, in the geometry's unit */
function thin(geometry: THREE.BufferGeometry, off: number): void {
  const { index, attributes: { position: place } } = geometry;
  if (!index || !place) return;
  const places = new Float32Array(3 * place.count);
  for (let i = 0; i < place.count; ++i) places.set([place.getX(i), place.getY(i), place.getZ(i)], 3 * i);
  const same = MeshoptSimplifier.generatePositionRemap(places, 3); // index of the first of the vertices in one place
  const [corners] = MeshoptSimplifier.simplify(Uint32Array.from(index.array, (i) => same[i]!), places, 3, 0, off, ['ErrorAbsolute', 'Permissive']);
  light(geometry, places, corners);
}

/**
 * Sets these corners of triangles. Each gets the mean normal of the triangles around it, weighted by area, without
 * those beyond a sharp edge. The normals of a finer mesh would look like dents.
 */
function light(geometry: THREE.BufferGeometry, places: Float32Array, corners: Uint32Array): void {
  const at = (i: number): THREE.Vector3 => new THREE.Vector3().fromArray(places, 3 * i);
  const flat: THREE.Vector3[] = [], around = new Map<number, number[]>();
  for (let i = 0; i < corners.length; i += 3) {
    const a = at(corners[i]!);
    flat.push(at(corners[i + 1]!).sub(a).cross(at(corners[i + 2]!).sub(a)));
    for (const corner of corners.subarray(i, i + 3)) around.set(corner, [...around.get(corner) ?? [], i / 3]);
  }
  const position: number[] = [], normals: number[] = [], indices: number[] = [], made = new Map<string, number>(), normal = new THREE.Vector3();
  corners.forEach((corner, i) => {
    const own = flat[Math.floor(i / 3)]!;
    const near = around.get(corner)!.filter((triangle) => own.dot(flat[triangle]!) >= EDGE * own.length() * flat[triangle]!.length());
    const key = [corner, ...near].join();
    if (!made.has(key)) {
      normal.set(0, 0, 0);
      for (const triangle of near) normal.add(flat[triangle]!);
      normals.push(...normal.normalize());
      position.push(...at(corner));
      made.set(key, made.size);
    }
    indices.push(made.get(key)!);
  });
  geometry.setIndex(indices);
  geometry.attributes = { position: new THREE.Float32BufferAttribute(position, 3), normal: new THREE.Float32BufferAttribute(normals, 3) };
}
