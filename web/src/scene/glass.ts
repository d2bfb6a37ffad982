import * as THREE from 'three';
import type { GlassSize } from '../protocol';
import { circle } from './circle';
import { Gripper } from './gripper';

/** m, thickness of the wall drawn around the inside, whose size the server sends. */
export const WALL = 0.0025;

/** m of liquid that is too thin to be seen. */
const FILM = 5e-4;

const SIDES = 40;
const { cos, sin } = circle(SIDES);

/** A cylinder whose top is a plane that tilts; the vertices move, nothing is allocated. */
class LiquidBody extends THREE.Mesh<THREE.BufferGeometry, THREE.MeshPhysicalMaterial> {
  #size: GlassSize = { radius: 0, height: 0, fill: 0 };
  /** m, rise at the wall along x and y, and of the middle: the visible part of a wave. */
  readonly surface: [number, number, number] = [0, 0, 0];
  readonly #position: THREE.BufferAttribute;
  readonly #normal: THREE.BufferAttribute;

  constructor() {
    const geometry = new THREE.BufferGeometry();
    const rows = SIDES + 1;
    const position = new THREE.BufferAttribute(new Float32Array((3 * rows + 1) * 3), 3);
    const normal = new THREE.BufferAttribute(new Float32Array((3 * rows + 1) * 3), 3);
    geometry.setAttribute('position', position);
    geometry.setAttribute('normal', normal);
    const index: number[] = [];
    for (let i = 0; i < SIDES; ++i) {
      index.push(i, i + 1, rows + i, i + 1, rows + i + 1, rows + i);
      index.push(3 * rows, 2 * rows + i, 2 * rows + i + 1);
    }
    geometry.setIndex(index);
    super(geometry, new THREE.MeshPhysicalMaterial({
      color: 0x9c1f33, roughness: 0.12, transparent: true, opacity: 0.9, side: THREE.DoubleSide, forceSinglePass: true,
    }));
    this.#position = position;
    this.#normal = normal;
  }

  fit(size: GlassSize): void {
    this.#size = size;
    this.visible = size.fill > FILM;
    const rows = SIDES + 1, bottom = -size.height / 2, r = size.radius - 0.0005; // more would shine through the wall
    for (let i = 0; i < rows; ++i) {
      for (const row of [0, rows, 2 * rows]) this.#position.setXYZ(row + i, r * cos[i]!, r * sin[i]!, bottom);
      for (const row of [0, rows]) this.#normal.setXYZ(row + i, cos[i]!, sin[i]!, 0);
    }
    this.tilt(0, 0);
    this.geometry.computeBoundingSphere();
  }

  /** rad, of the surface's normal about the glass's x and y. */
  tilt(aboutX: number, aboutY: number): void {
    const rows = SIDES + 1, top = this.#size.height / 2, middle = this.#size.fill - top;
    const sx = -Math.tan(Math.max(-1.2, Math.min(1.2, aboutY))), sy = Math.tan(Math.max(-1.2, Math.min(1.2, aboutX)));
    const n = Math.hypot(sx, sy, 1);
    this.surface[0] = sx * this.#size.radius;
    this.surface[1] = sy * this.#size.radius;
    this.surface[2] = middle;
    const p = this.#position.array, normals = this.#normal.array;
    for (let i = 0; i <= SIDES; ++i) {
      const rim = 3 * (rows + i), surface = 3 * (2 * rows + i);
      p[rim + 2] = p[surface + 2] = Math.min(top, Math.max(-top, middle + sx * p[rim]! + sy * p[rim + 1]!));
    }
    p[3 * 3 * rows + 2] = middle;
    for (let k = 3 * 2 * rows; k < normals.length; k += 3) {
      normals[k] = -sx / n;
      normals[k + 1] = -sy / n;
      normals[k + 2] = 1 / n;
    }
    this.#position.needsUpdate = true;
    this.#normal.needsUpdate = true;
  }
}

function shell({ radius: r, height: h }: GlassSize): THREE.BufferGeometry {
  const w = WALL;
  const outline = [[0, -h / 2 - w], [r + w, -h / 2 - w], [r + w, h / 2], [r, h / 2], [r, -h / 2], [0, -h / 2]];
  const lathe = new THREE.LatheGeometry(outline.map(([x, y]) => new THREE.Vector2(x, y)), 48);
  return lathe.rotateX(Math.PI / 2); // its axis along z
}

/** Replaces a mesh's shape by a new one. */
function reshape(mesh: THREE.Mesh, geometry: THREE.BufferGeometry): void {
  mesh.geometry.dispose();
  mesh.geometry = geometry;
}

/** The glass, axis along z, origin at its centre. It has no shape until the server has sent its size. */
export class Glass extends THREE.Group {
  readonly liquid = new LiquidBody();
  size: GlassSize = { radius: 0, height: 0, fill: 0 };
  readonly #body: THREE.Mesh;
  readonly #rim: THREE.Mesh;
  readonly #foot: THREE.Mesh;
  readonly #behind: THREE.Mesh[];
  #coarseness = 1;

  constructor() {
    super();
    const material = new THREE.MeshPhysicalMaterial({
      color: 0xe6f0f7, roughness: 0.04, metalness: 0, clearcoat: 1, transparent: true, opacity: 0.28, side: THREE.DoubleSide, depthWrite: false,
      forceSinglePass: true, // with two passes three.js looks up the program again in every frame
    });
    this.#body = new THREE.Mesh(new THREE.BufferGeometry(), material);
    this.#body.castShadow = true;
    this.#body.renderOrder = 2;
    // The edges that make a glass recognizable.
    const edge = new THREE.MeshPhysicalMaterial({ color: 0xffffff, roughness: 0.05, clearcoat: 1, transparent: true, opacity: 0.75 });
    this.#rim = new THREE.Mesh(new THREE.BufferGeometry(), edge);
    this.#foot = new THREE.Mesh(new THREE.BufferGeometry(), edge);
    this.#rim.renderOrder = this.#foot.renderOrder = 3;
    // Where the arm hides the glass, its edges are seen through the arm; drawn before the liquid, which hides nothing.
    const through = new THREE.MeshBasicMaterial({ color: 0x6b7886, transparent: true, opacity: 0.45, depthFunc: THREE.GreaterDepth, depthWrite: false });
    this.#behind = [this.#rim, this.#foot].map((edge) => {
      const mesh = new THREE.Mesh(edge.geometry, through);
      mesh.renderOrder = -0.5;
      edge.add(mesh);
      return mesh;
    });
    this.add(this.liquid, this.#body, this.#rim, this.#foot);
  }

  /** m of liquid. */
  fill(height: number): void {
    if (height === this.size.fill || this.size.height === 0) return;
    this.size = { ...this.size, fill: height };
    this.liquid.fit(this.size);
  }

  /** At a low resolution edges must be wider. @param coarseness 1: as wide as the glass */
  thicken(coarseness: number): void {
    if (coarseness === this.#coarseness) return;
    this.#coarseness = coarseness;
    if (this.size.height > 0) this.fit(this.size);
  }

  fit(size: GlassSize): void {
    this.size = size;
    const outside = size.radius + WALL;
    this.liquid.fit(size);
    reshape(this.#body, shell(size));
    const edge = WALL * this.#coarseness;
    reshape(this.#rim, new THREE.TorusGeometry(size.radius + WALL / 2, edge / 2, 10, 56));
    reshape(this.#foot, new THREE.CylinderGeometry(outside, outside * 0.96, 2 * edge, 48).rotateX(Math.PI / 2));
    [this.#rim, this.#foot].forEach((part, i) => { this.#behind[i]!.geometry = part.geometry; });
    this.#rim.position.z = size.height / 2;
    this.#foot.position.z = -size.height / 2 - WALL;
  }
}

/** The target: where the glass should be. */
export class Ghost extends THREE.Group {
  readonly #material = new THREE.MeshBasicMaterial({ color: 0x16a085, transparent: true, opacity: 0.3, depthWrite: false });
  readonly #edge = new THREE.MeshBasicMaterial({ color: 0x16a085, transparent: true, opacity: 0.9, depthWrite: false });
  readonly #body = new THREE.Mesh(new THREE.BufferGeometry(), this.#material);
  #size: GlassSize | null = null;
  #coarseness = 1;
  #gripper: Gripper | null = null;
  readonly #rings = [-1, 1].map(() => new THREE.Mesh(new THREE.BufferGeometry(), this.#edge)); // bottom and top

  constructor() {
    super();
    this.add(this.#body, ...this.#rings);
    const axis = new THREE.Mesh(new THREE.CylinderGeometry(0.001, 0.001, 0.2), this.#material);
    this.add(axis.rotateX(Math.PI / 2));
  }

  /** Shows a gripper as the target, or a glass again. */
  showGripper(shown: boolean): void {
    if (shown && !this.#gripper) this.add(this.#gripper = new Gripper(this.#material));
    if (this.#gripper) this.#gripper.visible = shown;
    for (const part of [this.#body, ...this.#rings]) part.visible = !shown;
  }

  /** See Gripper. @param wanted the target differs from the tool; otherwise the ghost would only tint the tool */
  open(closed: number, wanted: boolean): void {
    if (!this.#gripper || this.#body.visible) return;
    this.#gripper.open(closed);
    this.#gripper.visible = wanted;
  }

  /** See Glass. */
  thicken(coarseness: number): void {
    if (coarseness === this.#coarseness) return;
    this.#coarseness = coarseness;
    if (this.#size) this.fit(this.#size);
  }

  fit(size: GlassSize): void {
    this.#size = size;
    reshape(this.#body, shell(size));
    this.#rings.forEach((ring, top) => {
      reshape(ring, new THREE.TorusGeometry(size.radius + WALL, 0.0014 * this.#coarseness, 8, 56));
      ring.position.z = (top - 0.5) * size.height;
    });
  }

  paint(color: number, opacity: number): void {
    this.#material.color.setHex(color);
    this.#material.opacity = 0.6 * opacity;
    this.#edge.color.setHex(color);
    this.#edge.opacity = Math.min(1, 1.7 * opacity);
  }
}
