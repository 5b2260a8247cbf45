// Fails when openapi.json is not what the service describes, or src/api/schema.gen.ts not what openapi.json gives.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const service = process.env.STILLROOM ?? "../.venv/bin/stillroom";
const folder = mkdtempSync(join(tmpdir(), "stillroom-client-"));
try {
  const described = execFileSync(service, ["openapi"], { encoding: "utf8", maxBuffer: 1 << 26 });
  const fresh = join(folder, "schema.gen.ts");
  execFileSync("node_modules/.bin/openapi-typescript", ["openapi.json", "-o", fresh], {
    stdio: ["ignore", "ignore", "inherit"],
  });
  for (const [file, wanted] of [
    ["openapi.json", described],
    ["src/api/schema.gen.ts", readFileSync(fresh, "utf8")],
  ]) {
    if (readFileSync(file, "utf8") === wanted) continue;
    process.stderr.write(`web/${file} is stale: run \`make client\` and commit what it changes\n`);
    process.exitCode = 1;
  }
} finally {
  rmSync(folder, { recursive: true });
}
