// docs/tutorials/quest.md, step by step: each bold start of a row of its table is an action below; texts in quotation
// marks must be shown.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { distance, facts, finish, frames, inState, newestAddress, open, rest, ROOT, start, startProgram, state, terminal, until, watch, withoutPixels } from './harness.mjs';

const rows = readFileSync(join(ROOT, 'docs/tutorials/quest.md'), 'utf8').split('\n').map((line) => line.split('|').map((cell) => cell.trim()))
  .filter((cells) => /^\d+$/.test(cells[1])).map(([, number, act, seen]) => ({ number: Number(number), act, seen }));
const words = (text) => [...text.matchAll(/“([^”]*)”/g)].map(([, word]) => word);

let page, watcher, risen;
const device = (act, ...values) => page.evaluate(([code, with_]) => new Function('device', 'values', code)(globalThis.emulatedHeadset, with_), [act, values]);
const press = (button, value = 1, side = 'right') => device('device.controllers[values[0]].updateButtonValue(values[1], values[2])', side, button, value);
const tap = async (button) => {
  await press(button);
  await frames(page);
  await press(button, 0);
  await frames(page);
};
/** Squeezes until the arm follows; again if the hand timed out on a slow machine. */
const squeeze = () => until(async () => {
  await press('squeeze', 0);
  await frames(page);
  await inState(watcher, 'ready');
  await press('squeeze');
  for (let i = 0; i < 40; ++i) {
    if ((await state(watcher)).state === 'engaged') return true;
    await page.waitForTimeout(25);
  }
  return false;
}, 'the arm to follow');
/** Engages again if the hand timed out on a slow machine and this step needs an engaged hand. */
const gripAgain = async (bold) => {
  if (['Squeeze the grip', 'raise the hand'].includes(bold.at(-1)) && (await state(watcher)).state !== 'engaged') await squeeze();
};
const leftAlone = async () => {
  await until(async () => (await state(watcher)).state !== 'engaged', 'the arm to be let go');
  await rest(watcher);
};

const ACTS = {
  'Start the program': async () => {
    await start();
    await startProgram();
    watcher = await watch();
  },
  'Open the page': async () => { page = await open({ watch: true, context: { viewport: { width: 420, height: 300 } }, prepare: withoutPixels }); },
  'Enter the code': async () => {
    await page.fill('#code', new URLSearchParams(new URL(newestAddress()).hash.slice(1)).get('code'));
    await page.click('#pairing button');
    await until(async () => (await facts(page)).paired, 'the page to be paired');
  },
  'Press Enter VR': async () => {
    await page.click('#emulate'); // in place of a headset
    await page.waitForSelector('#enter-vr:not([hidden])');
    await page.evaluate(() => document.querySelector('#enter-vr').click());
    await until(() => page.evaluate(() => globalThis.steadyhand.headset.session !== null), 'VR');
  },
  'Look forward and press A': () => tap('a-button'),
  'Squeeze the grip': async () => {
    await squeeze();
    risen = (await state(watcher)).tools[0].pose.p[2];
  },
  'raise the hand': () => until(async () => {
    if ((await state(watcher)).state !== 'engaged') await squeeze();
    for (let i = 0; i < 20; ++i) {
      await device('device.controllers.right.position.y += 0.005');
      await page.waitForTimeout(30);
    }
    await page.waitForTimeout(300);
    return (await state(watcher)).tools[0].pose.p[2] > risen + 0.03;
  }, 'the glass to rise'),
  Release: async () => {
    await press('squeeze', 0);
    await leftAlone();
  },
  'press B': async () => {
    await squeeze();
    await tap('b-button');
    await inState(watcher, 'stopping');
    await rest(watcher);
  },
  'press the thumbstick': async () => {
    await press('squeeze', 0);
    await tap('thumbstick');
    await inState(watcher, 'ready');
  },
  'open the system menu': async () => {
    await squeeze();
    await device("device.updateVisibilityState('visible-blurred')");
    await leftAlone();
  },
  'B cannot stop the arm then': async () => {
    await press('b-button');
    await frames(page);
    await page.waitForTimeout(300);
    assert.equal((await state(watcher)).state, 'ready', 'the page hears no button beneath a menu');
    await press('b-button', 0);
  },
  'Close the menu': async () => {
    const { tools: [{ pose: tool }] } = await state(watcher);
    await device("device.updateVisibilityState('visible')");
    await page.waitForTimeout(500);
    assert.equal((await state(watcher)).state, 'ready');
    assert.ok(distance((await state(watcher)).tools[0].pose.p, tool.p) < 0.002, 'nothing moves');
  },
  Recentre: async () => {
    await device('device.recenter()');
    await press('squeeze', 0);
    await frames(page);
    await press('squeeze');
    await frames(page);
    await page.waitForTimeout(400);
    assert.equal((await state(watcher)).state, 'ready', 'nothing is led before A');
    await press('squeeze', 0);
  },
  'Leave VR': async () => {
    await page.evaluate(() => document.querySelector('#enter-vr').click());
    await until(() => page.evaluate(() => globalThis.steadyhand.headset.session === null), 'the page');
  },
};
/** All text that is visible now: of the terminal, the page, and in VR the board. */
const sight = async () => [terminal(), await page?.evaluate(() => `${document.body.innerText}\n${globalThis.steadyhand.headset.session ? globalThis.steadyhand.headset.board.text : ''}`)].join('\n').toLowerCase();

after(finish);
before(() => assert.ok(rows.length > 12, 'the table was found'));

test('every step of the first five minutes does what its page says', async () => {
  const done = new Set();
  for (const { number, act, seen } of rows) {
    const bold = [...`${act} ${seen}`.matchAll(/\*\*([^*]*)\*\*/g)].map(([, text]) => text).filter((text) => !(act.startsWith('†') && !(text in ACTS)));
    assert.ok(bold.length > 0 || act.startsWith('†'), `step ${number} is done by this test, or is marked †`);
    for (const text of bold) {
      assert.ok(text in ACTS, `step ${number}: this test knows how to do “${text}”`);
      await ACTS[text]();
      done.add(text);
    }
    if (act.startsWith('†')) continue;
    for (const word of words(seen)) await until(async () => (await sight()).includes(word.toLowerCase()) || (await gripAgain(bold), false), `“${word}” at step ${number}`);
  }
  assert.deepEqual(Object.keys(ACTS).filter((name) => !done.has(name)), [], 'every act has its step');
  assert.deepEqual(page.complaints, []);
});
