import { PICTURE_HEAD, type CameraFacts, type PictureHead } from './protocol';

/** Most frames in the queue of a decoder; a page that is behind continues at the next key frame. */
const MOST_QUEUED = 8;
/** Failures of a decoder in a row after which the page does not try again. */
const MOST_FAILURES = 3;

/** The codec string of WebCodecs, from the parameter set of a key frame (Annex B); null: there is none. */
export function codecOf(data: Uint8Array): string | null {
  for (let i = 0; i + 6 < data.length; ++i) {
    if (data[i] !== 0 || data[i + 1] !== 0 || data[i + 2] !== 1 || (data[i + 3]! & 0x1f) !== 7) continue;
    return `avc1.${[data[i + 4]!, data[i + 5]!, data[i + 6]!].map((byte) => byte.toString(16).padStart(2, '0')).join('')}`;
  }
  return null;
}

export const canDecode = (): boolean => typeof VideoDecoder !== 'undefined';

/** One camera: its frames are decoded as they arrive, and the newest is drawn with the page's next frame. */
export class CameraView {
  readonly canvas = document.createElement('canvas');
  /** Number of frames drawn. */
  drawn = 0;
  /** Why no more frames arrive; empty: they do. */
  ended = '';
  /** The browser cannot decode them. */
  failed = false;
  readonly #context: CanvasRenderingContext2D;
  #decoder: VideoDecoder | null = null;
  #codec = '';
  #needsKey = true;
  #failures = 0;
  /** Decoded, and not drawn yet. */
  #frame: VideoFrame | null = null;

  constructor(readonly facts: CameraFacts) {
    this.canvas.width = facts.width;
    this.canvas.height = facts.height;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', `View of camera ${facts.name}`);
    this.#context = this.canvas.getContext('2d', { alpha: false })!;
  }

  /** Takes a frame as it arrived. */
  take(head: PictureHead, message: ArrayBuffer): void {
    if (this.failed || !canDecode() || (this.#needsKey && !head.isKey)) return;
    const data = new Uint8Array(message, PICTURE_HEAD);
    if (head.isKey && !this.#prepare(data)) return;
    const decoder = this.#decoder;
    if (!decoder || decoder.state !== 'configured') return;
    this.#needsKey = decoder.decodeQueueSize >= MOST_QUEUED;
    if (this.#needsKey) return;
    try {
      decoder.decode(new EncodedVideoChunk({ type: head.isKey ? 'key' : 'delta', timestamp: Math.round(1e6 * head.exposed), data }));
    } catch {
      this.#gaveUp();
    }
  }

  /**
   * Draws the newest frame, if it has not been drawn. Returns when it was exposed, s of the session's clock; NaN: there
   * is none.
   */
  draw(): number {
    const frame = this.#frame;
    if (!frame) return NaN;
    const { width, height } = this.canvas, exposed = frame.timestamp / 1e6;
    this.#context.drawImage(frame, 0, 0, width, height);
    frame.close();
    this.#frame = null;
    ++this.drawn;
    return exposed;
  }

  /** The next frame must be a key frame. */
  forget(): void { this.#needsKey = true; }

  close(): void {
    this.#frame?.close();
    this.#frame = null;
    if (this.#decoder && this.#decoder.state !== 'closed') this.#decoder.close();
    this.#decoder = null;
  }

  #prepare(data: Uint8Array): boolean {
    const codec = codecOf(data);
    if (!codec) return false;
    if (this.#decoder && this.#decoder.state === 'configured' && codec === this.#codec) return true;
    this.close();
    const decoder = new VideoDecoder({
      output: (frame) => {
        this.#frame?.close();
        this.#frame = frame;
        this.#failures = 0;
      },
      error: () => this.#gaveUp(),
    });
    this.#decoder = decoder;
    this.#codec = codec;
    try {
      decoder.configure({ codec, optimizeForLatency: true });
    } catch {
      this.#gaveUp();
    }
    return this.#decoder !== null;
  }

  /** A broken frame, or a browser without H.264. */
  #gaveUp(): void {
    this.#needsKey = true;
    this.failed = ++this.#failures >= MOST_FAILURES;
    this.close();
  }
}
