import { decode, encode, PROTOCOL_VERSION, type ClientMessage, type ServerMessage, type StateMessage } from './protocol';
import { hasSimd } from './worker/module';
import { PortSocket, type Socket } from './worker/port_socket';
import { ServerClock } from './server_clock';
import type { Kept } from './worker/worker';

export type ConnectionStatus = 'connecting' | 'open' | 'lost' | 'refused';

/** The functions of the browser that a connection needs; tests have their own. */
export interface Surroundings {
  open(): Socket;
  /** s, monotonic. */
  now(): number;
  after(seconds: number, act: () => void): number;
  cancel(timer: number): void;
  readToken(): string;
  keepToken(token: string): void;
  /**
   * s without a message after which a connection is given up: without its far end it would wait for TCP, perhaps for
   * minutes.
   */
  patience: number;
}

export function browserSurroundings(): Surroundings {
  const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
  const key = 'steadyhand-token';
  let given = ''; // by this program; without storage, as in private windows, it lasts as long as the page
  return {
    open: () => {
      const socket = new WebSocket(`${scheme}://${location.host}/live`);
      socket.binaryType = 'arraybuffer';
      return socket;
    },
    now: () => performance.now() / 1000,
    after: (seconds, act) => window.setTimeout(act, seconds * 1000),
    cancel: (timer) => window.clearTimeout(timer),
    readToken: () => { try { return given || (localStorage.getItem(key) ?? ''); } catch { return given; } },
    keepToken: (token) => { given = token; try { localStorage.setItem(key, token); } catch { /* then `given` is all */ } },
    patience: 3,
  };
}

/**
 * Of a page without a program behind it: its session is in a Worker.
 * @param onFailure why there is none, for people
 * @param onKept more of what it records
 */
export function workerSurroundings(onFailure: (why: string) => void, onKept: (kept: Kept) => void): Surroundings {
  const begin = { site: new URL('.', location.href).href, robot: new URLSearchParams(location.search).get('robot') ?? '', simd: hasSimd() };
  const open = () => new PortSocket(begin, onFailure, onKept);
  let first: PortSocket | null = open(); // its messages come after this script, when the listeners are set
  // No other client exists: no token of an earlier session counts. Between page and Worker nothing is lost; a Worker
  // that stops sending has no processor.
  return { ...browserSurroundings(), open: () => {
    const socket = first ?? open();
    first = null;
    return socket;
  }, readToken: () => '', keepToken: () => {}, patience: 30 };
}

const PING_EVERY = 0.5; // s
/** Close code of a WebSocket whose far end shuts down normally (RFC 6455). */
const GOING_AWAY = 1001;
const RETRY = [0.25, 0.5, 1, 2]; // s

/** One client's end of the WebSocket: greets, pairs, pings, and connects again when the connection is lost. */
export class Connection {
  status: ConnectionStatus = 'connecting';
  /** s, of the last pong; NaN before the first. */
  roundTrip = NaN;
  bytesReceived = 0;
  /** The session's. */
  readonly clock = new ServerClock();
  /** Takes the camera frames that were requested. */
  onPicture: ((message: ArrayBuffer) => void) | null = null;
  /** The program reported its end. */
  ended = false;
  #socket: Socket | null = null;
  #attempts = 0;
  #timer = 0;
  #heard = 0;
  /** s, when the next look at the connection is due. */
  #due = 0;
  #echo = -1;
  #echoAt = 0;

  constructor(
    private readonly around: Surroundings,
    private code: string,
    private readonly onMessage: (message: ServerMessage) => void,
    private readonly onStatus: (status: ConnectionStatus) => void,
  ) {}

  start(): void {
    const socket = this.around.open();
    this.#socket = socket;
    this.#heard = this.around.now();
    socket.onopen = () => {
      const token = this.around.readToken();
      this.send(token ? { type: 'hello', version: PROTOCOL_VERSION, token } : { type: 'hello', version: PROTOCOL_VERSION });
      this.#ping();
    };
    this.#watchLater();
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => (typeof event.data === 'string' ? this.#take(event.data) : this.#see(event.data));
    socket.onclose = (event) => {
      if (event?.code === GOING_AWAY) this.ended = true;
      this.#lost();
    };
  }

  /** False: the message is dropped, because no connection is open or so much is waiting that it would arrive late. */
  send(message: ClientMessage): boolean {
    const socket = this.#socket;
    if (!socket || socket.readyState !== 1) return false;
    if (message.type === 'sample' && socket.bufferedAmount > 4096) return false;
    socket.send(encode(message));
    return true;
  }

  pair(code: string): void {
    this.send({ type: 'pair', code });
  }

  #see(picture: ArrayBuffer): void {
    this.bytesReceived += picture.byteLength;
    this.#heard = this.around.now();
    this.onPicture?.(picture);
  }

  #take(text: string): void {
    this.bytesReceived += text.length;
    this.#heard = this.around.now();
    const message = decode(text);
    if (!message) return;
    if (message.type === 'welcome') {
      this.#attempts = 0;
      this.clock.forget();
      this.ended = false;
      this.#become('open');
      if (this.code) this.pair(this.code);
      this.code = ''; // from then on there is the token
    } else if (message.type === 'paired') {
      this.around.keepToken(message.token);
    } else if (message.type === 'state') {
      this.#echo = (message as StateMessage).now_s;
      this.#echoAt = this.around.now();
    } else if (message.type === 'pong') {
      const now = this.around.now();
      this.roundTrip = now - message.t_s;
      this.clock.take(message, now);
    } else if (message.type === 'error' && message.code === 'version') {
      this.#become('refused');
    }
    this.onMessage(message);
  }

  #ping(): void {
    const now = this.around.now();
    this.send(this.#echo >= 0
      ? { type: 'ping', t_s: now, echo_s: this.#echo, held_s: Math.max(0, now - this.#echoAt) }
      : { type: 'ping', t_s: now });
  }

  #watchLater(): void {
    this.#due = this.around.now() + PING_EVERY;
    this.#timer = this.around.after(PING_EVERY, () => this.#watch());
  }

  #watch(): void {
    const now = this.around.now();
    // A page that was held up itself may have messages waiting: they are read before the far end is judged.
    const heldUp = now - this.#due > PING_EVERY;
    if (!heldUp && now - this.#heard > this.around.patience) return this.#lost();
    this.#ping();
    this.#watchLater();
  }

  #lost(): void {
    this.around.cancel(this.#timer);
    const socket = this.#socket!;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    this.#socket = null;
    this.#echo = -1;
    if (this.status === 'refused') return;
    this.#become('lost');
    const wait = RETRY[Math.min(this.#attempts++, RETRY.length - 1)] ?? 2;
    this.around.after(wait, () => this.start());
  }

  #become(status: ConnectionStatus): void {
    if (this.status === status) return;
    this.status = status;
    this.onStatus(status);
  }
}
