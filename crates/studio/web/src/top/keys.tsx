// The list of keys, and of what the pointer does, by the part of the page that they are for.

import type { JSX } from "preact";

import { actions, type Action } from "../actions";
import { keyName } from "../parts/button";
import { help } from "../store";
import { tour } from "./tour";

export function Keys(): JSX.Element | null {
  if (!help.value) return null;
  const everywhere = Object.values<Action>(actions).filter(({ keys }) => keys.length > 0);
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
      <div class="sections">
        <Section title="In the picture, and everywhere" rows={everywhere.map(({ title, keys }) => [title, keys.map(keyName)])} />
        {Object.entries(PARTS).map(([title, rows]) => (
          <Section key={title} title={title} rows={rows.map(([what, how]) => [what, how.split(" | ")])} />
        ))}
      </div>
      <form method="dialog" class="buttons">
        <button
          type="button"
          onClick={(event) => {
            // At once, so that the next key is the tour's.
            event.currentTarget.closest("dialog")?.close();
            tour.value = 0;
          }}
        >
          Tour
        </button>
        <button>Close</button>
      </form>
    </dialog>
  );
}

function Section({ title, rows }: { readonly title: string; readonly rows: readonly (readonly [string, readonly string[]])[] }): JSX.Element {
  return (
    <table>
      <caption>{title}</caption>
      <tbody>
        {rows.map(([what, keys]) => (
          <tr key={what}>
            <th scope="row">{what}</th>
            <td>
              {keys.map((key) => (
                <kbd key={key}>{key}</kbd>
              ))}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** For each part, the keys and the uses of the pointer that are no actions. */
const PARTS: Readonly<Record<string, readonly (readonly [string, string])[]>> = {
  "The pointer, in the picture": [
    ["Move along the ground", "drag"],
    ["Move up and down", "Shift drag"],
    ["Align with others, or move in steps", "Ctrl drag"],
    ["Move all keys of the selection", "drag, then Alt"],
    ["Give up a drag", "Escape"],
    ["Select several", "Shift click | Ctrl+Shift drag"],
    ["Rotate the view", "drag beside objects | Alt drag | middle drag | Alt+arrow"],
    ["Move the view", "right drag | Shift middle drag | Alt+Shift+arrow"],
    ["Zoom", "wheel | + | -"],
    ["Move a handle that has the focus", "arrow"],
  ],
  Objects: [
    ["Copy, cut and paste as text", "Ctrl+C | Ctrl+X | Ctrl+V"],
    ["Another object, in the list", "↑ | ↓ | Home | End"],
    ["Select several, in the list", "Shift click | Ctrl click | Shift+↑ | Shift+↓"],
    ["Rename, in the list", "F2 | Enter | double click"],
  ],
  Numbers: [
    ["Change", "drag across | Shift drag"],
    ["One step, or ten", "↑ | ↓ | Shift+↑ | Shift+↓"],
    ["Take what is typed, or take it back", "Enter | Escape"],
    ["Take the words of a text", "Ctrl+Enter"],
  ],
  "The timeline": [
    ["Another key", "← | → | ↑ | ↓"],
    ["Move keys", "drag | Alt+← | Alt+→"],
    ["Move keys by ten frames", "Alt+Shift+← | Alt+Shift+→"],
    ["Change values, in the curves", "drag | Alt+↑ | Alt+↓"],
    ["Zoom, or move the values, in the curves", "wheel | Shift wheel"],
    ["Select several keys", "Shift click | Shift+→ | Ctrl+A"],
    ["Copy and paste keys", "Ctrl+C | Ctrl+V"],
  ],
  "The script": [
    ["Complete a word", "Tab | Ctrl+Space"],
    ["Find and replace", "Ctrl+F"],
    ["The next match, or the one before", "F3 | Shift+F3"],
    ["Go to a line", "Ctrl+G"],
    ["The next error", "F8"],
    ["Comment lines, or take it back", "Ctrl+/"],
    ["Move lines", "Alt+↑ | Alt+↓"],
    ["Copy lines", "Alt+Shift+↑ | Alt+Shift+↓"],
    ["Delete lines", "Ctrl+Shift+K"],
    ["Another caret", "Ctrl+Alt+↑ | Ctrl+Alt+↓"],
    ["Select the next equal text, or all", "Ctrl+D | Ctrl+Shift+L"],
    ["Select a rectangle", "Alt drag"],
  ],
  Panels: [["Change the size, on the line between two", "arrow | double click"]],
};
