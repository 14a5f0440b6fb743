// The list of keys, and of what the pointer does.

import type { JSX } from "preact";

import { actions, type Action } from "../actions";
import { keyName } from "../parts/button";
import { help } from "../store";
import { tour } from "./tour";

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

const POINTER = [
  ["Move along the ground", "drag an object"],
  ["Move up and down", "Shift and drag"],
  ["Align with other objects, or move in steps", "Ctrl and drag"],
  ["Move all keys of the selection", "drag, then Alt"],
  ["Change a number", "drag across its field, finely with Shift"],
  ["Give up a drag", "Escape"],
  ["Rotate the view", "drag the background or the floor; Alt or the middle button, and drag; Alt and arrow keys"],
  ["Move the view", "right button, or Shift and the middle button, and drag; Alt+Shift and arrow keys"],
  ["Zoom in or out", "wheel; + and -"],
  ["Select several", "Shift and click; Ctrl+Shift and drag a box"],
  ["Copy, cut and paste objects or keys as text", "Ctrl+C, Ctrl+X, Ctrl+V"],
  ["Rename, in the list", "F2 or double click"],
  ["Change the order, in the list", "Alt with ↑ or ↓"],
  ["Go to another key, in the timeline", "arrow keys"],
  ["Move keys, in the timeline", "drag, or Alt with ← or →"],
  ["Select several keys, in the timeline", "Shift and click, or Ctrl+A"],
] as const;
