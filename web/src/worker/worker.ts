import { file, whole } from './files';
import { Module } from './module';
import { TAKEN } from './taken';

/** Page to Worker: one Begin (site, robot, SIMD); then messages of docs/reference/protocol.md as text. */
export interface Begin { site: string; robot: string; simd: boolean }
/** Worker to page, in addition to such messages: it cannot continue. */
export interface Failure { failure: string }
/** Worker to page: more bytes of a recording; no bytes: it is complete. */
export interface Kept { recording: string; bytes: Uint8Array<ArrayBuffer> }

/** Written next to the page by `./steadyhand site` (web/tools/make_site.mjs). */
interface Site { robots: string[]; bytes: Record<string, number> }

/** ms between two reads of the clock. Browsers make it 4; in a hidden tab perhaps 1000. */
const PERIOD = 2;
const PAGE = 1;
/** This Worker's side of its page's port; the page's types declare it as a window. */
const port = self as unknown as { postMessage(data: string | null | Failure | Kept, transfer?: Transferable[]): void; onmessage(event: MessageEvent<unknown>): void };
const now = (): number => performance.now() / 1000;

let module: Module | null = null;
/** The page has not taken the last state yet; `waiting` is sent after that. */
let underWay = false;
let waiting: string | null = null;
/** The session's last state, whether the page has taken it or not. */
let latest = '';

function fail(error: unknown): void {
  module = null;
  port.postMessage({ failure: error instanceof Error ? error.message : String(error) } satisfies Failure);
}

function sendState(text: string): void {
  latest = text;
  if (underWay) {
    waiting = text;
    return;
  }
  underWay = true;
  port.postMessage(text);
}

function take(data: unknown): void {
  if (data === TAKEN) {
    underWay = false;
    const next = waiting;
    waiting = null;
    if (next !== null) sendState(next);
  } else if (typeof data === 'string') {
    module?.receive(PAGE, data, now());
  }
}

async function begin({ site, robot, simd }: Begin): Promise<void> {
  const get = async (name: string, what: string, type: string) => (await file(new URL(name, site), what, type)).arrayBuffer();
  const name = simd ? 'steadyhand.wasm' : 'steadyhand-plain.wasm';
  // The largest file is requested first, before the list with its length.
  const planner = get(name, 'The planner', 'application/wasm');
  planner.catch(() => {}); // handled below
  const told = (await (await file(new URL('site.json', site), "The site's list")).json().catch(() => {
    throw new Error("The site's list (site.json) is not JSON: publish all files of the site's folder again.");
  })) as Site;
  const wanted = robot || told.robots[0]!;
  if (!told.robots.includes(wanted)) throw new Error(`This site has no robot “${wanted}”; it has ${told.robots.join(', ')}.`);
  const all = async (bytes: Promise<ArrayBuffer>, of: string, what: string) => whole(await bytes, told.bytes[of], `${what} (${of})`);
  const [code, setup] = await Promise.all([all(planner, name, 'The planner'), all(get(`robots/${wanted}.json`, 'The robot', 'application/json'), `robots/${wanted}.json`, 'The robot')]);
  const loaded = await Module.load(code, {
    send: (_client, text, isState) => (isState ? sendState(text) : port.postMessage(text)),
    keep: (recording, bytes) => port.postMessage({ recording, bytes }, [bytes.buffer]),
    close: () => fail(new Error('The session closed this page: too many unreadable messages. Reload it.')),
  });
  loaded.begin(new TextDecoder().decode(setup));
  loaded.join(PAGE, now());
  module = loaded;
  port.postMessage(null); // the connection is open
  setInterval(() => {
    try { module?.advance(now()); } catch (error) { fail(error); }
  }, PERIOD);
}

/** For tests and diagnosis: bytes used by the planner, s of left-out pauses, the last state. */
Object.assign(self, { steadyhand: { memory: () => module?.memory ?? 0, leftOut: () => module?.leftOut ?? 0, latest: () => latest } });

port.onmessage = (event) => {
  try {
    if (module) take(event.data);
    else if (typeof event.data === 'object' && event.data) begin(event.data as Begin).catch(fail);
  } catch (error) {
    fail(error);
  }
};
