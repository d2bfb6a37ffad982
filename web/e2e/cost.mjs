// What the page costs, as a table: `node web/e2e/cost.mjs`. The scene is drawn into few pixels, because this measures the
// page's own work in the processor: how fast pixels fill is the graphics card's affair, told by triangles and calls.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { allocations, buildReadable } from './allocations.mjs';
import { finish, isEngaged, lead, open, pressTarget, ready, start, startProgram, until } from './harness.mjs';

const SECONDS = 5;
const percentile = (values, share) => [...values].sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
const print = (what, value) => console.log(`${what.padEnd(64)} ${value}`);

/** s of the page's clock at which an arm with all its meshes has begun to move. */
const aliveAt = (page) => until(() => page.evaluate(() => globalThis.aliveAt), 'the arm to move');

async function frames(page, tools) {
  const heap = async () => (await tools.send('Runtime.getHeapUsage')).usedSize;
  const metrics = async () => Object.fromEntries((await tools.send('Performance.getMetrics')).metrics.map(({ name, value }) => [name, value]));
  await tools.send('HeapProfiler.collectGarbage');
  const count = () => page.evaluate(() => globalThis.steadyhand.frames());
  const begin = [await count(), await metrics(), await heap()];
  let allocated = 0, last = begin[2];
  for (let i = 0; i < SECONDS * 10; ++i) {
    await page.waitForTimeout(100);
    const now = await heap();
    allocated += Math.max(0, now - last); // less means that garbage was collected
    last = now;
  }
  const end = [await count(), await metrics()];
  const drawn = end[0] - begin[0];
  return { rate: drawn / SECONDS, script: (1000 * (end[1].ScriptDuration - begin[1].ScriptDuration)) / drawn, task: (1000 * (end[1].TaskDuration - begin[1].TaskDuration)) / drawn, allocated: allocated / drawn };
}

/** Who allocates, while a recording leads the arm and then a key, of a page whose functions have kept their names. */
async function printAllocations() {
  const folder = mkdtempSync(join(tmpdir(), 'steadyhand-page-'));
  try {
    const sources = buildReadable(folder);
    await startProgram('--page', folder);
    const page = await open({ context: { viewport: { width: 420, height: 300 } } });
    await page.evaluate(() => globalThis.steadyhand.stage.setQuality(3));
    await page.waitForTimeout(2000 * SECONDS); // until what runs often is compiled
    await printShares('while a recording leads', await allocations(page, sources, 2 * SECONDS));
    await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
    await ready(page);
    await page.evaluate(() => globalThis.steadyhand.stage.setQuality(3));
    await page.keyboard.down('KeyE');
    await page.waitForTimeout(1000 * SECONDS);
    await printShares('while a key leads', await allocations(page, sources, 2 * SECONDS));
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
    context: { viewport: { width: 420, height: 300 } },
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
  const tools = await page.context().newCDPSession(page);
  await tools.send('Performance.enable');
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(3));
  const drawn = await frames(page, tools);
  const info = await page.evaluate(() => { const { render } = globalThis.steadyhand.stage.renderer.info; return [render.triangles, render.calls]; });
  print('frames a second', drawn.rate.toFixed(0));
  print('scripts a frame, messages and plots included', `${drawn.script.toFixed(2)} ms`);
  print('all of the page\'s thread a frame, drawing calls included', `${drawn.task.toFixed(2)} ms`);
  print('allocated a frame, messages and the measurement included', `${(drawn.allocated / 1024).toFixed(1)} kB`);
  print('triangles, drawing calls', info.join(', '));
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
  await ready(page);
  await lead(page, {
    release: () => page.mouse.up(),
    grip: async () => {
      const at = await pressTarget(page);
      for (let i = 1; i <= 60 * SECONDS; ++i) {
        await page.mouse.move(at.x + 20 * Math.sin(i / 30), at.y - 20 * Math.sin(i / 40));
        await page.waitForTimeout(8);
      }
    },
  }, () => isEngaged(page), 'the mouse to lead the arm');
  const delays = await page.evaluate(() => globalThis.steadyhand.hand.delays);
  await page.mouse.up();
  print('input event to WebSocket, median, p99', `${(1000 * percentile(delays, 0.5)).toFixed(1)}, ${(1000 * percentile(delays, 0.99)).toFixed(1)} ms (${delays.length} events)`);
  const bytes = () => page.evaluate(() => [globalThis.steadyhand.connection.bytesReceived, globalThis.steadyhand.session.statesReceived]);
  const before = await bytes();
  await page.waitForTimeout(1000 * SECONDS);
  const after = await bytes();
  print('received a second', `${((after[0] - before[0]) / SECONDS / 1000).toFixed(0)} kB, ${((after[1] - before[1]) / SECONDS).toFixed(0)} states`);
  await page.context().close();
  await printAllocations();
} finally {
  await finish();
}
