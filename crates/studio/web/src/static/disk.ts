// A folder on the disk, where the browser has the File System Access API. Its handle outlives the page, which is loaded anew.

interface Picker {
  readonly showDirectoryPicker?: (options: { readonly mode: "readwrite" }) => Promise<FileSystemDirectoryHandle>;
}

interface Permission {
  readonly queryPermission: (of: { readonly mode: "readwrite" }) => Promise<string>;
}

const picker = globalThis as unknown as Picker;
const [NAME, STORE, KEY] = ["rayfold", "handles", "folder"];

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

/** Lets the user choose a folder, and opens it. */
export async function openFolder(): Promise<void> {
  const handle = await picker.showDirectoryPicker?.({ mode: "readwrite" });
  if (!handle) return;
  await inStore("readwrite", (store) => store.put(handle, KEY));
  location.hash = "#folder";
  location.reload();
}

/** Returns the folder that was chosen last, if it may still be read and written. */
export async function chosenFolder(): Promise<FileSystemDirectoryHandle | null> {
  const handle = await inStore<unknown>("readonly", (store) => store.get(KEY));
  if (!(handle instanceof FileSystemDirectoryHandle)) return null;
  const may = await (handle as unknown as Permission).queryPermission({ mode: "readwrite" });
  return may === "granted" ? handle : null;
}
