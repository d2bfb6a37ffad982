import * as THREE from 'three';
import { Words } from './board';

/** What a controller's parts do; each is shown at the controller until its first use. */
const PARTS = { lead: 'Grip: move the arm', forward: 'A: forward is where you look', stop: 'B: stop', stick: 'Stick: scale ↕, menu ↔', point: 'Trigger: press on the board, move it' } as const;
const LEFT: Readonly<Record<string, string>> = { forward: 'X: forward is where you look', stop: 'Y: stop' };
/** On the left if each hand has its own arm. */
const SWAP = 'X: swap the hands';

export type Part = keyof typeof PARTS;

/** m: width of a controller's label and of a notice before the eyes; distance and drop of the notice. */
const LABEL = 0.15, NOTICE = 0.5, AHEAD = 0.9, DOWN = 0.16;

/** Texts where the operator looks: at the controllers what they do, before the eyes what is lost. */
export class Guide {
  readonly notice = new Words('rgba(198, 40, 40, 0.94)', '#ffffff', 1, NOTICE);
  readonly #labels: { words: Words; left: boolean }[] = [];
  /** Names of the tools that the left and the right hand move; null: either moves the only one. */
  #arms: readonly [string, string] | null = null;
  readonly #unused = new Set<Part>(Object.keys(PARTS) as Part[]);

  constructor() {
    this.notice.renderOrder = 10;
    this.notice.material.depthTest = false;
  }

  /** @param grip of either controller */
  attach(grip: THREE.Group): void {
    const words = new Words('rgba(16, 20, 25, 0.85)', '#e8edf3', Object.keys(PARTS).length, LABEL), label = { words, left: false };
    words.position.set(0, 0.07, -0.06);
    words.rotation.x = -0.7;
    grip.add(words);
    (grip as unknown as THREE.EventDispatcher<{ connected: { data: XRInputSource } }>).addEventListener('connected', ({ data }) => {
      label.left = data.handedness === 'left';
      this.#tell(label);
    });
    this.#labels.push(label);
    this.#tell(label);
  }

  /**
   * A screen shows less than lenses: labels are larger by this factor, and next to the hand, clear of what it points
   * at.
   */
  showOnScreen(factor: number): void {
    for (const { words } of this.#labels) {
      words.scale.setScalar(factor);
      words.position.set(0.6 * factor * LABEL + 0.03, -0.03, 0);
    }
  }

  used(part: Part): void {
    if (this.#unused.delete(part)) this.#labels.forEach((label) => this.#tell(label));
  }

  /** See #arms. */
  set arms(names: readonly [string, string] | null) {
    if (names?.join('\n') === this.#arms?.join('\n')) return;
    this.#arms = names;
    this.#labels.forEach((label) => this.#tell(label));
  }

  get unused(): Part[] { return [...this.#unused]; }

  #tell({ words, left }: { words: Words; left: boolean }): void {
    const arm = this.#arms?.[left ? 0 : 1];
    words.say([...this.#unused].map((part) => {
      if (arm !== undefined && part === 'lead') return `Grip: move the arm ‘${arm}’`;
      return arm !== undefined && left && part === 'forward' ? SWAP : (left && LEFT[part]) || PARTS[part];
    }));
  }

  /** Before the eyes, wherever they turn. */
  follow(camera: THREE.Camera): void {
    camera.matrixWorld.decompose(this.notice.position, this.notice.quaternion, this.notice.scale);
    this.notice.translateZ(-AHEAD).translateY(-DOWN);
  }
}
