import { chromium } from 'playwright-core';
import { spawn } from 'node:child_process';
const dir = process.argv[2];
const program = spawn('./steadyhand', ['demo', '--arm', 'mujoco', '--task', 'carry', '--no-browser', '--port', '0', '--sessions', `${dir}/sessions`, '--set', 'recording.keep_free=0'], { cwd: '..' });
let output = '';
program.stdout.on('data', (d) => { output += d; }); program.stderr.on('data', (d) => { output += d; });
const wait = (ms) => new Promise((r) => setTimeout(r, ms));
for (let k = 0; k < 600 && !/^open\s+(http:\S+)/m.test(output); ++k) await wait(200);
const address = [...output.matchAll(/^open\s+(http:\S+)/gm)].at(-1)[1];
const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });
const page = await (await browser.newContext({ viewport: { width: 1280, height: 800 } })).newPage();
page.on('console', (m) => console.log('console:', m.text()));
await page.goto(address);
for (let k = 0; k < 300 && !(await page.evaluate(() => globalThis.steadyhand?.session.state && globalThis.steadyhand.stage.arm?.meshes.length >= 7)); ++k) await wait(200);
await wait(3000);
await page.screenshot({ path: `${dir}/1_open.png` });

await page.evaluate(() => globalThis.steadyhand.stage.setQuality(4));
const at = async () => page.evaluate(() => { const { session } = globalThis.steadyhand; return JSON.stringify([session.state.state, session.state.reason, session.state.tool.p, session.yours]); });
console.log(await at());
console.log(await page.evaluate(() => [...document.querySelectorAll('button')].filter((b) => b.offsetParent).map((b) => b.textContent.trim()).join(' | ')));
await page.getByRole('button', { name: /lead/i }).first().click({ timeout: 3000 }).catch((e) => console.log(String(e).slice(0, 200)));
await wait(1500);
await page.screenshot({ path: `${dir}/1b_card.png` });
console.log(await at());
await page.keyboard.press('b');
await wait(500);
console.log(await page.textContent('#episode-state'));
const spot = () => page.evaluate(() => {
    const { stage } = globalThis.steadyhand;
    const p = stage.ghost.getWorldPosition(stage.ghost.position.clone()).project(stage.view.camera);
    const box = stage.renderer.domElement.getBoundingClientRect();
    return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
});
for (let n = 0; n < 2; ++n) {
const p = await spot();
await page.mouse.move(p.x, p.y); await wait(400); await page.mouse.down();
for (let i = 1; i <= 60; ++i) { await page.mouse.move(p.x + (n ? -1 : 1) * i, p.y + i); await wait(30); }
console.log(await at());
if (!n) await page.screenshot({ path: `${dir}/2_led.png` });
await page.mouse.up(); await wait(800);
}
await page.keyboard.press('n'); await wait(1000);
console.log(await page.textContent('#episode-state'));
await page.evaluate(() => globalThis.steadyhand.stage.setQuality(1)); await wait(4000);
await page.screenshot({ path: `${dir}/3_kept.png` });
await browser.close();
program.kill('SIGINT'); await new Promise((r) => program.once('close', r));
console.log(output);
