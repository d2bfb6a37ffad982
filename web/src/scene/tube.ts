import type { Tool } from '../protocol';
import { Ribbon } from './ribbon';

/** Standard deviations that the tube shows across the way of the hand: it contains the hand in seven of eight cases. */
const SHOWN = 2;
/** m: the tube ends at this radius, as after a shake: a more uncertain prediction is not worth showing. */
const WIDEST = 0.1;

/**
 * Where the hand may be over the horizon: around its expected way, as wide as the uncertainty, until this is too
 * large.
 */
export class Tube extends Ribbon {
  readonly #radii: Float32Array;

  constructor(nodes: number) {
    super(nodes + 1, 0, 0.14);
    this.#radii = new Float32Array(nodes + 1);
  }

  protected override radius(k: number): number { return this.#radii[k]!; }
  protected override strength(): number { return this.opacity; }

  /** From the target on; nothing if the spread is not known. */
  show({ prediction, target }: Pick<Tool, 'prediction' | 'target'>): void {
    this.begin();
    if (prediction.some((node) => node[4] > 0)) {
      this.append(target.p);
      for (let k = 0; k < prediction.length && k + 1 < this.capacity; ++k) {
        const node = prediction[k]!;
        const radius = SHOWN * node[4];
        if (radius > WIDEST) break;
        this.#radii[k + 1] = radius;
        this.append(node);
      }
    }
    this.end();
  }
}
