// Prints a table of the page's processor time: `node web/e2e/cost.mjs`. Frames are measured with triangles but without
// pixels: filling pixels is the graphics card's work, for which the table has the numbers of triangles and calls.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { allocations, buildReadable } from './allocations.mjs';
import { finish, open, pressTarget, ready, start, startProgram, until, withoutPixels } from './harness.mjs';

const SECONDS = 5;
const SMALL = { viewport: { width: 420, height: 300 } };
const percentile = (values, share) => [...values].sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
const medianAndTail = (times) => `${(1000 * percentile(times, 0.5)).toFixed(1)}, ${(1000 * percentile(times, 0.99)).toFixed(1)} ms`;
const print = (what, value) => console.log(`${what.padEnd(64)} ${value}`);

/** s of the page's clock at which an arm with all its meshes starts to move. */
const aliveAt = (page) => until(() => page.evaluate(() => globalThis.aliveAt), 'the arm to move');

/** In the page, for so long: s between frames, and from the arrival of each state to the frame that shows it. */
const watchPictures = (page) => page.evaluate((seconds) => new Promise((done) => {
  const { session } = globalThis.steadyhand, take = session.take.bind(session), gaps = [], ages = [], came = [];
  session.take = (message, now) => {
    take(message, now);
    if (message.type === 'state') came.push(performance.now());
  };
  const end = performance.now() + 1000 * seconds;
  let last = performance.now();
  requestAnimationFrame(function step(time) { // comes behind the page's own, which has drawn by then
    gaps.push((time - last) / 1000);
    last = time;
    ages.push(...came.splice(0).map((at) => (performance.now() - at) / 1000));
    if (time < end) return requestAnimationFrame(step);
    delete session.take;
    done({ gaps: gaps.slice(1), ages });
  });
}), SECONDS);

/** Processor time of the page's thread for a frame. */
async function printPictures(page) {
  const tools = await page.context().newCDPSession(page);
  await tools.send('Performance.enable', { timeDomain: 'threadTicks' });
  const metrics = async () => Object.fromEntries((await tools.send('Performance.getMetrics')).metrics.map(({ name, value }) => [name, value]));
  const begin = await metrics(), { gaps, ages } = await watchPictures(page), end = await metrics();
  const each = (name) => `${((1000 * (end[name] - begin[name])) / gaps.length).toFixed(2)} ms`;
  print('pictures a second', (gaps.length / SECONDS).toFixed(0));
  print('between two pictures, median, p99', medianAndTail(gaps));
  print('a state\'s coming to the end of its picture\'s calls, median, p99', medianAndTail(ages));
  print('scripts a picture, messages and plots included', each('ScriptDuration'));
  print('all of the page\'s thread a picture, drawing calls included', each('TaskDuration'));
  print('the page is laid out anew, times a second', ((end.LayoutCount - begin.LayoutCount) / SECONDS).toFixed(1));
  await tools.detach();
}

/** How old the input events were when their samples left, while `act` made them. */
async function delaysOf(page, act) {
  await ready(page);
  await page.evaluate(() => { globalThis.steadyhand.hand.delays.length = 0; });
  await act();
  const delays = await page.evaluate(() => globalThis.steadyhand.hand.delays);
  return `${medianAndTail(delays)} (${delays.length} events)`;
}

/**
 * Drags the target for SECONDS; on a busy machine the arm may not be engaged all the time. As with a mouse, events come
 * at times that do not depend on the page's frames: if they waited for the page to take each event, they would never
 * meet a busy page.
 */
const dragDelays = (page) => delaysOf(page, async () => {
  const at = await pressTarget(page), moves = [];
  for (let i = 1; i <= 100 * SECONDS; ++i) {
    moves.push(page.mouse.move(at.x + 20 * Math.sin(i / 30), at.y - 20 * Math.sin(i / 40)));
    await page.waitForTimeout(4 + 12 * Math.random());
  }
  await Promise.all(moves);
  await page.mouse.up();
});

/** Taps a key, so that each press engages again. */
const keyDelays = (page) => delaysOf(page, async () => {
  for (let i = 0; i < 20 * SECONDS; ++i) {
    await page.keyboard.press(i % 2 ? 'KeyE' : 'KeyQ', { delay: 25 });
    await page.waitForTimeout(25);
  }
});

/**
 * Prints which functions allocate while a recording, then a key, controls the arm. The build keeps the names of
 * functions.
 */
async function printAllocations() {
  const folder = mkdtempSync(join(tmpdir(), 'steadyhand-page-'));
  try {
    const sources = buildReadable(folder);
    await startProgram('--page', folder);
    const page = await open({ context: SMALL, prepare: withoutPixels });
    await page.evaluate(() => globalThis.steadyhand.stage.setQuality(0));
    await page.waitForTimeout(2000 * SECONDS); // until what runs often is compiled
    printShares('while a recording leads', await allocations(page, sources, 2 * SECONDS));
    await ready(page);
    await page.keyboard.down('KeyE');
    await page.waitForTimeout(1000 * SECONDS);
    printShares('while a key leads', await allocations(page, sources, 2 * SECONDS));
    await page.keyboard.up('KeyE');
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

function printShares(when, { frames: drawn, shares }) {
  for (const [share, { bytes, functions }] of shares) {
    print(`${share}, ${when}`, `${(bytes / drawn).toFixed(0)} bytes a frame`);
    for (const [name, size] of functions.slice(0, 6)) console.log(`    ${name.padEnd(60)} ${(size / drawn).toFixed(0)}`);
  }
}

await start();
try {
  await startProgram();
  const page = await open({
    prepare: (context) => context.addInitScript(() => {
      let first = null;
      const timer = setInterval(() => {
        const q = globalThis.steadyhand?.session.state?.q;
        if (!q || globalThis.steadyhand.stage.arm?.meshes.length !== 7) return;
        first ??= q;
        if (!q.some((angle, i) => Math.abs(angle - first[i]) > 0.02)) return;
        globalThis.aliveAt = performance.now() / 1000;
        clearInterval(timer);
      }, 10);
    }),
  });
  print('from opening the address to an arm that moves', `${(await aliveAt(page)).toFixed(1)} s`);
  print('mouse event to WebSocket, median, p99, nothing drawn', await dragDelays(page));
  await page.context().close();

  const drawn = await open({ drawn: true });
  print('mouse event to WebSocket, median, p99, drawn in software', await dragDelays(drawn));
  print('key event to WebSocket, median, p99, drawn in software', await keyDelays(drawn));
  const bytes = () => drawn.evaluate(() => [globalThis.steadyhand.connection.bytesReceived, globalThis.steadyhand.session.statesReceived]);
  const before = await bytes();
  await drawn.waitForTimeout(1000 * SECONDS);
  const after = await bytes();
  print('received a second', `${((after[0] - before[0]) / SECONDS / 1000).toFixed(0)} kB, ${((after[1] - before[1]) / SECONDS).toFixed(0)} states`);
  await drawn.context().close();

  const quick = await open({ context: SMALL, prepare: withoutPixels });
  await quick.evaluate(() => globalThis.steadyhand.stage.setQuality(0));
  await quick.waitForTimeout(2000 * SECONDS);
  await printPictures(quick);
  const { triangles, calls } = await quick.evaluate(() => globalThis.steadyhand.stage.renderer.info.render);
  print('triangles, drawing calls', `${triangles}, ${calls}`);
  await quick.context().close();
  await printAllocations();
} finally {
  await finish();
}
