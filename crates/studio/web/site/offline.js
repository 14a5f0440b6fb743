// Keeps the site in the browser, so that it works without a network after the first load. `cargo xtask site` puts the
// names of the files here, and a version that changes with them. The page says in the query which module this machine runs.

const VERSION = "@VERSION@";
const FILES = ["@FILES@", location.search.slice(1)];
/** What a host says of itself: the newest, where there is a network. */
const OF_THE_HOST = "rayfold.json";

addEventListener("install", (event) => {
  // Not from the browser's cache, which may hold files of an older version.
  const load = (name) => new Request(name, { cache: "reload" });
  event.waitUntil(caches.open(VERSION).then((cache) => cache.addAll(FILES.map(load))));
});

addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith("rayfold-") && name !== VERSION);
  event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))));
});

async function answer(request) {
  const cache = await caches.open(VERSION);
  // Where the storage is full, the page works all the same.
  const keep = (found) => cache.put(request, found.clone()).catch(() => undefined);
  if (new URL(request.url).pathname.endsWith(`/${OF_THE_HOST}`)) {
    const found = await fetch(request, { cache: "no-cache" }).catch(() => null);
    if (found?.ok) await keep(found);
    return found ?? (await cache.match(request)) ?? new Response("{}");
  }
  const kept = await cache.match(request, { ignoreSearch: true });
  if (kept) return kept;
  const found = await fetch(request);
  // Pictures of examples are kept once they were shown.
  if (found.ok && found.type === "basic") await keep(found);
  return found;
}

addEventListener("fetch", (event) => {
  const { method, url } = event.request;
  if (method === "GET" && new URL(url).origin === location.origin) event.respondWith(answer(event.request));
});
