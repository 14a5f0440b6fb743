// The parts around the panels: the bar, the palette, the output, and notices.

import type { JSX } from "preact";

import { actions, type Action } from "./actions";
import { Button, keyName } from "./button";
import { filing } from "./file";
import { ask, connected, files, help, notice, output, state, tables } from "./store";

const SAVED = { yes: "saved", soon: "saving", conflict: "not saved", failed: "cannot be saved" } as const;

export function Bar(): JSX.Element {
  const now = state.value;
  const file = now ? files.value[now.file] : undefined;
  return (
    <header class="bar">
      <h1>{now?.title ?? "rayfold studio"}</h1>
      <span class="file">
        {file?.name} <span class={`saved ${now?.saved ?? ""}`} role="status">{now ? SAVED[now.saved] : ""}</span>
      </span>
      <button type="button" onClick={() => (filing.value = true)}>
        File
      </button>
      <nav aria-label="Edit">
        <Button action={actions.undo} />
        <Button action={actions.redo} />
      </nav>
      <nav aria-label="View">
        <Button action={actions.script} label="Camera" />
        <Button action={actions.lookFront} label="Front" />
        <Button action={actions.lookSide} label="Side" />
        <Button action={actions.lookTop} label="Top" />
        <Button action={actions.frame} label="Selection" />
        <Button action={actions.keepCamera} label="Keep this view" />
      </nav>
      <span class="gap" />
      <Result />
      <button type="button" title="Light or dark" onClick={theme}>
        Light or dark
      </button>
      <Button action={actions.help} label="Keys" />
    </header>
  );
}

function theme(): void {
  const dark = getComputedStyle(document.documentElement).colorScheme.trim() === "dark";
  const isDark = dark || (document.documentElement.style.colorScheme === "" && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.style.colorScheme = isDark ? "light" : "dark";
}

function Result(): JSX.Element {
  const now = output.value;
  const frame = state.value?.frame ?? 0;
  return (
    <div class="result" role="group" aria-label="Output">
      {now?.is === "running" ? (
        <>
          <progress value={now.done} max={now.of} aria-label="Frames drawn" /> {now.done} of {now.of}
          <button type="button" onClick={() => ask({ ask: "cancel" })}>
            Cancel
          </button>
        </>
      ) : (
        <button type="button" class="main" onClick={() => ask({ ask: "render" })}>
          Render GIF
        </button>
      )}
      {now?.is === "done" && (
        <a class="button" href="animation.gif" download={`${state.value?.title.replace(/\.txt$/, "") ?? "animation"}.gif`}>
          Download GIF ({Math.max(1, Math.round(now.bytes / 1000))} kB)
        </a>
      )}
      {now?.is === "failed" && <span class="failed">{now.why}</span>}
      {now?.is === "cancelled" && <span>cancelled</span>}
      <a class="button" href={`frame.png?${frame}`} download={`frame${frame + 1}.png`}>
        Frame
      </a>
      <a class="button" href="frames.zip" download="frames.zip" title="All frames, as PNG in a zip file">
        Frames
      </a>
      <a class="button" href="scripts.zip" download="scripts.zip">
        Scripts
      </a>
      <a class="button" href="#submit">
        Submit
      </a>
      <a class="button" href="#runs">
        Runs
      </a>
    </div>
  );
}

export function Palette(): JSX.Element {
  return (
    <section class="panel palette" aria-labelledby="palette-title">
      <h2 id="palette-title">Add</h2>
      <div class="buttons">
        {tables.value
          .filter((table) => table.role === "object" || table.role === "light" || table.name === "Camera")
          .map((table) => (
            <button
              type="button"
              key={table.name}
              class={table.role}
              draggable
              title={
                table.role === "camera"
                  ? "The script's camera: click to use the current view, or drag it onto the object that it should look at"
                  : `${table.name}: click, or drag it into the picture`
              }
              onDragStart={(event) => event.dataTransfer?.setData("text/plain", table.name)}
              onClick={() => ask({ ask: "add", command: table.name, at: null })}
            >
              {table.role === "camera" ? "Camera here" : table.name}
            </button>
          ))}
      </div>
    </section>
  );
}

export function Notices(): JSX.Element {
  const now = state.value;
  const file = now ? files.value[now.file]?.name : "";
  return (
    <div class="notices" role="alert">
      {!connected.value && (
        <p>
          The connection was lost. <a href="">Open the page again</a>, if <code>rayfold studio</code> still runs.
        </p>
      )}
      {now?.saved === "conflict" && (
        <p>
          {file} was changed or deleted by another program meanwhile.{" "}
          <button type="button" onClick={() => ask({ ask: "resolve", "keep-mine": true })}>
            Keep what is here
          </button>
          <button type="button" onClick={() => ask({ ask: "resolve", "keep-mine": false })}>
            Take what is in the file
          </button>
        </p>
      )}
      {now?.failure && <p>{now.failure}. What you change stays here, and is written as soon as that is possible.</p>}
      {notice.value && (
        <p>
          {notice.value}{" "}
          <button type="button" onClick={() => (notice.value = "")}>
            Close
          </button>
        </p>
      )}
    </div>
  );
}

export function Keys(): JSX.Element | null {
  if (!help.value) return null;
  return (
    <dialog
      class="keys"
      aria-labelledby="keys-title"
      ref={(dialog) => {
        if (!dialog || dialog.open) return;
        dialog.showModal();
        // The focus goes to the button at its end.
        dialog.scrollTop = 0;
      }}
      onClose={() => (help.value = false)}
    >
      <h2 id="keys-title">Keys</h2>
      <table>
        <tbody>
          {Object.values<Action>(actions).map((action) => (
            <tr key={action.title}>
              <th scope="row">{action.title}</th>
              <td>
                {action.keys.map((key) => (
                  <kbd key={key}>{keyName(key)}</kbd>
                ))}
              </td>
            </tr>
          ))}
          {POINTER.map(([what, how]) => (
            <tr key={what}>
              <th scope="row">{what}</th>
              <td>{how}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <form method="dialog">
        <button>Close</button>
      </form>
    </dialog>
  );
}

const POINTER = [
  ["Move along the ground", "drag an object"],
  ["Move up and down", "Shift and drag"],
  ["Move in steps", "Ctrl and drag"],
  ["Move all keys of the selection", "Alt and drag"],
  ["Rotate the view", "drag the background"],
  ["Move the view", "drag with the right button"],
  ["Zoom in or out", "wheel"],
  ["Select several", "Shift and click"],
  ["Rename, in the list", "F2 or double click"],
  ["Change the order, in the list", "Alt with ↑ or ↓"],
  ["Go to another key, in the timeline", "arrow keys"],
  ["Move keys, in the timeline", "drag, or Alt with ← or →"],
  ["Select several keys, in the timeline", "Shift and click, or Ctrl+A"],
] as const;
