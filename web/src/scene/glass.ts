import * as THREE from 'three';

/** As the simulated arm's glass, m (src/arm/liquid.hpp). */
export const GLASS = { radius: 0.035, height: 0.11, fill: 0.08, wall: 0.0025 };

const SIDES = 40;

/** A cylinder whose top is a plane that tilts; the vertices move, nothing is made anew. */
class LiquidBody extends THREE.Mesh<THREE.BufferGeometry, THREE.MeshPhysicalMaterial> {
  constructor() {
    const geometry = new THREE.BufferGeometry();
    const rows = SIDES + 1;
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array((3 * rows + 1) * 3), 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(new Float32Array((3 * rows + 1) * 3), 3));
    const index: number[] = [];
    for (let i = 0; i < SIDES; ++i) {
      index.push(i, i + 1, rows + i, i + 1, rows + i + 1, rows + i);
      index.push(3 * rows, 2 * rows + i, 2 * rows + i + 1);
    }
    geometry.setIndex(index);
    super(geometry, new THREE.MeshPhysicalMaterial({
      color: 0x9c1f33, roughness: 0.12, transparent: true, opacity: 0.9, side: THREE.DoubleSide, forceSinglePass: true,
    }));
    this.tilt(0, 0);
  }

  /** rad, of the surface's normal about the glass's x and y. */
  tilt(aboutX: number, aboutY: number): void {
    const position = this.geometry.getAttribute('position') as THREE.BufferAttribute;
    const normal = this.geometry.getAttribute('normal') as THREE.BufferAttribute;
    const rows = SIDES + 1, r = GLASS.radius - GLASS.wall - 0.0005, bottom = -GLASS.height / 2 + GLASS.wall;
    const sx = -Math.tan(Math.max(-1.2, Math.min(1.2, aboutY))), sy = Math.tan(Math.max(-1.2, Math.min(1.2, aboutX)));
    const n = Math.hypot(sx, sy, 1);
    for (let i = 0; i <= SIDES; ++i) {
      const c = Math.cos((2 * Math.PI * i) / SIDES), s = Math.sin((2 * Math.PI * i) / SIDES);
      const z = Math.min(GLASS.height / 2, Math.max(bottom, -GLASS.height / 2 + GLASS.fill + r * (sx * c + sy * s)));
      position.setXYZ(i, r * c, r * s, bottom);
      position.setXYZ(rows + i, r * c, r * s, z);
      position.setXYZ(2 * rows + i, r * c, r * s, z);
      normal.setXYZ(i, c, s, 0);
      normal.setXYZ(rows + i, c, s, 0);
      normal.setXYZ(2 * rows + i, -sx / n, -sy / n, 1 / n);
    }
    position.setXYZ(3 * rows, 0, 0, -GLASS.height / 2 + GLASS.fill);
    normal.setXYZ(3 * rows, -sx / n, -sy / n, 1 / n);
    position.needsUpdate = true;
    normal.needsUpdate = true;
  }
}

function shell(): THREE.BufferGeometry {
  const { radius: r, height: h, wall: w } = GLASS;
  const outline = [[0, -h / 2], [r, -h / 2], [r, h / 2], [r - w, h / 2], [r - w, -h / 2 + w], [0, -h / 2 + w]];
  const lathe = new THREE.LatheGeometry(outline.map(([x, y]) => new THREE.Vector2(x, y)), 48);
  return lathe.rotateX(Math.PI / 2); // its axis along z
}

/** The glass, axis along z, origin at its centre. */
export class Glass extends THREE.Group {
  readonly liquid = new LiquidBody();

  constructor() {
    super();
    const material = new THREE.MeshPhysicalMaterial({
      color: 0xe6f0f7, roughness: 0.04, metalness: 0, clearcoat: 1, transparent: true, opacity: 0.28, side: THREE.DoubleSide, depthWrite: false,
      forceSinglePass: true, // two passes have three.js look up the program anew with every frame
    });
    const body = new THREE.Mesh(shell(), material);
    body.castShadow = true;
    body.renderOrder = 2;
    // The edges by which an eye knows a glass.
    const edge = new THREE.MeshPhysicalMaterial({ color: 0xffffff, roughness: 0.05, clearcoat: 1, transparent: true, opacity: 0.75 });
    const rim = new THREE.Mesh(new THREE.TorusGeometry(GLASS.radius - GLASS.wall / 2, GLASS.wall / 2, 10, 56), edge);
    rim.position.z = GLASS.height / 2;
    const foot = new THREE.Mesh(new THREE.CylinderGeometry(GLASS.radius, GLASS.radius * 0.96, 0.005, 48).rotateX(Math.PI / 2), edge);
    foot.position.z = -GLASS.height / 2;
    rim.renderOrder = foot.renderOrder = 3;
    this.add(this.liquid, body, rim, foot);
  }
}

/** The target: where the glass should be. */
export class Ghost extends THREE.Group {
  readonly #material = new THREE.MeshBasicMaterial({ color: 0x16a085, transparent: true, opacity: 0.3, depthWrite: false });
  readonly #edge = new THREE.MeshBasicMaterial({ color: 0x16a085, transparent: true, opacity: 0.9, depthWrite: false });

  constructor() {
    super();
    this.add(new THREE.Mesh(shell(), this.#material));
    for (const z of [-1, 1]) {
      const ring = new THREE.Mesh(new THREE.TorusGeometry(GLASS.radius, 0.0014, 8, 56), this.#edge);
      ring.position.z = (z * GLASS.height) / 2;
      this.add(ring);
    }
    const axis = new THREE.Mesh(new THREE.CylinderGeometry(0.001, 0.001, 0.2), this.#material);
    this.add(axis.rotateX(Math.PI / 2));
  }

  paint(color: number, opacity: number): void {
    this.#material.color.setHex(color);
    this.#material.opacity = 0.6 * opacity;
    this.#edge.color.setHex(color);
    this.#edge.opacity = Math.min(1, 1.7 * opacity);
  }
}
