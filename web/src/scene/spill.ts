import * as THREE from 'three';
import type { Glass } from './glass';

const DROPS = 36;
const FALL = 1.1; // s that the drops fall
const WINE = 0x8a1c2e;

/** Liquid that leaves the glass: falling drops, and the puddle on the floor. */
export class Spill extends THREE.Group {
  readonly #drops = new THREE.InstancedMesh(new THREE.SphereGeometry(0.006, 10, 8),
    new THREE.MeshStandardMaterial({ color: WINE, roughness: 0.15 }), DROPS);
  readonly #puddle: THREE.Mesh;
  readonly #start = new Float32Array(DROPS * 3);
  readonly #speed = new Float32Array(DROPS * 3);
  readonly #at = new THREE.Matrix4();
  readonly #glass = new THREE.Vector3();
  #since = Infinity;
  #spilled = false;

  constructor(private readonly still: boolean) {
    super();
    // A few lobes, because a puddle is not a circle.
    const shape = new THREE.Shape();
    for (let i = 0; i <= 64; ++i) {
      const a = (2 * Math.PI * i) / 64, r = 0.14 * (1 + 0.16 * Math.sin(3 * a + 0.6) + 0.09 * Math.sin(5 * a + 2) + 0.05 * Math.sin(9 * a));
      if (i === 0) shape.moveTo(r, 0); else shape.lineTo(r * Math.cos(a), r * Math.sin(a));
    }
    this.#puddle = new THREE.Mesh(new THREE.ShapeGeometry(shape),
      new THREE.MeshStandardMaterial({ color: WINE, roughness: 0.12, transparent: true, opacity: 0.85 }));
    this.#puddle.rotateX(-Math.PI / 2);
    this.#puddle.receiveShadow = true;
    this.#drops.frustumCulled = false;
    this.add(this.#drops, this.#puddle);
    this.visible = false;
  }

  /** @param glass at its current pose @param t s */
  update(spilled: boolean, glass: Glass, t: number): void {
    if (spilled && !this.#spilled) this.#begin(glass, t);
    this.#spilled = this.visible = spilled;
    if (!spilled) return;
    const age = this.still ? FALL : Math.min(FALL, t - this.#since);
    this.#drops.visible = age < FALL;
    this.#puddle.scale.setScalar(Math.max(0.001, Math.sqrt(Math.max(0, age - 0.35) / (FALL - 0.35))));
    if (!this.#drops.visible) return;
    for (let i = 0; i < DROPS; ++i) {
      const k = 3 * i, s = Math.max(0, age - (0.35 * i) / DROPS);
      const y = this.#start[k + 1]! + this.#speed[k + 1]! * s - 4.905 * s * s;
      const size = y > 0 && s > 0 ? 0.6 + 0.4 * Math.sin(7 * i) : 0;
      this.#at.makeScale(size, size, size).setPosition(this.#start[k]! + this.#speed[k]! * s, Math.max(0, y), this.#start[k + 2]! + this.#speed[k + 2]! * s);
      this.#drops.setMatrixAt(i, this.#at);
    }
    this.#drops.instanceMatrix.needsUpdate = true;
  }

  #begin(glass: Glass, t: number): void {
    const { radius, height } = glass.size;
    this.#since = t;
    glass.getWorldPosition(this.#glass);
    this.#puddle.position.set(this.#glass.x, 0.004, this.#glass.z);
    for (let i = 0; i < DROPS; ++i) {
      const a = 2.4 * i, c = Math.cos(a), s = Math.sin(a), out = 0.12 + 0.1 * Math.sin(5 * i);
      this.#start.set([this.#glass.x + radius * c, this.#glass.y + height / 2, this.#glass.z + radius * s], 3 * i);
      this.#speed.set([out * c, 0.25 + 0.2 * Math.sin(3 * i), out * s], 3 * i);
    }
  }
}
