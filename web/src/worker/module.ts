/**
 * Exports of a module (src/steadyhand/apps/browser/exports.cpp); times in s, texts as UTF-8 at an address in its
 * memory.
 */
interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  take_memory(size: number): number;
  give_memory(address: number): void;
  begin(text: number, size: number, rateHz: number): number;
  advance(now: number): void;
  left_out(): number;
  join(client: number, now: number): void;
  leave(client: number, now: number): void;
  receive(client: number, text: number, size: number, now: number): void;
  solve(text: number, size: number, profile: number, problems: number): number;
  play(text: number, size: number, seconds: number): number;
  answer_text(): number;
  answer_size(): number;
}

/** Receives the module's calls. */
export interface Listener {
  send(client: number, text: string, isState: boolean): void;
  close(client: number): void;
  /** More bytes of a recording; no bytes: it is complete. */
  keep(name: string, bytes: Uint8Array<ArrayBuffer>): void;
}

/** WASI's error number for what a browser does not have, and of its monotonic clock. */
const NOT_SUPPORTED = 58, MONOTONIC = 1;

/** Some browsers switch it off in their strictest security mode. */
export const hasWebAssembly = (): boolean => typeof WebAssembly === 'object';

/**
 * Whether this browser has SIMD (two doubles at once) in WebAssembly: tested with the smallest module that needs it.
 */
export const hasSimd = (): boolean => hasWebAssembly() && WebAssembly.validate(new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11]));

/** The library as a module: a session, and plans for comparison with other platforms. */
export class Module {
  readonly #exports: Exports;
  readonly #encoder = new TextEncoder();
  readonly #decoder = new TextDecoder();
  /** The module's last message: the reason for a failure. */
  #said = '';

  private constructor(compiled: WebAssembly.Module, private readonly listener: Listener) {
    const system = this.#system(), absent = () => NOT_SUPPORTED;
    for (const { module, name } of WebAssembly.Module.imports(compiled)) {
      if (module === 'wasi_snapshot_preview1') system[name] ??= absent;
    }
    this.#exports = new WebAssembly.Instance(compiled, { steadyhand: this.#calls(), wasi_snapshot_preview1: system }).exports as unknown as Exports;
    this.#exports._initialize();
  }

  static async load(bytes: BufferSource, listener: Listener): Promise<Module> {
    return new Module(await WebAssembly.compile(bytes), listener);
  }

  /**
   * Throws the reason if there can be no session.
   * @param rateHz planning steps a second; 0: what this machine sustains
   */
  begin(setup: string, rateHz = 0): void { this.#must((text, size) => this.#exports.begin(text, size, rateHz), setup); }
  advance(now: number): void { this.#or(() => this.#exports.advance(now)); }
  join(client: number, now: number): void { this.#or(() => this.#exports.join(client, now)); }
  leave(client: number, now: number): void { this.#or(() => this.#exports.leave(client, now)); }
  receive(client: number, text: string, now: number): void {
    this.#with(text, (at, size) => this.#or(() => this.#exports.receive(client, at, size, now)));
  }
  /** See closed_loop.hpp. */
  solve(setup: string, profile: number, problems: number): { plans: number[][]; times_us: number[] } {
    this.#must((text, size) => this.#exports.solve(text, size, profile, problems), setup);
    return JSON.parse(this.#answer());
  }
  play(setup: string, seconds: number): { commands: number[][] } {
    this.#must((text, size) => this.#exports.play(text, size, seconds), setup);
    return JSON.parse(this.#answer());
  }
  /** s, total of pauses: how far the session's clock is behind this one. */
  get leftOut(): number { return this.#exports.left_out(); }
  /** bytes */
  get memory(): number { return this.#exports.memory.buffer.byteLength; }

  #answer(): string { return this.#read(this.#exports.answer_text(), this.#exports.answer_size()); }
  #read(at: number, size: number): string { return this.#decoder.decode(new Uint8Array(this.#exports.memory.buffer, at, size)); }

  #with(text: string, use: (at: number, size: number) => void): void {
    const bytes = this.#encoder.encode(text), at = this.#exports.take_memory(Math.max(1, bytes.length));
    new Uint8Array(this.#exports.memory.buffer).set(bytes, at);
    use(at, bytes.length);
    this.#exports.give_memory(at);
  }

  #must(call: (at: number, size: number) => number, text: string): void {
    this.#said = '';
    this.#with(text, (at, size) => { if (this.#or(() => call(at, size)) !== 0) throw new Error(this.#said); });
  }

  /** If the module traps, throws its last message, or else the browser's error. */
  #or<T>(call: () => T): T {
    try {
      return call();
    } catch (error) {
      throw this.#said ? new Error(this.#said) : error;
    }
  }

  #calls(): WebAssembly.ModuleImports {
    return {
      send: (client: number, at: number, size: number, isState: number) => this.listener.send(client, this.#read(at, size), isState !== 0),
      close: (client: number) => this.listener.close(client),
      keep: (name: number, nameSize: number, at: number, size: number) =>
        this.listener.keep(this.#read(name, nameSize), new Uint8Array(this.#exports.memory.buffer, at, size).slice()),
      say: (at: number, size: number) => { this.#said = this.#read(at, size); },
    };
  }

  /** Imports of an operating system: a clock, random bytes, and error output. No files. */
  #system(): WebAssembly.ModuleImports {
    const view = () => new DataView(this.#exports.memory.buffer);
    return {
      clock_time_get: (clock: number, _precision: bigint, at: number) => {
        const ms = clock === MONOTONIC ? performance.now() : Date.now();
        view().setBigUint64(at, BigInt(Math.round(1e6 * ms)), true);
        return 0;
      },
      random_get: (at: number, size: number) => {
        crypto.getRandomValues(new Uint8Array(this.#exports.memory.buffer, at, size));
        return 0;
      },
      fd_write: (_file: number, list: number, count: number, written: number) => {
        let all = 0;
        for (let i = 0; i < count; ++i) {
          const size = view().getUint32(list + 8 * i + 4, true);
          this.#said += this.#read(view().getUint32(list + 8 * i, true), size);
          all += size;
        }
        view().setUint32(written, all, true);
        return 0;
      },
      proc_exit: (code: number) => { throw new Error(this.#said || `the planner ended with code ${code}`); },
      environ_sizes_get: (count: number, size: number) => {
        view().setUint32(count, 0, true);
        view().setUint32(size, 0, true);
        return 0;
      },
      environ_get: () => 0,
    };
  }
}
