// A worker that draws, encodes or draws frames for the session, one call after the other.
//
// The page starts it, not the session's worker: Firefox hangs now and then while a worker starts another one.

import type { Post, ToHelper } from "./messages";
import { Fault, type Program } from "./module";

interface Answer {
  readonly result?: Uint8Array;
  readonly why?: string;
  readonly isFault?: boolean;
}

let helpers = 0;

export class Helper {
  readonly #page: Post;
  readonly #number: number;
  readonly #port: MessagePort;
  readonly #waiting: { readonly done: (result: Uint8Array) => void; readonly failed: (error: Error) => void }[] = [];

  constructor(program: Program, page: Post) {
    helpers += 1;
    const { port1, port2 } = new MessageChannel();
    [this.#page, this.#number, this.#port] = [page, helpers, port1];
    port1.onmessage = ({ data }: MessageEvent<Answer>) => {
      const next = this.#waiting.shift();
      if (data.result) next?.done(data.result);
      else next?.failed(data.isFault ? new Fault(data.why) : new Error(data.why));
    };
    page({ is: "helper", number: this.#number, program, port: port2 }, [port2]);
  }

  /** Makes a call whose result is of no interest. */
  tell(what: number, bytes: Uint8Array): void {
    this.#post({ what, number: 0, bytes, answers: false });
  }

  call(what: number, number: number, bytes: Uint8Array): Promise<Uint8Array> {
    return new Promise((done, failed) => {
      this.#waiting.push({ done, failed });
      this.#post({ what, number, bytes, answers: true });
    });
  }

  end(): void {
    this.#port.close();
    this.#page({ is: "end", number: this.#number });
    for (const { failed } of this.#waiting.splice(0)) failed(new Error("cancelled"));
  }

  #post(call: ToHelper): void {
    this.#port.postMessage(call, [call.bytes.buffer as ArrayBuffer]);
  }
}
