// The planner of a site (./steadyhand site, its folder in STEADYHAND_SITE) in Node, with a simulated clock.
import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { buildSync } from 'esbuild';
import { ROOT, SITE } from './harness.mjs';

const folder = mkdtempSync(join(tmpdir(), 'steadyhand-planner-'));
const real = performance.now;
let Module;
before(async () => {
  const { outputFiles } = buildSync({ entryPoints: [join(ROOT, 'web/src/worker/module.ts')], bundle: true, format: 'esm', write: false });
  writeFileSync(join(folder, 'module.mjs'), outputFiles[0].text);
  ({ Module } = await import(join(folder, 'module.mjs')));
});
after(() => {
  performance.now = real;
  rmSync(folder, { recursive: true });
});

/**
 * The last state of a session that plays its first recorded hand for so many seconds.
 * @param rate planning steps a second
 */
async function played(seconds, rate) {
  let state = '';
  const module = await Module.load(readFileSync(join(SITE, 'steadyhand.wasm')), {
    send: (_client, text, isState) => { if (isState) state = text; },
    close: () => assert.fail('closed'),
    keep: () => {},
  });
  module.begin(readFileSync(join(SITE, 'robots/ur5e.json'), 'utf8'), rate);
  const begin = 1000; // s, of a clock that began long ago
  module.join(1, begin);
  module.receive(1, '{"type":"hello","version":3}', begin);
  for (let t = 0; t < seconds; t += 0.008) module.advance(begin + t);
  return JSON.parse(state);
}

for (const taken of [0, 40, 400]) { // ms
  test(`no plan is refused where the system takes the processor for ${taken} ms in every fifth plan or so`, async () => {
    let looks = 0, now = 1e6;
    performance.now = () => (now += ++looks % 20 === 0 ? taken : 0.01);
    const { plans, rejected_plans: refused, planner_rate_hz: rate } = await played(30, 50);
    assert.equal(rate, 50);
    assert.ok(plans > (taken ? 500 : 1400), `${plans} plans`); // a step beyond its period delays the next by up to 100 ms
    assert.equal(refused, 0, `${refused} of ${plans}`);
  });
}
