// The fragment of the page's address: what is opened. Nothing of it goes over a network.
//
//   #project=NAME   a project that the browser keeps
//   #example=NAME   a copy of an example of the site
//   #scene=DATA     a project in the address itself (`link.ts`)
//   #new            a new project
//   #folder         the folder on the disk that was chosen last
//   #submit, #runs, #run=NAME   what was opened last, and runs in the bucket (`../runs/runs.ts`)

import { notice } from "../store";
import { chosenFolder, FOLDER } from "./disk";
import { unlinked } from "./link";
import type { Place } from "./messages";
import { isPlain } from "./projects";

export const NEW = "#new";

const LAST = "rayfold-project";

export function addressOf(name: string): string {
  return `#project=${encodeURIComponent(name)}`;
}

/** Notes what is open: the address is its own, and it is opened next time; first in this tab, then in others. */
export function opened(address: string): void {
  sessionStorage.setItem(LAST, address);
  localStorage.setItem(LAST, address);
  if (!/^#(tour$|submit$|runs$|run=)/.test(location.hash)) history.replaceState(null, "", address);
}

/** Returns what the address names, or else what was open last. */
export async function place(): Promise<Place> {
  return (await placeOf(location.hash)) ?? (await placeOf(sessionStorage.getItem(LAST) ?? localStorage.getItem(LAST) ?? "")) ?? { is: "project", name: null };
}

function decoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    throw new Error("the address is damaged");
  }
}

async function placeOf(hash: string): Promise<Place | null> {
  const [, key, value] = /^#(\w+)=(.*)$/s.exec(hash) ?? [];
  if (hash === NEW) return { is: "files", name: "scene", files: [] };
  if (key === "project" && value) {
    const name = decoded(value);
    if (!isPlain(name)) throw new Error(`${name} is no name of a project`);
    return { is: "project", name };
  }
  if (key === "example" && value) {
    const name = decoded(value);
    return { is: "example", name, address: new URL(`examples/${encodeURIComponent(name)}.zip`, location.href).href };
  }
  if (key === "scene" && value) {
    const { name, files } = await unlinked(value);
    const leftOut = files.filter((file) => !isPlain(file.name)).map((file) => file.name);
    if (leftOut.length > 0) notice.value = `The link has files that are left out, because their names are none of a folder: ${leftOut.join(", ")}`;
    return { is: "files", name, files: files.filter((file) => isPlain(file.name)) };
  }
  if (hash !== FOLDER) return null;
  const chosen = await chosenFolder();
  if (chosen?.isOpen) return { is: "folder", handle: chosen.handle };
  notice.value = chosen ? `The browser asks again before the folder ${chosen.handle.name} is used: open it again in the dialog File.` : "No folder was chosen in this browser.";
  return null;
}
