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
  readonly #size = new THREE.Vector2();
  #ratio = 1;
  /** Of the picture that is being drawn; null: none is. */
  #fence: WebGLSync | null = null;

  constructor(private readonly renderer: THREE.WebGLRenderer) {}

  /** A picture is on its way. */
  get draws(): boolean { return this.#fence !== null; }

  /** Begins a picture. @param ratio of its pixels to those of the page */
  draw(scene: THREE.Scene, camera: THREE.Camera, ratio: number, sharp: boolean): void {
    const { renderer } = this, gl = this.#gl, { x, y } = renderer.getSize(this.#size);
    this.#ratio = ratio;
    this.#target = sharp ? this.#sharp : this.#usual;
    this.#target.setSize(Math.max(1, Math.floor(x * ratio)), Math.max(1, Math.floor(y * ratio)));
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
    if (renderer.getPixelRatio() !== this.#ratio) renderer.setPixelRatio(this.#ratio);
    const { width, height } = this.#target, { __webglFramebuffer: drawn } = renderer.properties.get(this.#target) as { __webglFramebuffer: WebGLFramebuffer };
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, drawn);
    renderer.state.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    renderer.state.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
  }

  /** The picture that is on its way comes too late. */
  drop(): void {
    if (this.#fence) this.#gl.deleteSync(this.#fence);
    this.#fence = null;
  }

  get #gl(): WebGL2RenderingContext { return this.renderer.getContext() as WebGL2RenderingContext; }
}
