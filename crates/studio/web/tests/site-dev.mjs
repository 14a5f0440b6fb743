// What the tests of a page beside a bucket share in all browsers: `rayfold dev --site`, and a stand-in for Cognito.

import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { start } from "./processes.mjs";

const { RAYFOLD: program, SITE: site } = process.env;

async function freePort() {
  const server = createServer();
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address();
  await new Promise((done) => server.close(done));
  return port;
}

/** Starts a bucket with a page; `again` starts it with the data and the addresses that it had. */
export async function dev(env = {}) {
  const data = mkdtempSync(join(tmpdir(), "rayfold-dev-"));
  const [address, siteAddress] = [`127.0.0.1:${await freePort()}`, `127.0.0.1:${await freePort()}`];
  let run;
  const begin = async (env) => {
    run = start(program, ["dev", "--data", data, "--address", address, "--site", site, "--site-address", siteAddress], env);
    await run.said((text) => text.includes("aws s3 sync"));
  };
  const end = async () => {
    run.server.kill("SIGINT");
    await run.ended;
  };
  const again = async (env = {}) => {
    await end();
    await begin(env);
  };
  const stop = async () => {
    await end();
    rmSync(data, { recursive: true, force: true });
  };
  await begin(env);
  return { own: `http://${siteAddress}`, again, stop };
}

const LOGIN = "https://demo.auth.eu-central-1.amazoncognito.com";
const IDENTITY = "https://cognito-identity.eu-central-1.amazonaws.com/";
const signIn = { region: "eu-central-1", identityPoolId: "eu-central-1:pool", userPoolId: "eu-central-1_Pool", clientId: "client", loginUrl: LOGIN };

/**
 * Plays Cognito's part for the page at an address: its pages and answers are as its documentation describes them; they were
 * not compared with Cognito's own. `answer` gives what is to be answered to a request, or nothing for one that goes on; `asked` has what was asked.
 */
export async function cognito(own) {
  const { credentials: _, ...config } = await (await fetch(`${own}/rayfold.json`)).json();
  const given = await (await fetch(`${own}/credentials`, { method: "POST", headers: { origin: own } })).json();
  const stand = { asked: [], isStateRight: true, answer };
  const json = (value) => ({ status: 200, contentType: "application/json", headers: { "access-control-allow-origin": own, "access-control-allow-headers": "*" }, body: JSON.stringify(value) });
  let challenge = "";
  /** `body` is the text of the request, where the browser gives it. */
  async function answer(method, address, headers, body) {
    const url = new URL(address);
    const at = url.origin + url.pathname;
    if (at === `${own}/rayfold.json`) return json({ ...config, signIn });
    if (at === `${own}/studio.html`) {
      // As Terraform writes it.
      const policy = (text) => text.replace("connect-src 'self'", `connect-src 'self' ${IDENTITY.slice(0, -1)} ${LOGIN}`);
      const page = await fetch(at);
      return { status: 200, contentType: "text/html", headers: { "content-security-policy": policy(page.headers.get("content-security-policy")) }, body: policy(await page.text()) };
    }
    if (at === `${LOGIN}/oauth2/authorize`) {
      const query = url.searchParams;
      assert.deepEqual([query.get("response_type"), query.get("client_id"), query.get("code_challenge_method")], ["code", "client", "S256"]);
      challenge = query.get("code_challenge");
      const back = new URL(query.get("redirect_uri"));
      back.search = new URLSearchParams({ code: "code", state: stand.isStateRight ? query.get("state") : "another" });
      stand.asked.push("password");
      return { status: 200, contentType: "text/html", headers: {}, body: `<a href="${back.href.replace("&", "&amp;")}">Sign in</a>` };
    }
    if (at !== `${LOGIN}/oauth2/token` && at !== IDENTITY) return undefined;
    if (method === "OPTIONS") return json({});
    if (at !== IDENTITY) {
      if (body) {
        const digest = Buffer.from(await crypto.subtle.digest("SHA-256", Buffer.from(new URLSearchParams(body).get("code_verifier"))));
        assert.equal(digest.toString("base64url"), challenge, "the page that asked is the one that redeems");
      }
      stand.asked.push("token");
      const claims = Buffer.from(JSON.stringify({ exp: Date.now() / 1000 + 3600 })).toString("base64url");
      return json({ id_token: `e30.${claims}.signature` });
    }
    const what = headers["x-amz-target"].split(".")[1];
    if (body) assert.deepEqual(Object.keys(JSON.parse(body).Logins), ["cognito-idp.eu-central-1.amazonaws.com/eu-central-1_Pool"]);
    stand.asked.push(what);
    const Credentials = { AccessKeyId: given.accessKey, SecretKey: given.secretKey, SessionToken: given.sessionToken };
    return json({ IdentityId: given.identity, ...(what !== "GetId" && { Credentials }) });
  }
  return stand;
}
