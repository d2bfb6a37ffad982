// The real program with its simulated arm, and real browsers that look at it: for tests and measurements of the page.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { existsSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { connect, createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { basename, dirname, join, resolve } from 'node:path';
import playwright, { chromium } from 'playwright-core';

export const ROOT = resolve(process.env.STEADYHAND_ROOT ?? join(import.meta.dirname ?? '.', '../..'));
export const PROGRAM = process.env.STEADYHAND_PROGRAM ?? join(ROOT, 'build/release/steadyhand');
const ARTEFACTS = join(ROOT, 'build/artefacts');
export const BROWSER = process.env.STEADYHAND_BROWSER ?? ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(existsSync);
/**
 * WebDriver BiDi controls a stock Firefox. It has no touch input, no other colour scheme and no access to the network
 * traffic.
 */
export const FIREFOX = basename(BROWSER ?? '').startsWith('firefox');
/** For a normal Chromium without a graphics card: SwiftShader draws the scene, and nothing else. */
export const FLAGS = ['--no-sandbox', '--enable-unsafe-swiftshader'];
export const picture = (name) => join(ARTEFACTS, `page_${FIREFOX ? 'firefox_' : ''}${name}.png`);
export const PATIENCE = Number(process.env.STEADYHAND_PATIENCE ?? 180_000); // ms; far above what anything takes, so that a test ends

/** A folder of `./steadyhand site`: tests its page instead of the program's. Its session is in a Worker. */
export const SITE = process.env.STEADYHAND_SITE;
/** For tests that need a program: other clients, a network connection, recordings. */
export const NEEDS_PROGRAM = SITE ? { skip: 'needs a program behind the page' } : {};
export let browser, address, sessions;
let program, newest, output, screen;

/** The newest address with its code, from the terminal. */
export const newestAddress = () => (SITE ? address : [...output.matchAll(/^open\s+(http:\S+)/gm)].at(-1)?.[1]);
/** All output of the program. */
export const terminal = () => output;
export const plainAddress = () => address.replace(/#.*/, '');
/** The page's last known state, for the message of a failed test. */
const news = async () => (newest ? newest.evaluate(() => {
  const { session, hand } = globalThis.steadyhand;
  return `${session.state?.state}: ${session.state?.reason}; lease ${session.yours}, hand ${hand.source} ${hand.clutch}`;
}).catch(String) : 'no page');
/** Repeats `condition` until its result is true, and returns that. */
export async function until(condition, what) {
  const end = Date.now() + PATIENCE;
  for (;;) {
    const value = await condition();
    if (value) return value;
    if (Date.now() > end) assert.fail(`waited in vain for ${what}; ${await news()}\n${output}`);
    await new Promise((done) => setTimeout(done, 50));
  }
}

/** Replaces the running program by a new one with a simulated arm at home, on a free port. */
export async function startProgram(...more) {
  await stopProgram();
  newest = null;
  output = '';
  if (SITE) { // an ordinary file server; each page has its own session
    program = spawn('python3', ['-u', '-m', 'http.server', '0', '--bind', '127.0.0.1', '--directory', dirname(SITE)], { stdio: ['ignore', 'pipe', 'ignore'] });
    program.stdout.on('data', (data) => { output += data; });
    const root = await until(() => output.match(/\((http:\S+)\)/)?.[1], 'the file server');
    address = new URL(`${basename(SITE)}/`, root).href; // in a subfolder, because all addresses must be relative
    return;
  }
  // Another page than the one in the program, while one works on it.
  const page = process.env.STEADYHAND_WEB && !more.includes('--page') ? ['--page', process.env.STEADYHAND_WEB] : [];
  program = spawn(PROGRAM, ['demo', '--port', '0', '--no-browser', '--sessions', sessions, ...page, ...more]);
  program.stdout.on('data', (data) => { output += data; });
  program.stderr.on('data', (data) => { output += data; });
  address = await until(newestAddress, 'the program to print its address');
}

export async function stopProgram() {
  program?.kill('SIGINT');
  if (program?.exitCode === null) await new Promise((done) => program.once('close', done));
}

/** Firefox draws WebGL only with a screen: Xvfb gives it one in memory. */
async function startFirefox() {
  screen = spawn('Xvfb', ['-displayfd', '1', '-screen', '0', '1280x900x24', '-nolisten', 'tcp'], { stdio: ['ignore', 'pipe', 'ignore'] });
  const [number] = await once(screen.stdout, 'data', { signal: AbortSignal.timeout(PATIENCE) });
  const env = { ...process.env, DISPLAY: `:${String(number).trim()}`, MOZ_ENABLE_WAYLAND: '0', HOME: sessions };
  return playwright._bidiFirefox.launch({ executablePath: BROWSER, headless: false, env, timeout: PATIENCE });
}

/** A browser that draws in software, and a place for recordings. */
export async function start() {
  mkdirSync(ARTEFACTS, { recursive: true });
  sessions = mkdtempSync(join(tmpdir(), 'steadyhand-'));
  browser = FIREFOX ? await startFirefox() : await chromium.launch({
    executablePath: BROWSER,
    args: FLAGS,
  });
}

export const closePages = () => Promise.all(browser.contexts().map((context) => context.close()));

export async function finish() {
  await browser?.close();
  screen?.kill();
  await stopProgram();
  if (sessions) rmSync(sessions, { recursive: true, force: true, maxRetries: 5 }); // a browser may still tidy up
}

/** Collects the errors of a page from now on. */
export function complaintsOf(of) {
  const complaints = [];
  of.on('pageerror', (error) => complaints.push(String(error)));
  of.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
  return complaints;
}

/** In the page: prints uncaught errors, which BiDi does not report. */
function sayErrors() {
  addEventListener('error', ({ message }) => console.error(message));
  addEventListener('unhandledrejection', ({ reason }) => console.error(String(reason)));
}

/** Opens the tab and the fold that contain an element, as an operator would. */
export async function reveal(of, selector) {
  await (await of.$(selector))?.evaluate((wanted) => {
    const panel = wanted.closest('[role=tabpanel]'), fold = wanted.closest('details');
    if (panel?.hidden) document.getElementById(panel.getAttribute('aria-labelledby')).click();
    if (fold && !wanted.closest('summary')) fold.open = true;
  });
}

/** Reveals each element before a test presses, fills or chooses it. */
function revealing(of) {
  for (const name of ['click', 'tap', 'focus', 'fill', 'selectOption', 'check']) {
    const act = of[name].bind(of);
    of[name] = async (selector, ...more) => {
      await reveal(of, selector);
      return act(selector, ...more);
    };
  }
}

/**
 * The page, paired by the newest code, or watching; with its arm. Draws nothing until a test requests it; `drawn`:
 * draws normally.
 */
export async function open(options = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 720 }, ...options.context });
  if (FIREFOX) await context.addInitScript(sayErrors);
  await options.prepare?.(context);
  if (!options.first) await context.addInitScript(() => { try { localStorage.setItem('steadyhand.first-steps-seen', '1'); } catch { /* a report's frame keeps nothing */ } });
  const opened = await context.newPage();
  newest = opened;
  opened.setDefaultTimeout(PATIENCE);
  revealing(opened);
  opened.complaints = complaintsOf(opened);
  opened.requests = [];
  opened.on('request', (request) => opened.requests.push(request.url()));
  const to = options.watch ? plainAddress() : newestAddress();
  await opened.goto(options.cable?.to(to) ?? to, { waitUntil: 'commit', timeout: PATIENCE });
  await until(async () => (await options.alive?.(opened), opened.evaluate(() => globalThis.steadyhand?.session.state && globalThis.steadyhand.stage.arm?.meshes.length >= 7)), 'the page');
  // Without a graphics card a frame takes so long that the hand would time out.
  if (!options.drawn) await opened.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
  return opened;
}
/** For `open`: the page draws, but its triangles have no pixels, so that it keeps its pace without a graphics card. */
export const withoutPixels = (context) => context.addInitScript(() => {
  const drawing = WebGL2RenderingContext.prototype;
  for (const [name, count] of [['drawElements', 1], ['drawArrays', 2], ['drawElementsInstanced', 1], ['drawArraysInstanced', 2]]) {
    const draw = drawing[name];
    drawing[name] = function (...words) {
      words[count] = 0;
      draw.apply(this, words);
    };
  }
  drawing.clear = () => {}; // an emulated headset clears its canvas for every frame, which would redraw the whole window
});
export const state = (of) => of.evaluate(() => globalThis.steadyhand.session.state);
/** The weight of a term by its name. */
export const weight = (of, name) => of.evaluate((wanted) => {
  const { welcome, state } = globalThis.steadyhand.session;
  return state.controls.weights[welcome.terms.findIndex((term) => term.name === wanted)];
}, name);
export const facts = (of) => of.evaluate(() => { const { session } = globalThis.steadyhand; return { yours: session.yours, paired: session.paired, holder: session.holder }; });
export const say = (from, message) => from.evaluate((words) => globalThis.steadyhand.connection.send(words), message);
/** Ticks the box until the session records, or does not: a busy page may show the previous state meanwhile. */
export const record = (of, wanted) => until(async () => (await state(of)).recording === wanted ||
  ((await of.isChecked('#record')) !== wanted && (await of.click('#record')), false), wanted ? 'a recording to begin' : 'the recording to end');
export const distance = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
export const inState = (of, name) => until(async () => (await state(of)).state === name, `the state ${name}`);

/**
 * A screenshot of the page fully drawn. First frames compile shaders, so states become old; then waits for new states.
 */
export async function shot(of, name) {
  const frames = await of.evaluate(() => { globalThis.steadyhand.stage.setQuality(1); return globalThis.steadyhand.frames(); });
  await until(() => of.evaluate((n) => globalThis.steadyhand.frames() > n + 5, frames), 'pictures');
  await of.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
  await of.waitForTimeout(700);
  await of.screenshot({ path: picture(name), timeout: PATIENCE });
}

/**
 * A proxy to the current program: `to` makes an address go through it, `cut` ends its connections, `swallow` drops
 * their data.
 */
export async function cable() {
  const ends = new Set();
  const { hostname, port } = new URL(address);
  const server = createServer((near) => {
    const far = connect(Number(new URL(address).port), hostname);
    for (const [one, other] of [[near, far], [far, near]]) {
      one.setNoDelay(true);
      ends.add(one);
      one.on('error', () => {}).on('close', () => { ends.delete(one); other.destroy(); });
      one.pipe(other);
    }
  });
  await new Promise((done) => server.listen(0, hostname, done));
  return {
    to: (url) => url.replace(`:${port}/`, `:${server.address().port}/`),
    cut: () => ends.forEach((end) => end.destroy()),
    swallow: () => ends.forEach((end) => end.unpipe().resume()),
    remove: () => { server.close(); ends.forEach((end) => end.destroy()); },
  };
}

/**
 * A client that draws nothing, for the state that the server sends to another client. Has the functions for facts of
 * the page.
 */
export async function watch() {
  // The page alone knows its session.
  if (SITE) return { evaluate: (...all) => newest.evaluate(...all), waitForTimeout: (ms) => newest.waitForTimeout(ms), context: () => ({ close: () => {} }) };
  const context = await browser.newContext();
  const client = await context.newPage();
  client.setDefaultTimeout(PATIENCE);
  await client.goto(new URL('/nothing', address).href); // an empty page of the same origin
  await client.evaluate(() => {
    const session = { welcome: null, state: null, yours: false, paired: false, holder: 0, errors: [] };
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.onopen = () => socket.send('{"type":"hello","version":3}');
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.type === 'welcome') session.welcome = message;
      if (message.type === 'state') session.state = message;
      if (message.type === 'lease') Object.assign(session, { holder: message.holder, yours: message.yours });
      if (message.type === 'error') session.errors.push(message.code);
    };
    globalThis.steadyhand = { session, connection: { send: (message) => socket.send(JSON.stringify(message)) } };
  });
  await until(() => state(client), 'a state');
  return client;
}

/** Waits for four frames of the page, with a time limit in case none are drawn. */
export const frames = (of) => of.evaluate(() => new Promise((done) => {
  setTimeout(done, 10_000);
  let n = 0;
  const each = () => (++n > 3 ? done() : requestAnimationFrame(each));
  requestAnimationFrame(each);
}));

/** Waits until the arm is stationary: its joints hardly move, and not only because they reverse. */
export const rest = (of) => until(async () => {
  const still = async () => Math.max(...(await state(of)).dq.map(Math.abs)) < 0.005;
  if (!(await still())) return false;
  await of.waitForTimeout(100);
  return still();
}, 'rest');

/**
 * Makes the page ready: with control (a slow frame may have lost it: 3 s without a message), no recording playing, arm
 * stationary.
 */
export async function ready(of) {
  await until(async () => (await facts(of)).paired, 'the page to be paired');
  await until(async () => (await facts(of)).yours || (await say(of, { type: 'take' }), false), 'the lease');
  await say(of, { type: 'request', kind: 'playback', text: '' });
  await until(async () => (await state(of)).controls.playback === -1, 'the recording to end');
  await inState(of, 'ready');
  await rest(of);
}

export async function targetOnScreen(of) {
  return of.evaluate(() => {
    const { stage } = globalThis.steadyhand;
    const p = stage.ghost.getWorldPosition(stage.ghost.position.clone()).project(stage.view.camera);
    const box = stage.renderer.domElement.getBoundingClientRect();
    return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
  });
}

/** Presses the mouse at the target, which the handles need to notice first; where that is. */
export async function pressTarget(of) {
  const at = await targetOnScreen(of);
  await of.mouse.move(at.x, at.y);
  await of.waitForTimeout(300);
  await of.mouse.down();
  return at;
}

/**
 * Engages the arm until `done` is true; engages again if the hand timed out on a slow machine.
 * @param {{grip(): Promise<unknown>, release(): Promise<unknown>}} hand
 * @param {() => Promise<boolean>} done
 */
export const lead = (of, hand, done, what) => until(async () => {
  await hand.release();
  await inState(of, 'ready');
  await hand.grip();
  for (let i = 0; i < 60; ++i) {
    if (await done()) return true;
    await of.waitForTimeout(50);
  }
  return false;
}, what);
export const isEngaged = async (of) => (await state(of)).state === 'engaged';
