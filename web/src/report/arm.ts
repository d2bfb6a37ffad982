import { onResize } from '../element';
import { chainOf } from '../descriptions';
import { resolved } from '../profiles';
import type { Robot, Vec3 } from '../protocol';
import { indexAt, type Player } from '../replay/player';
import { timeText } from './head';

type Matrix = readonly (readonly number[])[];
const IDENTITY: Matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
const times = (a: Matrix, b: Matrix): Matrix => a.map((row) => b[0]!.map((_, j) => row.reduce((sum, value, k) => sum + value * b[k]![j]!, 0)));
/** Rodrigues' formula. */
function turn([x, y, z]: Vec3, angle: number): Matrix {
  const c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
  return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0], [y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0], [z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0], [0, 0, 0, 1]];
}
const shift = ([x, y, z]: Vec3, by: number): Matrix => [[1, 0, 0, x * by], [0, 1, 0, y * by], [0, 0, 1, z * by], [0, 0, 0, 1]];
const place = (pose: Matrix): Vec3 => [pose[0]![3]!, pose[1]![3]!, pose[2]![3]!];

/** Positions of the joints on the way to a tool and of the tool, base frame, m, and the tool's pose. */
export function chain(robot: Pick<Robot, 'mount' | 'joints' | 'tools'>, q: ArrayLike<number>, index = 0): { points: Vec3[]; pose: Matrix } {
  const tool = robot.tools[index]!;
  let pose = IDENTITY; // the first joint's origin includes the mount
  const points = [place(robot.mount ?? IDENTITY)];
  for (const k of chainOf(robot, index)) {
    const { origin, axis, type } = robot.joints[k]!;
    pose = times(times(pose, origin), type === 'prismatic' ? shift(axis, q[k] ?? 0) : turn(axis, q[k] ?? 0));
    points.push(place(pose));
  }
  pose = times(pose, tool.origin);
  points.push(place(pose));
  return { points, pose };
}

/** Most configurations along the tool's path, and the number of the latest that are emphasized. */
const WAY = 3000, LATELY = 20;
/** m: half the size of the tool symbol, and of the drawn ground. */
const TOOL = 0.05, GROUND = 0.75;

/** The measured arm as lines: its configuration at a time, and the path of its tool. Drag to rotate the view. */
export class ArmFigure {
  readonly #canvas: HTMLCanvasElement;
  readonly #told: HTMLElement;
  readonly #times: readonly number[];
  /** The way of each tool. */
  readonly #ways: readonly (readonly Vec3[])[];
  #azimuth = -0.7;
  #tilt = 0.35;
  #at = 0;

  /** @param figure with a canvas, and an output for the time */
  constructor(figure: HTMLElement, private readonly robot: Robot, private readonly player: Player) {
    this.#canvas = figure.querySelector('canvas')!;
    this.#told = figure.querySelector('output')!;
    const { t_s, q } = player.motion, stride = Math.ceil(t_s.length / WAY), kept = t_s.flatMap((_, i) => (i % stride === 0 ? [i] : []));
    this.#times = kept.map((i) => t_s[i]! - player.begin);
    this.#ways = robot.tools.map((_, tool) => kept.map((i) => chain(robot, q[i]!, tool).points.at(-1)!));
    this.#canvas.onpointermove = (event) => {
      if (!event.buttons) return;
      this.#azimuth += event.movementX * 0.01;
      this.#tilt = Math.min(1.4, Math.max(-0.2, this.#tilt + event.movementY * 0.01));
      this.draw();
    };
    onResize(this.#canvas, () => this.draw());
  }

  /** @param at s, from the start */
  show(at: number): void {
    if (at === this.#at) return;
    this.#at = at;
    this.draw();
  }

  #project([x, y, z]: Vec3): [number, number] {
    const u = x * Math.sin(this.#azimuth) + y * Math.cos(this.#azimuth), v = x * Math.cos(this.#azimuth) - y * Math.sin(this.#azimuth);
    return [-u, z * Math.cos(this.#tilt) + v * Math.sin(this.#tilt) - 0.3];
  }

  draw(): void {
    const ratio = devicePixelRatio, canvas = this.#canvas, width = canvas.width = canvas.clientWidth * ratio, height = canvas.height = canvas.clientHeight * ratio;
    const c = canvas.getContext('2d')!, unit = Math.min(width, height) / 1.45;
    const line = (points: readonly Vec3[], color: string, thick: number, alpha = 1): void => {
      c.beginPath();
      points.map((point) => this.#project(point)).forEach(([u, v], i) => c[i ? 'lineTo' : 'moveTo'](width / 2 + unit * u, height / 2 - unit * v));
      c.strokeStyle = resolved(`var(--${color})`);
      c.globalAlpha = alpha;
      c.lineWidth = thick * ratio;
      c.lineJoin = c.lineCap = 'round';
      c.stroke();
      c.globalAlpha = 1;
    };
    for (let k = -3; k <= 3; ++k) {
      line([[k / 4, -GROUND, 0], [k / 4, GROUND, 0]], 'grid', 1);
      line([[-GROUND, k / 4, 0], [GROUND, k / 4, 0]], 'grid', 1);
    }
    const now = indexAt(this.#times, this.#at) + 1;
    this.#ways.forEach((way, tool) => {
      line(way, 'muted', 1, 0.5);
      line(way.slice(Math.max(0, now - LATELY), now), tool === 0 ? 'ink' : 'tool-2', 2, 0.8);
      const { points, pose } = chain(this.robot, this.player.q(this.#at), tool), [x, y, z] = points.at(-1)!, [a, b, d] = [0, 1, 2].map((i) => pose[i]![2]! * TOOL) as [number, number, number];
      line(points, 'muted', 9);
      line(points, 'panel', 4);
      line([[x - a, y - b, z - d], [x + a, y + b, z + d]], 'liquid', 8);
    });
    this.#told.textContent = timeText(this.#at);
  }
}
