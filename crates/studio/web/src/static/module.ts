// The studio as a WebAssembly module (crates/web): calls of numbers and bytes.

/** The calls, as `run` in crates/web numbers them. */
export const Call = {
  open: 0, hear: 1, tick: 2, drawn: 3, get: 4, insert: 5, files: 6, lost: 7,
  put: 10, draw: 11,
  begin: 20, frame: 21, push: 22, finish: 23,
  unzip: 30, zip: 31,
  font: 40,
} as const;

export interface File {
  readonly name: string;
  readonly content: Uint8Array;
}

interface Exports {
  readonly memory: WebAssembly.Memory;
  readonly input: (length: number) => number;
  readonly output: () => number;
  readonly call: (what: number, number: number, time: number) => number;
  readonly fault: () => number;
}

/** An error after which the module is of no use. */
export class Fault extends Error {}

const NONE = new Uint8Array();
const encoder = new TextEncoder();
const decoder = new TextDecoder();

export const bytesOf = (text: string): Uint8Array => encoder.encode(text);
export const textOf = (bytes: Uint8Array): string => decoder.decode(bytes);

/** The module's dependencies name functions that only the tools of `wasm-bindgen` would give them. Nothing calls these. */
function imports(module: WebAssembly.Module): WebAssembly.Imports {
  const none = (): never => {
    throw new Error("the module has no surroundings");
  };
  const all: Record<string, Record<string, () => never>> = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) (all[from] ??= {})[name] = none;
  return all;
}

/** The module, and the font of letters that name none. */
export interface Program {
  readonly module: WebAssembly.Module;
  readonly font: Uint8Array;
}

export class Module {
  readonly #exports: Exports;

  constructor({ module, font }: Program) {
    this.#exports = new WebAssembly.Instance(module, imports(module)).exports as unknown as Exports;
    this.call(Call.font, 0, font);
  }

  /** Does what `what` names. The result is valid until the next call. */
  call(what: number, number = 0, bytes: Uint8Array = NONE): Uint8Array {
    const { memory, output } = this.#exports;
    const length = this.#run(what, number, bytes);
    const result = new Uint8Array(memory.buffer, output() >>> 0, length);
    if (result[0] !== 0) throw new Error(textOf(result.slice(1)));
    return result.subarray(1);
  }

  /** Returns the length of the result. */
  #run(what: number, number: number, bytes: Uint8Array): number {
    const { memory, input, output, call, fault } = this.#exports;
    try {
      const at = input(bytes.length) >>> 0;
      new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
      return call(what, number, performance.now());
    } catch (error) {
      const message = new Uint8Array(memory.buffer, output() >>> 0, fault());
      throw new Fault(message.length > 0 ? textOf(message) : String(error));
    }
  }
}

/** Files as one run of bytes: the length of each name and content before it. */
export function packed(files: readonly File[]): Uint8Array<ArrayBuffer> {
  const parts = files.flatMap(({ name, content }) => [bytesOf(name), content]);
  const bytes = new Uint8Array(parts.reduce((length, part) => length + 4 + part.length, 0));
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (const part of parts) {
    view.setUint32(at, part.length, true);
    bytes.set(part, at + 4);
    at += 4 + part.length;
  }
  return bytes;
}

/** The files of a run of bytes. */
export function unpacked(bytes: Uint8Array): File[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  let at = 0;
  const next = (): Uint8Array => {
    const start = at + 4;
    const end = start + view.getUint32(at, true);
    if (end > bytes.length) throw new RangeError("files were cut off");
    at = end;
    return bytes.slice(start, end);
  };
  const files: File[] = [];
  while (at < bytes.length) files.push({ name: textOf(next()), content: next() });
  return files;
}
