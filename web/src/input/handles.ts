import * as THREE from 'three';
import type { TransformControls } from 'three/examples/jsm/controls/TransformControls.js';

/** m, world: the unit of TransformControls; arrows begin at 0.3 and end at 0.6 of it, outside the glass. */
const SCALE = 0.3;
/** Smallest size by pointer, relative to TransformControls' own: in far views handles shrink no further. */
const LEAST = { fine: 0.6, coarse: 1 };
const BEGIN = 0.3, OUT = 0.14;
/** m, around the glass that follows the target. */
const FOLLOWER = 0.07;
/** px, from the middle of the glass: half of the least width for a finger. */
const FINGER = 24;
/** Of TransformControls: its size is a quarter of this share of the picture's height. */
const ITS_SHARE = 1.9;

/** The parts of TransformControls that are missing in its type. */
interface Gizmo { gizmo: Record<'translate', THREE.Object3D>; picker: Record<'translate', THREE.Object3D> }

/**
 * Keeps the glass visible: arrows begin next to it, squares are further out, and the middle (all of the glass) can be
 * dragged but is not drawn. The returned object makes the glass that follows the target draggable, too; the caller
 * sets its position in the world.
 */
export function clearTheMiddle(controls: TransformControls): THREE.Object3D {
  const follower = new THREE.Mesh(new THREE.SphereGeometry(FOLLOWER));
  follower.name = 'XYZ'; // TransformControls' name for motion in the picture's plane
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

/** Cuts off the near end of an axis' line that begins in the middle; arrow heads stay. */
function beginOutside(geometry: THREE.BufferGeometry, axis: number): void {
  const position = geometry.getAttribute('position') as THREE.BufferAttribute;
  for (let i = 0; i < position.count; ++i) if (Math.abs(position.getComponent(i, axis)) < BEGIN) position.setComponent(i, axis, BEGIN);
}

/** As large as the objects in the scene, but never too small to hit. @param height px, of the picture */
export function sizeOf(camera: THREE.PerspectiveCamera, at: THREE.Vector3, coarse: boolean, height = 0): number {
  const factor = at.distanceTo(camera.position) * Math.min(ITS_SHARE * Math.tan((Math.PI * camera.fov) / 360), 7);
  const finger = coarse && height > 0 ? (8 * FINGER) / (BEGIN * ITS_SHARE * height) : 0;
  return Math.max(coarse ? LEAST.coarse : LEAST.fine, finger, (4 * SCALE) / factor);
}
