import * as THREE from 'three';
import { RoomEnvironment } from 'three/examples/jsm/environments/RoomEnvironment.js';
import { SCENE_FROM_ROBOT } from '../frames';
import { chainOf } from '../descriptions';
import type { Cell, GlassSize, Pose, Robot, SessionState, StateMessage } from '../protocol';
import { Arm } from './arm';
import { Aside } from './aside';
import { toMatrix } from './body';
import { blindRenderer } from './blind';
import { Ghost, type Glass } from './glass';
import { COARSEST, Pace } from './pace';
import { Room, TABLE } from './room';
import { Surroundings } from './surroundings';
import { Thrift } from './thrift';
import { SeeThrough } from './see_through';
import { STATE_COLORS, toolColor } from './tool_colors';
import { ToolView } from './tool_view';
import { View } from './view';

/** Values of a recording at the time that is shown, and those of each of its tools. */
export interface Past { q(): ArrayLike<number>; readonly tools: readonly Past[]; readonly gripper: number | null; target(): Pose | null; tilt(): readonly [number, number]; readonly spilled: boolean; readonly spilledShare: number; readonly state: string; readonly fill: number }

/** Colour of another recording next to the one that is shown. */
const OTHER = 0x8a4fbf;
const meshesOf = (robot: Robot): string => `./arms/${robot.meshes ?? robot.name}.glb`;

const NO_PAIR: [number, number] = [-1, -1];
const UPRIGHT = [0, 0] as const;
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
  /** One for each tool of the robot. */
  readonly tools: ToolView[] = [];
  /** Index of the tool that mouse and keys move: the view keeps it in sight. */
  active = 0;
  arm: Arm | null = null;
  #robot: { robot: Robot; glass: GlassSize } | null = null;
  #double: Arm | null = null;
  readonly #room: Room;
  readonly #seeThrough = new SeeThrough();
  readonly #reach = new THREE.Group();
  readonly surroundings = new Surroundings();
  readonly #backdrop = new THREE.Color();
  readonly #target = new THREE.Vector3(); // world frame
  #shownAt = 0;
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
  /** Colours of the tools, and whether a spill is drawn and which tool is active. */
  readonly #looks = new Float64Array(3);
  readonly #wave = new Float64Array(3);

  constructor(canvas: HTMLCanvasElement, private readonly reducedMotion: boolean) {
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
    this.#room = new Room(software);
    this.scene.add(this.base, this.#room);
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

    this.#reach.visible = false;
    this.base.add(this.surroundings, this.#reach);
    this.tools.push(new ToolView(this.base, this.scene, 0, reducedMotion));
    this.#pace = new Pace(software ? SHADOWLESS : 0);
    this.#thrift = new Thrift(drawnBy === 'software');
    this.setDark(matchMedia('(prefers-color-scheme: dark)').matches);
    this.#aside = new Aside(this.renderer);
    this.#drawAt(this.#pace.level);
  }

  async setRobot(robot: Robot, glass: GlassSize): Promise<void> {
    if (this.arm) this.base.remove(this.arm);
    const arm = new Arm(robot, glass);
    this.arm = arm;
    while (this.tools.length > arm.tools.length) this.tools.pop()!.remove();
    this.#reach.clear();
    arm.tools.forEach((frame, i) => {
      const tool = this.tools[i] ??= new ToolView(this.base, this.scene, i, this.reducedMotion);
      tool.fit(glass, arm.grippers[i] !== null, arm.tools.length > 1 ? robot.tools[i]!.name : '');
      tool.thicken(1 / SHARES[this.#pace.level]!);
      frame.add(tool.glass);
      this.#addReach(robot, i);
    });
    this.active = Math.min(this.active, arm.tools.length - 1);
    this.view.forArms(arm.tools.length);
    this.base.add(arm);
    arm.pose(robot.home);
    this.#robot = { robot, glass };
    if (this.#double) this.base.remove(this.#double);
    this.#double = null;
    await arm.loadMeshes(meshesOf(robot), this.#software);
    this.wake();
  }

  /** Longest extent from an arm's second joint on; the reference is clipped to it (predict). */
  #addReach(robot: Robot, tool: number): void {
    const chain = chainOf(robot, tool).map((k) => robot.joints[k]!), sphere = new THREE.Mesh(new THREE.SphereGeometry(1, 48, 24),
      new THREE.MeshBasicMaterial({ color: 0x7b8794, wireframe: true, transparent: true, opacity: 0.08 }));
    sphere.scale.setScalar(chain.slice(2).reduce((sum, { origin }) => sum + Math.hypot(origin[0]![3]!, origin[1]![3]!, origin[2]![3]!), 0));
    if (chain[0]) sphere.position.setFromMatrixPosition(toMatrix(chain[0].origin));
    this.#reach.add(sphere);
  }

  get #tool(): ToolView { return this.tools[this.active] ?? this.tools[0]!; }
  /** Target of the active tool. */
  get ghost(): Ghost { return this.#tool.ghost; }
  /** Of the active tool. */
  get glass(): Glass { return this.#tool.glass; }

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
    for (const part of [this.arm, ...this.tools.map(({ ghost }) => ghost)]) if (part?.visible) box.expandByObject(part);
    this.surroundings.bound(box);
    this.view.frame(box);
  }

  get spilled(): boolean { return this.tools.some(({ spilled }) => spilled); }
  showReach(shown: boolean): void { this.#reach.visible = shown; }

  /**
   * The arm from a recording, with all that is known of that time.
   * @param other another recording, laid over it
   * @param t s, of the page's clock
   */
  showPast(q: ArrayLike<number>, past: Past | null = null, other: Past | null = null, t = 0): void {
    this.arm?.pose(q);
    this.arm?.nearestPair(NO_PAIR, Infinity, false);
    this.#now(false);
    for (let i = 0; i < this.tools.length; ++i) {
      const of = past?.tools[i] ?? null, state = of && of.state in STATE_COLORS ? of.state as SessionState : 'idle';
      if (of) this.#open(i, of.gripper, of.state === 'engaged');
      this.tools[i]!.showPast(of?.target() ?? null, toolColor(i, state), of && of.fill > 0 ? of.fill * (1 - of.spilledShare) : null, of?.tilt() ?? UPRIGHT, of?.spilled ?? false, t);
    }
    if (other && !this.#double) void this.#makeDouble();
    if (this.#double) this.#double.visible = other !== null;
    if (other) this.#double?.pose(other.q());
    other?.tools.forEach(({ gripper }, i) => this.#double?.grippers[i]?.open(gripper ?? 0));
  }

  /** See ToolView::open. */
  #open(tool: number, closed: number | null, engaged: boolean): void {
    this.arm?.grippers[tool]?.open(closed ?? 0);
    this.tools[tool]!.open(closed, engaged);
  }

  /** Creates a second arm that shows another recording. */
  async #makeDouble(): Promise<void> {
    if (!this.#robot) return;
    const { robot, glass } = this.#robot, double = new Arm(robot, glass);
    this.#double = double;
    this.base.add(double);
    double.tools.forEach((frame, i) => {
      if (double.grippers[i]) return;
      const ghost = new Ghost();
      ghost.fit(glass);
      ghost.paint(OTHER, 0.6);
      frame.add(ghost);
    });
    await double.loadMeshes(meshesOf(robot), this.#software);
    double.lookThrough(OTHER);
    this.wake();
  }

  #now(shown: boolean): void {
    for (let i = 0; i < this.tools.length; ++i) this.tools[i]!.showNow(shown);
    if (shown && this.#double) this.#double.visible = false;
  }

  /** @param t s, of the page's clock */
  show(state: StateMessage, stale: boolean, t: number): void {
    const restarted = state.now_s < this.#shownAt || state.now_s > this.#shownAt + 1, isNew = state.now_s !== this.#shownAt;
    this.#shownAt = state.now_s;
    this.#now(true);
    this.arm?.pose(state.q);
    this.arm?.nearestPair(state.nearest, state.clearance ?? Infinity, state.constraint.kind === 'self_collision');
    this.surroundings.goOn(state.now_s, state.tools);
    this.surroundings.touch(state.constraint.kind === 'obstacle' ? state.constraint.second : -1);
    for (let i = 0; i < this.tools.length; ++i) {
      const tool = state.tools[i], drawn = this.tools[i]!;
      if (!tool) continue;
      this.arm?.grippers[i]?.open(tool.gripper ?? 0);
      drawn.show(tool, i === this.active, stale, state.controls.fill, t);
      if (isNew) drawn.trace(tool, restarted);
    }
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
    for (const tool of this.tools) tool.thicken(1 / share);
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
    if (this.arm) this.#seeThrough.update(this.arm, presents ? this.renderer.xr.getCamera() : this.view.camera, this.glass, this.arm.grippers[this.active] !== null, this.#undrawn);
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
    this.#looks.fill(0);
    for (let i = 0; i < this.tools.length; ++i) this.#looks[i] = this.tools[i]!.color;
    this.#looks[2] = (this.spilled ? 1 : 0) + 2 * this.active;
    let count = thrift.look(this.#looks, now);
    count = thrift.look(camera.matrixWorld.elements, now, count);
    count = thrift.look(camera.projectionMatrix.elements, now, count);
    for (let i = 0; i < this.tools.length; ++i) {
      const { ghost, glass } = this.tools[i]!;
      count = thrift.look(ghost.matrix.elements, now, count);
      count = thrift.look(glass.matrixWorld.elements, now, count);
      for (let k = 0; k < 3; ++k) this.#wave[k] = glass.liquid.surface[k]! / WAVE_SEEN;
      count = thrift.look(this.#wave, now, count);
    }
  }
}
