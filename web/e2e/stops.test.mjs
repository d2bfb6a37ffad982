// Stops and grips on the page: asserts the motion of the arm, as the server sends it to another client. One program for
// all.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import {
  browser, cable, closePages, distance, facts, finish, FIREFOX, inState, isEngaged, lead, NEEDS_PROGRAM, newestAddress, open as openDrawn, pressTarget, ready, record, rest, reveal, say, start,
  startProgram, state, until, watch, weight, withoutPixels,
} from './harness.mjs';

/** Browsers differ only in keys; one browser is enough for the other tests. */
const IN_CHROMIUM = { skip: FIREFOX && 'in Chromium' };
before(async () => {
  await start();
  await startProgram();
});
afterEach(closePages);
after(finish);

/** These tests do not depend on how the page looks. */
const open = ({ prepare, ...options } = {}) => openDrawn({ ...options, prepare: async (context) => { await withoutPixels(context); await prepare?.(context); } });
const key = (page, code) => ({ grip: () => page.keyboard.down(code), release: () => page.keyboard.up(code) });
const stopped = (of) => inState(of, 'stopping');
/** Ends a stop without an event for the element that has the focus. */
async function reset(page, watcher) {
  await rest(watcher);
  await say(page, { type: 'request', kind: 'reset' });
  await inState(watcher, 'ready');
}
/** The arm stays where it is, at rest, for so many ms. */
async function staysPut(watcher, ms, why) {
  const { tools: [{ pose: tool }] } = await state(watcher);
  await watcher.waitForTimeout(ms);
  const now = await state(watcher);
  assert.ok(now.state !== 'engaged' && distance(now.tools[0].pose.p, tool.p) < 0.002, `${why}: ${now.state}, moved by ${distance(now.tools[0].pose.p, tool.p)} m`);
}

test('Space stops the arm whatever has the focus, and does nothing else', async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await page.evaluate(() => { globalThis.asked = []; const { connection } = globalThis.steadyhand, send = connection.send.bind(connection); connection.send = (m) => { globalThis.asked.push(m); return send(m); }; });
  const focusable = ['#tab-drive', '#mode', 'summary', '#emulate', '#lease', '#record', '#bodies', 'input[name=profile]:checked', '#scale', '#rate', '#playback', '#stop', '#scene', 'body'];
  for (const selector of focusable) {
    await page.evaluate(() => document.activeElement?.blur());
    await reveal(page, selector);
    await page.evaluate((which) => { document.querySelector(which).focus(); globalThis.asked.length = 0; }, selector);
    const before = await page.evaluate((which) => { const e = document.querySelector(which); return [e.checked, e.value, e.getAttribute('aria-pressed')]; }, selector);
    await page.keyboard.press('Space');
    await stopped(watcher);
    assert.deepEqual(await page.evaluate((which) => { const e = document.querySelector(which); return [e.checked, e.value, e.getAttribute('aria-pressed')]; }, selector), before, `${selector} is as it was`);
    const said = await page.evaluate(() => globalThis.asked.filter(({ type }) => type !== 'ping' && type !== 'sample'));
    assert.deepEqual(said, [{ type: 'request', kind: 'stop' }], `${selector}: a stop, one, and nothing else`);
    await reset(page, watcher);
  }
  // An open list handles keys itself.
  await page.focus('#rate');
  await page.keyboard.press('Alt+ArrowDown');
  await page.waitForTimeout(300);
  await page.keyboard.press('Space');
  await stopped(watcher);
  await page.keyboard.press('Escape');
  await page.evaluate(() => document.activeElement?.blur());
  await reset(page, watcher);
  // Reset is there only in a stop; a second stop must not become a reset.
  await page.keyboard.press('Escape');
  await stopped(watcher);
  await page.waitForSelector('#reset:not([hidden])');
  await page.focus('#reset');
  await page.keyboard.press('Space');
  await page.waitForTimeout(300);
  assert.equal((await state(watcher)).state, 'stopping');
  await page.keyboard.press('Enter');
  await inState(watcher, 'ready');
  // Held down it repeats; the second stop of a person would brake harder.
  await page.evaluate(() => { globalThis.asked.length = 0; });
  for (let i = 0; i < 5; ++i) await page.keyboard.down('Space');
  await page.keyboard.up('Space');
  await stopped(watcher);
  assert.equal(await page.evaluate(() => globalThis.asked.filter(({ kind }) => kind === 'stop').length), 1);
  assert.deepEqual(page.complaints, []);
});

test('what Space does elsewhere Enter does: toggles, chooses and presses what has the focus', async () => {
  const page = await open(), watcher = await watch();
  await until(async () => (await facts(page)).paired, 'the page to be paired');
  await say(page, { type: 'take' });
  await reset(page, watcher);
  await ready(page);
  await page.focus('#bodies');
  await page.keyboard.press('Enter');
  assert.equal(await page.isChecked('#bodies'), true);
  await page.keyboard.press('Enter');
  assert.equal(await page.isChecked('#bodies'), false);
  await page.focus('input[value=tracking]');
  await page.keyboard.press('Enter');
  await until(async () => (await weight(watcher, 'lateral')) === 0, 'the profile');
  await page.focus('#mode');
  await page.keyboard.press('Enter');
  assert.equal(await page.getAttribute('#mode', 'aria-pressed'), 'true');
  await page.keyboard.press('Enter');
  await page.click('input[value=waiter]');
});

test('with the keys shown a motion key only closes them, a stop does both, and showing them lets go', IN_CHROMIUM, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  const shown = () => page.isVisible('#help');
  const ask = async () => {
    await page.evaluate(() => document.activeElement?.blur());
    await page.keyboard.press('?');
    assert.equal(await shown(), true);
  };
  for (const code of ['KeyW', 'KeyI', 'KeyG']) {
    await ask();
    await page.keyboard.down(code);
    assert.equal(await shown(), false, `${code} closes it`);
    await staysPut(watcher, 400, `${code} was pressed behind the card`);
    await page.keyboard.up(code);
  }
  for (const stop of [() => page.keyboard.press('Escape'), () => page.keyboard.press('Space'), () => page.click('#stop')]) {
    await ask();
    await page.focus('#help-close'); // Space is no press, and Escape no mere closing
    await stop();
    await stopped(watcher);
    assert.equal(await shown(), false, 'nothing lies over Reset');
    await reset(page, watcher);
  }
  await page.focus('#help-open');
  await page.keyboard.press('Enter');
  assert.equal(await shown(), true);
  await page.keyboard.press('Escape');
  await stopped(watcher);
  await until(() => page.isVisible('#reset kbd'), 'Enter to be offered');
  await page.keyboard.press('Enter');
  await inState(watcher, 'ready');
  assert.equal(await shown(), false, 'Enter resets, also where a button had opened the keys');
  await ready(page);
  await page.evaluate(() => document.activeElement?.blur());
  await lead(watcher, key(page, 'KeyQ'), () => isEngaged(watcher), 'a key to lead');
  await ask();
  await inState(watcher, 'ready');
  await rest(watcher);
  await staysPut(watcher, 400, 'the key is still held');
  await page.keyboard.up('KeyQ');
  await page.keyboard.press('?');
  await lead(watcher, key(page, 'KeyE'), () => isEngaged(watcher), 'a fresh grip');
  await page.keyboard.up('KeyE');
  await inState(watcher, 'ready');
  assert.deepEqual(page.complaints, []);
});

test('what the mouse has pressed leaves Enter to Reset; where Enter ticks a box Reset does not claim it', IN_CHROMIUM, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await page.click('#bodies');
  await page.keyboard.press('Space');
  await stopped(watcher);
  assert.equal(await page.isChecked('#bodies'), true, 'Space only stops');
  await page.waitForSelector('#reset kbd:not([hidden])');
  await page.focus('#bodies');
  await page.waitForSelector('#reset kbd', { state: 'hidden' });
  await page.evaluate(() => document.activeElement.blur());
  await page.waitForSelector('#reset kbd:not([hidden])');
  await rest(watcher);
  await page.keyboard.press('Enter');
  await inState(watcher, 'ready');
  await page.click('#bodies');
});

test('in a text Space is a blank while the arm stands, and a stop while it moves', IN_CHROMIUM, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await page.evaluate(() => document.body.append(Object.assign(document.createElement('input'), { type: 'text', id: 'words' })));
  await page.focus('#words');
  await page.keyboard.type('yesterday spilled');
  assert.equal(await page.inputValue('#words'), 'yesterday spilled');
  assert.equal((await state(watcher)).state, 'ready');
  await say(page, { type: 'request', kind: 'playback', text: 'carrying' });
  await until(() => isEngaged(watcher), 'a motion');
  await page.focus('#words');
  await page.keyboard.press('Space');
  await stopped(watcher);
  assert.equal(await page.inputValue('#words'), 'yesterday spilled ', 'who typed it has it');
  await page.evaluate(() => document.activeElement?.blur());
  await reset(page, watcher);
});

test('a key that nothing comes of is told why', IN_CHROMIUM, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await say(page, { type: 'request', kind: 'tilt', value: 0 });
  await until(async () => (await state(page)).controls.tilt === 0, 'an upright glass');
  await page.evaluate(() => document.activeElement?.blur());
  const told = (key, words) => until(async () => { // for seconds only, which a busy machine may sleep through
    await page.keyboard.press(key);
    return (await page.textContent('#advice')).includes(words);
  }, words);
  await told('KeyI', 'Tilt with the hand');
  await page.keyboard.press('Space');
  await stopped(watcher);
  await told('KeyW', 'press “Reset” first');
  await page.waitForSelector('#reset[data-call=true]');
  await reset(page, watcher);
});

test('letters lead the arm also after a slider, a choice or a list was touched', async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  for (const selector of ['#scale', 'input[name=profile]:checked', '#rate']) {
    await page.focus(selector);
    const begin = await state(watcher);
    await lead(watcher, key(page, 'KeyE'), async () => (await isEngaged(watcher)) && distance((await state(watcher)).tools[0].pose.p, begin.tools[0].pose.p) > 0.01, `a key to lead the arm from ${selector}`);
    await page.keyboard.up('KeyE');
    await inState(watcher, 'ready');
  }
});

test('a key takes the free lease and leads in one press', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await say(page, { type: 'release' });
  await until(async () => !(await facts(page)).yours, 'the lease to be free');
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.down('KeyQ');
  await until(() => isEngaged(watcher), 'the key to lead the arm');
  await page.keyboard.up('KeyQ');
  await inState(watcher, 'ready');
});

test('a lease that comes while the grip is held moves nothing; a fresh grip does', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const other = await open(), page = await open(), watcher = await watch();
  await ready(other);
  await page.bringToFront();
  await page.keyboard.down('KeyQ'); // has no effect: the other client has control
  await say(other, { type: 'release' });
  await until(async () => !(await facts(other)).yours, 'the lease to be free');
  await say(page, { type: 'take' });
  await until(async () => (await facts(page)).yours, 'the lease');
  await staysPut(watcher, 700, 'the grip began before the lease');
  await until(async () => (await page.textContent('#advice')).includes('Release'), 'the words');
  await page.keyboard.up('KeyQ');
  await lead(watcher, key(page, 'KeyQ'), () => isEngaged(watcher), 'a fresh grip');
  await page.keyboard.up('KeyQ');
  await inState(watcher, 'ready');
});

test('a stop folds what is open over other things', async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  const isOpen = () => page.evaluate(() => document.querySelector('#playback').closest('details').open);
  await reveal(page, '#playback');
  assert.equal(await isOpen(), true);
  await page.keyboard.press('Escape');
  await stopped(watcher);
  assert.equal(await isOpen(), false);
  await reset(page, watcher);
});

test('a stop in the middle of a drag leaves handles that can be taken again', IN_CHROMIUM, async () => {
  const page = await open(), watcher = await watch();
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(2));
  await ready(page);
  const mouse = { grip: () => pressTarget(page), release: () => page.mouse.up() };
  await lead(watcher, mouse, () => isEngaged(watcher), 'the mouse to lead the arm');
  await page.keyboard.press('Space');
  await stopped(watcher);
  await until(() => page.evaluate(() => !globalThis.steadyhand.drag.controls.enabled), 'the handles to go');
  await page.mouse.up();
  await reset(page, watcher);
  await until(() => page.evaluate(() => globalThis.steadyhand.drag.controls.enabled), 'the handles to come back');
  assert.equal(await page.evaluate(() => globalThis.steadyhand.hand.source), null, 'nobody has the hand');
  await staysPut(watcher, 300, 'nobody holds anything');
  await lead(watcher, mouse, () => isEngaged(watcher), 'the mouse to lead the arm again');
  await page.mouse.up();
  await inState(watcher, 'ready');
});

test('while the past is on the screen nothing but Stop acts on the arm, and nothing of now is beside it', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  await lead(watcher, key(page, 'KeyE'), () => isEngaged(watcher), 'something to record');
  await record(page, false);
  await page.click('#recordings button'); // the key is still held
  await page.waitForSelector('#past:not([hidden])');
  assert.equal(await page.evaluate(() => globalThis.steadyhand.hand.source), null, 'let go at once, not by falling silent');
  await inState(watcher, 'ready');
  await rest(watcher);
  await staysPut(watcher, 300, 'a key is held from before');
  await page.keyboard.up('KeyE');
  await page.keyboard.down('KeyE');
  await staysPut(watcher, 700, 'a key is pressed');
  await page.keyboard.up('KeyE');
  await say(page, { type: 'request', kind: 'playback', text: 'carrying' });
  await until(async () => (await state(watcher)).controls.playback >= 0, 'a recording to lead the arm unseen');
  await page.keyboard.down('KeyE');
  await page.waitForTimeout(300);
  assert.ok((await state(watcher)).controls.playback >= 0, 'no grip takes it over');
  await say(page, { type: 'request', kind: 'playback', text: '' });
  await inState(watcher, 'ready');
  await rest(watcher);
  for (const shown of ['#latency', '#held', '#spill', '#plots', '#compare', '#reset']) assert.equal(await page.isVisible(shown), false, `${shown} is of now`);
  for (const control of ['#scale', '#playback', '#rate', '#record']) assert.equal(await page.isDisabled(control), true, `${control} acts on now`);
  assert.equal((await page.textContent('#state')).toLowerCase(), 'recording');
  assert.match(await page.textContent('#advice'), /only Stop/);
  await page.click('#past-close');
  await staysPut(watcher, 500, 'the key is held from the past');
  await page.keyboard.up('KeyE');
  await page.click('#recordings button');
  await page.waitForSelector('#past:not([hidden])');
  await page.keyboard.press('Space'); // on its own Pause button, which has the focus
  await stopped(watcher);
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press('Enter');
  await page.waitForTimeout(300);
  assert.equal((await state(watcher)).state, 'stopping', 'nothing resets it unseen');
  await page.click('#past-close');
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press('Enter');
  await inState(watcher, 'ready');
});

test('the puddle of now is not beside the past', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open();
  await ready(page);
  const spills = (spilled) => page.evaluate((is) => {
    const { session, stage } = globalThis.steadyhand, at = performance.now() / 1000;
    stage.show({ ...session.state, tools: [{ ...session.state.tools[0], liquid: { ...session.state.tools[0].liquid, spilled: is } }] }, false, at);
    return stage.spilled;
  }, spilled);
  assert.equal(await spills(true), true);
  assert.equal(await page.evaluate(() => { const { stage, session } = globalThis.steadyhand; stage.showPast(session.state.q); return stage.spilled; }), false);
});

test('never says that nothing moves when it cannot know', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async (t) => {
  const watcher = await watch(), wire = await cable();
  t.after(wire.remove);
  const page = await open({ cable: wire });
  await ready(page);
  await page.selectOption('#playback', 'carrying');
  await until(async () => Math.max(...(await state(watcher)).dq.map(Math.abs)) > 0.2, 'the arm to move');
  await page.evaluate(() => {
    const { connection } = globalThis.steadyhand;
    globalThis.said = [];
    new MutationObserver(() => globalThis.said.push(document.querySelector('#advice').textContent)).observe(document.body, { childList: true, characterData: true, subtree: true });
    connection.start = () => {}; // stays cut
  });
  wire.cut();
  const said = await until(() => page.evaluate(() => globalThis.said.find((words) => words.startsWith('Not connected'))), 'the words');
  assert.doesNotMatch(said, /nothing moves/i);
  assert.match(said, /may move/);
  assert.equal(await page.isDisabled('#stop'), true);
});

test('a connection that swallows everything is given up within seconds, and another one is made', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async (t) => {
  const wire = await cable();
  t.after(wire.remove);
  const page = await open({ cable: wire });
  await ready(page);
  const states = () => page.evaluate(() => globalThis.steadyhand.session.statesReceived);
  await page.evaluate(() => { globalThis.statuses = []; const { session } = globalThis.steadyhand, became = session.connectionBecame.bind(session); session.connectionBecame = (s) => { globalThis.statuses.push(s); became(s); }; });
  const since = Date.now();
  wire.swallow();
  await until(() => page.evaluate(() => globalThis.statuses.includes('lost')), 'the page to notice');
  assert.ok(Date.now() - since < 15_000, 'long before TCP would'); // 3 s, and what a busy machine adds
  const lost = await states();
  await until(async () => (await states()) > lost, 'news over another connection');
  await ready(page);
});

test('a code that is mistyped and a headset that refuses are told', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open({ watch: true });
  await page.fill('#code', 'bcdf bcdf bcdf');
  await page.click('#pairing button');
  await page.waitForSelector('#refusal:not([hidden])');
  assert.match(await page.textContent('#refusal'), /code/);
  await until(async () => /^You are watching( another operator)?\. (This|A) code/.test(await page.textContent('#advice')), 'the words over the scene');
  const code = new URLSearchParams(new URL(newestAddress()).hash.slice(1)).get('code');
  await page.fill('#code', ` ${code.toUpperCase()} `);
  assert.ok(await page.isVisible('#refusal'), 'what is below stays where it is until it is pressed');
  await page.click('#pairing button');
  await until(async () => (await facts(page)).paired, 'the page to be paired');
  await page.waitForSelector('#refusal[hidden]', { state: 'attached' });
  await page.click('#emulate');
  await page.waitForSelector('#enter-vr:not([hidden])');
  await page.evaluate(() => { navigator.xr.requestSession = () => Promise.reject(new DOMException('The user denied it.', 'NotAllowedError')); });
  await page.click('#enter-vr');
  await page.waitForSelector('#refusal:not([hidden])');
  assert.match(await page.textContent('#refusal'), /denied/);
  assert.equal(await page.evaluate(() => globalThis.steadyhand.headset.session), null);
});

test('a gamepad that falls silent with its bumper held lets go, and needs a fresh grip', IN_CHROMIUM, async () => {
  const page = await open({
    prepare: (context) => context.addInitScript(() => {
      globalThis.pads = [];
      navigator.getGamepads = () => globalThis.pads;
    }),
  });
  const watcher = await watch();
  await ready(page);
  // As in Chromium: the last values of the pad stay, and only the timestamp shows that it stopped sending.
  const pad = (axes, held, talks) => page.evaluate(([sticks, pressed, isTalking]) => {
    clearInterval(globalThis.talk);
    const tell = () => { globalThis.pads = [{ mapping: 'standard', timestamp: performance.now(), axes: sticks, buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i) })) }]; };
    tell();
    if (isTalking) globalThis.talk = setInterval(tell, 10);
    dispatchEvent(new Event('gamepadconnected'));
  }, [axes, held, talks]);
  const BUMPER = 5, up = [0, 0, 0, -0.3], still = [0, 0, 0, 0];
  await lead(watcher, { grip: () => pad(up, [BUMPER], true), release: () => pad(still, [], true) }, () => isEngaged(watcher), 'the gamepad to lead');
  await pad(up, [BUMPER], false);
  await until(async () => (await state(watcher)).state === 'ready', 'the arm to be let go');
  await rest(watcher);
  await pad(up, [BUMPER], true);
  await staysPut(watcher, 500, 'the bumper was never opened');
  await lead(watcher, { grip: () => pad(up, [BUMPER], true), release: () => pad(still, [], true) }, () => isEngaged(watcher), 'a fresh grip');
  await pad(still, [], true);
  await inState(watcher, 'ready');
});

/** Another person: another browser's profile, paired with the newest code. */
const stranger = async () => {
  const page = await open();
  await until(async () => (await facts(page)).paired, 'the other to be paired');
  return page;
};

test('the arm passes to who asks: granted, refused, and when nothing has led it for ten seconds', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  const other = await stranger();
  const ask = async (of, holder) => {
    await until(async () => (await of.textContent('#lease')).startsWith('Ask for control'), 'the offer');
    await of.click('#lease');
    await holder.waitForSelector('#asked:not([hidden])');
  };
  await ask(other, page);
  assert.match(await page.textContent('#asked-words'), /Another client asks/);
  await page.click('#grant');
  await until(async () => (await facts(other)).yours, 'the arm to change hands');
  // A request for control does not interrupt an engaged hand, however long it waits: the wait starts when the hand
  // releases.
  await ask(page, other);
  await other.bringToFront();
  await other.evaluate(() => document.activeElement?.blur());
  await lead(watcher, key(other, 'KeyJ'), () => isEngaged(watcher), 'the holder to lead');
  await until(async () => (await other.textContent('#asked-until')) === '', 'no hour for it');
  await other.keyboard.up('KeyJ');
  const since = Date.now();
  await until(async () => (await facts(page)).yours, 'the arm to come back');
  assert.ok(Date.now() - since > 9000, 'not before it had rested');
  await staysPut(watcher, 300, 'the new holder has not gripped');
  await ask(other, page);
  await page.click('#keep');
  await other.waitForSelector('#refusal:not([hidden])');
  assert.equal((await facts(page)).yours, true);
});

test('the second tab of the same person takes the arm at once', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open(), watcher = await watch();
  await ready(page);
  const tab = await page.context().newPage();
  await tab.goto(page.url(), { waitUntil: 'commit' });
  await until(() => tab.evaluate(() => globalThis.steadyhand?.session.paired && globalThis.steadyhand.session.state), 'the tab');
  await tab.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
  await until(async () => (await tab.textContent('#lease')) === 'Take control', 'the offer');
  await tab.click('#lease');
  await until(async () => (await facts(tab)).yours && !(await facts(page)).yours, 'the lease in the other tab');
  await tab.evaluate(() => document.activeElement?.blur());
  await lead(watcher, key(tab, 'KeyL'), () => isEngaged(watcher), 'the tab to lead');
  await tab.keyboard.up('KeyL');
  await inState(watcher, 'ready');
});

test('any tab stops the arm, paired or not, whoever leads it', { ...IN_CHROMIUM, ...NEEDS_PROGRAM }, async () => {
  const page = await open(), watcher = await watch(), visitor = await open({ watch: true });
  await ready(page);
  await page.bringToFront();
  await page.evaluate(() => document.activeElement?.blur());
  await lead(watcher, key(page, 'KeyQ'), () => isEngaged(watcher), 'the owner to lead');
  await visitor.keyboard.press('Space');
  await stopped(watcher);
  await page.keyboard.up('KeyQ');
  await visitor.keyboard.press('Enter');
  await page.waitForTimeout(300);
  assert.equal((await state(watcher)).state, 'stopping', 'who watches resets nothing');
  await reset(page, watcher);
  assert.equal(browser.contexts().length, 3);
});
