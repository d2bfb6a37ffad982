import { CameraView, canDecode } from './camera_view';
import { element, made, put } from './element';
import { offText } from './figures';
import { Median } from './median';
import { pictureHead, type CameraFacts } from './protocol';
import type { ServerClock } from './server_clock';

/** Number of frames whose median latency is shown. */
const MEASURED = 120;
/** s without a frame after which the page reports that. */
const QUIET_AFTER = 2;

const CANNOT = 'This browser cannot decode camera video: it has no WebCodecs with H.264, or the page was loaded over plain HTTP from another machine.';

/** The cameras of the session, as a panel of the page. Their images come only while they may be visible. */
export class Cameras {
  views: CameraView[] = [];
  /** s, from exposure to drawn on this page. */
  readonly latency = new Median(MEASURED);
  readonly #panel = element('cameras', HTMLDetailsElement);
  readonly #box = element('camera-views', HTMLDivElement);
  #words: HTMLElement[] = [];
  #drawnAt: number[] = [];
  #told = '';
  #asked = false;
  /** Frames that a study shows late on purpose. */
  readonly #late: { due: number; message: ArrayBuffer }[] = [];

  /** @param watch requests the frames of these cameras */
  constructor(private readonly clock: ServerClock, private readonly watch: (names: string[]) => void) {
    if (matchMedia('(max-width: 60rem)').matches) this.#panel.open = false; // it would lie over the arm
  }

  /** The cameras of the session, for a new connection. */
  offer(cameras: CameraFacts[]): void {
    this.#asked = false;
    this.#late.length = 0;
    const told = JSON.stringify(cameras);
    if (told === this.#told) {
      for (const view of this.views) {
        view.forget();
        view.ended = '';
      }
      return;
    }
    this.#told = told;
    for (const view of this.views) view.close();
    this.views = cameras.map((facts) => new CameraView(facts));
    this.#drawnAt = cameras.map(() => NaN);
    this.#words = cameras.map(() => made('span'));
    this.#box.replaceChildren(...this.views.map(({ canvas, facts }, i) => made('figure', {}, canvas, made('figcaption', {}, made('strong', {}, facts.name), this.#words[i]!))));
    put(this.#panel, 'hidden', cameras.length === 0);
  }

  /** @param why for each camera, why no more frames arrive; empty: they do */
  end(why: readonly string[]): void {
    for (let i = 0; i < this.views.length; ++i) this.views[i]!.ended = why[i] ?? '';
  }

  /** @param late s, by which it is to be shown late */
  take(message: ArrayBuffer, now: number, late: number): void {
    if (late === 0 && this.#late.length === 0) this.#decode(message);
    else this.#late.push({ due: now + late, message });
  }

  #decode(message: ArrayBuffer): void {
    const head = pictureHead(message);
    if (head) this.views[head.camera]?.take(head, message);
  }

  /** Call it with each frame of the page. */
  draw(now: number): void {
    while (this.#late.length > 0 && this.#late[0]!.due <= now) this.#decode(this.#late.shift()!.message);
    for (let i = 0; i < this.views.length; ++i) {
      const exposed = this.views[i]!.draw();
      if (Number.isNaN(exposed)) continue;
      this.#drawnAt[i] = now;
      this.latency.add(this.clock.at(performance.now() / 1000) - exposed);
    }
  }

  /**
   * Requests images, or stops them, and writes the texts.
   * @param allowed the server would send them @param shown they are visible
   */
  tell(now: number, allowed: boolean, shown: boolean, inHeadset: boolean): void {
    if (this.views.length === 0) return;
    const wanted = allowed && shown && canDecode() && (inHeadset || (this.#panel.open && !document.hidden));
    if (wanted !== this.#asked) {
      this.#asked = wanted;
      this.watch(wanted ? this.views.map((view) => view.facts.name) : []);
      for (let i = 0; i < this.views.length; ++i) {
        this.views[i]!.forget();
        this.#drawnAt[i] = now;
      }
      this.latency.clear();
    }
    const median = this.latency.value();
    put(element('cameras-latency', HTMLOutputElement), 'textContent', wanted && median === median ? `${offText(1000 * median)} ms` : '');
    const cannot = !canDecode() || this.views.some((view) => view.failed);
    const why = element('cameras-why', HTMLElement);
    put(why, 'textContent', cannot ? CANNOT : allowed || !shown ? '' : 'To see them, enter the code from the terminal.');
    put(why, 'hidden', why.textContent === '');
    for (let i = 0; i < this.views.length; ++i) {
      const view = this.views[i]!;
      const quiet = wanted && !cannot && now - this.#drawnAt[i]! > QUIET_AFTER;
      put(this.#words[i]!, 'textContent', view.ended ? `ended: ${view.ended}` : quiet ? 'no frame now' : '');
      put(view.canvas.dataset, 'old', String(view.ended !== '' || quiet));
    }
  }
}
