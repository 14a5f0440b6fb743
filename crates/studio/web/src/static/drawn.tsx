// A small picture that the studio draws: the session's worker has it drawn.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";

import type { Drawing } from "../connection/listener";
import { get } from "./files";

export function Drawn({ src, alt = "", ...of }: Drawing): JSX.Element {
  const [shown, setShown] = useState("");
  useEffect(() => {
    let address = "";
    let isGone = false;
    if (src) {
      const found = get(src).catch(() => null);
      void found.then((content) => {
        if (!content || isGone) return;
        address = URL.createObjectURL(new Blob([content], { type: "image/png" }));
        setShown(address);
      });
    }
    return () => {
      isGone = true;
      URL.revokeObjectURL(address);
    };
  }, [src]);
  return <img alt={alt} src={shown || undefined} {...of} />;
}
