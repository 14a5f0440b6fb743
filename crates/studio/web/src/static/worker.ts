// A worker of the page: it has the session, or it is one of those that draw and encode for it.

import { Session } from "./desk";
import type { Start, ToDesk, ToHelper } from "./messages";
import { Fault, Module } from "./module";

let session: Session | null = null;

const scope = globalThis as unknown as { postMessage: (message: unknown, transfer?: Transferable[]) => void };

/** Makes each call that comes through the port, and answers with the result, or with the error. */
function serve({ program, port }: Start): void {
  const module = new Module(program);
  port.onmessage = ({ data: { what, number, bytes, answers } }: MessageEvent<ToHelper>) => {
    try {
      const result = module.call(what, number, bytes).slice();
      if (answers) port.postMessage({ result }, [result.buffer]);
    } catch (error) {
      if (answers) port.postMessage({ why: error instanceof Error ? error.message : String(error), isFault: error instanceof Fault });
    }
  };
}

addEventListener("message", ({ data }: MessageEvent<ToDesk | Start>) => {
  if (typeof data !== "string" && data.is === "start") serve(data);
  else {
    session ??= new Session((message, transfer) => scope.postMessage(message, transfer));
    session.take(data);
  }
});
