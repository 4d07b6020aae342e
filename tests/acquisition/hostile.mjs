// SPDX-License-Identifier: Apache-2.0
// hostile.mjs AXISCAL: attacks the web page of a session from loopback, with a limited number of connections and a
// limited time. The journal must contain each reading that was shown.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import http from "node:http";
import https from "node:https";
import net from "node:net";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import tls from "node:tls";

const axiscal = resolve(process.argv[2]);
const scratch = mkdtempSync(join(tmpdir(), "axiscal-hostile-"));
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const programs = [];

async function comesTrue(what, seconds) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await pause(20)) {
    if (await what()) {
      return true;
    }
  }
  return false;
}

async function start(name, source, ...more) {
  const program = spawn(
    axiscal,
    ["acquire", "--connect", source, "--unattended", "--json", "--name", join(scratch, name), ...more],
    { cwd: scratch, stdio: ["ignore", "pipe", "pipe"] },
  );
  programs.push(program);
  const session = { name, program, shown: [], err: "", ended: null };
  session.over = new Promise((done) => program.on("close", (status) => done((session.ended = status))));
  let rest = "";
  program.stdout.on("data", (data) => {
    const lines = (rest + data).split("\n");
    rest = lines.pop();
    for (const line of lines.filter(Boolean)) {
      const event = JSON.parse(line);
      if (event.event === "captured") {
        session.shown.push(event.run);
      }
    }
  });
  program.stderr.on("data", (data) => (session.err += data));
  assert.ok(await comesTrue(() => /https?:\S+#\w+/.test(session.err), 20), session.err);
  session.url = new URL(session.err.match(/https?:\S+/)[0]);
  session.port = Number(session.url.port);
  session.fingerprint = session.err.match(/(?:[0-9A-F]{2}:){31}[0-9A-F]{2}/)?.[0];
  return session;
}

const memoryMiB = (session) =>
  Number(readFileSync(`/proc/${session.program.pid}/status`, "utf8").match(/VmRSS:\s+(\d+)/)[1]) / 1024;

// @return the time [ms] that a client at 127.0.0.1 waits for the page's style sheet.
async function userWaits(session) {
  const begun = Date.now();
  const answer = await get(session, "/acquire.css");
  assert.equal(answer.status, 200, answer.text);
  return Date.now() - begun;
}

function get(session, path, { headers = {}, method = "GET", body = "" } = {}) {
  const kind = session.url.protocol === "https:" ? https : http;
  return new Promise((done) => {
    const sent = kind.request(
      { host: session.url.hostname, port: session.port, path, method, headers, agent: false, rejectUnauthorized: false, timeout: 15000 },
      (response) => {
        let text = "";
        const certificate = response.socket.getPeerCertificate?.();
        response.on("data", (data) => (text += data));
        response.on("end", () => done({ status: response.statusCode, text, headers: response.headers, certificate }));
      },
    );
    sent.on("timeout", () => sent.destroy(new Error("no answer")));
    sent.on("error", (error) => done({ status: 0, text: String(error) }));
    sent.end(body);
  });
}

function connection(session, from = "127.0.0.1") {
  const socket = net.connect({ port: session.port, host: "127.0.0.1", localAddress: from });
  socket.on("error", () => {});
  socket.on("data", () => {});
  socket.ended = false;
  socket.on("close", () => (socket.ended = true));
  return socket;
}

// If the server served the other connections first, the user would wait for their deadline of 5 s. The limit is half
// of that, for busy machines and for packets that the system sends again after a second.
const keptWaiting = 2500; // ms

const say = (text) => console.log(text);

async function headersWithoutEnd(session) {
  const before = memoryMiB(session);
  const line = Buffer.from(`X-Header: ${"y".repeat(1000)}\r\n`.repeat(64));
  let sent = 0;
  const most = 64 << 20;
  const sockets = Array.from({ length: 8 }, () => connection(session));
  for (const socket of sockets) {
    socket.write("GET / HTTP/1.1\r\nHost: x\r\n");
  }
  for (const end = Date.now() + 5000; sent < most && Date.now() < end; ) {
    const open = sockets.filter((socket) => !socket.ended && socket.writable);
    if (open.length === 0) {
      break;
    }
    for (const socket of open) {
      sent += socket.write(line) ? line.length : 0;
    }
    await pause(1);
  }
  const grown = memoryMiB(session) - before;
  sockets.forEach((socket) => socket.destroy());
  assert.ok(grown < 50, `${grown} MiB for header lines`);
  say(`header lines without end: turned away after ${(sent / 1024).toFixed(0)} KiB had been sent, memory +${grown.toFixed(1)} MiB`);
}

async function bodyDripped(session) {
  const socket = connection(session);
  const begun = Date.now();
  socket.write("POST /login HTTP/1.1\r\nHost: x\r\nContent-Length: 4000\r\n\r\n");
  while (!socket.ended && Date.now() - begun < 20000) {
    socket.write("x");
    await pause(500);
  }
  const seconds = (Date.now() - begun) / 1000;
  assert.ok(socket.ended && seconds < 12, `a body of a byte each half second is open for ${seconds} s`);
  say(`a body of a byte each half second: closed after ${seconds.toFixed(1)} s`);
}

// 1000 idle and 100 slow connections come from eight other addresses. The user is at 127.0.0.1.
async function heldByOthers(session) {
  const sockets = [];
  for (let i = 0; i < 1000; ++i) {
    sockets.push(connection(session, `127.0.0.${2 + (i % 8)}`));
  }
  for (let i = 0; i < 100; ++i) {
    const socket = connection(session, `127.0.0.${2 + (i % 8)}`);
    socket.write("GET / HTTP/1.1\r\nHost: ");
    sockets.push(socket);
  }
  const drip = setInterval(() => sockets.forEach((socket) => socket.ended || socket.write("a")), 300);
  const waits = [];
  for (let i = 0; i < 20; ++i) {
    waits.push(await userWaits(session));
    await pause(100);
  }
  clearInterval(drip);
  sockets.forEach((socket) => socket.destroy());
  const longest = Math.max(...waits);
  assert.ok(longest < keptWaiting, `the user waits ${longest} ms`);
  say(`1000 idle and 100 slow connections of 127.0.0.2 to .9: the user at 127.0.0.1 waits at most ${longest} ms`);
}

// 200 slow connections come from the user's own address.
async function heldFromHere(session) {
  const sockets = Array.from({ length: 200 }, () => {
    const socket = connection(session);
    socket.write("GET / HTTP/1.1\r\nHost: ");
    return socket;
  });
  const waits = [];
  for (let i = 0; i < 10; ++i) {
    waits.push(await userWaits(session));
  }
  sockets.forEach((socket) => socket.destroy());
  const longest = Math.max(...waits);
  assert.ok(longest < keptWaiting, `the user waits ${longest} ms`);
  say(`200 slow connections of the user's own address: waits at most ${longest} ms`);
}

async function noise(session) {
  for (let i = 0; i < 2000; ++i) {
    await new Promise((done) => {
      const socket = net.connect(session.port, "127.0.0.1", () => {
        const bytes = Buffer.from(Array.from({ length: 60 }, (_, k) => (i * 31 + k * 17) % 256));
        socket.end(i % 3 === 0 ? bytes : i % 3 === 1 ? "POST /command HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n{" : "GET\r\n\r\n");
        done();
      });
      socket.on("error", done);
    });
  }
  for (const path of ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/attacked.journal", "/.git/config"]) {
    const answer = await get(session, path);
    assert.ok(answer.status >= 400 && !answer.text.includes("root:"), path);
  }
  assert.equal((await get(session, "/", { headers: { Host: "evil.example" } })).status, 403);
  assert.equal((await get(session, "/events")).status, 403);
  say("2000 pieces of noise, paths of other files, another host's name: turned away");
}

// With --listen the server uses TLS and the certificate whose fingerprint the terminal shows.
async function encrypted() {
  const session = await start("encrypted", "sim:?speed=2&seed=3", "--listen", "127.0.0.1");
  assert.equal(session.url.protocol, "https:");
  assert.ok(session.fingerprint, session.err);
  const answer = await get(session, "/");
  assert.equal(answer.status, 200, answer.text);
  assert.equal(answer.certificate.fingerprint256, session.fingerprint);
  // A request by plain HTTP gets no answer. Unfinished TLS handshakes do not block other clients.
  const plain = await new Promise((done) => {
    http.get({ host: "127.0.0.1", port: session.port, agent: false }, (response) => done(response.statusCode)).on("error", () => done(0));
  });
  assert.equal(plain, 0);
  const halves = Array.from({ length: 100 }, () => connection(session, "127.0.0.2"));
  halves.forEach((socket) => socket.write(Buffer.from([22, 3, 1, 2, 0])));
  const begun = Date.now();
  assert.equal((await get(session, "/acquire.css")).status, 200);
  assert.ok(Date.now() - begun < keptWaiting, "while greetings are not finished");
  const old = await new Promise((done) => {
    const socket = tls.connect({ port: session.port, host: "127.0.0.1", rejectUnauthorized: false, maxVersion: "TLSv1.1", minVersion: "TLSv1" }, () => done("taken"));
    socket.on("error", () => done("refused"));
  });
  assert.equal(old, "refused", "TLS 1.1");
  halves.forEach((socket) => socket.destroy());
  session.program.kill("SIGKILL");
  say("--listen: TLS with the fingerprint that is shown; plain HTTP and TLS 1.1 get nothing");
}

function journalRuns(name) {
  const path = join(scratch, `${name}.journal`);
  assert.ok(existsSync(path));
  return readFileSync(path, "utf8")
    .split("\n")
    .slice(0, -1)
    .map((line) => JSON.parse(line))
    .filter((entry) => entry.entry === "captured")
    .map((entry) => entry.run);
}

try {
  const session = await start("attacked", "sim:?speed=1&seed=3&rate=200", "--web", "--replicates", "20");
  await userWaits(session);
  for (const attack of [headersWithoutEnd, bodyDripped, heldByOthers, heldFromHere, noise]) {
    await attack(session);
    assert.equal(session.ended, null, session.err);
  }
  assert.ok(await comesTrue(() => session.shown.length > 1, 60), "the session goes on");
  const memory = memoryMiB(session);
  assert.ok(memory < 200, `${memory} MiB`);
  session.program.kill("SIGKILL");
  await session.over;
  const stored = new Set(journalRuns("attacked"));
  for (const run of session.shown) {
    assert.ok(stored.has(run), `run ${run} was shown and is lost`);
  }
  say(`the session beside it: ${session.shown.length} readings shown, none lost; ${memory.toFixed(0)} MiB`);
  await encrypted();
  console.log("hostile: passed");
} finally {
  programs.forEach((program) => program.kill("SIGKILL"));
  rmSync(scratch, { recursive: true, force: true });
}
process.exit(0);
