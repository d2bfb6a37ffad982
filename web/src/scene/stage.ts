import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { RoomEnvironment } from 'three/examples/jsm/environments/RoomEnvironment.js';
import { SCENE_FROM_ROBOT } from '../frames';
import type { Pose, Robot, SessionState, StateMessage } from '../protocol';
import { Arm } from './arm';
import { Ghost, Glass } from './glass';

export const STATE_COLORS: Record<SessionState, number> = {
  idle: 0x8a94a0, ready: 0x2f7fd0, engaged: 0x16a085, holding: 0xe0a100, stopping: 0xd1561c, fault: 0xc62828,
};

/** Height of the table that the arm stands on, m. */
const TABLE = 0.75;

const place = (object: THREE.Object3D, pose: Pose): void => {
  object.position.set(pose.p[0], pose.p[1], pose.p[2]);
  object.quaternion.set(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
};

/** Everything that is drawn. The arm's base frame is the group `base`; nothing is allocated from frame to frame. */
export class Stage {
  readonly renderer: THREE.WebGLRenderer;
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(45, 1, 0.05, 30);
  readonly orbit: OrbitControls;
  readonly base = new THREE.Group();
  readonly ghost = new Ghost();
  readonly glass = new Glass();
  arm: Arm | null = null;
  #room = new THREE.Group();
  #path: THREE.Line<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  #reach: THREE.Mesh;
  #puddle: THREE.Mesh<THREE.CircleGeometry, THREE.MeshStandardMaterial>;
  #grid: THREE.GridHelper | null = null;
  #floor: THREE.Mesh<THREE.CircleGeometry, THREE.MeshStandardMaterial>;
  #spilled = false;
  #sun: THREE.DirectionalLight;
  #quality = 0;
  #framesAtQuality = 0;
  #frameTime = 0.016;

  constructor(canvas: HTMLCanvasElement, reducedMotion: boolean) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType('local-floor');
    const pmrem = new THREE.PMREMGenerator(this.renderer);
    this.scene.environment = pmrem.fromScene(new RoomEnvironment(), 0.03).texture;
    this.scene.environmentIntensity = 0.55;
    pmrem.dispose();

    this.base.quaternion.set(...(SCENE_FROM_ROBOT as [number, number, number, number]));
    this.base.position.set(0, TABLE, -0.75);
    this.scene.add(this.base, this.#room);
    this.camera.position.set(1.35, 1.5, -2.05); // from the side where the glass is
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.target.set(0, 1.05, -0.85);
    this.orbit.enableDamping = !reducedMotion;
    this.orbit.minDistance = 0.4;
    this.orbit.maxDistance = 5;
    this.orbit.maxPolarAngle = 0.55 * Math.PI;
    this.orbit.update();

    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.#sun = sun;
    sun.position.set(1.4, 3.2, 1.2);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.bias = -0.0004;
    sun.shadow.normalBias = 0.02;
    Object.assign(sun.shadow.camera, { left: -1.6, right: 1.6, top: 1.6, bottom: -1.6, near: 0.5, far: 7 });
    sun.target.position.set(0, 0.6, -0.75);
    this.scene.add(sun, sun.target, new THREE.HemisphereLight(0xffffff, 0x8899aa, 0.5));

    this.#floor = new THREE.Mesh(new THREE.CircleGeometry(6, 64), new THREE.MeshStandardMaterial({ roughness: 0.95 }));
    this.#floor.rotateX(-Math.PI / 2);
    this.#floor.receiveShadow = true;
    const post = new THREE.Mesh(new THREE.CylinderGeometry(0.11, 0.15, TABLE, 48),
      new THREE.MeshStandardMaterial({ color: 0x3a434e, roughness: 0.6, metalness: 0.3 }));
    post.position.set(0, TABLE / 2, -0.75);
    post.castShadow = post.receiveShadow = true;
    this.#puddle = new THREE.Mesh(new THREE.CircleGeometry(0.16, 40),
      new THREE.MeshStandardMaterial({ color: 0x8a1c2e, roughness: 0.1, transparent: true, opacity: 0.85 }));
    this.#puddle.rotateX(-Math.PI / 2);
    this.#puddle.visible = false;
    this.#room.add(this.#floor, post, this.#puddle);

    const points = new THREE.BufferGeometry();
    points.setAttribute('position', new THREE.BufferAttribute(new Float32Array(130 * 3), 3));
    points.setDrawRange(0, 0);
    this.#path = new THREE.Line(points, new THREE.LineBasicMaterial({ color: 0x16a085, transparent: true, opacity: 0.95 }));
    this.#path.frustumCulled = false;
    this.#reach = new THREE.Mesh(new THREE.SphereGeometry(1, 48, 24),
      new THREE.MeshBasicMaterial({ color: 0x2f7fd0, wireframe: true, transparent: true, opacity: 0.08 }));
    this.#reach.visible = false;
    this.base.add(this.ghost, this.#path, this.#reach);
    this.setDark(matchMedia('(prefers-color-scheme: dark)').matches);
  }

  async setRobot(robot: Robot): Promise<void> {
    if (this.arm) this.base.remove(this.arm);
    const arm = new Arm(robot);
    this.arm = arm;
    arm.tool.add(this.glass);
    this.base.add(arm);
    arm.pose(robot.home);
    // Longest stretch from the second joint on, as the reference is clipped to (predict).
    let reach = 0;
    for (const joint of robot.joints.slice(2)) reach += Math.hypot(joint.origin[0]![3]!, joint.origin[1]![3]!, joint.origin[2]![3]!);
    this.#reach.scale.setScalar(reach);
    this.#reach.position.set(0, 0, robot.joints[0]?.origin[2]?.[3] ?? 0);
    await arm.loadMeshes(`./arms/${robot.name}.glb`);
  }

  setDark(dark: boolean): void {
    this.scene.background = new THREE.Color(dark ? 0x14171b : 0xe9eef3);
    this.scene.fog = new THREE.Fog(this.scene.background as THREE.Color, 4, 9);
    this.#floor.material.color.setHex(dark ? 0x23282f : 0xd5dce3);
    if (this.#grid) this.#room.remove(this.#grid);
    this.#grid = new THREE.GridHelper(8, 32, dark ? 0x4a5563 : 0x9aa7b5, dark ? 0x333b46 : 0xb9c3cd);
    this.#grid.position.y = 0.001;
    this.#room.add(this.#grid);
  }

  /** Augmented reality: the real room takes the place of ours. */
  showRoom(shown: boolean): void { this.#room.visible = shown; }
  showReach(shown: boolean): void { this.#reach.visible = shown; }

  show(state: StateMessage, stale: boolean): void {
    this.arm?.pose(state.q);
    this.arm?.nearestPair(state.nearest, state.clearance ?? Infinity);
    place(this.ghost, state.target);
    this.ghost.paint(stale ? STATE_COLORS.idle : STATE_COLORS[state.state], state.engaged ? 0.42 : 0.2);
    this.glass.liquid.tilt(state.liquid.tilt[0] ?? 0, state.liquid.tilt[1] ?? 0);
    if (state.liquid.spilled && !this.#spilled) {
      this.glass.getWorldPosition(this.#puddle.position);
      this.#puddle.position.y = 0.004;
    }
    this.#spilled = state.liquid.spilled;
    this.#puddle.visible = this.#spilled;
    const positions = this.#path.geometry.getAttribute('position') as THREE.BufferAttribute;
    const count = Math.min(state.path.length, positions.count);
    for (let k = 0; k < count; ++k) positions.setXYZ(k, state.path[k]![0], state.path[k]![1], state.path[k]![2]);
    positions.needsUpdate = true;
    this.#path.geometry.setDrawRange(0, count);
    this.#path.material.color.setHex(stale ? STATE_COLORS.idle : STATE_COLORS[state.state]);
  }

  /** Machines that draw slowly get fewer pixels, then no shadows: the hand matters more than the picture. @param dt s, of a frame */
  keepPace(dt: number): void {
    if (this.renderer.xr.isPresenting || document.hidden) return;
    this.#frameTime += 0.05 * (dt - this.#frameTime);
    if (++this.#framesAtQuality < 25 || this.#frameTime < 0.03 || this.#quality >= 3) return;
    this.#framesAtQuality = 0;
    this.#frameTime = 0.016;
    this.#quality += 1;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2) * [1, 0.7, 0.5, 0.4][this.#quality]!);
    if (this.#quality >= 2) this.#sun.castShadow = false;
  }

  resize(width: number, height: number): void {
    if (this.renderer.xr.isPresenting) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // Tall and narrow screens look from further away.
    this.camera.fov = width < height ? 62 : 45;
    this.camera.updateProjectionMatrix();
  }

  draw(): void {
    if (!this.renderer.xr.isPresenting) this.orbit.update();
    this.renderer.render(this.scene, this.camera);
  }
}
