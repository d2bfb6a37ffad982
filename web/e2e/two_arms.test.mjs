// Two arms (robot two_ur5e) against the real program: by mouse, keys and both controllers of the emulated headset.
// What the arms did is taken from the states that the server sends to another client.
import assert from 'node:assert/strict';
import { after, before, beforeEach, test } from 'node:test';
import { findsNothing } from './axe.mjs';
import { closePages, distance, finish, frames as framesOf, inState, NEEDS_PROGRAM, open, ready, rest, start, startProgram, state, until, watch, withoutPixels } from './harness.mjs';

let page, watcher;
const tools = async () => (await state(watcher)).tools;
const joints = async () => (await state(watcher)).command;
const on = (act, ...values) => page.evaluate(([code, with_]) => new Function('steadyhand', 'device', 'values', code)(globalThis.steadyhand, globalThis.emulatedHeadset, with_), [act, values]);
const active = () => on('return steadyhand.session.active');
const frames = () => framesOf(page);

before(async () => {
  await start();
  await startProgram('--robot', 'two_ur5e');
  watcher = await watch();
  page = await open({ context: { viewport: { width: 1200, height: 720 } }, prepare: withoutPixels });
  await ready(page);
});
after(async () => {
  await closePages();
  await finish();
});

/** Where a tool's target is on the page. */
const onScreen = (tool) => page.evaluate((t) => {
  const { stage } = globalThis.steadyhand, { ghost } = stage.tools[t], p = ghost.getWorldPosition(ghost.position.clone()).project(stage.view.camera);
  const box = stage.renderer.domElement.getBoundingClientRect();
  return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
}, tool);

/** The commanded joints of an arm of two_ur5e. */
const armOf = (q, tool) => q.slice(6 * tool, 6 * tool + 6);
/** Whether the arm of this tool has been commanded to stay exactly where it was. */
const stayed = (before, after, tool) => armOf(before, tool).every((q, k) => q === armOf(after, tool)[k]);

/** Drags a tool's glass upwards until it has followed; again if the hand timed out on a slow machine. */
const drag = (tool, pixels = -60) => until(async () => {
  await page.mouse.up();
  await inState(watcher, 'ready');
  await rest(watcher);
  const { x, y } = await onScreen(tool), begin = (await tools())[tool].pose.p;
  await page.mouse.move(x, y);
  await page.waitForTimeout(300);
  await page.mouse.down();
  for (let i = 1; i <= 20; ++i) {
    await page.mouse.move(x, y + (pixels * i) / 20);
    await page.waitForTimeout(30);
  }
  for (let i = 0; i < 20; ++i) {
    if (distance((await tools())[tool].pose.p, begin) > 0.03) return true;
    await page.waitForTimeout(50);
  }
  return false;
}, `tool ${tool} to follow the mouse`);

test('each handle moves its arm, and the other stays exactly where it was', async () => {
  assert.deepEqual(await on('return steadyhand.session.toolNames'), ['left', 'right']);
  for (const tool of [0, 1]) {
    const before = await joints();
    await drag(tool, tool === 0 ? -60 : 40);
    assert.equal(await active(), tool);
    const seen = await tools();
    assert.equal(seen[tool].state, 'engaged');
    assert.notEqual(seen[1 - tool].state, 'engaged');
    assert.ok(stayed(before, await joints(), 1 - tool), 'the other arm stays');
    assert.ok(!stayed(before, await joints(), tool));
    await page.mouse.up();
    await inState(watcher, 'ready');
    await rest(watcher);
    assert.ok(stayed(before, await joints(), 1 - tool), 'the other arm stays after the release, too');
  }
});

test('Tab in the scene, or a card, chooses the arm that keys move, and none while a hand is engaged', async () => {
  await page.mouse.click(700, 500); // the scene has the focus
  assert.equal(await page.evaluate(() => document.activeElement.id), 'scene');
  const first = await active();
  await page.keyboard.press('Tab');
  assert.equal(await active(), 1 - first);
  await page.keyboard.press('Tab');
  assert.equal(await active(), first);
  await page.keyboard.press('Shift+Tab');
  assert.notEqual(await page.evaluate(() => document.activeElement.id), 'scene', 'no trap for the focus');
  assert.equal(await active(), first);
  await page.click('#arms button:nth-child(2)');
  assert.equal(await active(), 1);
  assert.deepEqual(await page.$$eval('#arms button', (cards) => cards.map((card) => [card.ariaPressed, card.querySelector('.name').textContent])), [['false', '● left'], ['true', '◆ right']]);
  const before = await joints();
  await until(async () => {
    await page.keyboard.up('e');
    await inState(watcher, 'ready');
    await page.keyboard.down('e');
    await page.waitForTimeout(600);
    return (await tools())[1].state === 'engaged';
  }, 'a key to move the right arm');
  await page.click('#arms button:nth-child(1)');
  assert.equal(await active(), 1, 'the engaged hand keeps its arm');
  await until(async () => (await page.textContent('#advice')).includes('Release first'), 'why');
  await page.keyboard.up('e');
  await inState(watcher, 'ready');
  await rest(watcher);
  assert.ok(stayed(before, await joints(), 0) && !stayed(before, await joints(), 1));
});

test('on its page axe finds nothing', async () => {
  await findsNothing(page, 'two arms');
  assert.deepEqual(page.complaints, []);
});

const press = (side, button, value = 1) => on('device.controllers[values[0]].updateButtonValue(values[1], values[2])', side, button, value);
const tap = async (side, button) => {
  for (const value of [1, 0]) {
    await press(side, button, value);
    await frames();
  }
};
const HOME = { right: [-0.08, 1.17, -0.62], left: [-0.5, 1.17, -0.62] };
const place = (side, p) => on('device.controllers[values[0]].position.set(...values[1])', side, p);
const release = async () => {
  for (const side of ['left', 'right']) {
    await press(side, 'squeeze', 0);
    await place(side, HOME[side]);
  }
  await frames();
  await inState(watcher, 'ready');
  await rest(watcher);
};
/**
 * Squeezes these, and moves each by so many m upwards, at once, until `done` of the m that the tools rose; again if a hand
 * timed out on a slow machine.
 */
const raise = (by, done) => until(async () => {
  await release();
  const begin = await tools();
  for (const side of Object.keys(by)) await press(side, 'squeeze');
  await frames();
  await page.waitForTimeout(700); // a new engagement follows growing shares of the motion
  for (let i = 1; i <= 20; ++i) {
    for (const [side, up] of Object.entries(by)) await place(side, HOME[side].map((x, k) => (k === 1 ? x + (up * i) / 20 : x)));
    await page.waitForTimeout(30);
  }
  for (let i = 0; i < 40; ++i) {
    const now = await tools();
    if (now.filter((tool) => tool.state === 'engaged').length < Object.keys(by).length) return false;
    if (done(now.map(({ pose }, t) => pose.p[2] - begin[t].pose.p[2]))) return true;
    await page.waitForTimeout(50);
  }
  return false;
}, `the arms to follow ${JSON.stringify(by)}`);

test('both controllers move both arms at once, one alone moves its own, X swaps them once both are released', NEEDS_PROGRAM, async () => {
  await page.click('#emulate');
  await page.waitForSelector('#enter-vr:not([hidden])');
  await page.evaluate(() => document.querySelector('#enter-vr').click());
  await until(() => on('return steadyhand.headset.session !== null'), 'the session');
  await release();
  const board = () => on('return steadyhand.headset.board.text');
  await until(async () => !(await board()).includes('press A') || (await tap('right', 'a-button'), await page.waitForTimeout(250), false), 'forward');
  await ready(page);
  await raise({ left: 0.06, right: -0.06 }, ([left, right]) => left > 0.02 && right < -0.02);
  await tap('left', 'x-button');
  assert.match(await board(), /Release both grips/);
  await on('device.controllers.left.connected = false');
  await until(async () => (await tools()).every((tool) => tool.state !== 'engaged'), 'both arms to hold, of which one hand is lost');
  await until(async () => (await on('return steadyhand.headset.guide.notice.lines')).includes('Left controller not seen') || !(await tools()).some((tool) => tool.state === 'holding'), 'the notice');
  await on('device.controllers.left.connected = true');
  await release();
  const before = await joints();
  await raise({ left: -0.06 }, ([left]) => left < -0.02);
  await release();
  assert.ok(stayed(before, await joints(), 1), 'the right arm stays');
  assert.match(await board(), /Left hand \(X swaps\): ‘left’/);
  await tap('left', 'x-button');
  await until(async () => /Left hand \(X swaps\): ‘right’/.test(await board()), 'the board to show the swap');
  const held = await joints();
  await raise({ left: 0.06 }, ([, right]) => right > 0.02);
  await press('right', 'b-button'); // one stop for both
  await inState(watcher, 'stopping');
  assert.deepEqual((await tools()).map((tool) => tool.state), ['stopping', 'stopping']);
  await press('right', 'b-button', 0);
  await rest(watcher);
  assert.ok(stayed(held, await joints(), 0));
  assert.deepEqual(page.complaints, []);
});
