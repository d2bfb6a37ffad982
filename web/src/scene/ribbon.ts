import * as THREE from 'three';
import type { Vec3 } from '../protocol';
import { circle } from './circle';

const SIDES = 6;
const { cos, sin } = circle(SIDES);

/** A thin tube through points that change with every frame; thicker and stronger where it begins. Allocates nothing. */
export class Ribbon extends THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial> {
  readonly capacity: number;
  readonly #points: Float32Array;
  #count = 0;
  readonly #position: THREE.BufferAttribute;
  readonly #color: THREE.BufferAttribute;

  /** @param thickness m, at the first point @param opacity there */
  constructor(capacity: number, private readonly thickness: number, protected readonly opacity: number) {
    const geometry = new THREE.BufferGeometry();
    const position = new THREE.BufferAttribute(new Float32Array(capacity * SIDES * 3), 3);
    const color = new THREE.BufferAttribute(new Float32Array(capacity * SIDES * 4).fill(1), 4);
    geometry.setAttribute('position', position);
    geometry.setAttribute('color', color);
    const index: number[] = [];
    for (let k = 0; k + 1 < capacity; ++k) {
      for (let i = 0; i < SIDES; ++i) {
        const a = k * SIDES + i, b = k * SIDES + ((i + 1) % SIDES);
        index.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
      }
    }
    geometry.setIndex(index);
    geometry.setDrawRange(0, 0);
    super(geometry, new THREE.MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false, side: THREE.DoubleSide, forceSinglePass: true }));
    this.capacity = capacity;
    this.#position = position;
    this.#color = color;
    this.#points = new Float32Array(capacity * 3);
    this.frustumCulled = false;
  }

  paint(color: number): void { this.material.color.setHex(color); }

  begin(): void { this.#count = 0; }

  append(point: ArrayLike<number>): void {
    if (this.#count < this.capacity) this.#put(this.#count++, point);
  }

  /** Adds a point before the first; if the capacity is used up, the last one is dropped. */
  prepend(point: Vec3): void {
    this.#points.copyWithin(3, 0, 3 * (this.capacity - 1));
    this.#put(0, point);
    this.#count = Math.min(this.capacity, this.#count + 1);
  }

  /** Number by number: `set` would box each. */
  #put(k: number, point: ArrayLike<number>): void {
    for (let i = 0; i < 3; ++i) this.#points[3 * k + i] = point[i]!;
  }

  /** m, radius. @param rest 1 at the first point, 0 at the last */
  protected radius(_k: number, rest: number): number { return this.thickness * (0.25 + 0.75 * rest); }

  /** Opacity. */
  protected strength(rest: number): number { return this.opacity * rest; }

  /** Shows the points since begin(). Uses plain numbers: calls of three.js' vectors would box each. */
  end(): void {
    const n = this.#count, p = this.#points, at = this.#position.array, colors = this.#color.array;
    let tx = 0, ty = 0, tz = 1; // along the tube
    for (let k = 0; k < n; ++k) {
      const a = 3 * Math.max(0, k - 1), b = 3 * Math.min(n - 1, k + 1);
      const dx = p[b]! - p[a]!, dy = p[b + 1]! - p[a + 1]!, dz = p[b + 2]! - p[a + 2]!, length = Math.sqrt(dx * dx + dy * dy + dz * dz);
      if (length > 1e-5) { // a point at the same place keeps the last direction
        tx = dx / length;
        ty = dy / length;
        tz = dz / length;
      }
      // Across the tube: z x tangent, or x x tangent where it is steep; then tangent x side.
      const steep = Math.abs(tz) > 0.95, across = steep ? Math.sqrt(ty * ty + tz * tz) : Math.sqrt(tx * tx + ty * ty);
      const sx = steep ? 0 : -ty / across, sy = (steep ? -tz : tx) / across, sz = steep ? ty / across : 0;
      const ux = ty * sz - tz * sy, uy = tz * sx - tx * sz, uz = tx * sy - ty * sx;
      const rest = 1 - k / Math.max(1, n - 1), radius = this.radius(k, rest);
      for (let i = 0; i < SIDES; ++i) {
        const c = radius * cos[i]!, s = radius * sin[i]!, v = k * SIDES + i;
        at[3 * v] = p[3 * k]! + c * sx + s * ux;
        at[3 * v + 1] = p[3 * k + 1]! + c * sy + s * uy;
        at[3 * v + 2] = p[3 * k + 2]! + c * sz + s * uz;
        colors[4 * v + 3] = this.strength(rest);
      }
    }
    this.#position.needsUpdate = true;
    this.#color.needsUpdate = true;
    this.geometry.setDrawRange(0, Math.max(0, n - 1) * SIDES * 6);
  }
}
