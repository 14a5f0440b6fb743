// A project in an address: its files, compressed, in letters that an address may have.

import { packed, unpacked, type File } from "./module";

/** The longest link, in letters. Browsers and programs for messages cut longer ones. */
const LONGEST = 1_000_000;

/** The most bytes that a link may unpack to. */
const MOST = 64 << 20;

async function through(bytes: Uint8Array, stream: CompressionStream | DecompressionStream): Promise<Uint8Array> {
  const parts: Uint8Array[] = [];
  let length = 0;
  const reader = new Blob([bytes as Uint8Array<ArrayBuffer>]).stream().pipeThrough(stream).getReader();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    length += value.length;
    if (length > MOST) throw new Error("the link holds too much");
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts as Uint8Array<ArrayBuffer>[]).arrayBuffer());
}

/** Returns the fragment of a link to these files, or `null` if it would be too long. */
export async function linked(name: string, files: readonly File[]): Promise<string | null> {
  const bytes = await through(packed([{ name, content: new Uint8Array() }, ...files]), new CompressionStream("deflate-raw"));
  let text = "";
  // Not all at once: a call has only so many arguments.
  for (let at = 0; at < bytes.length; at += 1 << 14) text += String.fromCharCode(...bytes.subarray(at, at + (1 << 14)));
  const data = btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  return data.length > LONGEST ? null : `#scene=${data}`;
}

/** Returns the project of a link. */
export async function unlinked(data: string): Promise<{ readonly name: string; readonly files: readonly File[] }> {
  try {
    const text = atob(data.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = await through(Uint8Array.from(text, (letter) => letter.charCodeAt(0)), new DecompressionStream("deflate-raw"));
    const [project, ...files] = unpacked(bytes);
    if (!project) throw new Error("it is empty");
    return { name: project.name, files };
  } catch (error) {
    throw new Error(`the link is damaged or cut off (${error instanceof Error ? error.message : String(error)})`, { cause: error });
  }
}
