import * as THREE from 'three';
import type { Cell, CellObject } from '../protocol';
import { geometryOf, toMatrix } from './body';

/** Of the piece of a half-space's surface that is drawn, m. */
const SIZE = 2.4;
const PLAIN = 0x8b9bb0, TOUCHED = 0xe0a100;

const surfaceOf = (object: CellObject, grown: number): THREE.BufferGeometry => {
  switch (object.shape) {
    case 'half_space': return new THREE.PlaneGeometry(SIZE, SIZE).translate(0, 0, grown);
    case 'box': return geometryOf({ ...object, link: 0, size: object.size.map((s) => s + 2 * grown) as [number, number, number], rounding: object.rounding + grown });
    case 'cylinder': return geometryOf({ ...object, link: 0, length: object.length + 2 * grown, radius: object.radius + grown });
    default: return geometryOf({ ...object, link: 0, radius: object.radius + grown });
  }
};

/** What stands around the arm, in its base's frame: each object, and fainter the margin that is kept around it. */
export class Surroundings extends THREE.Group {
  #margins: THREE.Mesh[] = [];
  #touched = -1;

  setCell(cell: Cell | null): void {
    this.clear();
    this.#touched = -1;
    this.#margins = (cell?.objects ?? []).map((object) => {
      const plane = object.shape === 'half_space';
      const solid = new THREE.Mesh(surfaceOf(object, 0), new THREE.MeshStandardMaterial({
        color: new THREE.Color(object.color.startsWith('#') ? object.color : PLAIN), roughness: 0.8, side: THREE.DoubleSide,
        transparent: plane, opacity: plane ? 0.45 : 1, depthWrite: !plane,
      }));
      solid.receiveShadow = true;
      solid.castShadow = !plane;
      const margin = new THREE.Mesh(surfaceOf(object, object.margin), new THREE.MeshBasicMaterial({
        color: TOUCHED, transparent: true, opacity: 0.16, depthWrite: false, side: THREE.DoubleSide,
      }));
      for (const mesh of [solid, margin]) toMatrix(object.origin).decompose(mesh.position, mesh.quaternion, mesh.scale);
      solid.visible = object.color !== 'none' && !object.holds_only_tool;
      margin.visible = false;
      this.add(solid, margin);
      return margin;
    });
  }

  /** Which object holds the arm back; -1: none. */
  touch(index: number): void {
    if (index === this.#touched) return;
    const before = this.#margins[this.#touched], now = this.#margins[index];
    if (before) before.visible = false;
    if (now) now.visible = true;
    this.#touched = index;
  }
}
