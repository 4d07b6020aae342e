// SPDX-License-Identifier: Apache-2.0
// axe-core's check of a page as it stands now.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

// FOLDER has node_modules. The page's context must be made with { bypassCSP: true }: the check is a script
// that the page would refuse.
export async function assertAccessible(folder, page, name) {
  await page.evaluate(readFileSync(createRequire(join(folder, "package.json")).resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => window.axe.run());
  assert.deepEqual(violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html.slice(0, 90)).join("; ")}`), [], name);
}
