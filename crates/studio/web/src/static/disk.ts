// A folder on the disk, where the browser has the File System Access API. Its handle outlives the page, which is loaded anew.

const MODE = { mode: "readwrite" } as const;

interface Picker {
  readonly showDirectoryPicker?: (options: typeof MODE) => Promise<FileSystemDirectoryHandle>;
}

interface Permission {
  readonly queryPermission: (of: typeof MODE) => Promise<string>;
  readonly requestPermission: (of: typeof MODE) => Promise<string>;
}

const permission = (handle: FileSystemDirectoryHandle): Permission => handle as unknown as Permission;

const picker = globalThis as unknown as Picker;
const [NAME, STORE, KEY] = ["rayfold", "handles", "folder"];

/** The address of the folder that was chosen last. */
export const FOLDER = "#folder";

export const hasDisk = picker.showDirectoryPicker !== undefined;

function inStore<T>(mode: IDBTransactionMode, act: (store: IDBObjectStore) => IDBRequest<T>): Promise<T> {
  return new Promise((done, failed) => {
    const opening = indexedDB.open(NAME, 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
    opening.onerror = () => failed(opening.error ?? new Error("no storage"));
    opening.onsuccess = () => {
      const asked = act(opening.result.transaction(STORE, mode).objectStore(STORE));
      asked.onsuccess = () => done(asked.result);
      asked.onerror = () => failed(asked.error ?? new Error("no storage"));
    };
  });
}

function open(): void {
  location.hash = FOLDER;
  location.reload();
}

/** Lets the user choose a folder, and opens it. Choosing none is no error. */
export async function openFolder(): Promise<void> {
  try {
    const handle = await picker.showDirectoryPicker?.(MODE);
    if (!handle) return;
    await inStore("readwrite", (store) => store.put(handle, KEY));
    open();
  } catch (error) {
    if (!(error instanceof DOMException && error.name === "AbortError")) throw error;
  }
}

/** Returns the folder that was chosen last, and whether it may be read and written. */
export async function chosenFolder(): Promise<{ readonly handle: FileSystemDirectoryHandle; readonly isOpen: boolean } | null> {
  const handle = await inStore<unknown>("readonly", (store) => store.get(KEY)).catch(() => null);
  if (!(handle instanceof FileSystemDirectoryHandle)) return null;
  return { handle, isOpen: (await permission(handle).queryPermission(MODE)) === "granted" };
}

/** Asks the user whether the folder that was chosen last may be used again, and opens it if so. */
export async function openAgain(handle: FileSystemDirectoryHandle): Promise<void> {
  if ((await permission(handle).requestPermission(MODE)) !== "granted") throw new Error(`the browser may not use the folder ${handle.name}`);
  open();
}
