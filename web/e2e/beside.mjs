// Prints a table of the processor time that a page with software rendering leaves to the program on the same machine:
// `node web/e2e/beside.mjs [SECONDS]`. First the demo motion controls the arm, then the arm is stationary.
import { readdirSync, readFileSync } from 'node:fs';
import { finish, newestAddress, start, startProgram, state, until, browser } from './harness.mjs';

const SECONDS = Number(process.argv[2] ?? 40), TICKS = 100;
const print = (what, value) => console.log(`${what.padEnd(64)} ${value}`);

/** s of processor that all processes of the browser took. */
function taken() {
  let sum = 0;
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      if (!/chrom|firefox/.test(readFileSync(`/proc/${pid}/comm`, 'utf8'))) continue;
      const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1].split(' ');
      sum += (Number(fields[11]) + Number(fields[12])) / TICKS;
    } catch { /* gone meanwhile */ }
  }
  return sum;
}

async function look(page, what) {
  const seen = () => page.evaluate(() => {
    const { plans, rejected_plans, cycles, missed_deadlines } = globalThis.steadyhand.session.state;
    return { plans, rejected_plans, cycles, missed_deadlines, pictures: globalThis.steadyhand.stage.renderer.info.render.frame };
  });
  const before = await seen(), since = taken(), begin = Date.now();
  let holds = 0, spilled = 0, was = '';
  while (Date.now() - begin < 1000 * SECONDS) {
    const now = await state(page);
    if (now.reason_code === 'planner_late' && was !== now.reason_code) ++holds;
    was = now.reason_code;
    spilled = Math.max(spilled, now.tools[0].liquid.spilled_share);
    await page.waitForTimeout(200);
  }
  const after = await seen(), passed = (Date.now() - begin) / 1000, each = (name) => after[name] - before[name];
  print(`${what}: processors that the browser takes`, ((taken() - since) / passed).toFixed(2));
  print(`${what}: pictures a second`, (each('pictures') / passed).toFixed(1));
  print(`${what}: plans a second, late ones`, `${(each('plans') / passed).toFixed(0)}, ${((100 * each('rejected_plans')) / Math.max(1, each('plans'))).toFixed(2)} %`);
  print(`${what}: commands that were late`, `${((100 * each('missed_deadlines')) / each('cycles')).toFixed(3)} %`);
  print(`${what}: seen to hold for a late planner; spilled, %`, `${holds}; ${(100 * spilled).toFixed(1)}`);
}

await start();
try {
  await startProgram();
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } }), page = await context.newPage();
  await page.goto(newestAddress());
  await until(() => page.evaluate(() => globalThis.steadyhand?.stage.arm?.meshes.length >= 7 && globalThis.steadyhand.session.state?.tools[0].engaged), 'the demo motion');
  await page.waitForTimeout(5000);
  await look(page, 'led');
  await page.evaluate(() => globalThis.steadyhand.connection.send({ type: 'take' }));
  await until(async () => !(await state(page)).tools[0].engaged, 'the demo motion to end');
  await page.waitForTimeout(4000);
  await look(page, 'at rest');
} finally {
  await finish();
}
