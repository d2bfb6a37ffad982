// A Chromium with real windows and tabs: playwright keeps every page visible, and its timers fast. Controlled over a
// pipe by the DevTools protocol; its pages have those functions of playwright that the harness needs.
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { BROWSER, FLAGS } from './harness.mjs';

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

/** @param folder of its profile @param display of an X server */
export async function startWindows(folder, display) {
  const process_ = spawn(BROWSER, [`--user-data-dir=${folder}`, '--remote-debugging-pipe', '--no-first-run', '--window-size=600,500', ...FLAGS, 'about:blank'],
  { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'], env: { ...process.env, DISPLAY: display } });
  const [, , , out, into] = process_.stdio, waiting = new Map(), listeners = new Set();
  let number = 0, rest = '';
  into.on('data', (data) => {
    const messages = (rest + data).split('\0');
    rest = messages.pop();
    for (const message of messages.map((text) => JSON.parse(text))) {
      if (message.id === undefined) listeners.forEach((hear) => hear(message));
      else waiting.get(message.id)?.(message);
      waiting.delete(message.id);
    }
  });
  const send = async (method, params = {}, sessionId = undefined) => {
    const id = ++number, answered = new Promise((done) => waiting.set(id, done));
    out.write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    const { result, error } = await answered;
    if (error) throw new Error(`${method}: ${error.message}`);
    return result;
  };
  const evaluateIn = (sessionId) => async (act, argument) => {
    const { result, exceptionDetails } = await send('Runtime.evaluate',
      { expression: `(${act})(${JSON.stringify(argument) ?? ''})`, awaitPromise: true, returnByValue: true }, sessionId);
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  };

  /** A new tab, in front. */
  async function open(address, prepare = '') {
    const { targetId } = await send('Target.createTarget', { url: 'about:blank' });
    const { sessionId } = await send('Target.attachToTarget', { targetId, flatten: true });
    const on = (method, params) => send(method, params, sessionId), workers = [];
    listeners.add(({ method, params, sessionId: from }) => {
      if (from !== sessionId) return;
      if (method === 'Target.attachedToTarget' && params.targetInfo.type === 'worker') workers.push({ id: params.sessionId, evaluate: evaluateIn(params.sessionId) });
      if (method === 'Target.detachedFromTarget') workers.splice(0, workers.length, ...workers.filter(({ id }) => id !== params.sessionId));
    });
    await on('Target.setAutoAttach', { autoAttach: true, waitForDebuggerOnStart: false, flatten: true });
    await on('Page.enable');
    await on('Page.addScriptToEvaluateOnNewDocument', { source: prepare });
    await on('Page.navigate', { url: address });
    const key = (type) => (code) => on('Input.dispatchKeyEvent', { type, code, key: code.replace('Key', '').toLowerCase() });
    return {
      evaluate: evaluateIn(sessionId), send: on, workers: () => workers, waitForTimeout: wait,
      bringToFront: () => on('Page.bringToFront'), keyboard: { down: key('keyDown'), up: key('keyUp') },
    };
  }
  const close = async () => {
    const ended = once(process_, 'close');
    await send('Browser.close').catch(() => process_.kill());
    await ended;
  };
  return { open, close };
}
