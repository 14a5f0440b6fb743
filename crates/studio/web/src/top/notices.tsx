// What the page must tell: lost connections, conflicts with other programs, and messages.

import type { JSX } from "preact";

import { openNew } from "#connection";

import { visible } from "../parts/visible";
import { ask, connected, files, notice, state } from "../store";

export function Notices(): JSX.Element {
  const now = state.value;
  const file = now ? files.value[now.file]?.name : "";
  return (
    <div class="notices" role="alert">
      {!connected.value && (
        <p>
          {openNew ? "The studio has stopped." : "The connection was lost."} <a href="">Open the page again</a>
          {openNew ? (
            <button type="button" onClick={openNew}>
              Open a new project
            </button>
          ) : (
            <>
              , if <code>rayfold studio</code> still runs.
            </>
          )}
        </p>
      )}
      {now?.saved === "conflict" && (
        <p>
          {visible(file ?? "")} was changed or deleted by another program meanwhile.{" "}
          <button type="button" onClick={() => ask({ ask: "resolve", "keep-mine": true })}>
            Keep what is here
          </button>
          <button type="button" onClick={() => ask({ ask: "resolve", "keep-mine": false })}>
            Take what is in the file
          </button>
        </p>
      )}
      {now?.failure && <p>{visible(now.failure)}. What you change stays here, and is written as soon as that is possible.</p>}
      {notice.value && (
        <p>
          {visible(notice.value)}{" "}
          <button type="button" onClick={() => (notice.value = "")}>
            Close
          </button>
        </p>
      )}
    </div>
  );
}
