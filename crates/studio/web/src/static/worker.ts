// A worker of the page: it has the session, or it is one of those that draw and encode for it.

import { Session } from "./desk";
import type { ToDesk, ToWorker } from "./messages";
import { Fault, Module } from "./module";

let session: Session | null = null;
let module: Module | null = null;

const scope = globalThis as unknown as { postMessage: (message: unknown, transfer?: Transferable[]) => void };

/** Calls the module, and answers with the result, or with nothing if there is none. */
function serve(message: ToWorker): void {
  if (message.is === "start") {
    module = new Module(message.program);
    return;
  }
  try {
    const result = module?.call(message.what, message.number, message.bytes).slice() ?? new Uint8Array();
    if (message.answers) scope.postMessage({ result }, [result.buffer]);
  } catch (error) {
    if (message.answers) scope.postMessage({ why: error instanceof Error ? error.message : String(error), isFault: error instanceof Fault });
  }
}

addEventListener("message", ({ data }: MessageEvent<ToDesk | ToWorker>) => {
  if (typeof data === "string" || data.is === "open" || data.is === "ask") {
    session ??= new Session((message, transfer) => scope.postMessage(message, transfer));
    session.take(data);
  } else serve(data);
});
