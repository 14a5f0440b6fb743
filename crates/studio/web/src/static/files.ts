// Files of the studio by their addresses, as the program serves them: those of runs are in the bucket, others are made here.

import * as studio from "./connection";
import * as runs from "./stack/runs";

export const get = (address: string): Promise<Uint8Array<ArrayBuffer> | Blob | null> =>
  address.startsWith("runs/") ? runs.get(address) : studio.get(address);
