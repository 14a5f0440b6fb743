// A zip file of pictures, whose bytes the browser keeps: it may hold what a page has no memory for.

/** The format has 32 bits for a place, and 16 for the number of files. */
const [MOST_BYTES, MOST_FILES] = [2 ** 32 - 1, 2 ** 16 - 1] as const;

const CRC = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

function checksum(bytes: Uint8Array): number {
  let crc = -1;
  for (const byte of bytes) crc = (crc >>> 8) ^ (CRC[(crc ^ byte) & 255] ?? 0);
  return ~crc >>> 0;
}

/** Numbers of so many bytes each, the lowest byte first. */
function numbers(...fields: readonly (readonly [bytes: number, value: number])[]): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(fields.flatMap(([bytes, value]) => Array.from({ length: bytes }, (_, at) => (value >>> (8 * at)) & 255)));
}

export class Zip {
  readonly #files: Blob[] = [];
  /** What the end of the archive says of each file. */
  readonly #directory: BlobPart[] = [];
  #size = 0;

  /** Adds a file, uncompressed. Its name is in ASCII. */
  add(name: string, bytes: Uint8Array<ArrayBuffer>): void {
    const at = this.#size;
    if (at + bytes.length > MOST_BYTES || this.#files.length === MOST_FILES) {
      throw new Error("the frames are too many for a zip file of the browser: `rayfold fetch` writes them to files");
    }
    // The version that reads it, flags, method, time, and a date: the first of 1980.
    const head = [[2, 10], [2, 0], [2, 0], [2, 0], [2, 33], [4, checksum(bytes)], [4, bytes.length], [4, bytes.length], [2, name.length], [2, 0]] as const;
    const file = new Blob([numbers([4, 0x04034b50], ...head), name, bytes]);
    this.#files.push(file);
    this.#directory.push(numbers([4, 0x02014b50], [2, 10], ...head, [2, 0], [2, 0], [2, 0], [4, 0], [4, at]), name);
    this.#size += file.size;
  }

  finish(): Blob {
    const directory = new Blob(this.#directory);
    const count = this.#files.length;
    const end = numbers([4, 0x06054b50], [2, 0], [2, 0], [2, count], [2, count], [4, directory.size], [4, this.#size], [2, 0]);
    return new Blob([...this.#files, directory, end]);
  }
}
