import { gzipSync } from 'node:zlib';
import { readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { defineConfig, type Plugin } from 'vite';

/** The server sends every file as it is: what shrinks is stored as NAME.gz. */
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

export default defineConfig({
  base: './',
  cacheDir: '../build/vite',
  publicDir: false,
  build: {
    target: 'es2022', // older ones have no private members: each would become a search in a WeakMap
    outDir: process.env.STEADYHAND_PAGE ?? '../build/page',
    emptyOutDir: true,
    chunkSizeWarningLimit: 2000,
    modulePreload: { polyfill: false },
  },
  plugins: [compress()],
  test: { include: ['test/**/*.test.ts'], css: true },
} as Parameters<typeof defineConfig>[0]);
