// `node web/e2e/plans.mjs [--problems N] [--play SECONDS]`: compares the plans of WebAssembly with those of native
// code, and how long they take. JSON lines: for each profile and place (node, the browser of STEADYHAND_BROWSER,
// native) the plans a second, in all and in the block that was disturbed least, p50 and p99 (us; browsers give times to
// 0.1 or 1 ms), how many times the native code's time (median over blocks), and the largest difference (rad, rad/s) to
// native plans; with --play the same of a session's commands.
//   STEADYHAND_CLOSED_LOOP   tests/tools/closed_loop.cpp as a program; with as many lanes (2), if results are compared
//   STEADYHAND_BUILD         holds wasm/steadyhand.wasm and wasm-plain/steadyhand.wasm
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { buildSync } from 'esbuild';
import { browser, finish, FIREFOX, PROGRAM, ROOT, start } from './harness.mjs';

const { values } = parseArgs({ options: { problems: { type: 'string', default: '1000' }, play: { type: 'string', default: '0' }, 'no-browser': { type: 'boolean' } } });
const problems = Number(values.problems), seconds = Number(values.play);
const build = process.env.STEADYHAND_BUILD ?? join(ROOT, 'build');
const closedLoop = process.env.STEADYHAND_CLOSED_LOOP ?? join(build, 'release/closed_loop');
const folder = mkdtempSync(join(tmpdir(), 'steadyhand-plans-'));
const BIG = { maxBuffer: 1 << 30, encoding: 'utf8' };

const setup = execFileSync(PROGRAM, ['site-data', 'ur5e'], BIG);
writeFileSync(join(folder, 'setup.json'), setup);
const native = (...words) => JSON.parse(execFileSync(closedLoop, [join(folder, 'setup.json'), ...words.map(String)], BIG));
const bundle = (format) => buildSync({ entryPoints: [join(ROOT, 'web/src/worker/module.ts')], bundle: true, format, globalName: 'planner', write: false }).outputFiles[0].text;
writeFileSync(join(folder, 'module.mjs'), bundle('esm'));
const { Module } = await import(join(folder, 'module.mjs'));
const NOBODY = { send: () => {}, close: () => {}, keep: () => {} };

/** The largest difference of two lists of rows; infinite if their lengths differ or a value is not a number. */
function difference(a, b) {
  if (a.length !== b.length) return Infinity;
  let most = 0;
  for (let i = 0; i < a.length; ++i) {
    if (a[i].length !== b[i].length) return Infinity;
    for (let k = 0; k < a[i].length; ++k) {
      const d = Math.abs(a[i][k] - b[i][k]);
      if (!(d <= most)) most = Number.isNaN(d) ? Infinity : d;
    }
  }
  return most;
}
const BLOCK = Math.min(50, problems);
const native_blocks = new Map();
function say(words, times) {
  const sorted = [...times].sort((x, y) => x - y), at = (share) => Math.round(sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]);
  const mean = times.reduce((sum, t) => sum + t, 0) / times.length;
  // The machine has other load, too: takes the blocks that were disturbed least, each compared with the same block of
  // native code.
  const blocks = Array.from({ length: Math.floor(times.length / BLOCK) }, (_, i) => times.slice(BLOCK * i, BLOCK * (i + 1)).reduce((sum, t) => sum + t, 0) / BLOCK);
  if (words.where === 'native') native_blocks.set(words.profile, blocks);
  const shares = blocks.map((us, i) => us / native_blocks.get(words.profile)[i]).sort((x, y) => x - y);
  console.log(JSON.stringify({ ...words, plans_a_second: Math.round(1e6 / mean), calm_plans_a_second: Math.round(1e6 / Math.min(...blocks)),
    times_native: Number(shares[Math.floor(shares.length / 2)].toFixed(2)), p50_us: at(0.5), p99_us: at(0.99) }));
}

try {
  if (!values['no-browser']) await start();
  const page = values['no-browser'] ? null : await (await browser.newContext()).newPage();
  await page?.goto('about:blank');
  await page?.addScriptTag({ content: bundle('iife') });
  const kinds = { simd: 'wasm', plain: 'wasm-plain' };
  for (const [kind, preset] of Object.entries(kinds)) {
    const bytes = readFileSync(join(build, preset, 'steadyhand.wasm'));
    const module = await Module.load(bytes, NOBODY);
    await page?.evaluate(async (text) => {
      const { bytes } = { bytes: Uint8Array.from(atob(text), (c) => c.charCodeAt(0)) };
      globalThis.module = await globalThis.planner.Module.load(bytes, { send: () => {}, close: () => {}, keep: () => {} });
    }, bytes.toString('base64'));
    for (const [index, { name: profile }] of JSON.parse(setup).profiles.entries()) {
      const here = native(index, problems);
      if (kind === 'simd') say({ profile, where: 'native' }, here.times_us);
      const node = module.solve(setup, index, problems);
      say({ profile, where: 'node', kind, difference: difference(here.plans, node.plans) }, node.times_us);
      if (!page) continue;
      const there = await page.evaluate(([text, i, n]) => globalThis.module.solve(text, i, n), [setup, index, problems]);
      say({ profile, where: FIREFOX ? 'firefox' : 'chromium', kind, difference: difference(here.plans, there.plans) }, there.times_us);
    }
    if (seconds > 0) {
      const here = native('--play', seconds).commands, there = module.play(setup, seconds).commands;
      console.log(JSON.stringify({ session: seconds, kind, commands: there.length, difference: difference(here, there) }));
    }
  }
} finally {
  if (!values['no-browser']) await finish();
  rmSync(folder, { recursive: true, force: true });
}
