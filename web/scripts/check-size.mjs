// Fails when viewing a map takes more JavaScript than a phone on a slow line should wait for.
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const BUDGET_KB = 200;
const folder = "../server/stillroom/static/assets";

const sizes = readdirSync(folder)
  .filter((name) => name.endsWith(".js"))
  .map((name) => gzipSync(readFileSync(join(folder, name))).length / 1000);
const total = sizes.reduce((sum, size) => sum + size, 0);
process.stdout.write(`JavaScript, compressed: ${total.toFixed(1)} of ${BUDGET_KB} kB\n`);
if (total > BUDGET_KB) process.exitCode = 1;
