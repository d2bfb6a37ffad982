import * as THREE from 'three';

/** Marked as a headset's target: three.js applies the screen's tones and colours to no other target. */
function target(samples: number): THREE.WebGLRenderTarget {
  const made = Object.assign(new THREE.WebGLRenderTarget(1, 1, { samples, resolveDepthBuffer: false }), { isXRRenderTarget: true });
  made.texture.colorSpace = THREE.SRGBColorSpace;
  made.texture.internalFormat = 'RGBA8'; // colours are already the screen's when written
  return made;
}

/** Converts from premultiplied alpha (WebGL) to straight alpha (ImageData). */
function divideByAlpha({ data }: ImageData): void {
  for (let i = 0; i < data.length; i += 4) {
    const alpha = data[i + 3]!;
    if (alpha === 0 || alpha === 255) continue;
    for (let j = i; j < i + 3; ++j) data[j] = (255 * data[j]!) / alpha;
  }
}

/**
 * Draws a picture next to the canvas and shows it when it is complete. With software rendering, the browser reads back
 * what is drawn on a WebGL canvas, and the page, with keys and pointers, waits for that. A buffer is read without
 * waiting.
 */
export class Aside {
  readonly #usual = target(0);
  /** Antialiased, which takes a processor twice the time. */
  readonly #sharp = target(4);
  /** The emulated headset clears the bound target before each of its frames: this one, not the canvas. */
  readonly #nothing = new THREE.WebGLRenderTarget(1, 1, { depthBuffer: false });
  readonly #size = new THREE.Vector2();
  readonly #shown = Object.assign(document.createElement('canvas'), { className: 'picture' });
  readonly #context: CanvasRenderingContext2D;
  #pixels = new ImageData(1, 1);
  /** Of the picture that is being drawn: earlier ones are dropped. */
  #number = 0;
  #draws = false;

  constructor(private readonly renderer: THREE.WebGLRenderer) {
    this.#shown.setAttribute('aria-hidden', 'true');
    this.#context = this.#shown.getContext('2d')!;
  }

  /** A picture is being drawn. */
  get draws(): boolean { return this.#draws; }

  /**
   * Starts a picture.
   * @param ratio of its pixels to those of the page; null: as many as the canvas has, set by a headset
   */
  draw(scene: THREE.Scene, camera: THREE.Camera, ratio: number | null, sharp = false): void {
    const { renderer } = this, gl = renderer.getContext(), drawn = sharp ? this.#sharp : this.#usual;
    if (ratio === null) this.#size.set(gl.drawingBufferWidth, gl.drawingBufferHeight);
    else renderer.getSize(this.#size).multiplyScalar(ratio).floor();
    const width = Math.max(1, this.#size.x), height = Math.max(1, this.#size.y);
    drawn.setSize(width, height);
    renderer.setRenderTarget(drawn);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    if (this.#pixels.width !== width || this.#pixels.height !== height) this.#pixels = new ImageData(width, height);
    this.#draws = true;
    const number = ++this.#number, pixels = this.#pixels;
    renderer.readRenderTargetPixelsAsync(drawn, 0, 0, width, height, pixels.data).then(
      () => { if (number === this.#number) this.#show(pixels); },
      () => { if (number === this.#number) this.#draws = false; }); // the graphics context is lost: the next call draws again
  }

  #show(pixels: ImageData): void {
    const shown = this.#shown, { width, height } = pixels, canvas = this.renderer.domElement;
    this.#draws = false;
    divideByAlpha(pixels);
    if (shown.width !== width || shown.height !== height) Object.assign(shown, { width, height });
    this.#context.putImageData(pixels, 0, 0);
    if (shown.nextSibling !== canvas) canvas.before(shown); // an emulated headset moves the canvas
  }

  /** At the end of a frame of the emulated headset. */
  keepCanvas(): void { this.renderer.setRenderTarget(this.#nothing); }

  /** Shows the canvas itself again. */
  drop(): void {
    ++this.#number;
    this.#draws = false;
    this.#shown.remove();
  }
}
