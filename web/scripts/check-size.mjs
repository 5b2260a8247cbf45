// Fails when a page takes more JavaScript than a phone on a slow line should wait for.
import { readFileSync, rmSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const folder = "../server/stillroom/static";
const PAGES = [
  { page: "viewing", entries: ["src/pages/MapPage.tsx"], budgetKb: 200 },
  { page: "reviewing", entries: ["src/review/ReviewPage.tsx"], budgetKb: 210 },
  { page: "the fleet", entries: ["src/fleet/FleetPages.tsx"], budgetKb: 170 },
  { page: "editing", entries: ["src/pages/MapPage.tsx", "src/editor/Editor.tsx"], budgetKb: 300 },
];

const manifest = JSON.parse(readFileSync(join(folder, ".vite/manifest.json"), "utf8"));
rmSync(join(folder, ".vite"), { recursive: true });

const html = readFileSync(join(folder, "index.html"), "utf8");
/** What every page starts with. */
const START = [...html.matchAll(/(?:src|href)="\/(assets\/[^"]+\.js)"/g)].map(([, file]) => file);
if (START.length === 0) throw new Error("the page starts with no script");

function filesOf(entries, found = new Set(START)) {
  for (const name of entries) {
    const chunk = manifest[name];
    if (chunk === undefined) throw new Error(`${name} is no chunk of the build`);
    if (found.has(chunk.file)) continue;
    found.add(chunk.file);
    filesOf(chunk.imports ?? [], found);
  }
  return found;
}

for (const { page, entries, budgetKb } of PAGES) {
  const sizes = [...filesOf(entries)].map((file) => gzipSync(readFileSync(join(folder, file))).length / 1000);
  const total = sizes.reduce((sum, size) => sum + size, 0);
  process.stdout.write(`JavaScript for ${page}, compressed: ${total.toFixed(1)} of ${budgetKb} kB\n`);
  if (total > budgetKb) process.exitCode = 1;
}
