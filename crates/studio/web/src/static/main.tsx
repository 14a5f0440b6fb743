// The page without a program: its studio is in its workers.

import { start } from "../studio";
import { Places } from "./places";
import { listenDownloads } from "./save";
import { moduleFile } from "./variant";
import "./static.css";

start({ places: <Places /> });
listenDownloads();
// The site works without a network after this.
void navigator.serviceWorker?.register(`offline.js?${moduleFile}`).catch(() => undefined);
