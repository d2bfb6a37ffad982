import * as THREE from 'three';
import type { TransformControls } from 'three/examples/jsm/controls/TransformControls.js';

/** m, world: what TransformControls calls 1; arrows begin at 0.3 and end at 0.6 of it, outside of the glass. */
const SCALE = 0.3;
/** Of TransformControls' own size: fingers and far views need no smaller handles. */
const LEAST = { fine: 0.6, coarse: 1 };
const BEGIN = 0.3, OUT = 0.14;
/** m, around the glass that follows. */
const FOLLOWER = 0.07;
/** px, from the middle of the glass: what a finger must hit at least is twice as wide. */
const FINGER = 24;
/** Of TransformControls: its size is that of a quarter of this share of the picture's height. */
const ITS_SHARE = 1.9;

/** The parts of TransformControls that its type does not tell of. */
interface Gizmo { gizmo: Record<'translate', THREE.Object3D>; picker: Record<'translate', THREE.Object3D> }

/**
 * Leaves the glass free: arrows begin beside it, squares stand further out, and the middle, all of the glass, is felt, not seen. So is the
 * glass that follows the target, by what is returned: its place in the world, which the caller keeps.
 */
export function clearTheMiddle(controls: TransformControls): THREE.Object3D {
  const follower = new THREE.Mesh(new THREE.SphereGeometry(FOLLOWER));
  follower.name = 'XYZ'; // as TransformControls calls what moves in the picture's plane
  follower.matrixWorldAutoUpdate = false;
  const { gizmo, picker } = (controls as unknown as { _gizmo: Gizmo })._gizmo;
  for (const [parts, seen] of [[gizmo.translate, true], [picker.translate, false]] as const) {
    for (const part of parts.children as THREE.Mesh[]) {
      const { name, geometry } = part;
      if (name.length === 2) geometry.translate(...(['X', 'Y', 'Z'].map((axis) => (name.includes(axis) ? OUT : 0)) as [number, number, number]));
      if (!seen) {
        if (name === 'XYZ') {
          part.geometry = new THREE.SphereGeometry(BEGIN);
          part.add(follower);
        }
        continue;
      }
      if (name === 'XYZ') part.geometry = new THREE.BufferGeometry();
      if (name.length === 1) beginOutside(geometry, 'XYZ'.indexOf(name));
    }
  }
  return follower;
}

/** Of an axis' line that begins in the middle, the near end; arrow heads stay. */
function beginOutside(geometry: THREE.BufferGeometry, axis: number): void {
  const position = geometry.getAttribute('position') as THREE.BufferAttribute;
  for (let i = 0; i < position.count; ++i) if (Math.abs(position.getComponent(i, axis)) < BEGIN) position.setComponent(i, axis, BEGIN);
}

/** As large as the scene's own things, but never too small to be taken. @param height px, of the picture */
export function sizeOf(camera: THREE.PerspectiveCamera, at: THREE.Vector3, coarse: boolean, height = 0): number {
  const factor = at.distanceTo(camera.position) * Math.min(ITS_SHARE * Math.tan((Math.PI * camera.fov) / 360), 7);
  const finger = coarse && height > 0 ? (8 * FINGER) / (BEGIN * ITS_SHARE * height) : 0;
  return Math.max(coarse ? LEAST.coarse : LEAST.fine, finger, (4 * SCALE) / factor);
}
