// The pictures of README and docs, made anew: `node docs/pictures/make.mjs`, or only some: `... page_light arm`. Needs Chromium and a
// program that is built. What the program says while a recorded hand leads its arm is kept, and shown to the page picture by
// picture on a clock of the page's own: so nothing depends on how fast this machine draws.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { address, browser, finish, open, PATIENCE, PROGRAM, ROOT, start, startProgram, until } from '../../web/e2e/harness.mjs';

const FOLDER = process.env.STEADYHAND_PICTURES ?? join(ROOT, 'docs/pictures');
/** Of the movie: s between its pictures, s in all, pixels of each half. */
const STEP = 0.16, LENGTH = 10.6, HALF = { width: 400, height: 380 };
/** Of the page, px. */
const PAGE = { width: 1280, height: 800 };
const FINER = 2; // drawn so much larger, and reduced: a browser without a graphics card smooths no edges
const wanted = (name) => process.argv.length < 3 || process.argv.includes(name);

/** What the program sends to a client that watches while the arm follows for so long without a break, which takes a machine that is not too busy. */
async function listen(profile, seconds) {
  for (let i = 0; i < 8; ++i) {
    const heard = await listenOnce(profile, seconds);
    if (heard.states.every((state) => state.state === 'engaged' || state.now_s > heard.begin + seconds)) return heard;
  }
  return assert.fail('the hand was interrupted each time: end other work');
}

async function listenOnce(profile, seconds) {
  await startProgram('--profile', profile, '--no-recording');
  const context = await browser.newContext();
  const client = await context.newPage();
  await client.goto(new URL('/nothing', address).href);
  await client.evaluate(() => {
    globalThis.told = [];
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.onopen = () => socket.send('{"type":"hello","version":3}');
    socket.onmessage = (event) => globalThis.told.push(JSON.parse(event.data));
  });
  await until(() => client.evaluate((s) => {
    const states = globalThis.told.filter((message) => message.type === 'state');
    const first = states.find((message) => message.tools[0].engaged);
    return first && states.at(-1).now_s > first.now_s + s + 0.1;
  }, seconds), 'the hand to have played');
  const told = await client.evaluate(() => globalThis.told);
  await context.close();
  const states = told.filter((message) => message.type === 'state');
  const begin = states.find((message) => message.tools[0].engaged).now_s;
  return { welcome: told.find((message) => message.type === 'welcome'), states: states.filter((message) => message.now_s >= begin), begin };
}

/** The page on a clock of its own, which is told what was heard. */
async function replica(heard, context, prepare = () => {}) {
  let socket;
  const page = await open({
    watch: true,
    context: { deviceScaleFactor: FINER, ...context },
    prepare: async (of) => {
      await of.clock.install({ time: 0 });
      await of.clock.pauseAt(1000);
      await of.routeWebSocket('**/live', (route) => {
        socket = route;
        route.onMessage((text) => {
          if (JSON.parse(text).type !== 'hello') return;
          for (const message of [heard.welcome, { type: 'paired', token: 'none' }, { type: 'lease', holder: 0, yours: false, takeable: true, asker: 0, grant_s: null }, heard.states[0]]) {
            route.send(JSON.stringify(message));
          }
        });
      });
    },
    alive: (of) => of.clock.runFor(100),
  });
  await prepare(page);
  let next = 1, now = heard.begin, sent = 1;
  return {
    page,
    /** Goes on to that time; the last picture is drawn. */
    async until(time) {
      while (next < heard.states.length && heard.states[next].now_s <= time) {
        socket.send(JSON.stringify(heard.states[next]));
        ++sent;
        await page.clock.runFor(Math.max(1, Math.round(1000 * (heard.states[next].now_s - now))));
        now = heard.states[next++].now_s;
      }
      await until(() => page.evaluate((n) => globalThis.steadyhand.session.statesReceived >= n, sent), 'the page to hear all');
      await page.evaluate(() => globalThis.steadyhand.stage.setQuality(0));
      await page.clock.runFor(40);
      await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
    },
    shot: () => page.screenshot({ timeout: PATIENCE }),
    close: () => page.context().close(),
  };
}

/** A page that reduces pictures and sets them side by side. */
async function workshop() {
  const page = await (await browser.newContext()).newPage();
  return (shots, size, type, quality) => page.evaluate(async ({ shots, size, type, quality }) => {
    const canvas = new OffscreenCanvas(size.width * shots.length, size.height), pen = canvas.getContext('2d', { alpha: false });
    pen.imageSmoothingQuality = 'high';
    for (const [i, { data, title }] of shots.entries()) {
      const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
      pen.drawImage(picture, i * size.width, 0, size.width, size.height);
      if (!title) continue;
      pen.font = '600 17px sans-serif';
      pen.fillStyle = '#26323f';
      pen.fillText(title[0], i * size.width + 16, 30);
      pen.font = '14px sans-serif';
      pen.fillText(title[1], i * size.width + 16, 51);
      if (title[2]) {
        pen.fillStyle = '#b3261e';
        pen.font = '600 15px sans-serif';
        pen.fillText(title[2], i * size.width + 16, 76);
      }
    }
    const bytes = new Uint8Array(await (await canvas.convertToBlob({ type, quality })).arrayBuffer());
    let text = '';
    for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
    return btoa(text);
  }, { shots, size, type, quality }).then((data) => Buffer.from(data, 'base64'));
}

/** WebP files of one picture each as one that moves: https://developers.google.com/speed/webp/docs/riff_container */
function movie(pictures, { width, height }, ms) {
  const u24 = (value) => Buffer.from([value & 255, (value >> 8) & 255, (value >> 16) & 255]);
  const chunk = (name, ...parts) => {
    const body = Buffer.concat(parts), size = Buffer.alloc(4);
    size.writeUInt32LE(body.length);
    return Buffer.concat([Buffer.from(name), size, body, Buffer.alloc(body.length % 2)]);
  };
  const bits = (file) => {
    for (let at = 12; at < file.length;) {
      const name = file.toString('latin1', at, at + 4), size = file.readUInt32LE(at + 4);
      if (name === 'VP8 ' || name === 'VP8L') return chunk(name, file.subarray(at + 8, at + 8 + size));
      at += 8 + size + (size % 2);
    }
    return assert.fail('a WebP file without a picture');
  };
  const body = Buffer.concat([
    Buffer.from('WEBP'),
    chunk('VP8X', Buffer.from([2, 0, 0, 0]), u24(width - 1), u24(height - 1)),
    chunk('ANIM', Buffer.from([255, 255, 255, 255, 0, 0])),
    ...pictures.map((file) => chunk('ANMF', u24(0), u24(0), u24(width - 1), u24(height - 1), u24(ms), Buffer.from([2]), bits(file))),
  ]);
  return chunk('RIFF', body);
}

async function report() {
  const folder = mkdtempSync(join(tmpdir(), 'steadyhand-'));
  execFileSync(PROGRAM, ['replay', '--out', folder], { stdio: 'ignore' });
  const page = await (await browser.newContext({ viewport: { width: 1300, height: 1210 } })).newPage();
  await page.goto(pathToFileURL(join(folder, 'report.html')).href);
  await page.waitForTimeout(1000);
  await page.screenshot({ path: join(FOLDER, 'report.png') });
  rmSync(folder, { recursive: true });
}

/** What has a number on page_light, in the order of the table in docs/reference/page.md. */
const NUMBERED = ['#state', '#status dl', '#wave', '#views', '#stop', '#tabs', '#profiles', '#compared', '#plots', '#joint-panel'];
const number = (page) => page.evaluate((places) => places.forEach((place, i) => {
  const { left, top } = document.querySelector(place).getBoundingClientRect(), mark = document.createElement('b');
  mark.textContent = i + 1;
  Object.assign(mark.style, {
    position: 'fixed', left: `${Math.max(2, left - 12)}px`, top: `${Math.max(2, top - 10)}px`, zIndex: 99, width: '22px', borderRadius: '11px',
    font: '700 14px/22px sans-serif', textAlign: 'center', color: '#ffffff', background: '#b3261e',
  });
  document.body.append(mark);
}), NUMBERED);

async function still(name, heard, time, context, finish = () => {}) {
  const { page, until: goOn, shot, close } = await replica(heard, { viewport: PAGE, ...context });
  await goOn(heard.begin + time);
  await finish(page);
  const data = (await shot()).toString('base64');
  writeFileSync(join(FOLDER, `${name}.webp`), await (await workshop())([{ data }], PAGE, 'image/webp', 0.85));
  await close();
}

const SCENE_ALONE = 'aside, footer, main > :not(canvas) { display: none !important } main { position: fixed; inset: 0; width: 100vw; height: 100vh } canvas { width: 100% !important; height: 100% !important }';
async function arm(tracking, carry) {
  const halves = [];
  for (const heard of [tracking, carry]) {
    halves.push(await replica(heard, { viewport: HALF }, async (page) => {
      await page.addStyleTag({ content: SCENE_ALONE });
      await page.evaluate(() => { globalThis.steadyhand.drag.show(false); globalThis.steadyhand.drag.show = () => {}; }); // no handles
    }));
  }
  const compose = await workshop(), pictures = [];
  for (let t = 0; t < LENGTH; t += STEP) {
    const shots = [];
    for (const [i, heard] of [tracking, carry].entries()) {
      await halves[i].until(heard.begin + t);
      const { spilled } = (await halves[i].page.evaluate(() => globalThis.steadyhand.session.state)).tools[0].liquid;
      const title = i === 0 ? ['Tracking', 'as close to the hand as the limits allow'] : ['Carry', 'the closest that spills nothing'];
      shots.push({ data: (await halves[i].shot()).toString('base64'), title: [...title, spilled ? 'spilled' : ''] });
    }
    pictures.push(await compose(shots, HALF, 'image/webp', 0.28));
    if (process.env.STEADYHAND_KEEP) writeFileSync(join(process.env.STEADYHAND_KEEP, `${pictures.length}.webp`), pictures.at(-1));
  }
  const file = movie(pictures, { width: 2 * HALF.width, height: HALF.height }, 1000 * STEP);
  assert.ok(file.length < 600 * 1024, `${file.length} bytes are too many for a README`);
  writeFileSync(join(FOLDER, 'arm.webp'), file);
}

await start();
try {
  if (wanted('report')) await report();
  const tracking = ['page_dark', 'arm'].some(wanted) && await listen('tracking', LENGTH);
  const carry = ['page_light', 'arm'].some(wanted) && await listen('carry', LENGTH);
  if (wanted('page_light')) await still('page_light', carry, 6, {}, number);
  if (wanted('page_dark')) await still('page_dark', tracking, 9, { colorScheme: 'dark' });
  if (wanted('arm')) await arm(tracking, carry);
} finally {
  await finish();
}
