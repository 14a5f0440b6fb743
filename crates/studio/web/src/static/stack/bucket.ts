// The bucket, as the person who has signed in sees it.

import { encoded, signed, type Request } from "./sign";
import { person } from "./person";
import type { Stack } from "./stack";

export interface Listed {
  readonly key: string;
  readonly etag: string;
  readonly size: number;
}

const etagOf = (text: string | null | undefined): string => (text ?? "").replace(/"/g, "");

export class Bucket {
  readonly #stack: Stack;

  constructor(stack: Stack) {
    this.#stack = stack;
  }

  /** Returns the name of the person's folder. */
  async folder(): Promise<string> {
    return (await person(this.#stack)).identity;
  }

  async #send(method: Request["method"], key: string, query = "", body?: Uint8Array<ArrayBuffer>): Promise<Response> {
    const { keys } = await person(this.#stack);
    const url = new URL(`${this.#stack.endpoint}/${key.split("/").map(encoded).join("/")}${query}`);
    const headers = await signed({ method, url, ...(body && { body }) }, keys, this.#stack.region);
    let answer: Response;
    try {
      answer = await fetch(url, { method, headers, cache: "no-store", ...(body && { body }) });
    } catch {
      throw new Error("the bucket does not answer");
    }
    return answer;
  }

  /** Returns an answer, or nothing for an object that is not there. What is absent and what belongs to others is answered alike. */
  async #found(method: "GET" | "HEAD", key: string): Promise<Response | null> {
    const answer = await this.#send(method, key);
    if (answer.ok) return answer;
    if (answer.status === 404 || answer.status === 403) return null;
    throw new Error(`the bucket refuses ${key} (${answer.status})`);
  }

  async get(key: string): Promise<Uint8Array<ArrayBuffer> | null> {
    const answer = await this.#found("GET", key);
    return answer && new Uint8Array(await answer.arrayBuffer());
  }

  /** Returns the version and the size of an object, and the generation of an output. */
  async head(key: string): Promise<{ readonly etag: string; readonly size: number; readonly generation: string | null } | null> {
    const answer = await this.#found("HEAD", key);
    if (!answer) return null;
    const { headers } = answer;
    return { etag: etagOf(headers.get("etag")), size: Number(headers.get("content-length")), generation: headers.get("x-amz-meta-generation") };
  }

  async put(key: string, content: Uint8Array<ArrayBuffer>): Promise<void> {
    const answer = await this.#send("PUT", key, "", content);
    if (!answer.ok) throw new Error(`the bucket does not take ${key} (${answer.status})`);
  }

  async remove(key: string): Promise<void> {
    const answer = await this.#send("DELETE", key);
    if (!answer.ok) throw new Error(`the bucket does not delete ${key} (${answer.status})`);
  }

  /** Lists all objects whose keys have a prefix; of a level, those that have no slash after it. */
  async list(prefix: string, isLevel = false): Promise<Listed[]> {
    const all: Listed[] = [];
    let more = "";
    do {
      // In the order of the names, as signatures want it.
      const query = `?${more && `continuation-token=${encoded(more)}&`}${isLevel ? "delimiter=%2F&" : ""}list-type=2&prefix=${encoded(prefix)}`;
      const answer = await this.#send("GET", "", query);
      if (!answer.ok) throw new Error(`the bucket refuses a listing (${answer.status})`);
      const page = new DOMParser().parseFromString(await answer.text(), "application/xml");
      const text = (of: ParentNode, name: string): string => of.querySelector(name)?.textContent ?? "";
      for (const found of page.querySelectorAll("Contents")) {
        all.push({ key: text(found, "Key"), etag: etagOf(text(found, "ETag")), size: Number(text(found, "Size")) });
      }
      more = text(page, "NextContinuationToken");
    } while (more);
    return all;
  }
}
