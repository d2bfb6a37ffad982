import { MeshoptSimplifier } from 'meshoptimizer/simplifier';
import * as THREE from 'three';

/** m, that a surface may lie elsewhere. */
const OFF = 0.001;

/**
 * Meshes for a processor that draws: a sixth of the triangles, and light that is computed in a simpler way. Where it fails they stay as
 * they are.
 */
export async function coarsen(root: THREE.Object3D): Promise<void> {
  await MeshoptSimplifier.ready;
  root.updateMatrixWorld();
  const matte = new Map<THREE.Material, THREE.Material>(), scale = new THREE.Vector3();
  root.traverse((part) => {
    if (!(part instanceof THREE.Mesh)) return;
    thin(part.geometry as THREE.BufferGeometry, OFF / part.getWorldScale(scale).x);
    const shiny = part.material as THREE.MeshStandardMaterial;
    if (!matte.has(shiny)) matte.set(shiny, new THREE.MeshLambertMaterial({ color: shiny.color.clone().multiplyScalar(1 - shiny.metalness) }));
    part.material = matte.get(shiny)!;
  });
}

/** @param off as far as a surface may go, in the geometry's own unit */
function thin(geometry: THREE.BufferGeometry, off: number): void {
  const { index, attributes: { position: place } } = geometry;
  if (!index || !place) return;
  const corners = Uint32Array.from(index.array), places = new Float32Array(3 * place.count);
  for (let i = 0; i < place.count; ++i) places.set([place.getX(i), place.getY(i), place.getZ(i)], 3 * i);
  const [kept] = MeshoptSimplifier.simplify(corners, places, 3, 0, off, ['ErrorAbsolute', 'Permissive']);
  geometry.setIndex(new THREE.BufferAttribute(kept, 1));
}
