import type { Kept } from './worker/worker';

/** A recording of this page's own session. */
export interface KeptRecording {
  name: string;
  /** Bytes so far. */
  size: number;
  /** Being written; complete; or cut short by the end of its session, and readable up to there. */
  state: 'open' | 'complete' | 'cut short';
  downloaded: boolean;
}

/** Recordings of a page without a program: the browser keeps them, perhaps on disk, until the page is closed. */
export class KeptRecordings {
  readonly list: KeptRecording[] = [];
  readonly #parts = new Map<KeptRecording, Blob[]>();

  /** @param onChange the list, or a text of it, has changed */
  constructor(private readonly onChange: () => void) {
    addEventListener('beforeunload', (event) => { if (this.list.some(({ downloaded }) => !downloaded)) event.preventDefault(); });
  }

  take({ recording: name, bytes }: Kept): void {
    let kept = this.list.find((each) => each.name === name && each.state === 'open');
    if (!kept) {
      kept = { name, size: 0, state: 'open', downloaded: false };
      this.list.unshift(kept);
      this.#parts.set(kept, []);
    }
    kept.size += bytes.length;
    if (bytes.length > 0) this.#parts.get(kept)!.push(new Blob([bytes]));
    else kept.state = 'complete';
    this.onChange();
  }

  /** The session has ended. */
  cut(): void {
    const open = this.list.filter(({ state }) => state === 'open');
    for (const kept of open) kept.state = 'cut short';
    if (open.length > 0) this.onChange();
  }

  /** Through the browser, as NAME.mcap. */
  download(kept: KeptRecording): void {
    const href = URL.createObjectURL(new Blob(this.#parts.get(kept)));
    Object.assign(document.createElement('a'), { href, download: `${kept.name}.mcap` }).click();
    setTimeout(() => URL.revokeObjectURL(href), 60_000);
    kept.downloaded = kept.state !== 'open';
    this.onChange();
  }

  forget(kept: KeptRecording): void {
    this.list.splice(this.list.indexOf(kept), 1);
    this.#parts.delete(kept);
    this.onChange();
  }
}
