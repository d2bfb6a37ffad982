import { gzipSync } from 'node:zlib';
import { readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { defineConfig, mergeConfig, type Plugin, type UserConfig } from 'vite';

/** The server sends every file unchanged: files that compress well are stored as NAME.gz. */
function compress(): Plugin {
  let folder = '';
  return {
    name: 'compress',
    configResolved: (config) => { folder = config.build.outDir; },
    closeBundle() {
      for (const entry of readdirSync(folder, { recursive: true, withFileTypes: true })) {
        if (!entry.isFile() || entry.name.endsWith('.gz')) continue;
        const path = join(entry.parentPath ?? entry.path, entry.name); // `path` before Node 20.12
        const packed = gzipSync(readFileSync(path), { level: 9 });
        writeFileSync(`${path}.gz`, packed);
        rmSync(path);
      }
    },
  };
}

/** Parts that the operator's page and the report share: `<!-- src/PART.html -->` includes that file. */
const parts: Plugin = {
  name: 'parts',
  transformIndexHtml: { order: 'pre', handler: (html) => html.replace(/<!-- (src\/\S+\.html) -->/g, (_, path: string) => readFileSync(path, 'utf8').trim()) },
};

/** Puts scripts and styles into the page itself: a report is one file, which loads no other. */
const inline: Plugin = {
  name: 'inline',
  enforce: 'post',
  generateBundle(_, bundle) {
    const page = Object.values(bundle).find(({ fileName }) => fileName.endsWith('.html'));
    if (page?.type !== 'asset') throw new Error('no page to put scripts and styles into');
    const take = (path: string): string => {
      const file = bundle[path.replace(/^\.\//, '')]!;
      delete bundle[file.fileName];
      return file.type === 'chunk' ? file.code.replaceAll('</script', '<\\/script') : String(file.source);
    };
    page.source = String(page.source)
      .replace(/<script type="module"[^>]* src="([^"]+)"><\/script>/, (_all, path: string) => `<script type="module">${take(path)}</script>`)
      .replace(/<link rel="stylesheet"[^>]* href="([^"]+)">/, (_all, path: string) => `<style>${take(path)}</style>`);
  },
};

/** The report's page; its data takes the place of {{data}} (src/steadyhand/report/figures/page.cpp). */
const REPORT = {
  plugins: [parts, inline],
  publicDir: false as const,
  build: { rollupOptions: { input: 'report.html' }, cssCodeSplit: false },
};

export default defineConfig(({ mode }) => mergeConfig({
  base: './',
  cacheDir: '../build/vite',
  build: {
    target: 'es2022', // older ones have no private members: each would become a search in a WeakMap
    outDir: process.env.STEADYHAND_PAGE ?? '../build/page',
    emptyOutDir: true,
    chunkSizeWarningLimit: 2000,
    modulePreload: { polyfill: false },
  },
  test: { include: ['test/**/*.test.ts'], css: true },
} as UserConfig, mode === 'report' ? REPORT : { plugins: [parts, compress()], publicDir: false }));
