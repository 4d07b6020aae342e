// SPDX-License-Identifier: Apache-2.0
// node acquire.test.mjs FOLDER AXISCAL [PICTURES]: runs a session by clicks in headless Chromium, with a second
// browser that watches, a reload and a lost connection, and attacks the server. FOLDER contains node_modules.
// PICTURES is a folder for screenshots. Exits with status 77 without Chromium.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import http from "node:http";
import https from "node:https";
import net from "node:net";
import { networkInterfaces, tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { assertAccessible } from "./accessible.mjs";
import { comesTrue, inked, launch, listen, pause } from "./browser.mjs";

const [folder, axiscal, pictures] = process.argv.slice(2).map((argument) => resolve(argument));
const scratch = mkdtempSync(join(tmpdir(), "axiscal-acquire-"));

const programs = [];
// Starts a session with a page. The program prints the page's address to stderr.
async function start(name, source, ...more) {
  const program = spawn(axiscal, ["acquire", "--connect", source, "--web", "--json", "--name", join(scratch, name), ...more], {
    cwd: scratch,
    stdio: ["pipe", "pipe", "pipe"],
  });
  programs.push(program);
  const session = { program, events: [], out: "", err: "", ended: null };
  session.over = new Promise((done) => program.on("close", (status) => done((session.ended = status))));
  program.stdout.on("data", (data) => {
    session.out += data;
    const lines = session.out.split("\n");
    session.out = lines.pop();
    session.events.push(...lines.filter(Boolean).map((line) => JSON.parse(line)));
  });
  program.stderr.on("data", (data) => (session.err += data));
  assert.ok(await comesTrue(() => /https?:\S+#\w+/.test(session.err)), session.err);
  session.url = session.err.match(/https?:\S+/)[0];
  session.count = (kind) => session.events.filter((event) => event.event === kind).length;
  return session;
}

const port = (session) => Number(new URL(session.url).port);
function request(session, { host = "127.0.0.1", method = "GET", path = "/", headers = {}, body = "" } = {}) {
  return new Promise((done) => {
    const by = session.url.startsWith("https:") ? https : http;
    const sent = by.request({ host, port: port(session), method, path, headers, rejectUnauthorized: false }, (response) => {
      let text = "";
      const certificate = response.socket.getPeerCertificate?.();
      response.on("data", (data) => (text += data));
      response.on("end", () => done({ status: response.statusCode, text, headers: response.headers, certificate }));
    });
    sent.on("error", (error) => done({ status: 0, text: String(error) }));
    sent.end(body);
  });
}

async function open(browser, session, options = {}) {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  const heard = listen(page);
  // Records all lines of the page's log, which displays only the last ones.
  const log = [];
  await page.exposeFunction("logged", (text) => log.push(text));
  await page.addInitScript(() =>
    addEventListener("DOMContentLoaded", () => {
      const lines = document.getElementById("log");
      new MutationObserver((changes) => changes.forEach((one) => one.addedNodes.forEach((line) => logged(line.textContent)))).observe(lines, { childList: true });
    }),
  );
  await page.goto(session.url);
  await page.waitForSelector("html[data-ready]");
  return { context, page, log, ...heard };
}

const phaseIs = (page, phase, timeout = 20000) => page.waitForSelector(`body[data-phase="${phase}"]`, { timeout });
const doneIs = (page, count) => page.waitForSelector(`body[data-done="${count}"]`, { timeout: 20000 });
const isDrawn = (page, canvas) => comesTrue(async () => (await page.$eval(canvas, inked)) > 0.1);
const click = (page, action) => page.click(`#actions [data-action="${action}"]`);
async function picture(page, name) {
  if (pictures) {
    await page.screenshot({ path: join(pictures, `${name}.png`), fullPage: true });
  }
}

async function aSessionByClicks(browser) {
  const session = await start("clicks \u00fc", "sim:?speed=12&seed=2&error=0.15", "--manual");
  const mine = await open(browser, session, { viewport: { width: 1280, height: 900 } });
  const { page } = mine;
  assert.equal(new URL(page.url()).hash, "", "the key does not stay in the address");
  const other = await open(browser, session, { viewport: { width: 1280, height: 900 }, colorScheme: "dark" });
  const watcher = other.page;
  assert.ok(await watcher.locator("#control").isVisible(), "the second browser watches");
  assert.ok(await watcher.locator("#actions button").first().isDisabled());
  await page.click("#sound");
  // Takes one reading. A knock or a doubted pose may prevent a reading, so that it is tried again.
  const takeOne = async (name = null) => {
    const before = session.count("captured");
    for (let tries = 0; session.count("captured") === before; ++tries) {
      assert.ok(tries < 20, "a reading is never taken");
      await phaseIs(page, "ready");
      if (name) {
        await picture(page, name);
      }
      const answers = () => session.count("captured") + session.count("question");
      const old = answers();
      await click(page, "capture");
      await comesTrue(() => answers() > old, 2);
      if (session.count("question") === 1) {
        await picture(page, "acquire-question");
      }
    }
  };
  let undone = false;
  for (let done = 0; done < 12; ++done) {
    await takeOne(done === 1 ? "acquire-ready" : null);
    await doneIs(page, done + 1);
    if (done === 3) {
      await page.reload();
      await page.waitForSelector("html[data-ready]");
      await doneIs(page, 4);
    }
    if (done === 5) {
      // The controlling page loses its connection. The session goes on, and the page reconnects by itself.
      await mine.context.setOffline(true);
      await watcher.waitForSelector("html[data-ready]");
      await pause(1500);
      await mine.context.setOffline(false);
      await page.waitForSelector("#link:text-is('connected')", { timeout: 20000 });
      await page.waitForSelector("#control", { state: "hidden" });
    }
    if (done === 6 && !undone) {
      undone = true;
      await click(page, "undo");
      await doneIs(page, 6);
      --done;
    }
    if (done === 7 && (await watcher.locator("#control").isVisible())) {
      await watcher.click("#control");
      await page.waitForSelector("#control:not([hidden])");
      await watcher.waitForSelector("#control", { state: "hidden" });
      await page.click("#control");
      await page.waitForSelector("#control", { state: "hidden" });
      await doneIs(watcher, 8);
      await picture(watcher, "acquire-dark");
    }
  }
  await phaseIs(page, "review");
  // The review names a wrong reading that no question has detected. Only this reading is taken again.
  const isSuggested = async () => (await page.locator('#actions [data-action="retake-suggested"]').count()) > 0;
  for (let rounds = 0; rounds < 3 && (await isSuggested()); ++rounds) {
    await click(page, "retake-suggested");
    await page.waitForSelector('body:not([data-done="12"])');
    for (let done = Number(await page.getAttribute("body", "data-done")); done < 12; ++done) {
      await takeOne();
      await doneIs(page, done + 1);
    }
    await phaseIs(page, "review");
  }
  assert.match(await page.textContent("#outcomes .verdict"), /^Calibrated/);
  assert.match(await page.textContent("#outcomes tr:nth-child(2) td"), /^\u2212?\d[\d.]* \u00b1 \d/);
  await picture(page, "acquire-review");
  await click(page, "finish");
  // At the end the page offers files and the choice of a new session.
  await page.waitForSelector("#files:not([hidden])");
  assert.deepEqual(await page.locator("#file-links a").allTextContents(), ["Report", "Certificate (draft)", "C header", "Record", "Readings"]);
  await picture(page, "acquire-result");
  const [report] = await Promise.all([mine.context.waitForEvent("page"), page.click("#file-links a >> nth=0")]);
  await report.waitForSelector("html[data-ready=yes]");
  assert.match(await report.textContent("h1"), /^Calibration of accelerometer/);
  await report.close();
  const fetched = await page.evaluate(async () => (await fetch("/files/clicks%20%C3%BC.json")).status);
  assert.equal(fetched, 200);
  assert.ok(await watcher.locator("[data-wish=leave]").isDisabled(), "one controls");
  // Starts a second session with the same instrument in the same page.
  await page.click("[data-wish=again]");
  await doneIs(page, 0);
  await takeOne();
  await doneIs(page, 1);
  await mine.context.setOffline(true);
  // Control passes to the other browser when the controlling browser is gone.
  await watcher.waitForSelector("#control", { state: "hidden" });
  await click(watcher, "quit");
  await click(watcher, "quit");
  await mine.context.setOffline(false);
  assert.equal(await session.over, 1, session.err);
  assert.match(session.err, /stopped with 1 readings.*clicks \u00fc-2\.journal/s);
  assert.ok(session.count("question") >= 1, "the person erred");
  assert.ok(other.log.some((text) => /the reading shows|agrees with no pose/.test(text)), other.log.join("; "));
  const record = JSON.parse(readFileSync(join(scratch, "clicks \u00fc.json"), "utf8"));
  assert.notEqual(record.status, "refused");
  assert.equal(session.count("files"), 1, "what the first session left is told");
  const own = new URL(session.url).host;
  const others = mine.requests.map((text) => new URL(text)).filter((url) => url.protocol !== "data:" && url.host !== own);
  assert.deepEqual(others, [], "no request leaves the page's own server");
  // The browser itself reports failed requests while it is offline.
  const complaints = [...mine.complaints, ...other.complaints];
  assert.deepEqual(complaints.filter((text) => !/ERR_|Failed to load|disconnected/.test(text)), []);
  await mine.context.close();
  await other.context.close();
}

// Buttons are large enough for gloves, and the headline is readable from three metres.
async function largeEnough(browser) {
  const session = await start("large", "sim:?speed=5");
  const { page, context } = await open(browser, session, { viewport: { width: 1280, height: 900 }, bypassCSP: true });
  await page.waitForSelector('body[data-phase="laying"]:not([data-done="0"])', { timeout: 20000 });
  const sizes = await page.evaluate(() =>
    [...document.querySelectorAll("#actions button")].map((one) => one.getBoundingClientRect()).map((box) => [box.width, box.height]),
  );
  assert.ok(sizes.every(([width, height]) => width >= 120 && height >= 64), JSON.stringify(sizes));
  const headline = await page.$eval("#headline", (one) => parseFloat(getComputedStyle(one).fontSize));
  assert.ok(headline >= 48, `${headline} px`);
  assert.ok(await isDrawn(page, "#cube canvas"), "the cube is drawn");
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    await assertAccessible(folder, page, `session, ${colorScheme}`);
  }
  await page.emulateMedia({ colorScheme: "light" });
  await picture(page, "acquire-laying");
  await page.setViewportSize({ width: 420, height: 860 });
  await picture(page, "acquire-phone");
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 425, `${wide} px wide on a phone`);
  await context.close();
}

// A session without a cube: readings fill the sphere until the target is reached, and give a record.
async function aFreeSession(browser) {
  const session = await start("free", "sim:?speed=4&seed=2&noise=0.003", "--free", "--instrument", "magnetometer", "--field", "geomagnetic", "--field-magnitude", "48", "--field-unit", "uT", "--unit", "uT");
  const { page, context, complaints } = await open(browser, session, { viewport: { width: 1280, height: 900 } });
  const sphere = (what) => page.evaluate((name) => window.axiscalSphere[name](), what);
  await page.waitForSelector("body.free");
  assert.ok(await comesTrue(async () => (await sphere("points")) > 100));
  const early = await sphere("filled");
  await picture(page, "acquire-free");
  assert.ok(await isDrawn(page, "#sphere"), "the sphere is drawn");
  assert.ok(await comesTrue(async () => (await page.textContent("#headline")) === "The target is reached", 60), "it is never enough");
  assert.ok((await sphere("filled")) > early, "gaps are filled");
  assert.match(await page.textContent("#free-numbers"), /Hard iron \[uT\].*\u00b1/);
  await picture(page, "acquire-free-enough");
  if (pictures) {
    console.log(`${await sphere("points")} points, ${await sphere("framesPerSecond")} frames a second`);
  }
  // A second browser gets all the points.
  const late = await open(browser, session, { viewport: { width: 420, height: 860 } });
  assert.ok(await comesTrue(async () => (await late.page.evaluate(() => window.axiscalSphere.points())) >= 100));
  await picture(late.page, "acquire-free-phone");
  await late.context.close();
  await click(page, "finish");
  await phaseIs(page, "review");
  await click(page, "finish");
  await page.waitForSelector("#files:not([hidden])");
  assert.equal(await page.locator("#outcomes tr").count(), 4);
  await page.click("[data-wish=leave]");
  assert.equal(await session.over, 0, session.err);
  assert.equal(JSON.parse(readFileSync(join(scratch, "free.json"), "utf8")).method, "magnitude");
  assert.deepEqual(complaints, []);
  await context.close();
}

async function theServerIsNotImpressed() {
  const session = await start("attacked", "sim:?speed=20&seed=3");
  const key = new URL(session.url).hash.slice(1);
  const host = `127.0.0.1:${port(session)}`;
  const json = { "Content-Type": "application/json", "X-Axiscal": "1" };
  const login = (headers, body = JSON.stringify({ key })) => request(session, { method: "POST", path: "/login", headers, body });

  const page = await request(session);
  assert.equal(page.status, 200);
  assert.match(page.headers["content-security-policy"], /default-src 'none'/);
  assert.match(page.headers["content-security-policy"], /frame-ancestors 'none'/);
  assert.ok(!page.text.includes(key), "the page does not hold the key");
  assert.equal((await request(session, { headers: { Host: "evil.example" } })).status, 403, "another host's name");
  assert.equal((await request(session, { headers: { Host: `evil.example:${port(session)}` } })).status, 403);
  assert.equal((await login({ ...json, Origin: "http://evil.example" })).status, 403, "another site");
  assert.equal((await login({ ...json, "Sec-Fetch-Site": "cross-site" })).status, 403);
  assert.equal((await login({ "Content-Type": "application/json" })).status, 403, "no script of ours");
  assert.equal((await login({ "Content-Type": "text/plain", "X-Axiscal": "1" })).status, 403);
  assert.equal((await login(json, '{"key":"0123"}')).status, 403);
  assert.equal((await request(session, { path: "/events" })).status, 403, "no key, nothing to see");
  assert.equal((await request(session, { method: "POST", path: "/command", headers: json, body: '{"command":"quit"}' })).status, 403);
  for (const path of ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/attacked.journal", "/acquire.js/..%2f", "/.git/config"]) {
    const answer = await request(session, { path });
    assert.ok(answer.status >= 400, path);
    assert.ok(!answer.text.includes("root:"), path);
  }
  assert.equal((await login(json, "x".repeat(100000))).status >= 400, true, "a body without end");
  assert.ok([400, 414, 431, 0].includes((await request(session, { headers: { "X-Long": "y".repeat(20000) } })).status));

  const entered = await login({ ...json, Origin: `http://${host}` });
  assert.equal(entered.status, 200);
  assert.match(entered.headers["set-cookie"][0], /HttpOnly; SameSite=Strict/);
  const cookie = entered.headers["set-cookie"][0].split(";")[0];
  const watcher = (await login(json)).headers["set-cookie"][0].split(";")[0];
  const ask = (who, command) => request(session, { method: "POST", path: "/command", headers: { ...json, Cookie: who }, body: JSON.stringify({ command }) });
  assert.equal((await ask(watcher, "quit")).status, 409, "one controls");
  assert.equal((await ask(cookie, "explode")).status, 400);

  // The session takes readings during thousands of slow, incomplete and random requests.
  const before = session.count("captured");
  const sockets = [];
  for (let i = 0; i < 60; ++i) {
    const socket = net.connect(port(session), "127.0.0.1", () => socket.write("GET / HTTP/1.1\r\nHost: "));
    socket.on("error", () => {});
    sockets.push(socket);
  }
  for (let i = 0; i < 2000; ++i) {
    await new Promise((done) => {
      const socket = net.connect(port(session), "127.0.0.1", () => {
        const noise = Buffer.from(Array.from({ length: 40 }, (_, k) => (i * 31 + k * 17) % 256));
        socket.end(i % 3 === 0 ? noise : i % 3 === 1 ? "POST /command HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n{" : "GET\r\n\r\n");
        done();
      });
      socket.on("error", done);
    });
  }
  const more = Math.min(before + 3, 12);
  assert.ok(await comesTrue(() => session.ended !== null || session.count("captured") >= more), "the session goes on");
  assert.equal(session.ended, null);
  sockets.forEach((socket) => socket.destroy());
  // After these connections have ended or timed out, the page is served again.
  let answer = { status: 0 };
  await comesTrue(async () => (answer = await request(session)).status === 200);
  assert.equal(answer.status, 200, `${answer.text} ${session.ended} ${session.err}`);
  assert.equal((await ask(cookie, "quit")).status, 200);
  assert.equal(await session.over, 1, "stopped by the one who controls");
}

// At an IPv6 address the page is encrypted and is served only under its own host name. The browser accepts the
// certificate, as the user is asked to do.
async function atAnotherAddress(browser) {
  const session = await start("six", "sim:?speed=5", "--listen", "::1");
  const { hostname, host } = new URL(session.url);
  assert.equal(hostname, "[::1]");
  const answer = (Host) => request(session, { host: "::1", headers: { Host } });
  const mine = await answer(host);
  assert.equal(mine.status, 200);
  assert.ok(session.err.includes(mine.certificate.fingerprint256), "the terminal shows the fingerprint");
  assert.equal((await answer(host.replace("::1", "::2"))).status, 403);
  const { page, context } = await open(browser, session, { ignoreHTTPSErrors: true });
  await page.waitForSelector("#link:text-is('connected')");
  assert.ok((await context.cookies(session.url)).every((cookie) => cookie.secure && cookie.httpOnly));
  assert.ok(await comesTrue(() => session.err.match(/https:\S+/g).length === 2), "a new key for the next one");
  await context.close();
}

const browser = await launch(folder);
try {
  for (const test of [aSessionByClicks, largeEnough, aFreeSession].filter(() => !process.env.ONLY_SERVER)) {
    await test(browser);
    console.log(`ok: ${test.name}`);
  }
  await theServerIsNotImpressed();
  console.log("ok: theServerIsNotImpressed");
  if (Object.values(networkInterfaces()).flat().some((one) => one.address === "::1")) {
    await atAnotherAddress(browser);
    console.log("ok: atAnotherAddress");
  }
} finally {
  programs.forEach((program) => program.kill("SIGKILL"));
  await browser.close();
  rmSync(scratch, { recursive: true, force: true });
}
process.exit(0);
