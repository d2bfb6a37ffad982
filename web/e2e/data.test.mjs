// From a hand to a data set (README.md): the mouse moves the glass onto its mark in an episode that is kept; `dataset`
// converts it.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import test, { after, before } from 'node:test';
import { findsNothing } from './axe.mjs';
import { BROWSER, PROGRAM, ROOT, closePages, distance, finish, open, ready, rest, sessions, start, startProgram, state, stopProgram, terminal, until, withoutPixels } from './harness.mjs';

const MODULE = join(dirname(PROGRAM), 'python'), PYTHON = process.env.STEADYHAND_PYTHON ?? join(ROOT, '.deps/venv/bin/python');
const CASE = { skip: BROWSER ? (existsSync(join(MODULE, 'steadyhand')) ? false : 'the Python package is not built') : 'no browser on this machine', timeout: 360_000 };
before(start);
after(finish);

/** Pixels at which the mouse feels a handle, if there are any. */
const findHandle = (of, handle) => of.evaluate((wanted) => {
  const { stage, drag: { controls } } = globalThis.steadyhand;
  const box = stage.renderer.domElement.getBoundingClientRect(), found = [];
  for (let x = 4; x < box.width; x += 4) {
    for (let y = 4; y < box.height; y += 4) {
      controls.pointerHover({ x: (2 * x) / box.width - 1, y: 1 - (2 * y) / box.height, button: -1 });
      if (controls.axis === wanted) found.push([box.left + x, box.top + y]);
    }
  }
  return found[Math.floor(found.length / 2)];
}, handle);

/** Pixels of a place, m in the base. */
const pixel = (of, place) => of.evaluate((at) => {
  const { stage } = globalThis.steadyhand;
  const p = stage.ghost.position.clone().fromArray(at).applyMatrix4(stage.base.matrixWorld).project(stage.view.camera);
  const box = stage.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}, place);

/**
 * Drags a handle until the tool is there, m; again if perspective, or a timeout on a busy machine, left it elsewhere.
 */
const dragTo = (of, handle, wanted, close) => until(async () => {
  await ready(of); // with control, which a page that draws slowly may lose
  const { tools: [{ pose: tool, target }] } = await state(of);
  const there = (p) => p.map((x, i) => (handle.includes('XYZ'[i]) ? wanted[i] : x));
  if (distance(tool.p, there(tool.p)) < close) return true;
  const grip = await findHandle(of, handle);
  if (!grip) return false;
  const begin = await pixel(of, target.p), end = await pixel(of, there(target.p)), steps = Math.ceil(distance(there(target.p), target.p) / 0.004);
  await of.mouse.move(...grip);
  await of.waitForTimeout(300);
  await of.mouse.down();
  for (let k = 1; k <= steps; ++k) {
    await of.mouse.move(grip[0] + ((end[0] - begin[0]) * k) / steps, grip[1] + ((end[1] - begin[1]) * k) / steps);
    await of.waitForTimeout(40);
  }
  await rest(of);
  await of.mouse.up();
  return false;
}, `the tool at ${wanted} by ${handle}`);

/** In the headset the camera images are above the board, and continue. */
async function seesCamerasInHeadset(page) {
  await page.click('#emulate');
  await page.waitForSelector('#enter-vr:not([hidden])');
  await page.evaluate(() => document.querySelector('#enter-vr').click());
  const uploads = () => page.evaluate(() => globalThis.steadyhand.headset.screens.screens.map(({ material }) => material.map.version));
  const first = await until(async () => { const all = await uploads(); return all.length === 2 && all; }, 'two screens');
  await until(async () => (await uploads()).every((count, i) => count > first[i] + 2), 'pictures on the screens');
  const names = await until(() => page.evaluate(() => { const all = globalThis.steadyhand.headset.screens.screens.map(({ words }) => words.lines); return all[0] && all; }), 'their names');
  assert.deepEqual(names, ['front', 'wrist']);
  await page.evaluate(() => document.querySelector('#enter-vr').click());
  await until(() => page.evaluate(() => globalThis.steadyhand.headset.session === null), 'VR to be left');
}

/** Camera images are drawn, and stop while they are hidden. */
async function seesCameras(page) {
  const drawn = () => page.evaluate(() => globalThis.steadyhand.cameras.views.map((view) => view.drawn));
  const more = async (than, what) => until(async () => (await drawn()).every((count, i) => count > than[i] + 3), what);
  await more([0, 0], 'pictures of both cameras');
  const { names, shades, latency, off } = await page.evaluate(() => {
    const { cameras, connection } = globalThis.steadyhand;
    const shadesOf = ({ canvas }) => new Set(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data).size;
    return { names: cameras.views.map(({ facts }) => facts.name), shades: cameras.views.map(shadesOf), latency: cameras.latency.value(), off: connection.clock.uncertainty };
  });
  assert.deepEqual(names, ['front', 'wrist']);
  assert.ok(shades.every((count) => count > 30), `something is seen: ${shades} shades`);
  assert.ok(latency > -off && latency < 10, `${latency} s from glass to glass`);
  console.log(`from glass to glass ${(1000 * latency).toFixed(0)} ms in the median, ${(1000 * off).toFixed(1)} ms uncertain`);
  await until(() => page.evaluate(() => /^\d+ ms$/.test(document.querySelector('#cameras-latency').textContent)), 'the latency on the page');
  await findsNothing(page, 'the panel of cameras');
  await page.evaluate(() => globalThis.steadyhand.connection.send({ type: 'watch', cameras: ['ceiling'] }));
  await until(() => page.evaluate(() => globalThis.steadyhand.session.lastError?.message.includes('there are front, wrist')), 'a camera that is not there to be refused');
  await more(await drawn(), 'those that were asked for before');
  await page.click('#cameras summary');
  await page.waitForTimeout(1000);
  const folded = await drawn();
  await page.waitForTimeout(1000);
  assert.deepEqual(await drawn(), folded, 'nothing is sent for a folded panel');
  await page.click('#cameras summary');
  await more(folded, 'pictures after the next key picture');
}

test('an episode by mouse becomes a data set', CASE, async () => {
  // Longer timeouts of the hand, for a page with software rendering on a busy machine.
  const patient = ['gate.gap_max=2', 'supervision.hold_after=2', 'supervision.disengage_after=4'].flatMap((each) => ['--set', each]);
  await startProgram('--arm', 'mujoco', '--task', 'carry', '--set', 'mujoco.seed=3', ...patient);
  const page = await open({ prepare: withoutPixels });
  await ready(page);
  await seesCameras(page);
  const mark = await until(() => page.evaluate(() => globalThis.steadyhand.session.welcome.cell.objects.find((each) => each.name === 'mark')?.origin.map((row) => row[3])), 'the mark');
  // A key acts on the state that the page has drawn by then.
  const press = (key, done, what) => until(async () => (await done()) || (await page.keyboard.press(key), await page.waitForTimeout(500), false), what);
  await press('KeyB', async () => (await state(page)).episode.running, 'an episode');
  await dragTo(page, 'XY', mark, 0.01);
  await dragTo(page, 'Z', [0, 0, mark[2] + 0.05], 0.007); // a little into the table, which holds the glass up
  await press('KeyN', async () => (await state(page)).episode.kept === 1, 'the episode to be kept');
  await seesCamerasInHeadset(page);
  assert.deepEqual(page.complaints, []);
  const { success, spilled, time } = (await state(page)).task;
  await closePages();
  await stopProgram();
  console.log(`success ${success} after ${time} s, spilled ${spilled}\n${terminal()}`);

  const data = process.env.STEADYHAND_DATA_SET ?? join(sessions, 'data'); // it stays where it is asked for
  // A busy machine loses pictures.
  const done = spawnSync(PYTHON, ['-m', 'steadyhand.dataset', sessions, '--out', data, '--picture-pause', '60'], { env: { ...process.env, PYTHONPATH: MODULE, STEADYHAND_PROGRAM: PROGRAM }, encoding: 'utf8' });
  console.log(done.stdout, done.stderr);
  assert.equal(done.status, 0, done.stderr);
  const info = JSON.parse(readFileSync(join(data, 'meta/info.json'), 'utf8'));
  assert.equal(info.total_episodes, 1);
  for (const key of ['observation.images.front', 'observation.images.wrist', 'next.success', 'action']) assert.ok(key in info.features, key);
});
