// Fails when src/api/schema.gen.ts is not what openapi.json gives.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const folder = mkdtempSync(join(tmpdir(), "stillroom-client-"));
try {
  const fresh = join(folder, "schema.gen.ts");
  execFileSync("node_modules/.bin/openapi-typescript", ["openapi.json", "-o", fresh], {
    stdio: ["ignore", "ignore", "inherit"],
  });
  if (readFileSync(fresh, "utf8") !== readFileSync("src/api/schema.gen.ts", "utf8")) {
    process.stderr.write("web/src/api/schema.gen.ts is stale: run `make client`\n");
    process.exitCode = 1;
  }
} finally {
  rmSync(folder, { recursive: true });
}
