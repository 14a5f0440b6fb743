// Files that the page hands to the user.

import { notice } from "../store";
import { get } from "./files";

export function save(content: Uint8Array<ArrayBuffer> | Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content]));
  link.download = name;
  link.click();
  // The browser has begun to read it by then.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Lets links to files of the studio work, as the program serves them. */
export function listenDownloads(): void {
  addEventListener(
    "click",
    (event) => {
      const link = (event.target as Element).closest("a[download]");
      const address = link?.getAttribute("href");
      if (!link || !address || /^\w+:/.test(address)) return;
      event.preventDefault();
      const name = link.getAttribute("download") ?? "";
      get(address).then(
        (content) => {
          if (content) save(content, name);
          else notice.value = `There is no ${name} to save.`;
        },
        (error: unknown) => (notice.value = `${name} cannot be saved: ${error instanceof Error ? error.message : String(error)}`),
      );
    },
    true,
  );
}
