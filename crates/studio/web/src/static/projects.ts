// The projects that the browser keeps in its own storage, each a folder of files. Without such a storage, as in some
// private windows, they last as long as the page.

import type { File } from "./module";

const ROOT = "projects";

async function root(): Promise<FileSystemDirectoryHandle | null> {
  try {
    const all = await navigator.storage.getDirectory();
    return await all.getDirectoryHandle(ROOT, { create: true });
  } catch {
    return null;
  }
}

/** A folder of files, in the browser's storage or on the disk. */
export class Folder {
  readonly #handle: FileSystemDirectoryHandle | null;
  /** The writing in progress: one after the other, so that the last content stays. */
  #writing: Promise<void> = Promise.resolve();

  constructor(handle: FileSystemDirectoryHandle | null) {
    this.#handle = handle;
  }

  /** Whether files are kept here. */
  get isKept(): boolean {
    return this.#handle !== null;
  }

  async files(): Promise<(File & { readonly modified: number })[]> {
    const files = [];
    for await (const [name, handle] of this.#handle?.entries() ?? []) {
      if (handle.kind !== "file") continue;
      const file = await (handle as FileSystemFileHandle).getFile();
      files.push({ name, content: new Uint8Array(await file.arrayBuffer()), modified: file.lastModified });
    }
    return files;
  }

  /** Returns the time at which each file was last modified. */
  async times(): Promise<Map<string, number>> {
    const times = new Map<string, number>();
    for await (const [name, handle] of this.#handle?.entries() ?? []) {
      if (handle.kind === "file") times.set(name, (await (handle as FileSystemFileHandle).getFile()).lastModified);
    }
    return times;
  }

  async read(name: string): Promise<Uint8Array> {
    const file = await (await this.#handle?.getFileHandle(name))?.getFile();
    return new Uint8Array((await file?.arrayBuffer()) ?? new ArrayBuffer());
  }

  /** Writes files of different names at the same time, each whole or not at all. */
  write(...files: readonly File[]): Promise<void> {
    const handle = this.#handle;
    const write = async ({ name, content }: File): Promise<void> => {
      const file = await handle?.getFileHandle(name, { create: true });
      const stream = await file?.createWritable();
      await stream?.write(content as Uint8Array<ArrayBuffer>);
      await stream?.close();
    };
    const written = this.#writing.then(async () => void (await Promise.all(files.map(write))));
    this.#writing = written.catch(() => undefined);
    return written;
  }

  /** Waits until everything is written. */
  settle(): Promise<void> {
    return this.#writing;
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
    if (!known.has(own) || isSame(await (await project(own)).files(), files)) return own;
  }
}

function isSame(some: readonly File[], others: readonly File[]): boolean {
  const all = new Map(some.map(({ name, content }) => [name, content]));
  const isEqual = (a: Uint8Array | undefined, b: Uint8Array): boolean => a?.length === b.length && a.every((byte, at) => byte === b[at]);
  return some.length === others.length && others.every(({ name, content }) => isEqual(all.get(name), content));
}
