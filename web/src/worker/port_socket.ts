import { hasWebAssembly } from './module';
import { TAKEN } from './taken';
import type { Begin, Failure, Kept } from './worker';

/** The part of a WebSocket that a connection uses. */
export type Socket = Pick<WebSocket, 'send' | 'close' | 'readyState' | 'bufferedAmount' | 'onopen' | 'onmessage' | 'onclose'>;

/** A session in a Worker of this page, with the interface of a WebSocket to a program. */
export class PortSocket implements Socket {
  onopen: WebSocket['onopen'] = null;
  onmessage: WebSocket['onmessage'] = null;
  onclose: WebSocket['onclose'] = null;
  readyState: WebSocket['readyState'] = WebSocket.CONNECTING;
  readonly bufferedAmount = 0;
  readonly #worker: Worker;

  /** @param onFailure receives a message for users: why there is no session, or why it ended */
  constructor(begin: Begin, private readonly onFailure: (why: string) => void, private readonly onKept: (kept: Kept) => void) {
    this.#worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    this.#worker.onmessage = (event: MessageEvent<string | null | Failure | Kept>) => this.#take(event.data);
    this.#worker.onerror = () => this.#end('The planner’s Worker did not start: publish all files of the site’s folder again, or use a newer browser.');
    if (hasWebAssembly()) this.#worker.postMessage(begin);
    else setTimeout(() => this.#end('This browser runs no WebAssembly, which the planner needs: enable it (a lockdown mode disables it), or use another browser.'));
  }

  send(text: string): void { if (this.readyState === WebSocket.OPEN) this.#worker.postMessage(text); }

  close(): void {
    this.readyState = WebSocket.CLOSED;
    this.#worker.terminate();
  }

  #take(data: string | null | Failure | Kept): void {
    const socket = this as unknown as WebSocket;
    if (data === null) {
      this.readyState = WebSocket.OPEN;
      this.onopen?.call(socket, new Event('open'));
    } else if (typeof data === 'string') {
      this.onmessage?.call(socket, new MessageEvent('message', { data }));
      if (data.startsWith('{"type":"state"')) this.#worker.postMessage(TAKEN);
      // The Worker belongs to this page, so the operator need not type a code.
      if (data.startsWith('{"type":"welcome"')) this.send('{"type":"pair","code":"local"}');
    } else if ('recording' in data) {
      this.onKept(data);
    } else {
      this.#end(data.failure);
    }
  }

  #end(why: string): void {
    if (this.readyState === WebSocket.CLOSED) return;
    this.close();
    this.onFailure(why);
    this.onclose?.call(this as unknown as WebSocket, new CloseEvent('close'));
  }
}
