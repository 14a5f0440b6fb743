// Signatures of requests to S3 (AWS Signature Version 4):
// https://docs.aws.amazon.com/AmazonS3/latest/API/sig-v4-header-based-auth.html

/** Temporary credentials. */
export interface Keys {
  readonly accessKey: string;
  readonly secretKey: string;
  readonly sessionToken: string;
}

export interface Request {
  readonly method: "DELETE" | "GET" | "HEAD" | "PUT";
  readonly url: URL;
  readonly body?: Uint8Array<ArrayBuffer>;
}

const encoder = new TextEncoder();

export const hex = (bytes: ArrayBuffer): string => Array.from(new Uint8Array(bytes), (byte) => byte.toString(16).padStart(2, "0")).join("");

const hash = async (content: Uint8Array<ArrayBuffer>): Promise<string> => hex(await crypto.subtle.digest("SHA-256", content));

async function keyed(key: ArrayBuffer | Uint8Array<ArrayBuffer>, text: string): Promise<ArrayBuffer> {
  const own = await crypto.subtle.importKey("raw", key, { name: "HMAC", hash: "SHA-256" }, false, ["sign"]);
  return crypto.subtle.sign("HMAC", own, encoder.encode(text));
}

/** Encodes a text as signatures expect it: all but letters, digits and four signs. */
export const encoded = (text: string): string => encodeURIComponent(text).replace(/[!'()*]/g, (sign) => `%${sign.charCodeAt(0).toString(16).toUpperCase()}`);

/** Returns the headers that sign a request. Its URL has each part encoded by `encoded`, and its query in order. */
export async function signed({ method, url, body }: Request, keys: Keys, region: string, now = new Date()): Promise<Record<string, string>> {
  const time = now.toISOString().replace(/[-:]|\.\d+/g, "");
  const scope = `${time.slice(0, 8)}/${region}/s3/aws4_request`;
  const content = await hash(body ?? new Uint8Array());
  const own = { "x-amz-content-sha256": content, "x-amz-date": time, "x-amz-security-token": keys.sessionToken };
  const headers = Object.entries({ host: url.host, ...own });
  const names = headers.map(([name]) => name).join(";");
  const canonical = [method, url.pathname, url.search.slice(1), ...headers.map(([name, value]) => `${name}:${value}`), "", names, content].join("\n");
  const text = ["AWS4-HMAC-SHA256", time, scope, await hash(encoder.encode(canonical))].join("\n");
  let key: ArrayBuffer | Uint8Array<ArrayBuffer> = encoder.encode(`AWS4${keys.secretKey}`);
  for (const part of scope.split("/")) key = await keyed(key, part);
  const signature = hex(await keyed(key, text));
  return { ...own, authorization: `AWS4-HMAC-SHA256 Credential=${keys.accessKey}/${scope}, SignedHeaders=${names}, Signature=${signature}` };
}
