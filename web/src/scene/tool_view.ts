import * as THREE from 'three';
import type { GlassSize, Pose, Tool } from '../protocol';
import { Ghost, Glass } from './glass';
import { Ribbon } from './ribbon';
import { Spill } from './spill';
import { STATE_COLORS, TOOL_COLORS, TOOL_MARKS, toolColor } from './tool_colors';
import { Tube } from './tube';

/** Number of states in the glass's trail, about two seconds. */
const TRAIL = 120;
/** m, of the name above the tool: its height, and where it is. */
const NAME = 0.05, ABOVE = 0.2;

const place = (object: THREE.Object3D, pose: Pose): void => {
  object.position.set(pose.p[0], pose.p[1], pose.p[2]);
  object.quaternion.set(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
};

/** The tool's name in the scene; filled: mouse and keys move this tool. */
function nameSign(name: string, index: number, filled: boolean): THREE.Sprite {
  const canvas = document.createElement('canvas'), c = canvas.getContext('2d')!, color = `#${TOOL_COLORS[index]!.toString(16)}`;
  const font = '600 44px system-ui, sans-serif', text = `${TOOL_MARKS[index]!} ${name}`;
  c.font = font;
  canvas.width = Math.ceil(c.measureText(text).width) + 48;
  canvas.height = 72;
  c.font = font; // the canvas forgets it with a new size
  c.fillStyle = filled ? color : 'rgba(255, 255, 255, 0.85)';
  c.strokeStyle = color;
  c.lineWidth = 4;
  c.beginPath();
  c.roundRect(2, 2, canvas.width - 4, canvas.height - 4, 24);
  c.fill();
  c.stroke();
  c.fillStyle = filled ? '#ffffff' : color;
  c.fillText(text, 24, 51);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const sign = new THREE.Sprite(new THREE.SpriteMaterial({ map, transparent: true, depthTest: false, toneMapped: false }));
  sign.scale.set((NAME * canvas.width) / canvas.height, NAME, 1);
  sign.renderOrder = 5;
  return sign;
}

/** All that is drawn of a tool: its glass, the target, plan, prediction, past, spill, and its name if there are two. */
export class ToolView {
  readonly glass = new Glass();
  readonly ghost = new Ghost();
  readonly #path = new Ribbon(132, 0.0055, 0.95);
  readonly #tube = new Tube(128);
  readonly #trail = new Ribbon(TRAIL, 0.0025, 0.4);
  readonly #spill: Spill;
  /** As the other tool is active, and as this is. */
  #signs: THREE.Sprite[] = [];
  #hasGripper = false;
  color = 0;

  /** @param base the group of the arm's base frame @param scene of the floor */
  constructor(private readonly base: THREE.Group, private readonly scene: THREE.Scene, private readonly index: number, reducedMotion: boolean) {
    this.#spill = new Spill(reducedMotion);
    this.#trail.paint(0x8a94a0);
    this.#tube.paint(index > 0 ? TOOL_COLORS[1] : 0x2f7fd0);
    base.add(this.ghost, this.#trail, this.#path, this.#tube);
    scene.add(this.#spill);
    this.showNow(false);
  }

  /** @param name shown in the scene; empty: it is the only tool */
  fit(glass: GlassSize, hasGripper: boolean, name: string): void {
    this.#hasGripper = hasGripper;
    this.glass.fit(glass);
    this.ghost.fit(glass);
    this.glass.visible = !hasGripper;
    this.ghost.showGripper(hasGripper);
    this.base.remove(...this.#signs);
    this.#signs = name ? [false, true].map((filled) => nameSign(name, this.index, filled)) : [];
    if (this.#signs.length > 0) this.base.add(...this.#signs);
  }

  /** The robot has fewer tools. */
  remove(): void {
    this.base.remove(this.ghost, this.#trail, this.#path, this.#tube, ...this.#signs);
    this.scene.remove(this.#spill);
    this.glass.removeFromParent();
  }

  get spilled(): boolean { return this.#spill.visible; }

  /** The current state is shown, not a recording. */
  showNow(shown: boolean): void {
    this.ghost.visible = this.#path.visible = this.#tube.visible = this.#trail.visible = shown;
    if (!shown) for (const sign of this.#signs) sign.visible = false;
  }

  /** @param level m, of the liquid in a full glass @param t s, of the page's clock */
  show(tool: Tool, active: boolean, stale: boolean, level: number, t: number): void {
    this.color = stale ? STATE_COLORS.idle : toolColor(this.index, tool.state);
    this.open(tool.gripper, tool.engaged);
    place(this.ghost, tool.target);
    this.ghost.paint(this.color, tool.engaged ? 0.5 : 0.28);
    this.#pour(level * (1 - tool.liquid.spilled_share), tool.liquid.tilt[0] ?? 0, tool.liquid.tilt[1] ?? 0, tool.liquid.spilled, t);
    this.#path.begin();
    for (let k = 0; k < tool.path.length; ++k) this.#path.append(tool.path[k]!);
    this.#path.end();
    this.#path.paint(this.color);
    this.#tube.show(tool);
    for (let i = 0; i < this.#signs.length; ++i) {
      const sign = this.#signs[i]!;
      sign.visible = (i === 1) === active;
      sign.position.set(tool.pose.p[0], tool.pose.p[1], tool.pose.p[2] + ABOVE);
    }
  }

  /** @param restarted the session has no past */
  trace(tool: Tool, restarted: boolean): void {
    if (restarted) this.#trail.begin();
    this.#trail.prepend(tool.pose.p);
    this.#trail.end();
  }

  /** Of a recording. @param target null: not known @param level m, of the liquid; null: not known */
  showPast(target: Pose | null, color: number, level: number | null, tilt: readonly [number, number], spilled: boolean, t: number): void {
    this.ghost.visible = target !== null;
    if (target) place(this.ghost, target);
    this.ghost.paint(color, 0.35);
    this.#pour(level ?? this.glass.size.fill, tilt[0], tilt[1], spilled, t);
  }

  /**
   * Its gripper, if it is one.
   * @param closed 0 open to 1 closed; null: not known @param engaged the target may be elsewhere
   */
  open(closed: number | null, engaged: boolean): void { this.ghost.open(closed ?? 0, engaged); }

  #pour(level: number, tiltX: number, tiltY: number, spilled: boolean, t: number): void {
    this.glass.fill(level);
    this.glass.liquid.tilt(tiltX, tiltY);
    this.#spill.update(!this.#hasGripper && spilled, this.glass, t);
  }

  /** See Glass. */
  thicken(coarseness: number): void {
    this.glass.thicken(coarseness);
    this.ghost.thicken(coarseness);
  }
}
