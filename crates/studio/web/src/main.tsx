// The page of the program.

import { Runs } from "./runs/panel";
import { follow } from "./runs/runs";
import { start } from "./studio";

start({ children: <Runs /> });
follow();
