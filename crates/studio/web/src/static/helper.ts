// A worker that the session's worker starts: it draws, encodes or draws frames, one call after the other.

import type { ToWorker } from "./messages";
import { Fault, type Program } from "./module";

interface Answer {
  readonly result?: Uint8Array;
  readonly why?: string;
  readonly isFault?: boolean;
}

export class Helper {
  readonly #worker: Worker;
  readonly #waiting: { readonly done: (result: Uint8Array) => void; readonly failed: (error: Error) => void }[] = [];

  constructor(program: Program) {
    // The program of this very worker.
    this.#worker = new Worker(self.location.href, { type: "module" });
    this.#worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      const next = this.#waiting.shift();
      if (data.result) next?.done(data.result);
      else next?.failed(data.isFault ? new Fault(data.why) : new Error(data.why));
    };
    this.#post({ is: "start", program });
  }

  /** Makes a call whose result is of no interest. */
  tell(what: number, bytes: Uint8Array): void {
    this.#post({ is: "call", what, number: 0, bytes, answers: false }, [bytes.buffer as ArrayBuffer]);
  }

  call(what: number, number: number, bytes: Uint8Array): Promise<Uint8Array> {
    return new Promise((done, failed) => {
      this.#waiting.push({ done, failed });
      this.#post({ is: "call", what, number, bytes, answers: true }, [bytes.buffer as ArrayBuffer]);
    });
  }

  end(): void {
    this.#worker.terminate();
    for (const { failed } of this.#waiting.splice(0)) failed(new Error("cancelled"));
  }

  #post(message: ToWorker, transfer: Transferable[] = []): void {
    this.#worker.postMessage(message, transfer);
  }
}
