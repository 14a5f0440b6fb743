// Runs in a bucket, as the program that serves the page knows them.

import type { RunUpdate } from "../protocol";

/** An answer about runs, as JSON. Without `ok` it is a refusal, or the reason of a failure as text. */
export interface Answer {
  readonly ok: boolean;
  readonly text: string;
}

export async function ask(what: string, body?: object): Promise<Answer> {
  const sent = body === undefined ? {} : { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  try {
    const answer = await fetch(what, sent);
    return { ok: answer.ok, text: await answer.text() };
  } catch {
    return { ok: false, text: "the studio does not answer: does it still run?" };
  }
}

/** Hears the state of a run at an address, and each change of it, until the returned function is called. */
export function watch(address: string, hear: (update: RunUpdate) => void): () => void {
  // The browser reconnects automatically, and then receives all frames.
  const source = new EventSource(address);
  source.onmessage = (message: MessageEvent<string>) => hear(JSON.parse(message.data) as RunUpdate);
  return () => source.close();
}
