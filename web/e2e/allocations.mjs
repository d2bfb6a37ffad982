// Measures how much each function of the page allocates: V8's sampling profiler, with source maps to find the file.
import { execFileSync } from 'node:child_process';
import { readdirSync, readFileSync } from 'node:fs';
import { SourceMap } from 'node:module';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';
import { ROOT } from './harness.mjs';

/** Bundles the page into `folder` with names and source maps; these by the scripts' file names. */
export function buildReadable(folder) {
  const web = join(ROOT, 'web');
  const env = { ...process.env, STEADYHAND_PAGE: folder };
  execFileSync(process.execPath, [join(web, 'node_modules/vite/bin/vite.js'), 'build', '--logLevel', 'error', '--minify', 'false', '--sourcemap'],
    { cwd: web, env, stdio: 'inherit' });
  const maps = readdirSync(folder, { recursive: true }).filter((name) => name.endsWith('.js.map.gz'));
  return new Map(maps.map((name) => [name.split('/').at(-1).replace('.map.gz', ''), new SourceMap(JSON.parse(gunzipSync(readFileSync(join(folder, name))).toString()))]));
}

/** The file that a function was written in; empty: the browser's own, or the measurement's. */
function fileOf({ url, lineNumber, columnNumber }, sources) {
  const entry = sources.get(url.split('/').at(-1))?.findEntry(lineNumber, columnNumber);
  const source = entry?.originalSource ?? '';
  return /node_modules\/.*/.exec(source)?.[0] ?? /src\/(?!.*\/src\/).*/.exec(source)?.[0] ?? '';
}

const OWN = 'own drawing', THREE = 'three.js', MESSAGES = 'messages (parsing, plots)', REST = 'browser and measurement';

/** The part of the page that an allocation counts for; `inherited`: its caller's part. */
function shareOf(file, name, inherited) {
  if (inherited === MESSAGES || file.startsWith('src/plots/') || (file.endsWith('src/connection.ts') && name.endsWith('onmessage'))) return MESSAGES;
  // An object of three.js that our own code makes is our own.
  if (file.includes('node_modules/three')) return inherited === OWN && /^([A-Z]\w*|clone)$/.test(name) ? OWN : THREE;
  if (file.includes('node_modules/uplot')) return MESSAGES;
  if (file.startsWith('src/')) return OWN;
  return inherited; // a built-in function counts as its caller
}

/**
 * Bytes per frame that drawing the scene allocates, from the result of `allocations`: without work per second or per
 * message.
 */
export const ofTheScene = ({ frames, shares }) => shares.find(([share]) => share === OWN)[1].functions
  .reduce((sum, [name, size]) => (/ src\/scene\/|node_modules\/three/.test(name) ? sum + size / frames : sum), 0);

/** Bytes per frame of the function of the scene that allocates most. */
export const mostOfTheScene = ({ frames, shares }) => Math.max(0, ...shares.find(([share]) => share === OWN)[1].functions
  .map(([name, size]) => (/ src\/scene\/|node_modules\/three/.test(name) ? size / frames : 0)));

/** @returns frames, and [share, {bytes, functions: [name, bytes], largest first}] of everything allocated in so many seconds */
export async function allocations(page, sources, seconds) {
  const tools = await page.context().newCDPSession(page);
  const count = () => page.evaluate(() => globalThis.steadyhand.frames());
  const begin = await count();
  await tools.send('HeapProfiler.startSampling', { samplingInterval: 512, includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true });
  await page.waitForTimeout(1000 * seconds);
  const { profile } = await tools.send('HeapProfiler.stopSampling');
  const frames = (await count()) - begin;
  const shares = new Map([OWN, THREE, MESSAGES, REST].map((share) => [share, { bytes: 0, functions: new Map() }]));
  const visit = (node, caller, inherited) => {
    const file = fileOf(node.callFrame, sources), share = shareOf(file, node.callFrame.functionName, inherited);
    const name = file ? `${node.callFrame.functionName || '(anonymous)'} ${file}` : caller;
    const sum = shares.get(share);
    sum.bytes += node.selfSize;
    sum.functions.set(name, (sum.functions.get(name) ?? 0) + node.selfSize);
    for (const child of node.children) visit(child, name, share);
  };
  visit(profile.head, '', REST);
  await tools.detach();
  return { frames, shares: [...shares].map(([share, { bytes, functions }]) => [share, { bytes, functions: [...functions].sort((a, b) => b[1] - a[1]) }]) };
}
