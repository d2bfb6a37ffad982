import * as THREE from 'three';
import type { CameraView } from '../camera_view';
import { Words } from './board';

/** m: the board's width, shared by all screens, and the gap between them. */
const ALL = 0.72, GAP = 0.02;
/** m, largest width of a screen. */
const WIDEST = 0.5;

/** A camera's image, in the headset. */
class Screen extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly words: Words;
  #shown = -1;

  constructor(readonly view: CameraView, width: number) {
    const map = new THREE.CanvasTexture(view.canvas);
    map.colorSpace = THREE.SRGBColorSpace;
    map.generateMipmaps = false;
    map.minFilter = THREE.LinearFilter;
    super(new THREE.PlaneGeometry(width, (width * view.canvas.height) / view.canvas.width), new THREE.MeshBasicMaterial({ map, toneMapped: false }));
    this.words = new Words('rgba(16, 20, 25, 0.92)', '#e8edf3', 1, width);
    this.words.position.y = -this.geometry.parameters.height / 2 - this.words.geometry.parameters.height / 2;
    this.add(this.words);
  }

  /** Uploads the texture if another image was drawn. */
  update(): void {
    const { view } = this, { map } = this.material;
    if (view.drawn !== this.#shown) map!.needsUpdate = true;
    this.#shown = view.drawn;
  }

  free(): void {
    for (const each of [this, this.words]) {
      each.geometry.dispose();
      each.material.map!.dispose();
      each.material.dispose();
    }
  }
}

/** The cameras' images in a row above the board; they move with it. */
export class Screens extends THREE.Group {
  #of: readonly CameraView[] = [];
  readonly screens: Screen[] = [];

  /** @param bottom m, their lower edge */
  constructor(private readonly bottom: number) { super(); }

  /** @param views those of the page; another list if the cameras change */
  update(views: readonly CameraView[]): void {
    if (views !== this.#of) this.#build(views);
    for (const screen of this.screens) screen.update();
  }

  /** Names, and the status of each camera. */
  write(): void {
    for (const { view, words } of this.screens) words.say([view.ended ? `${view.facts.name}: ended` : view.facts.name]);
  }

  #build(views: readonly CameraView[]): void {
    this.#of = views;
    for (const screen of this.screens) screen.free();
    this.clear();
    const width = Math.min(WIDEST, (ALL - GAP * (views.length - 1)) / views.length);
    this.screens.splice(0, Infinity, ...views.map((view, i) => {
      const screen = new Screen(view, width), { height } = screen.geometry.parameters;
      screen.position.set((width + GAP) * (i - (views.length - 1) / 2), this.bottom + screen.words.geometry.parameters.height + height / 2, 0);
      return screen;
    }));
    if (this.screens.length > 0) this.add(...this.screens); // three.js reports an error for none
  }
}
