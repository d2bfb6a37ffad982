import * as THREE from 'three';
import { RoomEnvironment } from 'three/examples/jsm/environments/RoomEnvironment.js';
import { SCENE_FROM_ROBOT } from '../frames';
import type { Cell, GlassSize, Pose, Robot, SessionState, StateMessage } from '../protocol';
import { Arm } from './arm';
import { Aside } from './aside';
import { toMatrix } from './body';
import { blindRenderer } from './blind';
import { Ghost, Glass } from './glass';
import { COARSEST, Pace } from './pace';
import { Ribbon } from './ribbon';
import { Room, TABLE } from './room';
import { Spill } from './spill';
import { Surroundings } from './surroundings';
import { Thrift } from './thrift';
import { Tube } from './tube';
import { SeeThrough } from './see_through';
import { View } from './view';

export const STATE_COLORS: Record<SessionState, number> = {
  idle: 0x8a94a0, ready: 0x2f7fd0, engaged: 0x16a085, holding: 0xe0a100, stopping: 0xd1561c, fault: 0xc62828,
};

/** Values of a recording at the time that is shown. */
export interface Past { q(): ArrayLike<number>; readonly gripper: number | null; target(): Pose | null; tilt(): readonly [number, number]; readonly spilled: boolean; readonly spilledShare: number; readonly state: string; readonly fill: number }

/** Colour of another recording next to the one that is shown. */
const OTHER = 0x8a4fbf;
const meshesOf = (robot: Robot): string => `./arms/${robot.meshes ?? robot.name}.glb`;

const NO_PAIR: [number, number] = [-1, -1];
/**
 * Level of `Pace` from which on there are no shadows; software rendering starts here, because triangles cost it more
 * than pixels.
 */
const SHADOWLESS = 2;

/** Share of the screen's pixels that are drawn at each level of `Pace`. */
const SHARES = [1, 0.8, 0.6, 0.4];
/** The same for software rendering for a headset: its board must be readable. */
const SOFTWARE_VR = 0.75;

/**
 * The visible change of a wave (a pixel or two), as a multiple of that of a position: the liquid needs long to settle.
 */
const WAVE_SEEN = 10;

/** Number of states in the glass's trail, about two seconds. */
const TRAIL = 120;

const place = (object: THREE.Object3D, pose: Pose): void => {
  object.position.set(pose.p[0], pose.p[1], pose.p[2]);
  object.quaternion.set(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
};

/** What renders: in virtual machines, remote desktops and browsers without a driver it is the processor. */
function drawing(): 'hardware' | 'software' | 'nothing' {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return 'nothing';
  const name = String(gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name) ? 'software' : 'hardware';
}

/** Everything that is drawn. The arm's base frame is the group `base`; nothing is allocated for each frame. */
export class Stage {
  readonly renderer: THREE.WebGLRenderer;
  /** The browser cannot draw: no WebGL 2. */
  readonly blind: boolean;
  readonly #software: boolean;
  readonly scene = new THREE.Scene();
  readonly view: View;
  readonly base = new THREE.Group();
  readonly ghost = new Ghost();
  readonly glass = new Glass();
  arm: Arm | null = null;
  #robot: { robot: Robot; glass: GlassSize } | null = null;
  #double: Arm | null = null;
  readonly #room: Room;
  readonly #path = new Ribbon(132, 0.0055, 0.95);
  readonly #tube = new Tube(128);
  readonly #seeThrough = new SeeThrough();
  readonly #trail = new Ribbon(TRAIL, 0.0025, 0.4);
  readonly #reach: THREE.Mesh;
  readonly #spill: Spill;
  readonly surroundings = new Surroundings();
  readonly #backdrop = new THREE.Color();
  readonly #target = new THREE.Vector3(); // world frame
  #shownAt = 0;
  #color = 0;
  #sun: THREE.DirectionalLight;
  readonly #sky = new THREE.HemisphereLight(0xffffff, 0x9aa6b4, 1.5);
  #dark = false;
  #still = false;
  #presents = false;
  /** An emulated headset has the canvas, with software rendering. */
  #emulates = false;
  readonly #pace: Pace;
  readonly #thrift: Thrift;
  readonly #aside: Aside;
  /** Shadows are drawn for every second frame: this saves a fifth of the work and is not visible. */
  #shadowsOld = false;
  /** Of the frame that is being drawn on the canvas; null: none is, or the browser cannot report it. */
  #fence: WebGLSync | null = null;
  /** s, since the last drawn frame. */
  #undrawn = 0;
  /** Colour of the state, and whether a spill is drawn. */
  readonly #looks = new Float64Array(2);
  readonly #wave = new Float64Array(3);

  constructor(canvas: HTMLCanvasElement, reducedMotion: boolean) {
    // The page's background shines through; in augmented reality the room does.
    const drawnBy = drawing(), software = drawnBy !== 'hardware';
    this.blind = drawnBy === 'nothing';
    this.#software = software;
    this.renderer = this.blind ? blindRenderer(canvas)
      : new THREE.WebGLRenderer({ canvas, antialias: !software, alpha: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.toneMappingExposure = 0.95;
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType('local-floor');
    this.base.quaternion.set(...(SCENE_FROM_ROBOT as [number, number, number, number]));
    this.base.position.set(0, TABLE, -0.75);
    this.#spill = new Spill(reducedMotion);
    this.#room = new Room(software);
    this.scene.add(this.base, this.#room, this.#spill);
    this.view = new View(canvas, reducedMotion);

    const sun = new THREE.DirectionalLight(0xfff6ea, 2.4);
    this.#sun = sun;
    sun.position.set(-1.5, 3.4, 0.4);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.radius = 5;
    sun.shadow.bias = -0.0004;
    sun.shadow.normalBias = 0.02;
    Object.assign(sun.shadow.camera, { left: -1.5, right: 1.5, top: 1.5, bottom: -1.5, near: 0.5, far: 6 });
    sun.target.position.set(0, 0.7, -0.85);
    const rim = new THREE.DirectionalLight(0xbcd7ff, 0.9);
    rim.position.set(2.2, 2.0, -2.6);
    this.scene.add(sun, sun.target, rim, this.#sky);

    this.#reach = new THREE.Mesh(new THREE.SphereGeometry(1, 48, 24),
      new THREE.MeshBasicMaterial({ color: 0x7b8794, wireframe: true, transparent: true, opacity: 0.08 }));
    this.#reach.visible = false;
    this.#trail.paint(0x8a94a0);
    this.#tube.paint(0x2f7fd0);
    this.base.add(this.surroundings, this.ghost, this.#trail, this.#path, this.#tube, this.#reach);
    this.#now(false);
    this.#pace = new Pace(software ? SHADOWLESS : 0);
    this.#thrift = new Thrift(drawnBy === 'software');
    this.setDark(matchMedia('(prefers-color-scheme: dark)').matches);
    this.#aside = new Aside(this.renderer);
    this.#drawAt(this.#pace.level);
  }

  async setRobot(robot: Robot, glass: GlassSize): Promise<void> {
    if (this.arm) this.base.remove(this.arm);
    this.glass.fit(glass);
    this.ghost.fit(glass);
    const arm = new Arm(robot, glass);
    this.arm = arm;
    arm.tool.add(this.glass);
    this.glass.visible = arm.gripper === null;
    this.ghost.showGripper(arm.gripper !== null);
    this.base.add(arm);
    arm.pose(robot.home);
    // Longest extent from the second joint on; the reference is clipped to it (predict).
    let reach = 0;
    for (const joint of robot.joints.slice(2)) reach += Math.hypot(joint.origin[0]![3]!, joint.origin[1]![3]!, joint.origin[2]![3]!);
    this.#reach.scale.setScalar(reach);
    if (robot.joints[0]) this.#reach.position.setFromMatrixPosition(toMatrix(robot.joints[0].origin));
    this.#robot = { robot, glass };
    if (this.#double) this.base.remove(this.#double);
    this.#double = null;
    await arm.loadMeshes(meshesOf(robot), this.#software);
    this.wake();
  }

  setCell(cell: Cell | null): void {
    this.wake();
    // Objects of the cell without a colour are drawn by the page: the floor and the pedestal.
    const ours = (cell?.objects ?? []).filter((object) => object.color === 'none');
    const floors = ours.filter((object) => object.shape === 'half_space' && object.origin[2]![2]! > 0.999);
    this.base.position.y = floors.length > 0 ? -Math.min(...floors.map((floor) => floor.origin[2]![3]!)) : TABLE;
    this.surroundings.floor = -this.base.position.y;
    this.surroundings.setCell(cell);
    this.#room.showPedestal(floors.length === 0 || ours.some((object) => object.name === 'column'));
  }

  setDark(dark: boolean): void {
    this.#backdrop.setHex(dark ? 0x14181d : 0xe9eef3);
    this.#dark = dark;
    this.#room.setDark(dark);
    this.#seeThrough.faint = dark ? 0.45 : 0.3; // the arm's own grey is nearly that of the night
    this.#light();
    this.wake();
  }

  #light(): void {
    const reflects = this.scene.environment !== null;
    // The arm's own grey is dark: on a dark background it needs more light to look the same.
    this.scene.environmentIntensity = this.#dark ? 0.75 : 0.6;
    this.#sun.intensity = this.#dark ? 2.8 : 2.4;
    this.#sky.intensity = (reflects ? 0.45 : 1.7) * (this.#dark ? 1.3 : 1);
  }

  /** Reflections in metal and glass. Computed once; without a graphics card this takes many seconds. */
  #reflect(): void {
    const pmrem = new THREE.PMREMGenerator(this.renderer);
    this.scene.environment = pmrem.fromScene(new RoomEnvironment(), 0.03, 0.1, 100, { size: 128 }).texture;
    pmrem.dispose();
    this.#light();
  }

  /**
   * Virtual reality has a background of the page; augmented reality shows the real room.
   * @param emulated on the page's own canvas
   */
  present(mode: XRSessionMode | null, emulated = false): void {
    this.#room.visible = mode !== 'immersive-ar';
    this.scene.background = mode === 'immersive-vr' ? this.#backdrop : null;
    // Drawn for both eyes, and the quality is not reduced if frames are late: it starts without the most expensive
    // parts.
    this.#presents = mode !== null;
    this.#emulates = emulated && this.#thrift.software;
    this.#aside.drop();
    this.view.shows(this.#presents);
    this.#shade();
  }
  /** Moves the camera until the whole arm and the target are visible. */
  frameAll(): void {
    const box = new THREE.Box3();
    for (const part of [this.arm, this.ghost]) if (part?.visible) box.expandByObject(part);
    this.surroundings.bound(box);
    this.view.frame(box);
  }

  get spilled(): boolean { return this.#spill.visible; }
  showReach(shown: boolean): void { this.#reach.visible = shown; }

  /**
   * The arm from a recording, with all that is known of that time.
   * @param other another recording, laid over it
   * @param t s, of the page's clock
   */
  showPast(q: ArrayLike<number>, past: Past | null = null, other: Past | null = null, t = 0): void {
    this.arm?.pose(q);
    if (past) this.#open(past.gripper, past.state === 'engaged');
    this.arm?.nearestPair(NO_PAIR, Infinity, false);
    this.#now(false);
    const target = past?.target() ?? null, tilt = past?.tilt();
    if (past && past.fill > 0) this.glass.fill(past.fill * (1 - past.spilledShare));
    this.glass.liquid.tilt(tilt?.[0] ?? 0, tilt?.[1] ?? 0);
    this.ghost.visible = target !== null;
    if (target) place(this.ghost, target);
    this.ghost.paint(STATE_COLORS[past?.state as SessionState] ?? STATE_COLORS.idle, 0.35);
    this.#spill.update(this.glass.visible && (past?.spilled ?? false), this.glass, t);
    if (other && !this.#double) void this.#makeDouble();
    if (this.#double) this.#double.visible = other !== null;
    if (other) this.#double?.pose(other.q());
    if (other) this.#double?.gripper?.open(other.gripper ?? 0);
  }

  /**
   * @param closed 0 open to 1 closed; null: not known, or no gripper
   * @param led engaged: the target may be elsewhere
   */
  #open(closed: number | null, led: boolean): void {
    this.arm?.gripper?.open(closed ?? 0);
    this.ghost.open(closed ?? 0, led);
  }

  /** Creates a second arm that shows another recording. */
  async #makeDouble(): Promise<void> {
    if (!this.#robot) return;
    const { robot, glass } = this.#robot, double = new Arm(robot, glass);
    this.#double = double;
    this.base.add(double);
    const ghost = new Ghost();
    ghost.fit(glass);
    ghost.paint(OTHER, 0.6);
    if (!double.gripper) double.tool.add(ghost);
    await double.loadMeshes(meshesOf(robot), this.#software);
    double.lookThrough(OTHER);
    this.wake();
  }

  #now(shown: boolean): void {
    this.ghost.visible = this.#path.visible = this.#tube.visible = this.#trail.visible = shown;
    if (shown && this.#double) this.#double.visible = false;
  }

  /** @param t s, of the page's clock */
  show(state: StateMessage, stale: boolean, t: number): void {
    const color = stale ? STATE_COLORS.idle : STATE_COLORS[state.state];
    this.#now(true);
    this.arm?.pose(state.q);
    this.#open(state.gripper, state.engaged);
    this.arm?.nearestPair(state.nearest, state.clearance ?? Infinity, state.constraint.kind === 'self_collision');
    this.surroundings.goOn(state.now_s, state.tool);
    this.surroundings.touch(state.constraint.kind === 'obstacle' ? state.constraint.second : -1);
    this.#color = color;
    place(this.ghost, state.target);
    this.ghost.paint(color, state.engaged ? 0.5 : 0.28);
    this.glass.fill(state.controls.fill * (1 - state.liquid.spilled_share));
    this.glass.liquid.tilt(state.liquid.tilt[0] ?? 0, state.liquid.tilt[1] ?? 0);
    this.#spill.update(this.glass.visible && state.liquid.spilled, this.glass, t);
    this.#path.begin();
    for (let k = 0; k < state.path.length; ++k) this.#path.append(state.path[k]!);
    this.#path.end();
    this.#path.paint(color);
    this.#tube.show(state);
    if (state.now_s === this.#shownAt) return;
    // A session that has restarted has no past.
    if (state.now_s < this.#shownAt || state.now_s > this.#shownAt + 1) this.#trail.begin();
    this.#shownAt = state.now_s;
    this.#trail.prepend(state.tool.p);
    this.#trail.end();
  }

  /**
   * Slow machines draw fewer pixels, then no shadows: the operator's motion matters more than the picture.
   * @param dt s, of a frame
   */
  keepPace(dt: number): void {
    if (this.renderer.xr.isPresenting || document.hidden || this.#still) return;
    if (this.#pace.take(dt)) this.#drawAt(this.#pace.level);
  }

  /**
   * Draws every frame of the browser at this quality.
   * @param quality a level of `Pace`; one more than the coarsest: the last picture stays, for tests of everything else
   */
  setQuality(quality: number): void {
    this.#still = quality > COARSEST;
    if (this.#still) return;
    this.#thrift.software = false;
    this.#aside.drop();
    this.#pace.restart(quality);
    this.#drawAt(quality);
  }

  #drawAt(quality: number): void {
    const share = SHARES[quality]!;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2) * share);
    for (const part of [this.glass, this.ghost]) part.thicken(1 / share);
    this.#shade();
    if (quality < 1 && !this.scene.environment && !this.blind) this.#reflect();
  }

  #shade(): void {
    this.#sun.castShadow = !this.#presents && this.#pace.level < SHADOWLESS;
    this.#room.showShadows(this.#sun.castShadow);
  }

  /** @param room see View */
  resize(width: number, height: number, room: readonly [number, number] = [0, 0]): void {
    if (this.renderer.xr.isPresenting) return;
    this.renderer.setSize(width, height, false);
    this.#thrift.blank(performance.now() / 1000);
    this.view.resize(width / height, room);
    this.#pace.restart();
  }

  /** Pixels of a frame in virtual reality, relative to those of the headset. */
  get vrShare(): number { return this.#thrift.software ? SOFTWARE_VR : 1; }

  /** Something visible has changed. */
  wake(): void { this.#thrift.wake(performance.now() / 1000); }

  /** Plans are late: the processor is needed for more than the picture. */
  late(now: number): void { this.#thrift.late(now); }

  /**
   * @param dt s, since the last call
   * @param now s, of the page's clock
   * @param busy the page did other work in this frame
   */
  draw(dt: number, now: number, busy: boolean): void {
    const presents = this.renderer.xr.isPresenting;
    if (!presents) this.view.update(this.ghost.visible ? this.ghost.getWorldPosition(this.#target) : null, dt);
    if (this.#still) {
      this.scene.updateMatrixWorld(); // hits of a pointer need current positions even if nothing is drawn
      return;
    }
    this.#undrawn += dt;
    let sharp = false;
    if (!presents) {
      this.#lookForMotion(now);
      const picture = this.#thrift.next(now, this.#isDrawing(), this.#pace.level > 0, busy);
      if (picture === 'none') return this.scene.updateMatrixWorld();
      sharp = picture === 'sharp';
    } else if (this.#emulates && this.#isDrawing()) {
      this.renderer.xr.updateCamera(this.view.camera);
      this.scene.updateMatrixWorld();
      return this.#aside.keepCanvas();
    }
    if (this.arm) this.#seeThrough.update(this.arm, presents ? this.renderer.xr.getCamera() : this.view.camera, this.glass, this.#undrawn);
    this.#undrawn = 0;
    const { renderer, scene, view: { camera } } = this, ratio = Math.min(devicePixelRatio, 2) * (sharp ? 1 : SHARES[this.#pace.level]!);
    if (this.#emulates) {
      this.#aside.draw(scene, camera, null);
      return this.#aside.keepCanvas();
    }
    if (presents) return renderer.render(scene, camera);
    renderer.shadowMap.needsUpdate = this.#shadowsOld = !this.#shadowsOld;
    if (this.#thrift.software) return this.#aside.draw(scene, camera, ratio, sharp);
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
    renderer.render(scene, camera);
    if (this.#thrift.spares) this.#fenceOff();
  }

  /** Marks the end of a frame's commands: the next frame would wait for a slow one, and the page with it. */
  #fenceOff(): void {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    if (this.#fence) gl.deleteSync(this.#fence);
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  /** Whether the last frame is still being drawn. */
  #isDrawing(): boolean {
    if (this.#aside.draws) return true;
    if (!this.#fence) return false;
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    if (!gl.isContextLost() && gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.SIGNALED) return true;
    gl.deleteSync(this.#fence);
    this.#fence = null;
    return false;
  }

  #lookForMotion(now: number): void {
    const thrift = this.#thrift, { camera } = this.view;
    this.#looks[0] = this.#color;
    this.#looks[1] = this.#spill.visible ? 1 : 0;
    let count = thrift.look(this.#looks, now);
    count = thrift.look(camera.matrixWorld.elements, now, count);
    count = thrift.look(camera.projectionMatrix.elements, now, count);
    count = thrift.look(this.ghost.matrix.elements, now, count);
    count = thrift.look(this.glass.matrixWorld.elements, now, count);
    const { surface } = this.glass.liquid;
    for (let k = 0; k < 3; ++k) this.#wave[k] = surface[k]! / WAVE_SEEN;
    thrift.look(this.#wave, now, count);
  }
}
