// Programs that tests and measurements start.

import { spawn } from "node:child_process";

/** A run of a program; `said` waits for its standard output, `ended` for its end. */
export function start(program, args, env = {}, cwd = undefined) {
  const server = spawn(program, args, { stdio: ["ignore", "pipe", "pipe"], env: { ...process.env, ...env }, cwd });
  let [out, err] = ["", ""];
  server.stderr.on("data", (bytes) => (err += bytes));
  const ended = new Promise((resolve) => server.on("exit", resolve));
  const said = (enough) =>
    new Promise((resolve, reject) => {
      const look = () => enough(out) && resolve(out);
      server.stdout.on("data", (bytes) => {
        out += bytes;
        look();
      });
      server.on("exit", () => reject(new Error(`rayfold ${args[0]} ended: ${err}`)));
      look();
    });
  return { server, ended, said };
}
