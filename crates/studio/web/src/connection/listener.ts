// What the page needs of a studio: messages in order, each way. A program gives them by a socket, a worker by its own.

export interface Listener {
  readonly opened: () => void;
  /** Receives a message as JSON. */
  readonly told: (text: string) => void;
  /** Receives a picture as bytes with their header. */
  readonly shown: (picture: ArrayBuffer) => void;
  readonly closed: () => void;
}

/** Sends a message, unless the connection is closed. Returns whether it was sent. */
export type Send = (text: string) => boolean;

/** A small picture that the studio draws. */
export interface Drawing {
  readonly src: string | undefined;
  readonly alt?: string;
  readonly width?: number;
  readonly height?: number;
  readonly loading?: "lazy";
}
