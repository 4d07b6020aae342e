// SPDX-License-Identifier: Apache-2.0
// Checks the accessibility of a page in its current state by axe-core.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

// FOLDER contains node_modules. The page's context must be created with { bypassCSP: true }, because the page's
// policy blocks the script of axe-core.
export async function assertAccessible(folder, page, name) {
  await page.evaluate(readFileSync(createRequire(join(folder, "package.json")).resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => window.axe.run());
  assert.deepEqual(violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html.slice(0, 90)).join("; ")}`), [], name);
}
