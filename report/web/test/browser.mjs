// SPDX-License-Identifier: Apache-2.0
// Common functions of the page tests: they start a browser, wait for conditions and check canvases.
import { existsSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((path) => existsSync(path));

// FOLDER contains node_modules. { webgl: false } disables WebGL. Exits with status 77 without Chromium.
export function launch(folder, { webgl = true } = {}) {
  if (!executablePath) {
    console.log("skipped: no Chromium");
    process.exit(77);
  }
  const { chromium } = createRequire(join(folder, "package.json"))("playwright-core");
  return chromium.launch({
    executablePath,
    args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
      ...(webgl ? ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] : ["--disable-gpu", "--disable-3d-apis"])],
  });
}

export const pause = (ms) => new Promise((done) => setTimeout(done, ms));

// Waits until a condition is true. @return false if it is not true in time. A page may be drawn some time after
// its data have arrived.
export async function comesTrue(what, seconds = 20) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await pause(25)) {
    if (await what()) {
      return true;
    }
  }
  return false;
}

// Records the errors and the requests of a page.
export function listen(page) {
  const heard = { complaints: [], requests: [] };
  page.on("console", (message) => message.type() === "error" && heard.complaints.push(message.text()));
  page.on("pageerror", (error) => heard.complaints.push(String(error)));
  page.on("request", (request) => heard.requests.push(request.url()));
  return heard;
}

// The share of pixels that differ from the first pixel: 0 for an empty canvas. To be evaluated in the page.
export function inked(canvas) {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0);
  const { data } = pen.getImageData(0, 0, copy.width, copy.height);
  let other = 0;
  for (let i = 4; i < data.length; i += 4) {
    other += data[i] !== data[0] || data[i + 1] !== data[1] || data[i + 2] !== data[2] ? 1 : 0;
  }
  return other / (data.length / 4);
}
