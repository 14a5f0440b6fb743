// The projects that the browser keeps in its own storage, each a folder of files. Without such a storage, as in some
// private windows, they last as long as the page.

import type { File } from "./module";

const ROOT = "projects";

/** The most bytes of a folder that the studio holds. */
const MOST = 256 << 20;

/** Returns whether a name is that of a file or a folder, and of no hidden one, as those of zip files are (`browser/archive.rs`). */
export const isPlain = (name: string): boolean => name !== "" && !name.startsWith(".") && !/[\p{Cc}/\\:]/u.test(name);

async function root(): Promise<FileSystemDirectoryHandle | null> {
  try {
    const all = await navigator.storage.getDirectory();
    return await all.getDirectoryHandle(ROOT, { create: true });
  } catch {
    return null;
  }
}

/** Returns whether a file of a folder is not read: a hidden one, or one that Chromium writes before it takes another's place. */
const isSkipped = (name: string): boolean => name.startsWith(".") || name.endsWith(".crswap");

/** A folder of files, in the browser's storage or on the disk. */
export class Folder {
  readonly #handle: FileSystemDirectoryHandle | null;

  constructor(handle: FileSystemDirectoryHandle | null) {
    this.#handle = handle;
  }

  /** Whether files are kept here. */
  get isKept(): boolean {
    return this.#handle !== null;
  }

  /** Returns the files, and the names of those that are left out, because the studio cannot hold them. */
  async files(): Promise<{ readonly files: readonly (File & { readonly modified: number })[]; readonly leftOut: readonly string[] }> {
    const found = [];
    for await (const handle of this.#handle?.values() ?? []) {
      if (handle.kind === "file" && !isSkipped(handle.name)) found.push(await (handle as FileSystemFileHandle).getFile());
    }
    // Scripts are small: what is left out are pictures, models and films.
    found.sort((a, b) => a.size - b.size);
    const [files, leftOut] = [[] as (File & { readonly modified: number })[], [] as string[]];
    let room = MOST;
    for (const file of found) {
      room -= file.size;
      if (room < 0) leftOut.push(file.name);
      else files.push({ name: file.name, content: new Uint8Array(await file.arrayBuffer()), modified: file.lastModified });
    }
    return { files, leftOut };
  }

  /** Returns the time at which each file was last modified. */
  async times(): Promise<Map<string, number>> {
    const times = new Map<string, number>();
    for await (const name of this.#handle?.keys() ?? []) {
      const time = isSkipped(name) ? null : await this.time(name);
      if (time !== null) times.set(name, time);
    }
    return times;
  }

  /** Returns the time at which a file was last modified; nothing if it is a folder, or is gone. */
  async time(name: string): Promise<number | null> {
    const handle = await this.#handle?.getFileHandle(name).catch(() => null);
    return (await handle?.getFile())?.lastModified ?? null;
  }

  async read(name: string): Promise<Uint8Array> {
    const file = await (await this.#handle?.getFileHandle(name))?.getFile();
    return new Uint8Array((await file?.arrayBuffer()) ?? new ArrayBuffer());
  }

  /** Writes files of different names at the same time, each whole or not at all. */
  async write(...files: readonly File[]): Promise<void> {
    const write = async ({ name, content }: File): Promise<void> => {
      const file = await this.#handle?.getFileHandle(name, { create: true });
      const stream = await file?.createWritable();
      await stream?.write(content as Uint8Array<ArrayBuffer>);
      await stream?.close();
    };
    await Promise.all(files.map(write));
  }
}

/** Returns the names of all projects. */
export async function projects(): Promise<string[]> {
  const names = [];
  for await (const [name, handle] of (await root())?.entries() ?? []) if (handle.kind === "directory") names.push(name);
  return names.sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
}

export async function remove(name: string): Promise<void> {
  await (await root())?.removeEntry(name, { recursive: true });
}

/** Opens the folder of a project, which may be new. */
export async function project(name: string): Promise<Folder> {
  return new Folder((await (await root())?.getDirectoryHandle(name, { create: true })) ?? null);
}

/** Keeps files as a project. Returns its name: this one, unless a project of this name has other files. */
export async function keep(name: string, files: readonly File[]): Promise<string> {
  const own = await nameFor(name, files);
  const folder = await project(own);
  await folder.write(...files);
  return own;
}

async function nameFor(name: string, files: readonly File[]): Promise<string> {
  const plain = name.replace(/[^\p{L}\p{N} ._-]/gu, "-").replace(/^\.+/, "").slice(0, 80) || "scene";
  const known = new Set(await projects());
  for (let number = 1; ; number += 1) {
    const own = number === 1 ? plain : `${plain}-${number}`;
    if (!known.has(own) || isSame((await (await project(own)).files()).files, files)) return own;
  }
}

function isSame(some: readonly File[], others: readonly File[]): boolean {
  const all = new Map(some.map(({ name, content }) => [name, content]));
  const isEqual = (a: Uint8Array | undefined, b: Uint8Array): boolean => a?.length === b.length && a.every((byte, at) => byte === b[at]);
  return some.length === others.length && others.every(({ name, content }) => isEqual(all.get(name), content));
}
