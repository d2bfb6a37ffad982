import * as THREE from 'three';
import type { Cell, CellObject, Pose } from '../protocol';
import { geometryOf, toMatrix } from './body';

/** m, size of the drawn piece of a half-space's surface. */
const SIZE = 2.4;
const ONE = new THREE.Vector3(1, 1, 1);
const PLAIN = 0x8b9bb0, TOUCHED = 0xe0a100;

const surfaceOf = (object: CellObject, grown: number): THREE.BufferGeometry => {
  switch (object.shape) {
    case 'half_space': return new THREE.PlaneGeometry(SIZE, SIZE).translate(0, 0, grown);
    case 'box': return geometryOf({ ...object, link: 0, size: [object.size[0] + 2 * grown, object.size[1] + 2 * grown, object.size[2] + 2 * grown], rounding: object.rounding + grown });
    case 'cylinder': return geometryOf({ ...object, link: 0, length: object.length + 2 * grown, radius: object.radius + grown });
    default: return geometryOf({ ...object, link: 0, radius: object.radius + grown });
  }
};

/** Names of boxes added on the page, and m above the floor below which they need no stand. */
const ADDED = /^box \d+$/, LOW = 0.02;

/**
 * Under an added box: a table of its size on a leg, and its shadow on the floor. It is only drawn: the planner knows
 * the box, not the table.
 */
class Stand extends THREE.Group {
  /** @param height m, from the floor @param width m, of the box */
  constructor(height: number, width: number) {
    super();
    const metal = new THREE.MeshStandardMaterial({ color: 0x9aa6b4, roughness: 0.6, transparent: true, opacity: 0.55 });
    if (height > LOW) {
      const leg = new THREE.Mesh(new THREE.CylinderGeometry(0.012, 0.012, height, 12), metal), top = new THREE.Mesh(new THREE.CylinderGeometry(0.75 * width, 0.75 * width, 0.008, 40), metal);
      leg.rotation.x = top.rotation.x = Math.PI / 2;
      leg.position.z = -height / 2;
      top.position.z = -0.004;
      this.add(leg, top);
    }
    const disc = new THREE.CircleGeometry(width, 40), count = disc.getAttribute('position').count, shade = new Float32Array(4 * count);
    shade[3] = 0.45; // opacity in the middle; 0 at the edge
    disc.setAttribute('color', new THREE.BufferAttribute(shade, 4));
    const shadow = new THREE.Mesh(disc, new THREE.MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
    shadow.position.z = 0.003 - height;
    this.add(shadow);
  }

  free(): void {
    for (const part of this.children as THREE.Mesh<THREE.BufferGeometry, THREE.Material>[]) {
      part.geometry.dispose();
      part.material.dispose();
    }
  }
}

/** An obstacle, and more faintly the margin that is kept around it. */
class Solid extends THREE.Group {
  readonly surface: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  readonly #margin: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  readonly #stand: Stand | null = null;

  /** @param floor m, its height in the base's frame */
  constructor(public object: CellObject, floor: number) {
    super();
    const plane = object.shape === 'half_space';
    this.surface = new THREE.Mesh(surfaceOf(object, 0), new THREE.MeshStandardMaterial({
      color: new THREE.Color(object.color.startsWith('#') ? object.color : PLAIN), roughness: 0.8, side: THREE.DoubleSide,
      transparent: plane, opacity: plane ? 0.45 : 1, depthWrite: !plane,
    }));
    this.surface.receiveShadow = true;
    this.surface.castShadow = !plane;
    this.surface.visible = object.color !== 'none' && !object.holds_only_tool;
    this.#margin = new THREE.Mesh(surfaceOf(object, object.margin), new THREE.MeshBasicMaterial({
      color: TOUCHED, transparent: true, opacity: 0.16, depthWrite: false, side: THREE.DoubleSide,
    }));
    this.#margin.visible = false;
    this.add(this.surface, this.#margin);
    if (object.shape === 'box' && ADDED.test(object.name)) {
      const [width, , high] = object.size, below = object.origin[2]![3]! - high / 2 - floor;
      this.#stand = new Stand(Math.max(below, 0), width);
      this.#stand.position.z = -high / 2;
      this.add(this.#stand);
    }
    this.stand(object);
  }

  /** Moves the carried object with its tool. @param tools poses in the base's frame */
  ride(tools: readonly THREE.Matrix4[]): void {
    if (this.object.attached) toMatrix(this.object.origin).premultiply(tools[this.object.tool ?? 0]!).decompose(this.position, this.quaternion, this.scale);
  }

  stand(object: CellObject): void {
    this.object = object;
    if (this.#stand) this.#stand.visible = !object.attached;
    toMatrix(object.origin).decompose(this.position, this.quaternion, this.scale);
  }

  /** Moves the object by its velocity. @param t s, since it was at its origin */
  goOn(t: number): void {
    const { velocity, origin } = this.object; // destructuring its entries would use an iterator and allocate each time
    if (velocity[0] || velocity[1] || velocity[2]) this.position.set(origin[0]![3]! + t * velocity[0], origin[1]![3]! + t * velocity[1], origin[2]![3]! + t * velocity[2]);
  }

  touched(now: boolean): void { this.#margin.visible = now; }

  free(): void {
    this.#stand?.free();
    for (const mesh of [this.surface, this.#margin]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}

const looks = ({ origin: _, velocity: __, ...rest }: CellObject): string => JSON.stringify(rest);

/** The obstacles, in the base's frame of the arm. */
export class Surroundings extends THREE.Group {
  #solids: Solid[] = [];
  /** m, height of the floor in the base's frame. */
  floor = -0.75;
  #touched = -1;
  /** s, on the session's clock. */
  #at = 0;
  readonly #tools = [new THREE.Matrix4(), new THREE.Matrix4()];
  readonly #p = new THREE.Vector3();
  readonly #q = new THREE.Quaternion();
  readonly #hits: THREE.Intersection[] = [];

  setCell(cell: Cell | null): void {
    const before = new Map(this.#solids.map((solid) => [looks(solid.object), solid]));
    this.#solids = (cell?.objects ?? []).map((object) => {
      const same = before.get(looks(object));
      if (!same) return new Solid(object, this.floor);
      before.delete(looks(object));
      same.stand(object);
      return same;
    });
    for (const gone of before.values()) gone.free();
    this.clear();
    for (const solid of this.#solids) {
      solid.touched(false);
      this.add(solid);
    }
    this.#touched = -1;
    this.#at = cell?.at_s ?? 0;
  }

  /** Moves objects that have a velocity or are carried. @param now s, on the session's clock @param tools poses in the base */
  goOn(now: number, tools: readonly { pose: Pose }[]): void {
    for (let i = 0; i < tools.length; ++i) {
      const { p, q } = tools[i]!.pose;
      this.#tools[i]!.compose(this.#p.fromArray(p), this.#q.fromArray(q), ONE);
    }
    for (let i = 0; i < this.#solids.length; ++i) {
      this.#solids[i]!.goOn(now - this.#at);
      this.#solids[i]!.ride(this.#tools);
    }
  }

  /** Highlights the object of the active constraint; -1: none. */
  touch(index: number): void {
    if (index === this.#touched) return;
    this.#solids[this.#touched]?.touched(false);
    this.#solids[index]?.touched(true);
    this.#touched = index;
  }

  /** The object that a tool carries, or else the one with this name, if it exists; empty: neither. Allocates nothing. */
  carriedOr(name: string, tool: number): string {
    let found = '';
    for (let i = 0; i < this.#solids.length; ++i) {
      const { object } = this.#solids[i]!;
      if (object.attached && (object.tool ?? 0) === tool) return object.name;
      if (object.name === name) found = name;
    }
    return found;
  }

  get objects(): CellObject[] { return this.#solids.map((solid) => solid.object); }
  solid(name: string): THREE.Object3D | undefined { return this.#solids.find((solid) => solid.object.name === name); }
  /** Extends the box to all visible objects of finite size. */
  bound(box: THREE.Box3): void {
    for (const solid of this.#solids) if (solid.surface.visible && solid.object.shape !== 'half_space') box.expandByObject(solid);
  }

  /** Puts the object where the server reported it. */
  standAsTold(name: string): void { for (const solid of this.#solids) if (solid.object.name === name) solid.stand(solid.object); }

  /** The object that a ray meets first, and where, world frame; planes do not count. */
  under(ray: THREE.Raycaster, where: THREE.Vector3): CellObject | null {
    let nearest = Infinity, found: CellObject | null = null;
    for (const { surface, object } of this.#solids) {
      if (!surface.visible || object.shape === 'half_space' || object.attached) continue;
      this.#hits.length = 0;
      ray.intersectObject(surface, false, this.#hits);
      const hit = this.#hits[0];
      if (!hit || hit.distance >= nearest) continue;
      nearest = hit.distance;
      found = object;
      where.copy(hit.point);
    }
    return found;
  }
}
