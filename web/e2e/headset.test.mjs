// The emulated headset (iwer) against the real program: asserts the motion of the arm, as the server sends it to
// another client. One program, one page and, unless a test says otherwise, one VR session for all.
import assert from 'node:assert/strict';
import { after, before, beforeEach, test } from 'node:test';
import {
  closePages, distance, facts, finish, frames as framesOf, inState, lead, NEEDS_PROGRAM, open, ready, rest, say, start, startProgram, state, until, watch,
  withoutPixels,
} from './harness.mjs';

let page, watcher;
const HOME = { right: [-0.18, 1.25, -0.6], left: [-0.62, 1.2, -0.5] };

before(async () => {
  await start();
  await startProgram();
  watcher = await watch();
  page = await open({
    context: { viewport: { width: 420, height: 300 } },
    prepare: async (context) => {
      await withoutPixels(context);
      await context.addInitScript(() => { // the page's own connection, to cut it
        globalThis.WebSocket = class extends WebSocket { constructor(...words) { super(...words); globalThis.socket = this; } };
      });
    },
  });
  await ready(page);
  await page.click('#emulate');
  await page.waitForSelector('#enter-vr:not([hidden])');
});
after(async () => {
  await closePages();
  await finish();
});

const press = (side, button, value = 1) => page.evaluate(([s, b, v]) => globalThis.emulatedHeadset.controllers[s].updateButtonValue(b, v), [side, button, value]);
const place = (side, [x, y, z]) => page.evaluate(([s, ...p]) => globalThis.emulatedHeadset.controllers[s].position.set(...p), [side, x, y, z]);
/** Raises the hand from where it was, as fast as a hand can. */
async function raise(side, by) {
  const [x, y, z] = HOME[side];
  for (let i = 1; i <= 25; ++i) {
    await place(side, [x, y + (by * i) / 25, z]);
    await page.waitForTimeout(30);
  }
}
const connect = (side, connected) => page.evaluate(([s, is]) => { globalThis.emulatedHeadset.controllers[s].connected = is; }, [side, connected]);
const show = (visibility) => page.evaluate((to) => globalThis.emulatedHeadset.updateVisibilityState(to), visibility);
const headset = (member) => page.evaluate((name) => globalThis.steadyhand.headset[name], member);
const board = () => page.evaluate(() => globalThis.steadyhand.headset.board.text);
const boardSays = (words) => until(async () => (await board()).includes(words), `“${words}” on the board`);
const handOf = () => page.evaluate(() => globalThis.steadyhand.hand.source);
const frames = () => framesOf(page);

async function tap(side, button) {
  await press(side, button);
  await frames();
  await press(side, button, 0);
  await frames();
}
async function enter(button = '#enter-vr') {
  await page.evaluate((selector) => document.querySelector(selector).click(), button);
  await until(() => page.evaluate(() => globalThis.steadyhand.headset.session !== null), 'the session');
}
async function leave() {
  await page.evaluate(() => globalThis.steadyhand.headset.session?.end());
  await until(() => page.evaluate(() => globalThis.steadyhand.headset.session === null), 'its end');
}
const asksForForward = async () => { await page.waitForTimeout(250); return (await board()).includes('press A'); };
async function setForward() {
  await boardSays('press A');
  // A press before the first frame of a session has no effect.
  await until(async () => !(await board()).includes('press A') || (await tap('right', 'a-button'), false), 'forward to be set');
}
const stopped = () => inState(watcher, 'stopping');
async function reset() {
  await stopped();
  await rest(watcher);
  await tap('right', 'thumbstick');
  await inState(watcher, 'ready');
}
/** Squeezes until the arm follows; again if the hand timed out on a slow machine. */
const squeeze = (side) => until(async () => {
  await press(side, 'squeeze', 0);
  await frames();
  await inState(watcher, 'ready');
  await press(side, 'squeeze');
  for (let i = 0; i < 40; ++i) {
    if ((await state(watcher)).state === 'engaged') return true;
    await page.waitForTimeout(25);
  }
  return false;
}, `the ${side} controller to lead the arm`);
/** The arm is not engaged, and stays where it is for so many ms. */
async function staysPut(ms, why) {
  const { tools: [{ pose: tool }] } = await state(watcher);
  await page.waitForTimeout(ms);
  const now = await state(watcher);
  assert.ok(now.state !== 'engaged' && distance(now.tools[0].pose.p, tool.p) < 0.002, `${why}: ${now.state}, moved by ${distance(now.tools[0].pose.p, tool.p)} m`);
}

beforeEach(async () => {
  for (const side of ['left', 'right']) {
    await connect(side, true);
    await place(side, HOME[side]);
    for (const button of ['squeeze', 'thumbstick', 'trigger', side === 'right' ? 'a-button' : 'x-button', side === 'right' ? 'b-button' : 'y-button']) await press(side, button, 0);
  }
  await show('visible');
  if (!(await page.evaluate(() => globalThis.steadyhand.headset.session !== null))) {
    await enter();
  }
  await frames();
  if (await asksForForward()) await setForward();
  if ((await state(watcher)).state === 'stopping') await reset();
  await ready(page);
});

test('leads, feels limits, loses the hand, scales, looks forward, also in the real room', async () => {
  await page.evaluate(() => {
    globalThis.pulses = 0;
    globalThis.felt = false;
    setInterval(() => {
      const { session, headset } = globalThis.steadyhand;
      globalThis.felt ||= session.state.constraint.kind !== 'none';
      for (const { gamepad } of headset.session?.inputSources ?? []) {
        if (gamepad && !gamepad.hapticActuators?.[0]?.counted) {
          Object.defineProperty(gamepad, 'hapticActuators', { configurable: true, value: [{ counted: true, pulse: () => { ++globalThis.pulses; } }] });
        }
      }
    }, 10);
  });
  await say(page, { type: 'request', kind: 'scale', value: 2 }); // a slow machine sees little of the motion: twice the scale makes it enough
  await until(async () => (await state(page)).controls.scale === 2, 'the scale');
  const begin = await state(watcher);
  await press('right', 'trigger'); // before a grip it means nothing
  const lead = (by, done) => until(async () => {
    await place('right', HOME.right);
    await squeeze('right');
    await page.waitForTimeout(300);
    await raise('right', by);
    return done();
  }, 'the hand to lead the glass');
  await until(async () => {
    await connect('right', true);
    await lead(0.2, async () => (await state(watcher)).tools[0].pose.p[2] > begin.tools[0].pose.p[2] + 0.04);
    await connect('right', false);
    await until(async () => (await state(watcher)).state !== 'engaged', 'the arm to disengage');
    const held = await state(watcher);
    if (held.state !== 'holding') return false; // the hand has just timed out
    assert.notEqual(held.reason, '');
    return true;
  }, 'the arm to hold for a lost hand');
  await rest(watcher);
  await connect('right', true);
  await lead(1.0, () => page.evaluate(() => globalThis.felt && globalThis.pulses > 0));
  await press('right', 'squeeze', 0);
  await ready(page);
  const { scale, yaw } = (await state(page)).controls;
  const stick = (y) => page.evaluate((to) => globalThis.emulatedHeadset.controllers.left.updateAxis('thumbstick', 'y-axis', to), y);
  await stick(1);
  await until(async () => (await state(page)).controls.scale < scale, 'the stick to scale');
  await stick(0);
  await page.evaluate(() => globalThis.emulatedHeadset.quaternion.set(0, -0.2, 0, 0.98));
  await tap('left', 'x-button');
  await until(async () => (await state(page)).controls.yaw !== yaw, 'forward to be set');
  await leave();
  await enter('#enter-ar');
  assert.equal(await page.evaluate(() => globalThis.steadyhand.stage.scene.background), null, 'the real room is the backdrop');
  await until(async () => await page.textContent('#enter-ar') === 'Leave AR' && await page.isHidden('#enter-vr'), 'the way out to be named');
  await leave();
  assert.deepEqual(page.complaints, []);
});

test('the trigger pours in a grip, and what ends the grip ends that', async () => {
  const tilted = (to, what) => until(async () => Math.abs((await state(page)).controls.tilt - to) < 1e-3, what);
  await say(page, { type: 'request', kind: 'tilt', value: 0.25 });
  await tilted(0.25, 'the tilt');
  await press('right', 'trigger'); // before the grip it means nothing
  await squeeze('right');
  await frames();
  await tilted(0.25, 'the tilt to stay');
  await press('right', 'trigger', 0);
  await frames();
  await press('right', 'trigger');
  await tilted(Math.PI, 'the trigger to pour');
  await press('right', 'trigger', 0);
  await tilted(0.25, 'the tilt that was before');
  await frames();
  await press('right', 'trigger');
  await tilted(Math.PI, 'the trigger to pour again');
  await press('right', 'squeeze', 0);
  await tilted(0.25, 'the end of the grip to end it');
  await ready(page);
});

test('asks for a floor and for layers, for no hands; 72 pictures a second; no shadows', async () => {
  await leave();
  await page.evaluate(() => {
    const { xr } = navigator, request = xr.requestSession.bind(xr);
    xr.requestSession = (mode, options) => { globalThis.asked = options; return request(mode, options); };
  });
  await enter();
  const { optionalFeatures, requiredFeatures } = await page.evaluate(() => globalThis.asked);
  assert.deepEqual([...optionalFeatures].sort(), ['layers', 'local-floor']);
  assert.equal(requiredFeatures, undefined);
  await until(() => page.evaluate(() => globalThis.steadyhand.headset.session.frameRate === 72), '72 Hz; the device begins with 90');
  const shadows = () => page.evaluate(() => { let any = false; globalThis.steadyhand.stage.scene.traverse((o) => { any ||= o.isLight === true && o.castShadow; }); return any; });
  const work = async () => {
    const before = await page.evaluate(() => { const { stage } = globalThis.steadyhand; globalThis.emulatedHeadset.stereoEnabled = true; stage.setQuality(0); return stage.renderer.info.render.frame; });
    await until(() => page.evaluate((n) => globalThis.steadyhand.stage.renderer.info.render.frame > n + 3, before), 'pictures');
    const { calls, triangles } = await page.evaluate(() => globalThis.steadyhand.stage.renderer.info.render);
    await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
    return { calls, triangles };
  };
  assert.equal(await shadows(), false);
  const { calls, triangles } = await work();
  assert.equal(await shadows(), false, 'a better picture on the page brings none either');
  console.log(`a stereo picture: ${calls} calls, ${triangles} triangles`);
  assert.ok(calls < 200 && calls > 20, `${calls} calls for both eyes`); // fewer if the tests before left the arm outside the view
  assert.ok(triangles < 400_000, `${triangles} triangles`);
  await leave();
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(0));
  assert.equal(await shadows(), true, 'on the page they are back');
  await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
});

test('B and Y stop, whichever controller leads, and each press of each', async () => {
  await squeeze('left');
  await press('right', 'b-button');
  await stopped();
  await press('left', 'squeeze', 0);
  await reset(); // B is still held
  await press('left', 'y-button');
  await stopped();
  await press('left', 'y-button', 0);
  await press('right', 'b-button', 0);
  await reset();
  await squeeze('right');
  await press('left', 'y-button');
  await stopped();
  await press('left', 'y-button', 0);
  await reset();
});

test('B stops also when the controller that leads has dropped out', async () => {
  await squeeze('right');
  await connect('right', false);
  await until(async () => (await state(watcher)).state !== 'engaged', 'the arm to be left alone');
  await press('left', 'y-button');
  await stopped();
});

test('a controller that is lost in the grip holds the arm, and leads on where it comes back', async () => {
  await squeeze('right');
  await connect('right', false);
  await until(async () => ['holding', 'ready'].includes((await state(watcher)).state), 'the arm to hold');
  await connect('right', true);
  await until(async () => ['engaged', 'ready'].includes((await state(watcher)).state), 'the arm to follow, or to have been let go by a slow machine');
});

test('a second squeeze steals nothing, and gets nothing when the first lets go', async () => {
  let way = 0.1; // up and down in turn: if a slow machine needs many attempts, the arm stays within its reach
  await until(async () => {
    way = -way;
    await press('left', 'squeeze', 0);
    for (const side of ['left', 'right']) await place(side, HOME[side]);
    await squeeze('right');
    await rest(watcher);
    const begin = await state(watcher);
    await press('left', 'squeeze');
    await frames();
    await raise('left', 0.3);
    const after = await state(watcher);
    await raise('right', way);
    const end = await state(watcher);
    if (![begin, after, end].every((seen) => seen.state === 'engaged')) return false; // the hand timed out meanwhile
    assert.ok(distance(after.tools[0].target.p, begin.tools[0].target.p) < 0.01, 'the left hand leads nothing');
    return Math.sign(way) * (end.tools[0].target.p[2] - begin.tools[0].target.p[2]) > 0.02;
  }, 'the right hand to lead the arm, and the left one not');
  await press('right', 'squeeze', 0);
  await inState(watcher, 'ready');
  await rest(watcher);
  await place('left', HOME.left);
  await staysPut(500, 'the left grip began in the right one’s');
  await squeeze('left');
});

/** Before an item of the board, or its upper edge, and pointing at it. */
const aim = (side, label, aside = 0) => page.evaluate(([s, wanted, by]) => {
  const { board } = globalThis.steadyhand.headset, device = globalThis.emulatedHeadset.controllers[s], { width, height } = board.geometry.parameters;
  const on = [];
  for (let u = 0; u < 1; u += 0.01) for (let v = 0; v < 1; v += 0.01) if (wanted && board.items[board.itemAt(u, v)]?.label === wanted) on.push([u, v]);
  const at = on.length ? on[on.length >> 1] : [0.5, 0.97];
  const p = board.localToWorld(board.position.clone().set((at[0] - 0.5) * width + by, (at[1] - 0.5) * height, 0.5)), q = board.quaternion;
  device.position.set(p.x, p.y, p.z);
  device.quaternion.set(q.x, q.y, q.z, q.w);
}, [side, label, aside]);
const items = () => page.evaluate(() => globalThis.steadyhand.headset.board.items.map(({ label }) => label));
const chosen = () => page.evaluate(() => { const { board } = globalThis.steadyhand.headset; return board.items[board.chosen]?.label ?? ''; });
const profile = () => page.evaluate(() => { const { welcome, state } = globalThis.steadyhand.session; return welcome.profiles[state.controls.profile].name; });

test('the board has a menu: a ray or the stick chooses, the trigger or the stick presses, and the board can be moved', async (t) => {
  const lower = () => page.evaluate(() => Object.values(globalThis.emulatedHeadset.controllers).forEach((each) => each.quaternion.set(-0.4, 0, 0, 0.92))); // no ray on the board
  t.after(() => page.evaluate(() => Object.values(globalThis.emulatedHeadset.controllers).forEach((each) => each.quaternion.set(0, 0, 0, 1))));
  await until(async () => (await items()).includes('Waiter'), 'the menu');
  await until(async () => {
    await aim('right', 'Waiter');
    await frames();
    return (await chosen()) === 'Waiter';
  }, 'the ray to choose');
  await tap('right', 'trigger');
  await until(async () => (await profile()) === 'waiter', 'the profile');
  const stick = (x) => page.evaluate((to) => globalThis.emulatedHeadset.controllers.left.updateAxis('thumbstick', 'x-axis', to), x);
  await place('right', HOME.right);
  await lower();
  await until(async () => {
    if ((await chosen()) === 'Carry') return true;
    await stick(1);
    await page.waitForTimeout(120);
    await stick(0);
    await page.waitForTimeout(250);
    return false;
  }, 'the stick to choose');
  await tap('left', 'thumbstick');
  await until(async () => (await profile()) === 'carry', 'the profile by the stick');
  const where = () => page.evaluate(() => globalThis.steadyhand.headset.board.position.toArray());
  const before = await where();
  await aim('right', '');
  await frames();
  await press('right', 'trigger');
  await frames();
  await aim('right', '', 0.15);
  await until(async () => distance(await where(), before) > 0.05, 'the board to go with the hand');
  await press('right', 'trigger', 0);
  await frames();
  const left = await where();
  await place('right', HOME.right);
  await frames();
  assert.ok(distance(await where(), left) < 1e-6, 'it stays where it was left');
  await squeeze('right');
  assert.deepEqual((await page.evaluate(() => globalThis.steadyhand.headset.guide.unused)).filter((part) => part !== 'stop'), [], 'what was used once is told no more');
  assert.deepEqual(page.complaints, []);
});

test('recentring lets go, and asks for forward anew', async () => {
  // An arm at the end of its reach moves a little when it is engaged again. Once it has stopped, only the new origin
  // could move it.
  const begin = await until(async () => {
    await rest(watcher);
    await squeeze('right');
    await rest(watcher);
    const now = await state(watcher);
    return now.state === 'engaged' && now; // or the hand timed out
  }, 'an arm that is led and rests');
  await page.evaluate(() => globalThis.emulatedHeadset.recenter());
  await inState(watcher, 'ready');
  await rest(watcher);
  assert.ok(distance((await state(watcher)).tools[0].pose.p, begin.tools[0].pose.p) < 0.02, 'the new origin moved no arm');
  await staysPut(400, 'the grip is held from before');
  await press('right', 'squeeze', 0);
  await boardSays('press A');
  await press('right', 'squeeze');
  await staysPut(500, 'forward is not known');
  await press('right', 'squeeze', 0);
  const { yaw } = (await state(watcher)).controls;
  await page.evaluate(() => globalThis.emulatedHeadset.quaternion.set(0, 0.3, 0, 0.95));
  await setForward();
  await until(async () => (await state(watcher)).controls.yaw !== yaw, 'forward to be where the operator looks');
  await squeeze('right');
});

for (const visibility of ['visible-blurred', 'hidden']) {
  test(`a session that is ${visibility} lets go`, async () => {
    await squeeze('right');
    await show(visibility);
    await until(async () => (await handOf()) === null, 'the hand to be let go');
    // Hidden, no frames come; iwer makes them all the same.
    if (visibility === 'hidden') {
      await page.evaluate(() => {
        const { session } = globalThis.steadyhand.headset, next = session.requestAnimationFrame.bind(session);
        globalThis.kept = [];
        session.requestAnimationFrame = (act) => globalThis.kept.push(act);
        globalThis.goOn = () => { delete session.requestAnimationFrame; globalThis.kept.forEach((act) => next(act)); };
      });
    }
    await inState(watcher, 'ready');
    await rest(watcher);
    await staysPut(400, 'the menu is open');
    await show('visible');
    if (visibility === 'hidden') await page.evaluate(() => globalThis.goOn());
    await frames();
    await staysPut(500, 'the grip is held from before');
    await squeeze('right');
  });
}

test('says by how much the headset predicted its poses', async () => {
  await page.evaluate(() => {
    Object.defineProperty(XRFrame.prototype, 'predictedDisplayTime', { configurable: true, get: () => performance.now() + 30 });
    globalThis.said = [];
    const { connection } = globalThis.steadyhand, send = connection.send.bind(connection);
    connection.send = (message) => { if (message.clutch) globalThis.said.push(message.lead_s); return send(message); };
  });
  await squeeze('right');
  await until(() => page.evaluate(() => globalThis.said.some((lead) => lead > 0.02 && lead < 0.031)), 'the lead');
  assert.ok(await page.evaluate(() => globalThis.steadyhand.headset.leads.length > 0), 'they are kept to look at');
  const refused = await page.evaluate(() => globalThis.steadyhand.session.lastError?.code);
  assert.ok(refused === undefined || refused === 'late', `the server understands it: ${refused}`); // late: so is a busy machine's page
  await page.evaluate(() => { delete globalThis.steadyhand.connection.send; });
});

test('a headset that makes no more frames and says nothing is silent', async () => {
  await squeeze('right');
  await page.evaluate(() => {
    const { headset } = globalThis.steadyhand;
    headset.simulated = false; // a real one's hand is not repeated between frames
    const next = headset.session.requestAnimationFrame.bind(headset.session);
    globalThis.kept = [];
    headset.session.requestAnimationFrame = (act) => globalThis.kept.push(act);
    globalThis.goOn = () => { headset.simulated = true; delete headset.session.requestAnimationFrame; globalThis.kept.forEach((act) => next(act)); };
  });
  await inState(watcher, 'ready');
  await rest(watcher);
  await page.evaluate(() => globalThis.goOn());
});

test('a pose that the headset guesses holds the arm', async () => {
  const guess = (is) => page.evaluate((guessed) => {
    const { gripSpace } = globalThis.emulatedHeadset.controllers.right.inputSource;
    const key = Object.getOwnPropertySymbols(gripSpace).find(({ description }) => description === '@iwer/xr-space');
    gripSpace[key].emulated = guessed;
  }, is);
  await until(async () => {
    await guess(false);
    await squeeze('right');
    await guess(true);
    for (let i = 0; i < 40; ++i) {
      const now = await state(watcher);
      if (now.state === 'ready') return false; // the hand has just timed out
      if (now.state === 'holding' && /guesses/.test(now.reason)) return true;
      await page.waitForTimeout(25);
    }
    return false;
  }, 'the arm to hold, and to say why');
  await rest(watcher);
  await guess(false);
  await until(async () => ['engaged', 'ready'].includes((await state(watcher)).state), 'the arm to follow again');
});

test('hands that the headset sees lead nothing', async () => {
  await leave();
  await page.evaluate(() => { // a browser that sends hands without a request
    const { xr } = navigator, request = Object.getPrototypeOf(xr).requestSession.bind(xr);
    xr.requestSession = (mode, options) => request(mode, { ...options, optionalFeatures: [...options.optionalFeatures, 'hand-tracking'] });
  });
  await enter();
  await setForward();
  await squeeze('right');
  await page.evaluate(() => { globalThis.emulatedHeadset.primaryInputMode = 'hand'; });
  await until(async () => (await state(watcher)).state !== 'engaged', 'the arm to be left alone');
  assert.equal(await page.evaluate(() => [...globalThis.steadyhand.headset.session.inputSources].filter(({ hand }) => hand).length), 2, 'there are hands');
  await page.evaluate(() => {
    globalThis.steadyhand.hand.letGo();
    globalThis.emulatedHeadset.hands.right.updatePinchValue(1);
    globalThis.emulatedHeadset.hands.right.position.y += 0.2;
  });
  await inState(watcher, 'ready');
  await rest(watcher);
  await staysPut(500, 'a pinch is no grip');
  await page.evaluate(() => { globalThis.emulatedHeadset.primaryInputMode = 'controller'; delete navigator.xr.requestSession; });
  await leave();
});

test('the lease comes with A; a grip before it leads nothing', NEEDS_PROGRAM, async () => {
  await leave();
  await say(page, { type: 'release' });
  await until(async () => !(await facts(page)).yours, 'the lease to be free');
  await enter();
  await press('right', 'squeeze');
  await staysPut(500, 'forward is not known, and nobody has the lease');
  await press('right', 'squeeze', 0);
  assert.doesNotMatch(await board(), /Drive|drag|key/i);
  await setForward();
  await until(async () => (await facts(page)).yours, 'the lease');
  await squeeze('right');
});

test('leaving brings the page back: the picture beneath its buttons, and the view of before', async () => {
  await leave();
  const looks = () => page.evaluate(() => {
    const canvas = document.querySelector('#scene');
    return [canvas.nextElementSibling?.id, canvas.parentElement.tagName, ...globalThis.steadyhand.stage.view.camera.position.toArray().map((x) => x.toFixed(3))].join(' ');
  });
  await until(async () => !(await looks()).startsWith(' '), 'the picture to be back');
  let before = await looks();
  await until(async () => { // a view that stepped back comes nearer
    await page.waitForTimeout(300);
    return before === (before = await looks());
  }, 'a view that rests');
  await enter();
  await until(async () => (await looks()) !== before, 'the headset to look from elsewhere');
  await leave();
  await until(async () => (await looks()) === before, `all to be as before: ${before}`);
  await enter();
  await setForward();
});

test('the emulated head turns by arrow keys, which leave the hand alone; the glass is in its picture, and the state beside it in a line', async () => {
  await page.evaluate(() => document.activeElement?.blur()); // arrows are a slider's that has the focus
  await page.keyboard.press('Home');
  const seen = () => page.evaluate(() => {
    const { stage } = globalThis.steadyhand, head = globalThis.emulatedHeadset, camera = stage.view.camera.clone(), { clientWidth, clientHeight } = head.canvasContainer;
    camera.clearViewOffset();
    camera.fov = (180 / Math.PI) * head.fovy;
    camera.aspect = clientWidth / clientHeight;
    camera.position.set(head.position.x, head.position.y, head.position.z);
    camera.quaternion.set(head.quaternion.x, head.quaternion.y, head.quaternion.z, head.quaternion.w);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    const { x, y, z } = stage.glass.getWorldPosition(stage.glass.position.clone()).project(camera);
    return { x, y, z };
  });
  await until(async () => { const { x, y, z } = await seen(); return Math.abs(x) < 0.8 && Math.abs(y) < 0.8 && z < 1; }, 'the glass in the picture');
  await rest(page);
  const begin = await seen(), source = await page.evaluate(() => globalThis.steadyhand.hand.source);
  for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowLeft');
  await until(async () => (await seen()).x > begin.x + 0.2, 'the head to turn to the left');
  await page.keyboard.press('ArrowUp');
  await until(async () => (await seen()).y < begin.y - 0.1, 'the head to look up');
  assert.equal(await page.evaluate(() => globalThis.steadyhand.hand.source), source);
  await page.keyboard.press('Home');
  await until(async () => Math.abs((await seen()).x - begin.x) < 0.05, 'the head to turn back');
  assert.deepEqual(await page.$$eval('#wave, #held, #status dl', (parts) => parts.filter((part) => part.checkVisibility()).length), 0);
});

test('the emulated hand is under the mouse, and its trigger presses what the mouse is on, however short the press', async () => {
  const small = page.viewportSize();
  await page.setViewportSize({ width: 1280, height: 800 });
  await page.evaluate(() => { scrollTo(0, 0); document.activeElement?.blur(); });
  await page.keyboard.press('Home');
  const wanted = 'Waiter';
  /** Where on the page an item of the board is seen. */
  const place = () => page.evaluate((label) => {
    const { stage, headset: { board } } = globalThis.steadyhand, head = globalThis.emulatedHeadset, index = board.items.findIndex((item) => item.label === label);
    const inside = [];
    for (let u = 0.005; u < 1; u += 0.01) for (let v = 0.005; v < 1; v += 0.005) if (board.itemAt(u, v) === index) inside.push([u, v]);
    if (inside.length === 0) return null;
    const [u, v] = [0, 1].map((k) => inside.reduce((sum, each) => sum + each[k], 0) / inside.length), { width, height } = board.geometry.parameters;
    const at = board.localToWorld(board.position.clone().set((u - 0.5) * width, (v - 0.5) * height, 0));
    const camera = stage.view.camera.clone(), box = document.querySelector('#scene').getBoundingClientRect();
    camera.clearViewOffset();
    camera.fov = (180 / Math.PI) * head.fovy;
    camera.aspect = box.width / box.height;
    camera.position.set(head.position.x, head.position.y, head.position.z);
    camera.quaternion.set(head.quaternion.x, head.quaternion.y, head.quaternion.z, head.quaternion.w);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    const { x, y } = at.project(camera);
    return [box.left + (box.width * (x + 1)) / 2, box.top + (box.height * (1 - y)) / 2];
  }, wanted);
  const led = async () => { const { welcome, state: now } = await page.evaluate(() => globalThis.steadyhand.session); return welcome.profiles.find(({ index }) => index === now.controls.profile).label; };
  for (const button of ['right', 'left']) {
    assert.doesNotMatch(await led(), /Waiter/);
    await until(async () => {
      const at = await place();
      if (!at) return false;
      await page.mouse.move(...at);
      await frames();
      await page.mouse.click(...at, { button });
      await page.waitForTimeout(300);
      return /Waiter/.test(await led());
    }, `the profile that the mouse pressed with its ${button} button`);
    await page.mouse.move(10, 700); // off the board
    await say(page, { type: 'request', kind: 'profile', text: 'carry' });
    await until(async () => /Carry/.test(await led()), 'the profile of before');
  }
  await page.setViewportSize(small);
});

test('the emulated hand that leads pours with the other button of the mouse, and holds when both are open', async () => {
  const { x, y, width, height } = await (await page.$('#scene')).boundingBox(), tilt = () => page.evaluate(() => globalThis.steadyhand.session.state.controls.tilt);
  const before = await tilt(), source = () => page.evaluate(() => globalThis.steadyhand.hand.source);
  assert.ok(before < 1, `the glass stays upright at first: ${before}`);
  await page.mouse.move(x + 0.6 * width, y + 0.5 * height);
  await frames();
  await lead(page, { grip: () => page.mouse.down(), release: () => page.mouse.up() }, async () => (await source()) === 'headset', 'the hand to lead');
  await page.mouse.down({ button: 'right' });
  await until(async () => (await tilt()) > 3, 'the glass to lean as the hand does');
  await page.mouse.up({ button: 'right' });
  await until(async () => (await tilt()) === before, 'the glass to stay upright again');
  assert.equal(await source(), 'headset');
  await page.mouse.up();
  await until(async () => (await source()) === null, 'the hand to let go');
});

test('a session that cannot be drawn to is left again, and that is said', async () => {
  await leave();
  await page.evaluate(() => {
    globalThis.Layer = globalThis.XRWebGLLayer;
    globalThis.XRWebGLLayer = class { constructor() { throw new Error('no buffer for this layer'); } };
  });
  await page.evaluate(() => document.querySelector('#enter-vr').click());
  await page.waitForSelector('#refusal:not([hidden])');
  assert.match(await page.textContent('#refusal'), /no buffer/);
  await page.evaluate(() => { globalThis.XRWebGLLayer = globalThis.Layer; });
  await enter(); // the one before has ended, or there could be no other
  await page.waitForSelector('#refusal[hidden]', { state: 'attached' });
  await setForward();
});

test('the board never says that nothing moves when it cannot know', NEEDS_PROGRAM, async () => {
  await page.evaluate(() => { globalThis.steadyhand.connection.start = () => { globalThis.isDue = true; }; }); // stays cut
  await page.evaluate(() => globalThis.socket.close());
  await boardSays('Not connected');
  assert.doesNotMatch(await board(), /nothing moves/i);
  assert.match(await board(), /may move/);
  await until(() => page.evaluate(() => globalThis.isDue), 'its own time to come back, or there would be two connections');
  await page.evaluate(() => { const { connection } = globalThis.steadyhand; delete connection.start; connection.start(); });
  await ready(page);
});

test('where the processor draws, nothing is drawn on the canvas itself, for which the browser and the hand would wait', async () => {
  const drawn = await open({ drawn: true, context: { viewport: { width: 420, height: 300 } }, prepare: withoutPixels });
  await drawn.evaluate(() => document.querySelector('#emulate').click());
  await drawn.waitForSelector('#enter-vr:not([hidden])', { state: 'attached' });
  await drawn.evaluate(() => document.querySelector('#enter-vr').click());
  await until(() => drawn.evaluate(() => globalThis.steadyhand.headset.session !== null), 'the session');
  await drawn.waitForTimeout(1000); // what was under way when it began
  await drawn.evaluate(() => {
    const { renderer } = globalThis.steadyhand.stage, gl = renderer.getContext(), put = CanvasRenderingContext2D.prototype.putImageData;
    globalThis.drawing = { onCanvas: 0, wiped: 0, shown: 0 };
    const watch = (name, what) => {
      const act = gl[name].bind(gl);
      gl[name] = (...words) => {
        globalThis.drawing[what] += gl.getParameter(gl.DRAW_FRAMEBUFFER_BINDING) === null;
        return act(...words);
      };
    };
    for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced', 'blitFramebuffer']) watch(name, 'onCanvas');
    watch('clear', 'wiped');
    CanvasRenderingContext2D.prototype.putImageData = function (...words) {
      globalThis.drawing.shown += this.canvas.className === 'picture' && this.canvas.nextSibling === renderer.domElement;
      return put.apply(this, words);
    };
  });
  const { onCanvas, wiped } = await until(() => drawn.evaluate(() => globalThis.drawing.shown > 20 && globalThis.drawing), 'pictures');
  assert.deepEqual({ onCanvas, wiped }, { onCanvas: 0, wiped: 0 });
  await drawn.context().close();
});
