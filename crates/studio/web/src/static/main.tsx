// The page without a program: its studio is in its workers.

import { Runs } from "../runs/panel";
import { follow } from "../runs/runs";
import { canSubmit, notice } from "../store";
import { start } from "../studio";
import { Places } from "./places";
import { listenDownloads } from "./save";
import { comeBack } from "./stack/person";
import { stack } from "./stack/stack";
import { moduleFile } from "./variant";
import "./static.css";

start({ places: <Places />, children: <Runs /> });
listenDownloads();
void stack().then(async (known) => {
  if (!known) return;
  await comeBack(known).catch((error: unknown) => (notice.value = String(error)));
  canSubmit.value = true;
  follow();
});
// The site works without a network after this.
void navigator.serviceWorker?.register(`offline.js?${moduleFile}`).catch(() => undefined);
