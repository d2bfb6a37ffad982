import * as THREE from 'three';

/** As the canvas: three.js gives what it draws for a headset tones and colours of the screen, and only that. */
function target(samples: number): THREE.WebGLRenderTarget {
  const made = Object.assign(new THREE.WebGLRenderTarget(1, 1, { samples, resolveDepthBuffer: false }), { isXRRenderTarget: true });
  made.texture.colorSpace = THREE.SRGBColorSpace;
  made.texture.internalFormat = 'RGBA8'; // its colours are the screen's when they are written
  return made;
}

/**
 * A picture that is drawn beside the canvas, and put there once it is done. Where the processor draws, the browser reads back what is
 * shown of a canvas, and the page waits for as long as the drawing takes: keys and pointers with it.
 */
export class Aside {
  readonly #usual = target(0);
  /** Without steps at its edges, which takes a processor twice the time. */
  readonly #sharp = target(4);
  /** Which of both is drawn, or was. */
  #target = this.#usual;
  /** The emulated headset wipes, before each of its frames, what is bound then: this in place of the canvas. */
  readonly #nothing = new THREE.WebGLRenderTarget(1, 1, { depthBuffer: false });
  readonly #size = new THREE.Vector2();
  #ratio: number | null = 1;
  /** Of the picture that is being drawn; null: none is. */
  #fence: WebGLSync | null = null;

  constructor(private readonly renderer: THREE.WebGLRenderer) {}

  /** A picture is on its way. */
  get draws(): boolean { return this.#fence !== null; }

  /** Begins a picture. @param ratio of its pixels to those of the page; null: as many as the canvas has, which a headset has set */
  draw(scene: THREE.Scene, camera: THREE.Camera, ratio: number | null, sharp = false): void {
    const { renderer } = this, gl = this.#gl;
    this.#ratio = ratio;
    this.#target = sharp ? this.#sharp : this.#usual;
    if (ratio === null) this.#size.set(gl.drawingBufferWidth, gl.drawingBufferHeight);
    else renderer.getSize(this.#size).multiplyScalar(ratio).floor();
    this.#target.setSize(Math.max(1, this.#size.x), Math.max(1, this.#size.y));
    renderer.setRenderTarget(this.#target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    this.drop();
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  /** Puts the picture on the canvas if it is done. */
  show(): void {
    if (!this.#fence) return;
    const { renderer } = this, gl = this.#gl;
    if (!gl.isContextLost() && gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.SIGNALED) return;
    this.drop();
    if (this.#ratio !== null && renderer.getPixelRatio() !== this.#ratio) renderer.setPixelRatio(this.#ratio);
    const { width, height } = this.#target, { __webglFramebuffer: drawn } = renderer.properties.get(this.#target) as { __webglFramebuffer: WebGLFramebuffer };
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, drawn);
    renderer.state.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
  }

  /** At the end of a frame of the emulated headset. */
  keepCanvas(): void { this.renderer.setRenderTarget(this.#nothing); }

  /** The picture that is on its way comes too late. */
  drop(): void {
    if (this.#fence) this.#gl.deleteSync(this.#fence);
    this.#fence = null;
  }

  get #gl(): WebGL2RenderingContext { return this.renderer.getContext() as WebGL2RenderingContext; }
}
