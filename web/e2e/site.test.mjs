// Tests of the site alone (`./steadyhand site`, its folder in STEADYHAND_SITE): no program, a network that may fail,
// files that may be broken. page.test.mjs, stops.test.mjs and headset.test.mjs run on the site, too, and test what page
// and program share.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, afterEach, before, test } from 'node:test';
import {
  address, browser, closePages, complaintsOf, distance, facts, finish, FIREFOX, inState, isEngaged, lead, open, PATIENCE, picture, PROGRAM, ready, record, rest, say, start,
  startProgram, state, until, withoutPixels,
} from './harness.mjs';

/** In a stock Firefox, WebDriver BiDi cannot intercept the network of a Worker. */
const IN_CHROMIUM = { skip: FIREFOX && 'only Chromium lends itself to that' };
before(async () => {
  await start();
  await startProgram();
});
afterEach(closePages);
after(finish);

/** Opens the page where it cannot start, and waits for its message `wanted`. */
async function advice(wanted, prepare) {
  const context = await browser.newContext({ viewport: { width: 700, height: 420 }, serviceWorkers: 'block' });
  await prepare(context);
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  await page.goto(address, { waitUntil: 'commit' });
  await until(async () => wanted.test(await page.textContent('#advice').catch(() => '')), `the words ${wanted}`);
  return page;
}
const answer = (file, what) => (context) => context.route(`**/${file}`, what);

test('from opening to an arm that moves; nothing leaves the folder', async () => {
  const begin = performance.now();
  const page = await open({ prepare: withoutPixels });
  const first = await state(page);
  await until(async () => distance((await state(page)).q, first.q) > 0.01, 'the arm to move');
  console.log(`opening to a moving arm: ${((performance.now() - begin) / 1000).toFixed(2)} s`);
  const { begun, moved } = await page.evaluate(() => ({ begun: performance.getEntriesByType('navigation')[0].startTime, moved: performance.now() }));
  assert.ok(moved > begun);
  assert.deepEqual(page.requests.filter((url) => !url.startsWith(address) && !url.startsWith('data:') && !url.startsWith('blob:')), []);
  assert.deepEqual(page.complaints, []);
});

test('a profile changes while the arm moves, Stop stops it, Reset readies it, and it is led again', async () => {
  const page = await open({ prepare: withoutPixels });
  await ready(page);
  const key = { grip: () => page.keyboard.down('KeyE'), release: () => page.keyboard.up('KeyE') };
  await lead(page, key, () => isEngaged(page), 'a key to lead the arm');
  await say(page, { type: 'request', kind: 'profile', text: 'waiter' });
  await until(() => page.evaluate(() => { const { welcome, state } = globalThis.steadyhand.session; return welcome.profiles[state.controls.profile].name === 'waiter'; }), 'the profile');
  await page.click('#stop');
  await inState(page, 'stopping');
  await page.keyboard.up('KeyE');
  await rest(page);
  await page.click('#reset');
  await inState(page, 'ready');
  await lead(page, key, () => isEngaged(page), 'a key to lead the arm again');
  assert.deepEqual(page.complaints, []);
});

test('after the first visit it needs no network', IN_CHROMIUM, async () => {
  const page = await open({ prepare: withoutPixels });
  await page.evaluate(() => navigator.serviceWorker.ready);
  const { caches: kept } = await until(() => page.evaluate(async () => {
    const names = await caches.keys();
    return names.length > 0 && { caches: names };
  }), 'the files to be kept');
  assert.equal(kept.length, 1);
  await page.context().setOffline(true);
  await page.reload({ waitUntil: 'commit' });
  await until(() => page.evaluate(() => globalThis.steadyhand?.session.state), 'the page without a network');
  const first = await state(page);
  await until(async () => distance((await state(page)).q, first.q) > 0.01, 'the arm to move');
});

test('what it records is downloaded as MCAP, which the program opens', IN_CHROMIUM, async () => {
  const page = await open({ prepare: withoutPixels });
  await until(async () => (await facts(page)).yours || (await say(page, { type: 'take' }), false), 'the lease');
  await record(page, true);
  await ready(page);
  await lead(page, { grip: () => page.keyboard.down('KeyE'), release: () => page.keyboard.up('KeyE') }, () => isEngaged(page), 'a key to lead the arm');
  await page.waitForTimeout(1500);
  await page.keyboard.up('KeyE');
  await record(page, false);
  await until(async () => /gone with this page/.test(await page.textContent('#recordings')), 'the recording to be complete');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#recordings button:has-text("Download")')]);
  assert.match(download.suggestedFilename(), /^\d{4}-\d\d-\d\d_[-\d]+\.mcap$/);
  const folder = mkdtempSync(join(tmpdir(), 'steadyhand-')), file = join(folder, 'session.mcap');
  await download.saveAs(file);
  assert.match(await page.textContent('#recordings'), /downloaded/);
  for (const words of [['replay', file, '--out', join(folder, 'replay')], ['report', file, '--out', join(folder, 'report')]]) {
    const done = spawnSync(PROGRAM, words, { encoding: 'utf8' });
    assert.equal(done.status, 0, done.stderr);
  }
  rmSync(folder, { recursive: true });
  assert.deepEqual(page.complaints, []);
});

test('files that are missing, of another kind or cut short are named, with what to do', IN_CHROMIUM, async () => {
  await advice(/The planner \(steadyhand\.wasm\) is missing on the server \(404\): publish/, answer('steadyhand.wasm', (route) => route.fulfill({ status: 404 })));
  await advice(/The planner \(steadyhand\.wasm\) has type text\/html/, answer('steadyhand.wasm', (route) => route.fulfill({ contentType: 'text/html', body: '<p>' })));
  const page = await advice(/The robot \(robots\/ur5e\.json\) is cut short: 20 of \d+ bytes/,
    answer('robots/ur5e.json', (route) => route.fulfill({ contentType: 'application/json', body: '{"robot":{"name":"ur' })));
  await page.screenshot({ path: picture('site_cut_short'), timeout: PATIENCE });
  await advice(/site\.json\) is missing/, answer('site.json', (route) => route.fulfill({ status: 404 })));
  await advice(/The planner \(steadyhand\.wasm\) could not be loaded/, answer('steadyhand.wasm', (route) => route.abort()));
});

test('a robot that cannot be is refused with its key', IN_CHROMIUM, async () => {
  await advice(/robot\.joints: has 0 entries; it must have 1 to 8/, async (context) => {
    const broken = '{"robot":{"name":"ur5e","joints":[]}}';
    await context.route('**/site.json', (route) => route.fulfill({ json: { robots: ['ur5e'], bytes: { 'robots/ur5e.json': broken.length } } }));
    await context.route('**/robots/ur5e.json', (route) => route.fulfill({ contentType: 'application/json', body: broken }));
  });
});

test('without WebAssembly it says so', IN_CHROMIUM, async () => {
  await advice(/runs no WebAssembly.*use another browser/, (context) => context.addInitScript(() => { delete globalThis.WebAssembly; }));
});

test('who comes first is told what to do, once', async () => {
  const page = await open({ first: true, prepare: withoutPixels });
  assert.ok(await page.isVisible('#first-steps'));
  await page.click('#first-demo');
  await page.reload({ waitUntil: 'commit' });
  await until(() => page.evaluate(() => globalThis.steadyhand?.session.state), 'the page');
  assert.equal(await page.isVisible('#first-steps'), false);
});

test('a robot that the site does not have is told', IN_CHROMIUM, async () => {
  const page = await advice(/(?:)/, async () => {});
  await page.goto(`${address}?robot=ur50`, { waitUntil: 'commit' });
  await until(async () => /no robot “ur50”; it has ur5e/.test(await page.textContent('#advice')), 'the words');
});

test('without SIMD it loads the other module, without WebGL it says so, and moves all the same', IN_CHROMIUM, async () => {
  const context = await browser.newContext({ viewport: { width: 700, height: 420 }, serviceWorkers: 'block' });
  await context.addInitScript(() => {
    WebAssembly.validate = () => false;
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind.startsWith('webgl') ? null : getContext.call(this, kind, ...more); };
  });
  const page = await context.newPage();
  const requests = [];
  context.on('request', (request) => requests.push(request.url()));
  const complaints = complaintsOf(page);
  await page.goto(address, { waitUntil: 'commit' });
  await until(() => page.evaluate(() => globalThis.steadyhand?.session.state), 'the page');
  const first = await state(page);
  await until(async () => distance((await state(page)).q, first.q) > 0.01, 'the arm to move');
  assert.ok(await page.isVisible('#blind'));
  assert.ok(requests.some((url) => url.endsWith('steadyhand-plain.wasm')) && !requests.some((url) => url.endsWith('steadyhand.wasm')));
  assert.equal((await facts(page)).paired, true);
  assert.deepEqual(complaints.filter((words) => !/WebGL/.test(words)), []);
});
