// `node web/e2e/endurance.mjs [--minutes N] [--pictures HZ]`: a site (STEADYHAND_SITE) plays for so long in a Chromium
// with real windows and tabs, then in a hidden tab, then frozen. Prints JSON lines. Exits with 1 if memory grows, the
// session's clock drifts or the arm moves in a hidden tab. Needs Xvfb. --pictures limits the frame rate: software
// rendering must leave the planner a processor.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { address, finish, inState, isEngaged, lead, ready, say, startProgram, state, until, withoutPixels } from './harness.mjs';
import { startWindows } from './windows.mjs';

const { values } = parseArgs({ options: { minutes: { type: 'string', default: '60' }, pictures: { type: 'string', default: '60' } } });
const minutes = Number(values.minutes), pictures = Number(values.pictures);
assert.ok(minutes >= 0 && pictures > 0, '--minutes and --pictures are numbers');
const fewPictures = (hz) => { globalThis.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 1000 / hz); };
const tell = (words) => console.log(JSON.stringify(words));
const fastest = async (page) => Math.max(...(await state(page)).dq.map(Math.abs));

/**
 * s: how far the session's clock, with the time left out of it, is ahead of its Worker's clock: the largest of several
 * samples, because a busy Worker is behind until its turn comes. And the delay until the page gets it, which is no
 * drift.
 */
async function clocks(page) {
  let best = null;
  for (let i = 0; i < 20; ++i, await page.waitForTimeout(50)) {
    const of = await page.workers()[0].evaluate(() => {
      const { latest, leftOut } = globalThis.steadyhand;
      return { at_ms: performance.timeOrigin + performance.now(), own_s: performance.now() / 1000, session_s: JSON.parse(latest()).now_s, left_out_s: leftOut() };
    });
    const seen = await page.evaluate(() => ({ at_ms: performance.timeOrigin + performance.now(), heard_s: globalThis.steadyhand.session.state.now_s }));
    const ahead = of.session_s + of.left_out_s - of.own_s, news_late_s = (seen.at_ms - of.at_ms) / 1000 - (seen.heard_s - of.session_s);
    if (!best || ahead > best.ahead) best = { ahead, news_late_s, session_s: of.session_s, left_out_s: of.left_out_s };
  }
  return best;
}

/** The same, and bytes of the planner and of what is behind the page's objects. */
async function look(page) {
  const [worker] = page.workers(), planner_bytes = await worker.evaluate(() => globalThis.steadyhand.memory());
  await page.send('HeapProfiler.collectGarbage');
  const { usedSize } = await page.send('Runtime.getHeapUsage'), { plans, rejected_plans: refused, state: now } = await state(page);
  return { ...(await clocks(page)), planner_bytes, page_bytes: usedSize, plans, refused, state: now };
}

/** A recorded hand controls the arm for so many s; starts again if a pause of a busy machine ended it. */
async function led(page, seconds) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await page.waitForTimeout(2000)) {
    const { playback } = (await state(page)).controls;
    if (playback !== -1) continue;
    await say(page, { type: 'take' });
    await say(page, { type: 'request', kind: 'playback', text: await page.evaluate(() => globalThis.steadyhand.session.welcome.recordings[0]) });
  }
}

async function play(page) {
  await led(page, 20); // until everything that is made only once exists
  const first = await look(page);
  tell(first);
  let last = first;
  for (let i = 1; i <= minutes; ++i) {
    await led(page, 60);
    last = await look(page);
    tell({ minute: i, drift_s: last.ahead - first.ahead, ...last });
  }
  if (minutes < 1) return;
  assert.ok(last.planner_bytes <= first.planner_bytes, 'the planner took more memory');
  assert.ok(last.page_bytes < 1.5 * first.page_bytes, 'the page took more memory');
  assert.ok(last.plans - first.plans > 60 * 4 * minutes, 'plans were made');
  assert.ok(Math.abs(last.ahead - first.ahead) < 0.1, 'the clocks drift apart');
}

const grip = (page) => ({ grip: () => page.keyboard.down('KeyE'), release: () => page.keyboard.up('KeyE') });

/** Another tab comes to the front, or the browser freezes the page, while a hand controls the arm. */
async function leave(page, other, how, hide, show) {
  await page.bringToFront();
  await ready(page);
  await lead(page, grip(page), () => isEngaged(page), 'a key to lead the arm');
  await page.waitForTimeout(300);
  const begin = await state(page);
  await hide();
  await other.waitForTimeout(10_000);
  await show();
  await until(async () => (await state(page)).now_s > begin.now_s + 0.8, 'news');
  const back = await state(page);
  const speed = await fastest(page);
  tell({ how, hidden_s: 10, session_went_on_s: back.now_s - begin.now_s, state: back.state, fastest_rad_s: speed });
  assert.ok(!['engaged', 'holding'].includes(back.state), `${how}: nobody leads an arm that nobody sees, but it is ${back.state}`);
  assert.ok(speed < 1e-3, `${how}: the arm moves`);
  await page.keyboard.up('KeyE');
  await inState(page, 'ready');
  await ready(page);
  await lead(page, grip(page), () => isEngaged(page), 'a fresh grip to lead the arm');
  await page.keyboard.up('KeyE');
}

const folder = mkdtempSync(join(tmpdir(), 'steadyhand-endurance-'));
const screen = spawn('Xvfb', ['-displayfd', '1', '-screen', '0', '1000x700x24', '-nolisten', 'tcp'], { stdio: ['ignore', 'pipe', 'ignore'] });
let windows;
try {
  const [number] = await once(screen.stdout, 'data');
  await startProgram();
  windows = await startWindows(folder, `:${String(number).trim()}`);
  let prepare;
  await withoutPixels({ addInitScript: (act) => { prepare = `(${act})()`; } });
  if (pictures < 60) prepare += `;(${fewPictures})(${pictures})`;
  const page = await windows.open(address, prepare);
  await until(() => page.evaluate(() => globalThis.steadyhand?.session.state), 'the page');
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
  await play(page);
  const other = await windows.open('about:blank');
  await leave(page, other, 'another tab in front', async () => {
    await other.bringToFront();
    await until(() => page.evaluate(() => document.hidden), 'the page to be hidden');
  }, () => page.bringToFront());
  await leave(page, other, 'frozen', () => page.send('Page.setWebLifecycleState', { state: 'frozen' }),
    () => page.send('Page.setWebLifecycleState', { state: 'active' }));
} finally {
  await windows?.close();
  await finish();
  screen.kill();
  rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
}
