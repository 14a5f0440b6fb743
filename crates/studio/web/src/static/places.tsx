// Where projects come from and go to: the browser's storage, zip files, links, folders on the disk.

import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";

import { notice } from "../store";
import { visible } from "../parts/visible";
import { addressOf, NEW } from "./address";
import { addFiles, importProject, ownFiles, project, projects, removeProject, unzip, write, zip } from "./connection";
import { chosenFolder, hasDisk, openAgain, openFolder } from "./disk";
import { linked } from "./link";
import { textOf, type File } from "./module";
import { save } from "./save";

const names = signal<readonly string[]>([]);

/** A folder of the disk that was chosen before, and may be used again if the user agrees. */
const before = signal<FileSystemDirectoryHandle | null>(null);

const failed = (error: unknown): void => {
  notice.value = error instanceof Error ? error.message : String(error);
};

/** Opens what an address names, once everything here is written. */
async function go(address: string): Promise<void> {
  await write();
  location.hash = address;
  location.reload();
}

async function openFiles(chosen: FileList | null): Promise<void> {
  const files: File[] = [];
  let name = "";
  for (const file of chosen ?? []) {
    const content = new Uint8Array(await file.arrayBuffer());
    name ||= file.name.replace(/\.(zip|txt)$/i, "");
    if (!/\.zip$/i.test(file.name)) files.push({ name: file.name, content });
    else {
      const [leftOut, ...held] = (await unzip(content)) ?? [];
      if (leftOut?.content.length && !confirm(`Files in folders of ${file.name} are left out: ${textOf(leftOut.content)}`)) return;
      files.push(...held);
    }
  }
  if (files.length === 0) return;
  const own = await importProject(name, files);
  if (own) await go(addressOf(own));
}

/** Puts files into the project that is open. */
async function add(chosen: FileList | null): Promise<void> {
  const files = await Promise.all(Array.from(chosen ?? [], async (file): Promise<File> => ({ name: file.name, content: new Uint8Array(await file.arrayBuffer()) })));
  const known = new Set((await ownFiles()).map(({ name }) => name));
  const replaced = files.filter(({ name }) => known.has(name)).map(({ name }) => name);
  if (replaced.length > 0 && !confirm(`Replace ${replaced.join(", ")}?`)) return;
  if (await addFiles(files)) location.reload();
  else notice.value = `${files.map(({ name }) => name).join(", ")} can be named by the scripts of the project.`;
}

async function share(): Promise<void> {
  const [, ...files] = await ownFiles();
  const fragment = await linked(project.value, files);
  if (!fragment) {
    notice.value = "The project is too large for a link: save it as a zip file.";
    return;
  }
  const link = new URL(fragment, location.href).href;
  await navigator.clipboard.writeText(link).then(
    () => (notice.value = `The link is on the clipboard: ${Math.ceil(link.length / 1000)} kB. It holds the whole project.`),
    // Without a clipboard, the address bar has it.
    () => history.replaceState(null, "", fragment),
  );
}

async function saveZip(): Promise<void> {
  const content = await zip();
  if (content) save(content, `${project.value}.zip`);
}

export function Places(): JSX.Element {
  useEffect(() => {
    void projects().then((found) => (names.value = found));
    if (hasDisk) void chosenFolder().then((chosen) => (before.value = chosen && !chosen.isOpen ? chosen.handle : null));
  }, []);
  const asked = before.value;
  const others = names.value.filter((name) => name !== project.value);
  return (
    <section class="places" aria-label="Projects">
      <h3>Projects of this browser</h3>
      {others.length > 0 && (
        <ul>
          {others.map((name) => (
            <li key={name}>
              <a
                href={addressOf(name)}
                onClick={(event) => {
                  event.preventDefault();
                  void go(addressOf(name));
                }}
              >
                {visible(name)}
              </a>{" "}
              <button
                type="button"
                aria-label={`Delete the project ${name}`}
                onClick={() => confirm(`Delete the project ${name}?`) && void removeProject(name).then(projects).then((found) => (names.value = found))}
              >
                Delete
              </button>
            </li>
          ))}
        </ul>
      )}
      <div class="buttons">
        <label>
          Open a zip file, or scripts and their files:{" "}
          <input type="file" multiple aria-label="Open a project" onChange={(event) => void openFiles(event.currentTarget.files).catch(failed)} />
        </label>
      </div>
      <div class="buttons">
        <label>
          Add scripts, models and pictures to {visible(project.value)}:{" "}
          <input type="file" multiple aria-label="Add files" onChange={(event) => void add(event.currentTarget.files).catch(failed)} />
        </label>
      </div>
      <div class="buttons">
        <button type="button" onClick={() => void go(NEW)}>
          New project
        </button>
        <button type="button" onClick={() => void saveZip()}>
          Save as zip
        </button>
        <button type="button" onClick={() => void share()}>
          Copy a link
        </button>
        {hasDisk && (
          <button type="button" onClick={() => void write().then(openFolder).catch(failed)}>
            Open a folder
          </button>
        )}
        {asked && (
          <button type="button" onClick={() => void openAgain(asked).catch(failed)}>
            Open the folder {visible(asked.name)} again
          </button>
        )}
      </div>
      {notice.value && <p role="status">{visible(notice.value)}</p>}
    </section>
  );
}
