// The person who has signed in, and temporary credentials. On AWS the password is typed on a page of Cognito's, which sends
// the browser back with a code; the code is redeemed for a token (with PKCE: only by the page that asked), the token for
// credentials. The token stays in this tab, and ends within the hour.

import { hex, type Keys } from "./sign";
import type { SignIn, Stack } from "./stack";

/** A person's identity, which is the name of their folder, with credentials. */
export interface Person {
  readonly identity: string;
  readonly keys: Keys;
}

/** Credentials of an hour are renewed before their end, in milliseconds. */
const RENEWED = 50 * 60_000;

const ASKED = "rayfold-sign-in";
const TOKEN = "rayfold-token";

/** What the page remembers while the browser is on Cognito's page. */
interface Asked {
  readonly verifier: string;
  readonly state: string;
  readonly hash: string;
}

const encoder = new TextEncoder();
const base64url = (bytes: Uint8Array): string => btoa(String.fromCharCode(...bytes)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=/g, "");
const random = (): string => hex(crypto.getRandomValues(new Uint8Array(32)).buffer);
const here = (): string => location.origin + location.pathname;

async function json(address: string, init: RequestInit): Promise<Record<string, unknown>> {
  const answer = await fetch(address, { ...init, method: "POST" });
  if (!answer.ok) throw new Error(`signing in was refused (${answer.status})`);
  return (await answer.json()) as Record<string, unknown>;
}

/** Whether the browser has come back without a token. It is not sent away again by itself, or there might be no end of it. */
let hasFailed = false;

/** Leaves for the page that asks for the password. */
export async function leave({ loginUrl, clientId }: SignIn): Promise<never> {
  if (hasFailed) {
    hasFailed = false;
    throw new Error("nobody was signed in: choose the list of runs to try again");
  }
  const asked: Asked = { verifier: random(), state: random(), hash: location.hash };
  sessionStorage.setItem(ASKED, JSON.stringify(asked));
  const challenge = base64url(new Uint8Array(await crypto.subtle.digest("SHA-256", encoder.encode(asked.verifier))));
  const query = { response_type: "code", client_id: clientId, redirect_uri: here(), scope: "openid", state: asked.state, code_challenge_method: "S256", code_challenge: challenge };
  location.assign(`${loginUrl}/oauth2/authorize?${new URLSearchParams(query)}`);
  return new Promise<never>(() => undefined);
}

/** Redeems the code with which the browser has come back, if it has, and restores the address. */
export async function comeBack({ signIn }: Stack): Promise<void> {
  const query = new URLSearchParams(location.search);
  const kept = sessionStorage.getItem(ASKED);
  if (!signIn || !kept || !query.has("state")) return;
  sessionStorage.removeItem(ASKED);
  const asked = JSON.parse(kept) as Asked;
  history.replaceState(null, "", here() + asked.hash);
  hasFailed = true;
  const code = query.get("code");
  // Another page's code would sign this person in as somebody else.
  if (!code || query.get("state") !== asked.state) return;
  const body = new URLSearchParams({ grant_type: "authorization_code", client_id: signIn.clientId, code, redirect_uri: here(), code_verifier: asked.verifier });
  const { id_token: token } = await json(`${signIn.loginUrl}/oauth2/token`, { body });
  if (typeof token !== "string") return;
  sessionStorage.setItem(TOKEN, token);
  hasFailed = false;
}

/** Returns whether a token is of use for some time. Who made it, Cognito checks. */
function isFresh(token: string): boolean {
  const [, claims = ""] = token.split(".");
  const { exp } = JSON.parse(atob(claims.replace(/-/g, "+").replace(/_/g, "/"))) as { readonly exp: number };
  return exp * 1000 > Date.now() + 60_000;
}

async function ofCognito(signIn: SignIn): Promise<Person> {
  const token = sessionStorage.getItem(TOKEN);
  if (!token || !isFresh(token)) throw new Error("nobody is signed in any more: open the list of runs");
  const { region, identityPoolId, userPoolId } = signIn;
  const ask = (what: string, body: object): Promise<Record<string, unknown>> =>
    json(`https://cognito-identity.${region}.amazonaws.com/`, {
      headers: { "content-type": "application/x-amz-json-1.1", "x-amz-target": `AWSCognitoIdentityService.${what}` },
      body: JSON.stringify({ ...body, Logins: { [`cognito-idp.${region}.amazonaws.com/${userPoolId}`]: token } }),
    });
  const { IdentityId: identity } = (await ask("GetId", { IdentityPoolId: identityPoolId })) as { readonly IdentityId: string };
  const { Credentials: given } = (await ask("GetCredentialsForIdentity", { IdentityId: identity })) as {
    readonly Credentials: { readonly AccessKeyId: string; readonly SecretKey: string; readonly SessionToken: string };
  };
  return { identity, keys: { accessKey: given.AccessKeyId, secretKey: given.SecretKey, sessionToken: given.SessionToken } };
}

async function ofDev(address: string): Promise<Person> {
  const { identity, ...keys } = (await json(address, {})) as unknown as { readonly identity: string } & Keys;
  return { identity, keys };
}

let known: { readonly person: Promise<Person>; readonly since: number } | null = null;

/** Returns the person who has signed in. */
export function person({ signIn, credentials = "" }: Stack): Promise<Person> {
  if (known && Date.now() - known.since < RENEWED) return known.person;
  const person = signIn ? ofCognito(signIn) : ofDev(credentials);
  known = { person, since: Date.now() };
  person.catch(() => (known = null));
  return person;
}

export function isSignedIn({ signIn }: Stack): boolean {
  const token = sessionStorage.getItem(TOKEN);
  return !signIn || (token !== null && isFresh(token));
}
