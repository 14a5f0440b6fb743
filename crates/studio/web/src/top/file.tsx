// Loading another text and saving a copy: examples, an empty scene, or a chosen file. The text replaces the shown script
// or becomes a new script of the folder.

import { signal } from "@preact/signals";
import type { ComponentChildren, JSX } from "preact";

import { visible } from "../parts/visible";
import type { Source } from "../protocol";
import { ask, canCreate, examples, files, notice, state } from "../store";

/** The largest file in bytes that can be opened: it must fit into one message to the server. */
const MOST = 1 << 20;

/** Whether the dialog is open. */
export const filing = signal(false);

const chosen = signal("shown");
const text = signal<{ readonly name: string; readonly text: string } | null>(null);
const name = signal("");

function source(): Source | null {
  if (chosen.value === "shown") return { what: "shown" };
  if (chosen.value === "empty") return { what: "empty" };
  if (chosen.value === "file") return text.value && { what: "text", text: text.value.text };
  return { what: "example", name: chosen.value };
}

function load(as: string | null): void {
  const from = source();
  if (!from) {
    notice.value = "Choose a file first.";
    return;
  }
  ask({ ask: "load", from, new: as });
  filing.value = false;
}

async function choose(file: File | undefined): Promise<void> {
  if (!file) return;
  if (file.size > MOST) {
    notice.value = `${file.name} is larger than 1 MiB: name it when you start rayfold studio.`;
    return;
  }
  text.value = { name: file.name, text: await file.text() };
  chosen.value = "file";
  name.value = file.name;
}

export function FileDialog({ places }: { readonly places?: ComponentChildren }): JSX.Element | null {
  if (!filing.value) return null;
  const now = state.value;
  const shown = files.value[now?.file ?? 0]?.name ?? "";
  const option = (value: string, label: string): JSX.Element => (
    <label class="choice">
      <input type="radio" name="source" value={value} checked={chosen.value === value} onChange={() => (chosen.value = value)} /> {label}
    </label>
  );
  return (
    <dialog
      class="file-dialog"
      aria-labelledby="file-title"
      ref={(dialog) => {
        if (dialog && !dialog.open) dialog.showModal();
      }}
      onClose={() => (filing.value = false)}
    >
      <h2 id="file-title">Open, new, save as</h2>
      <fieldset>
        <legend>Which text</legend>
        {option("shown", `${visible(shown)}, as it stands`)}
        {option("empty", "An empty scene")}
        {examples.value.map((example) => option(example, `Example: ${example}`))}
        {option("file", text.value ? `Your file ${visible(text.value.name)}` : "A file on this computer")}
        <input type="file" accept=".txt,text/plain" aria-label="Choose a file" onChange={(event) => void choose(event.currentTarget.files?.[0])} />
      </fieldset>
      <div class="buttons">
        <button type="button" class="main" disabled={chosen.value === "shown"} onClick={() => load(null)}>
          Replace {visible(shown)}
        </button>
        <span class="note">Undo restores the previous text.</span>
      </div>
      {canCreate.value ? (
        <form
          class="buttons"
          onSubmit={(event) => {
            event.preventDefault();
            load(name.value.endsWith(".txt") ? name.value : `${name.value}.txt`);
          }}
        >
          <label>
            New script of the folder: <input class="rename" value={name.value} onInput={(event) => (name.value = event.currentTarget.value)} />
          </label>
          <button disabled={name.value === ""}>Save as</button>
        </form>
      ) : (
        <p class="note">The studio was opened with a single script; open a folder to add scripts.</p>
      )}
      {places}
      <div class="buttons">
        <a class="button" href={`script.txt?${now?.file ?? 0}`} download={shown}>
          Download {visible(shown)}
        </a>
        <span class="gap" />
        <button type="button" onClick={() => (filing.value = false)}>
          Close
        </button>
      </div>
    </dialog>
  );
}
