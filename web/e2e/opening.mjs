// `node opening.mjs [--times N]`: measures N times how long it takes from opening the site (its folder in
// STEADYHAND_SITE) to a moving arm, each time in a new browser context. Prints a line of JSON for each: s since the
// opening at which each part was there.
import { parseArgs } from 'node:util';
import { loadavg } from 'node:os';
import { closePages, distance, finish, open, start, startProgram, state, until, withoutPixels } from './harness.mjs';

const { values: { times } } = parseArgs({ options: { times: { type: 'string', default: '5' } } });
await start();
await startProgram();
const all = [];
for (let i = 0; i < Number(times); ++i) {
  const begin = performance.now();
  const page = await open({ prepare: withoutPixels });
  const first = await state(page);
  await until(async () => distance((await state(page)).q, first.q) > 0.01, 'the arm to move');
  const s = (performance.now() - begin) / 1000;
  all.push(s);
  const marks = await page.evaluate(() => Object.fromEntries([
    ...performance.getEntriesByType('resource').map(({ name, responseEnd }) => [name.split('/').pop().replace(/-[\w-]{8}\./, '.'), responseEnd]),
    ...performance.getEntriesByType('mark').map(({ name, startTime }) => [name, startTime]),
  ].map(([name, ms]) => [name, Math.round(ms) / 1000])));
  console.log(JSON.stringify({ s: Math.round(1000 * s) / 1000, load: loadavg()[0], marks }));
  await closePages();
}
all.sort((a, b) => a - b);
console.log(JSON.stringify({ least: all[0], median: all[all.length >> 1], of: all.length }));
await finish();
