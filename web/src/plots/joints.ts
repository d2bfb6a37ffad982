import { made, put } from '../element';
import { partText, wholeText } from '../figures';
import type { Robot, StateMessage } from '../protocol';

interface Row { angle: HTMLElement; at: HTMLElement; speed: HTMLElement; limits: [number, number]; fastest: number; shown: [number, number] }

/** deg, or mm of a sliding joint */
const angleText = (q: number, sliding: boolean): string => (sliding ? `${wholeText(1000 * q)} mm` : `${wholeText((180 / Math.PI) * q)}°`);

/**
 * Position of each joint between its limits, and its speed as a share of the largest allowed. Uses CSS transforms,
 * which need no new layout.
 */
export class Joints {
  readonly #rows: Row[];
  readonly #sliding: boolean[];

  constructor(root: HTMLElement, robot: Robot) {
    this.#sliding = robot.joints.map(({ type }) => type === 'prismatic');
    root.replaceChildren();
    this.#rows = robot.joints.map((joint, i) => {
      const name = partText(joint.name), at = made('i'), speed = made('b'), angle = made('output');
      const limits: [number, number] = [robot.position_min?.[i] ?? -Math.PI, robot.position_max?.[i] ?? Math.PI], fastest = robot.velocity_max?.[i] ?? 1;
      const title = `${name}: from ${angleText(limits[0], this.#sliding[i]!)} to ${angleText(limits[1], this.#sliding[i]!)}; the line below is its speed, full at ${angleText(fastest, this.#sliding[i]!)}/s`;
      root.append(made('div', { title }, made('span', {}, name), made('span', { className: 'bar' }, at, speed), angle));
      return { angle, at, speed, limits, fastest, shown: [NaN, NaN] };
    });
  }

  draw({ q, dq }: StateMessage): void {
    this.#rows.forEach((row, i) => {
      const [low, high] = row.limits, share = Math.round(1000 * Math.min(1, Math.max(0, (q[i]! - low) / (high - low))));
      const speed = Math.round(100 * Math.min(1, Math.abs(dq[i]!) / row.fastest));
      if (share !== row.shown[0]) {
        row.at.style.transform = `translateX(${share / 10}%)`;
        put(row.at.dataset, 'near', String(share < 30 || share > 970));
        put(row.angle, 'textContent', angleText(q[i]!, this.#sliding[i]!));
      }
      if (speed !== row.shown[1]) {
        row.speed.style.transform = `scaleX(${speed / 100})`;
        put(row.speed.dataset, 'near', String(speed >= 98));
      }
      row.shown[0] = share;
      row.shown[1] = speed;
    });
  }
}
