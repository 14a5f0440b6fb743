// The fragment of the page's address: what is opened. Nothing of it goes over a network.
//
//   #project=NAME   a project that the browser keeps
//   #example=NAME   a copy of an example of the site
//   #scene=DATA     a project in the address itself (`link.ts`)
//   #folder         the folder on the disk that was chosen last
//   #submit, #runs, #run=NAME   the project that was opened last, and runs in the bucket (`../runs/runs.ts`)

import { chosenFolder } from "./disk";
import { unlinked } from "./link";
import type { Place } from "./messages";

const LAST = "rayfold-project";

export function addressOf(name: string): string {
  return `#project=${encodeURIComponent(name)}`;
}

/** Notes that a project is open: the address is its own, and it is opened next time. */
export function opened(name: string): void {
  localStorage.setItem(LAST, name);
  if (!/^#(tour$|submit$|runs$|run=)/.test(location.hash)) history.replaceState(null, "", addressOf(name));
}

/** Returns what the address names. */
export async function place(): Promise<Place> {
  const [, key, value] = /^#(\w+)=(.*)$/s.exec(location.hash) ?? [];
  if (key === "project" && value) return { is: "project", name: decodeURIComponent(value) };
  if (key === "example" && value) {
    const name = decodeURIComponent(value);
    return { is: "example", name, address: new URL(`examples/${encodeURIComponent(name)}.zip`, location.href).href };
  }
  if (key === "scene" && value) {
    const { name, files } = await unlinked(value);
    return { is: "files", name, files };
  }
  if (location.hash === "#folder") {
    const handle = await chosenFolder();
    if (handle) return { is: "folder", handle };
  }
  return { is: "project", name: localStorage.getItem(LAST) };
}
