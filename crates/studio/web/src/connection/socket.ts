// The connection to the program that serves the page: its socket, and its files by their addresses.

import type { Listener, Send } from "./listener";

/** Leaves what is open for a new project. The program has one project. */
export const openNew: (() => void) | null = null;

/** The address of the start page, if the studio was opened from it. */
export const startPage: string | null = globalThis.location?.search === "?start" ? "start" : null;

export function open({ opened, told, shown, closed }: Listener): Send {
  const address = new URL("socket", location.href);
  address.protocol = "ws:";
  const socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = opened;
  socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => (typeof data === "string" ? told(data) : shown(data));
  socket.onclose = closed;
  return (text) => socket.readyState === WebSocket.OPEN && (socket.send(text), true);
}
