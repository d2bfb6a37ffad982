import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import type { GlassSize, Robot } from '../protocol';
import { geometryOf, toMatrix } from './body';
import { WALL } from './glass';
import { Gripper } from './gripper';

const CALM = new THREE.Color(0x8fa0b2);
const LIT = new THREE.Color(0xe0a100);
/** m; a closer pair is shown even if the other bodies are hidden. */
const CLOSE = 0.006;

/** A soap bubble: strong at the edge, so that its inside stays visible. */
class Bubble extends THREE.ShaderMaterial {
  constructor() {
    super({
      transparent: true, depthWrite: false, uniforms: { color: { value: new THREE.Color() }, strength: { value: 1 } },
      vertexShader: `
varying vec3 toEye, outward;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  toEye = -seen.xyz;
  outward = normalMatrix * normal;
  gl_Position = projectionMatrix * seen;
}`,
      fragmentShader: `
uniform vec3 color;
uniform float strength;
varying vec3 toEye, outward;
void main() {
  float edge = 1.0 - abs(dot(normalize(toEye), normalize(outward)));
  gl_FragColor = vec4(color, strength * (0.08 + 0.72 * edge * edge));
  #include <colorspace_fragment>
}`,
    });
  }

  paint(color: THREE.Color, strength: number): void {
    (this.uniforms.color!.value as THREE.Color).copy(color);
    this.uniforms.strength!.value = strength;
  }
}

/** Name of a body that no mesh shows: arms on one base are on it (robots/two_ur5e.yaml). */
const TABLE = 'table';
function tableOf(body: THREE.Mesh): THREE.Mesh {
  const table = new THREE.Mesh(body.geometry, new THREE.MeshStandardMaterial({ color: 0xc3cad2, roughness: 0.7 }));
  table.position.copy(body.position);
  table.quaternion.copy(body.quaternion);
  table.castShadow = table.receiveShadow = true;
  return table;
}

/** A plain gripper from the flange to the glass, so that the glass does not float. */
function holder(tool: THREE.Object3D, glass: GlassSize): THREE.Object3D {
  const group = new THREE.Group();
  const radius = glass.radius + WALL, reach = tool.position.length() - radius;
  if (reach < 0.01) return group;
  const grey = new THREE.MeshStandardMaterial({ color: 0x66707c, roughness: 0.5, metalness: 0.1 }); // seen by day and at night
  const body = new THREE.Mesh(new THREE.CylinderGeometry(0.022, 0.032, reach * 0.75, 32), grey);
  body.position.y = reach * 0.375;
  group.add(body);
  for (const side of [-1, 1]) {
    const finger = new THREE.Mesh(new THREE.BoxGeometry(0.008, reach * 0.3 + 1.4 * radius, 0.02), grey);
    finger.position.set(side * (radius + 0.004), reach * 0.7 + 0.7 * radius, 0);
    group.add(finger);
  }
  group.traverse((part) => { part.castShadow = true; });
  // y along the way to the glass, z along the glass: the fingers are at its sides.
  const y = tool.position.clone().normalize();
  const x = y.clone().cross(new THREE.Vector3(0, 0, 1).applyQuaternion(tool.quaternion)).normalize();
  group.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(x, y, x.clone().cross(y)));
  return group;
}

/** The arm from `describe`: a frame for each link, with meshes and collision bodies attached. */
export class Arm extends THREE.Group {
  /** The controlled frames; the glasses are attached here. */
  readonly tools: THREE.Group[] = [];
  /** Of each tool; null: it holds a glass. */
  readonly grippers: (Gripper | null)[] = [];
  readonly meshes: THREE.Object3D[] = [];
  readonly #links: THREE.Group[] = [];
  readonly #axes: THREE.Vector3[] = [];
  readonly #slides: boolean[] = [];
  readonly #bodies: THREE.Mesh<THREE.BufferGeometry, Bubble>[] = [];
  readonly #materials = new Set<THREE.Material>();
  #bodiesShown = false;
  /** The collision bodies are drawn while the meshes are not loaded. */
  #waits = false;
  readonly #nearest: [number, number] = [-1, -1];
  readonly #mount = new THREE.Matrix4();

  constructor(robot: Robot, glass: GlassSize) {
    super();
    if (robot.mount) this.#mount.copy(toMatrix(robot.mount));
    this.#links.push(this.#frame(this));
    for (const [k, joint] of robot.joints.entries()) {
      const origin = new THREE.Group();
      toMatrix(joint.origin).decompose(origin.position, origin.quaternion, origin.scale);
      this.#links[joint.parent ?? k]!.add(origin);
      this.#links.push(this.#frame(origin));
      this.#axes.push(new THREE.Vector3(...joint.axis).normalize());
      this.#slides.push(joint.type === 'prismatic');
    }
    for (const { link, origin, gripper: closes } of robot.tools) {
      const parent = this.#links[link]!, tool = this.#frame(parent), gripper = closes ? new Gripper() : null;
      toMatrix(origin).decompose(tool.position, tool.quaternion, tool.scale);
      this.tools.push(tool);
      this.grippers.push(gripper);
      if (gripper) tool.add(gripper); else parent.add(holder(tool, glass));
    }
    for (const body of robot.bodies) {
      const mesh = new THREE.Mesh(geometryOf(body), new Bubble());
      toMatrix(body.origin).decompose(mesh.position, mesh.quaternion, mesh.scale);
      mesh.visible = false;
      this.#links[body.link]?.add(mesh);
      this.#bodies.push(mesh);
      if (body.link === 0 && body.name === TABLE) this.#links[0]!.add(tableOf(mesh));
    }
  }

  #frame(parent: THREE.Object3D): THREE.Group {
    const group = new THREE.Group();
    parent.add(group);
    return group;
  }

  /**
   * Loads the mesh with the robot's name, if the server has one; otherwise the collision bodies are drawn.
   * @param coarse for software rendering
   */
  async loadMeshes(url: string, coarse: boolean): Promise<boolean> {
    this.#waits = true;
    this.#paintBodies();
    try {
      const gltf = await new GLTFLoader().loadAsync(url);
      if (coarse) await import('./coarse').then(({ coarsen }) => coarsen(gltf.scene)).catch(() => {}); // fails in a browser without WebAssembly
      this.#links.forEach((link, k) => {
        const node = gltf.scene.getObjectByName(`link${k}`);
        if (!node) return;
        node.traverse((part) => {
          part.castShadow = true;
          part.receiveShadow = true;
          if (part instanceof THREE.Mesh) for (const material of [part.material].flat() as THREE.Material[]) this.#materials.add(material);
        });
        if (k === 0) node.applyMatrix4(this.#mount);
        node.traverse((part) => { // moves only with its link
          part.updateMatrix();
          part.matrixAutoUpdate = false;
        });
        link.add(node);
        this.meshes.push(node);
      });
      return true;
    } catch {
      this.showBodies(true);
      return false;
    } finally {
      this.#waits = false;
      this.#paintBodies();
    }
  }

  /** One translucent colour: this is not the arm itself. */
  lookThrough(color: number): void {
    const material = new THREE.MeshStandardMaterial({ color, transparent: true, opacity: 0.3, roughness: 0.6, depthWrite: false });
    this.traverse((part) => {
      if (!(part instanceof THREE.Mesh) || part.material instanceof Bubble || this.tools.some((tool, i) => !this.grippers[i] && tool.getObjectById(part.id))) return;
      part.material = material;
      part.castShadow = part.receiveShadow = false;
    });
  }

  /** The collision bodies that the arm is planned with, visible or not; also used to test what the arm hides. */
  get bodies(): readonly THREE.Mesh[] { return this.#bodies; }

  /** @param opacity of the meshes; 1: unchanged */
  setOpacity(opacity: number): void {
    for (const material of this.#materials) {
      material.opacity = opacity;
      if (material.transparent === opacity < 1) continue;
      material.transparent = opacity < 1;
      material.needsUpdate = true;
    }
  }

  pose(q: ArrayLike<number>): void {
    for (let k = 0; k < this.#axes.length; ++k) {
      const link = this.#links[k + 1]!, axis = this.#axes[k]!;
      if (this.#slides[k]) link.position.copy(axis).multiplyScalar(q[k] ?? 0);
      else link.quaternion.setFromAxisAngle(axis, q[k] ?? 0);
    }
  }

  showBodies(shown: boolean): void {
    this.#bodiesShown = shown;
    this.#paintBodies();
  }

  /** Highlights the nearest pair: always when it is an active constraint or nearly touches. */
  nearestPair(pair: [number, number], clearance: number, active: boolean): void {
    const shown = this.#bodiesShown || active || clearance < CLOSE;
    const first = shown ? pair[0] : -1, second = shown ? pair[1] : -1;
    if (first === this.#nearest[0] && second === this.#nearest[1]) return;
    this.#nearest[0] = first;
    this.#nearest[1] = second;
    this.#paintBodies();
  }

  #paintBodies(): void {
    this.#bodies.forEach((mesh, i) => {
      const lit = i === this.#nearest[0] || i === this.#nearest[1];
      mesh.visible = this.#bodiesShown || this.#waits || lit;
      mesh.material.paint(lit ? LIT : CALM, lit ? 1 : 0.55);
    });
  }
}
