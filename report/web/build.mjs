// SPDX-License-Identifier: Apache-2.0
// node build.mjs OUT: bundles the scripts of the report and of the session's page, and uPlot's style
// sheet, into OUT/report.js, OUT/acquire.js and OUT/uplot.css.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";

const out = process.argv[2] ?? "dist";
mkdirSync(out, { recursive: true });
await build({
  entryPoints: ["src/report.js", "src/acquire.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  charset: "ascii",
  legalComments: "inline",
  outdir: out,
});
copyFileSync("node_modules/uplot/dist/uPlot.min.css", `${out}/uplot.css`);

// What would end the script element, or start a comment in it, is written otherwise.
const file = `${out}/report.js`;
const text = readFileSync(file, "utf8").replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
writeFileSync(file, text);
