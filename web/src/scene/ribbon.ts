import * as THREE from 'three';

const SIDES = 6;

/** A thin tube through points that change with every frame; thicker and stronger where it begins. Nothing is made anew. */
export class Ribbon extends THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial> {
  readonly capacity: number;
  readonly #points: Float32Array;
  #count = 0;
  readonly #tangent = new THREE.Vector3(0, 0, 1);
  readonly #side = new THREE.Vector3();
  readonly #up = new THREE.Vector3();

  /** @param thickness m, of its beginning; @param opacity there */
  constructor(capacity: number, private readonly thickness: number, private readonly opacity: number) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(capacity * SIDES * 3), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(capacity * SIDES * 4).fill(1), 4));
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
    this.#points = new Float32Array(capacity * 3);
    this.frustumCulled = false;
  }

  paint(color: number): void { this.material.color.setHex(color); }

  begin(): void { this.#count = 0; }

  append(x: number, y: number, z: number): void {
    if (this.#count >= this.capacity) return;
    const k = 3 * this.#count++;
    this.#points[k] = x;
    this.#points[k + 1] = y;
    this.#points[k + 2] = z;
  }

  /** Shows what was appended since begin(). */
  end(): void {
    const n = this.#count, p = this.#points;
    const position = this.geometry.getAttribute('position') as THREE.BufferAttribute;
    const color = this.geometry.getAttribute('color') as THREE.BufferAttribute;
    for (let k = 0; k < n; ++k) {
      const a = 3 * Math.max(0, k - 1), b = 3 * Math.min(n - 1, k + 1);
      this.#side.set(p[b]! - p[a]!, p[b + 1]! - p[a + 1]!, p[b + 2]! - p[a + 2]!);
      if (this.#side.lengthSq() > 1e-10) this.#tangent.copy(this.#side).normalize(); // where it stands still, as before
      this.#side.set(0, 0, 1);
      if (Math.abs(this.#tangent.z) > 0.95) this.#side.set(1, 0, 0);
      this.#side.cross(this.#tangent).normalize();
      this.#up.crossVectors(this.#tangent, this.#side);
      const rest = 1 - k / Math.max(1, n - 1), radius = this.thickness * (0.25 + 0.75 * rest);
      for (let i = 0; i < SIDES; ++i) {
        const c = radius * Math.cos((2 * Math.PI * i) / SIDES), s = radius * Math.sin((2 * Math.PI * i) / SIDES), v = k * SIDES + i;
        position.setXYZ(v, p[3 * k]! + c * this.#side.x + s * this.#up.x, p[3 * k + 1]! + c * this.#side.y + s * this.#up.y,
          p[3 * k + 2]! + c * this.#side.z + s * this.#up.z);
        color.setW(v, this.opacity * rest);
      }
    }
    position.needsUpdate = true;
    color.needsUpdate = true;
    this.geometry.setDrawRange(0, Math.max(0, n - 1) * SIDES * 6);
  }
}
