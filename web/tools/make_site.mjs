// `node make_site.mjs --out DIR [--robot NAME]...`: the page, the planner as WebAssembly and robots as files for any web server.
// ./steadyhand site calls it, and says where the parts are:
//   STEADYHAND_PROGRAM   asked for what a session of a robot begins with
//   STEADYHAND_BUILD     holds release/page, wasm/steadyhand.wasm and wasm-plain/steadyhand.wasm
import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, relative, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { gunzipSync, gzipSync } from 'node:zlib';

const ROOT = resolve(import.meta.dirname ?? dirname(new URL(import.meta.url).pathname), '../..');
const PROGRAM = process.env.STEADYHAND_PROGRAM ?? join(ROOT, 'build/release/steadyhand');
const BUILD = process.env.STEADYHAND_BUILD ?? join(ROOT, 'build');
/** Allows only files of the folder, compiled WebAssembly, and inline styles, which the plots need. */
const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; "
  + "img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; base-uri 'none'; form-action 'none'";
/** A folder is overwritten only if it has this file. */
const LIST = 'site.json';

function refuse(words) {
  console.error(`steadyhand: ${words}`);
  process.exit(2);
}

function options() {
  try {
    const { values } = parseArgs({ options: { out: { type: 'string' }, robot: { type: 'string', multiple: true }, help: { type: 'boolean', short: 'h' } } });
    return values;
  } catch (error) {
    return refuse(`site: ${error.message}; see ./steadyhand site --help`);
  }
}

const { out, robot: robots = ['ur5e'], help } = options();
if (help) {
  console.log('steadyhand site --out DIR [--robot NAME]...\n\n'
    + 'Writes the page with its planner and a simulated arm into DIR, as files for any web server (docs/how-to/browser.md).\n'
    + '  --out DIR     an empty or new folder, or one that this command wrote before\n'
    + '  --robot NAME  of robots/, or a robot file; again for more. The first is shown, others with ?robot=NAME. Default: ur5e');
  process.exit(0);
}
if (!out) refuse('site needs --out DIR, the folder to write');
if (existsSync(out) && !statSync(out).isDirectory()) refuse(`site: ${out} is no folder`);
if (existsSync(out) && readdirSync(out).length > 0 && !existsSync(join(out, LIST))) {
  refuse(`site: ${out} holds something else (it is not empty, and has no ${LIST}); name another folder`);
}

const files = new Map();
const page = join(BUILD, 'release/page');
for (const entry of readdirSync(page, { recursive: true, withFileTypes: true })) {
  if (!entry.isFile()) continue;
  const path = join(entry.parentPath ?? entry.path, entry.name); // `path` before Node 20.12
  const name = relative(page, path).replace(/\.gz$/, '');
  files.set(name, path.endsWith('.gz') ? gunzipSync(readFileSync(path)) : readFileSync(path));
}
const index = files.get('index.html')?.toString() ?? refuse(`site: ${page} has no index.html`);
files.set('index.html', Buffer.from(index.replace('<meta charset="utf-8">',
  `<meta charset="utf-8">\n<meta http-equiv="Content-Security-Policy" content="${POLICY}">\n<meta name="steadyhand-session" content="worker">`)));
files.set('steadyhand.wasm', readFileSync(join(BUILD, 'wasm/steadyhand.wasm')));
files.set('steadyhand-plain.wasm', readFileSync(join(BUILD, 'wasm-plain/steadyhand.wasm')));
files.set('licenses.txt', Buffer.concat(['LICENSE', 'THIRD_PARTY.md'].map((name) => readFileSync(join(ROOT, name)))));
const names = [], scenes = mkdtempSync(join(tmpdir(), 'steadyhand-'));
for (const robot of robots) {
  const scene = join(scenes, `${names.length}.glb`);
  let setup;
  try {
    setup = execFileSync(PROGRAM, ['site-data', robot, '--scene', scene], { maxBuffer: 1 << 28, stdio: ['ignore', 'pipe', 'pipe'] });
  } catch (error) {
    refuse(`site: robot ${robot}: ${String(error.stderr ?? error.message).trim().replace(/^steadyhand: /, '')}`);
  }
  const { name, meshes = name } = JSON.parse(setup).robot;
  if (!/^[\w.-]+$/.test(name)) refuse(`site: robot ${robot} has the name “${name}”; letters, digits, dots and hyphens make a file's name`);
  files.set(`robots/${name}.json`, setup);
  if (existsSync(scene)) files.set(`arms/${meshes}.glb`, readFileSync(scene));
  names.push(name);
}
rmSync(scenes, { recursive: true });
const bytes = Object.fromEntries([...files].map(([name, data]) => [name, data.length]));
files.set(LIST, Buffer.from(JSON.stringify({ robots: names, bytes })));
const version = createHash('sha256');
for (const [name, data] of files) version.update(name).update(data);
const listed = ['./', ...files.keys()].filter((name) => name !== 'licenses.txt');
files.set('offline.js', Buffer.from(`const version = '${version.digest('hex').slice(0, 16)}';\nconst files = ${JSON.stringify(listed)};\n${
  readFileSync(join(ROOT, 'web/site/offline.js'), 'utf8')}`));

let packed = 0;
for (const [name, data] of files) {
  mkdirSync(dirname(join(out, name)), { recursive: true });
  writeFileSync(join(out, name), data);
  packed += gzipSync(data, { level: 9 }).length;
}
console.log(`${out}: ${files.size} files, ${(packed / 1e6).toFixed(2)} MB compressed. Try it: python3 -m http.server --directory ${out}`);
