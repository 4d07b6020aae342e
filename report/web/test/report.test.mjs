// SPDX-License-Identifier: Apache-2.0
// node report.test.mjs FOLDER AXISCAL: makes reports with the program AXISCAL and uses them in headless
// Chromium. FOLDER contains node_modules. Exits with status 77 without Chromium.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { assertAccessible } from "./accessible.mjs";
import { comesTrue, inked, launch, listen } from "./browser.mjs";

const [folder, axiscal] = process.argv.slice(2).map((argument) => resolve(argument));
const scratch = mkdtempSync(join(tmpdir(), "axiscal-report-"));
const path = (name) => join(scratch, name);
const run = (...args) => execFileSync(axiscal, args, { cwd: scratch, stdio: ["ignore", "pipe", "pipe"] });

const HOSTILE = "</script><img src=x onerror=document.title='hit'>\"'&";
const truth = {
  format: "axiscal-calibration",
  version: 1,
  instrument: { kind: "accelerometer", serial: HOSTILE, axes: ["x", "y", "z"], unit: "V" },
  field: { kind: "gravity", unit: "g", magnitude: 1, in_table: [0, 0, 1] },
  coefficients: {
    bias: [0.1, -0.2, 0.3],
    sensitivity: [[1, 0.02, -0.01], [0.015, 0.98, 0.02], [-0.02, 0.01, 1.03]],
  },
};

function makeReport() {
  writeFileSync(path("truth.json"), JSON.stringify(truth));
  run("simulate", "--truth", "truth.json", "--noise", "1e-4", "--seed", "5", "--replicates", "2", "-o", "run.csv");
  run("calibrate", "run.csv", "--instrument", "accelerometer", "--field", "gravity", "--unit", "V", "--serial", HOSTILE, "-o", "cal.json");
  run("report", "cal.json", "run.csv", "-o", "report.html");
}

const unfold = (page) => page.evaluate(() => document.querySelectorAll("details.part").forEach((part) => (part.open = true)));

async function open(browser, options = {}) {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  const heard = listen(page);
  await page.goto(`file://${path("report.html")}`);
  return { context, page, ...heard };
}

async function withScript(browser) {
  const { context, page, complaints, requests } = await open(browser, { viewport: { width: 1100, height: 900 } });
  await page.waitForSelector("html[data-ready=yes]");
  assert.deepEqual(complaints, []);
  assert.deepEqual(requests, [`file://${path("report.html")}`], "the page asks for nothing");
  assert.equal(await page.title(), `Calibration of accelerometer ${HOSTILE}`, "typed text is shown as typed");
  assert.equal(await page.locator("img").count(), 0);
  const plots = await page.evaluate(() => window.axiscalReport.plots());
  assert.equal(plots, await page.locator("svg.drawn").count());
  assert.ok(plots >= 8);
  assert.ok(!(await page.locator("#residuals-by-run").isVisible()));
  await page.locator("nav a[href='#residuals']").click();
  assert.ok(await page.locator("#residuals-by-run").isVisible());
  await unfold(page);
  // A reading under the pointer has a readout, and is highlighted in the table and in the other figures.
  const mark = page.locator("#residuals-by-run .mark").nth(4);
  await mark.scrollIntoViewIfNeeded();
  const area = await mark.boundingBox();
  await page.mouse.move(area.x + area.width / 2 + 3, area.y + area.height / 2 + 3);
  const pointed = await mark.getAttribute("data-run");
  assert.match(await page.locator("#residuals-by-run .readout").textContent(), /^[xyz]: run \d+, residual \[V\] [\u2212\d]/);
  assert.equal(await page.locator("tr.pointed").count(), 1);
  assert.equal(await page.locator("tr.pointed").getAttribute("data-run"), pointed);
  assert.ok((await page.locator("#residuals-by-face .mark.pointed").count()) >= 1);
  await page.mouse.move(0, 0);
  assert.equal(await page.locator(".pointed").count(), 0);
  assert.equal(await page.locator("svg.drawn title").count(), 0, "no mark is named twice");
  // A button enlarges a figure.
  const figure = page.locator("#residuals-by-run");
  const small = (await figure.boundingBox()).width;
  await figure.locator("button.enlarge").click();
  assert.ok((await figure.boundingBox()).width > 1.5 * small);
  await figure.locator("button.enlarge").click();
  // The cube is drawn, turns with the mouse and the keys, and takes the pose of the selected reading.
  const canvas = page.locator("#cube-view canvas");
  await canvas.scrollIntoViewIfNeeded();
  assert.ok(await comesTrue(async () => (await canvas.evaluate(inked)) > 0.1), "the cube has pixels");
  const view = () => page.evaluate(() => window.axiscalReport.cube.view());
  const before = await view();
  const box = await canvas.boundingBox();
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 300, box.y + 180);
  await page.mouse.up();
  const turned = await view();
  assert.ok(Math.abs(turned.around - before.around) > 0.5);
  await canvas.focus();
  await page.keyboard.press("ArrowUp");
  assert.ok((await view()).above > turned.above);
  await page.locator("[data-reading='5']").press("Enter");
  assert.equal(await page.locator("[data-reading='5']").getAttribute("aria-pressed"), "true");
  const said = await page.locator("#cube-reading").textContent();
  const row = page.locator("tr", { has: page.locator("[data-reading='5']") });
  assert.ok(said.startsWith(`Run ${await page.locator("[data-reading='5']").textContent()}: face `));
  assert.ok(said.includes(await row.locator("td").first().textContent()));
  await page.locator("#cube-next").click();
  assert.equal(await page.evaluate(() => window.axiscalReport.cube.chosen()), 6);
  // Each plot has a description and a table.
  for (const figure of await page.locator("figure").all()) {
    assert.ok((await figure.locator("svg[role=img]").first().getAttribute("aria-label")).length > 20);
    assert.ok((await figure.locator("details table tbody tr").count()) > 0);
  }
  await page.emulateMedia({ colorScheme: "dark" });
  const paper = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  assert.equal(paper, "rgb(20, 24, 28)");
  await page.emulateMedia({ colorScheme: "light" });
  await page.evaluate(() => document.querySelectorAll("details.part").forEach((part) => (part.open = false)));
  const pdf = await page.pdf({ format: "A4" });
  assert.ok(pdf.length > 20000 && pdf.subarray(0, 5).toString() === "%PDF-");
  await context.close();
}

async function contrast(browser) {
  for (const colorScheme of ["light", "dark"]) {
    const { context, page } = await open(browser, { colorScheme, bypassCSP: true });
    await page.waitForSelector("html[data-ready=yes]");
    await unfold(page);
    await page.waitForTimeout(300);
    await assertAccessible(folder, page, `report, ${colorScheme}`);
    const worst = await page.evaluate(() => {
      const rgb = (text) => text.match(/[\d.]+/g).map(Number);
      const luminance = ([r, g, b]) => {
        const [x, y, z] = [r, g, b].map((v) => (v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
        return 0.2126 * x + 0.7152 * y + 0.0722 * z;
      };
      const behind = (element) => {
        for (let at = element; at; at = at.parentElement) {
          const color = rgb(getComputedStyle(at).backgroundColor);
          if (color.length < 4 || color[3] > 0) {
            return color;
          }
        }
        return [255, 255, 255];
      };
      let least = 21;
      let what = "";
      for (const element of document.querySelectorAll("main *, header *")) {
        const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
        if (!own || element.closest("svg") || !element.checkVisibility()) {
          continue;
        }
        const [a, b] = [luminance(rgb(getComputedStyle(element).color)), luminance(behind(element))];
        const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        if (ratio < least) {
          [least, what] = [ratio, element.outerHTML.slice(0, 80)];
        }
      }
      return { least, what };
    });
    assert.ok(worst.least >= 4.5, `contrast ${worst.least} in ${colorScheme}: ${worst.what}`);
    await context.close();
  }
}

async function withoutScript(browser) {
  const { context, page } = await open(browser, { javaScriptEnabled: false });
  assert.ok((await page.locator("svg.drawn").count()) >= 6);
  assert.ok(await page.locator("svg.drawn").first().isVisible());
  assert.ok((await page.locator("svg.drawn .mark title").count()) > 20, "marks have their words");
  assert.equal(await page.locator(".seats li").count(), 12);
  await page.locator("#points summary").first().click();
  assert.ok(await page.locator(".seats li").first().isVisible());
  await context.close();
}

// The page works without WebGL.
async function withoutWebGL() {
  const browser = await launch(folder, { webgl: false });
  const { page, complaints } = await open(browser);
  await page.waitForSelector("html[data-ready=yes]");
  await unfold(page);
  const canvas = page.locator("#cube-view canvas");
  assert.ok(await comesTrue(async () => (await canvas.evaluate(inked)) > 0.1), "the cube has pixels");
  assert.deepEqual(complaints, []);
  await browser.close();
}

// Fills in a run sheet on a phone. Typed values survive a reload, and calibrate reads the saved CSV.
async function runSheet(browser) {
  run("plan", "--seed", "5", "-o", "sheet.csv", "--page", "sheet.html");
  run("simulate", "--truth", "truth.json", "--noise", "1e-4", "--seed", "5", "-o", "filled.csv");
  const values = new Map(
    readFileSync(path("filled.csv"), "utf8").trim().split("\n").slice(1).map((line) => line.split(",")).map((cells) => [`${cells[2]},${cells[3]}`, cells.slice(4, 7)]),
  );
  const context = await browser.newContext({ viewport: { width: 390, height: 844 }, acceptDownloads: true, bypassCSP: true });
  const page = await context.newPage();
  const { complaints, requests } = listen(page);
  await page.goto(`file://${path("sheet.html")}`);
  await page.fill("[name=serial]", "QA 113");
  await page.fill("[name=operator]", 'A. "Ann" Smith, Jr.');
  const steps = page.locator("li[data-cells]");
  assert.equal(await steps.count(), 12);
  await assertAccessible(folder, page, "run sheet");
  for (let i = 0; i < 12; ++i) {
    const [, , rest, fence] = (await steps.nth(i).getAttribute("data-cells")).split(",");
    const fields = steps.nth(i).locator("input[data-axis]");
    for (let k = 0; k < 3; ++k) {
      // The first reading has decimal commas.
      const typed = values.get(`${rest},${fence}`)[k];
      await fields.nth(k).fill(i === 0 ? typed.replace(".", ",") : typed);
    }
    if (i === 5) {
      const [half] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
      await half.saveAs(path("half.csv"));
      assert.equal(readFileSync(path("half.csv"), "utf8").trim().split("\n").length, 7);
      assert.match(await page.textContent("#told"), /^6 of 12 readings saved/);
      await page.reload();
      assert.match(await page.textContent("#told"), /^6 of 12/);
    }
  }
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
  assert.equal(download.suggestedFilename(), "QA_113.csv");
  await download.saveAs(path("typed.csv"));
  run("calibrate", "typed.csv", "--instrument", "accelerometer", "--unit", "V", "-o", "typed.json");
  const typed = JSON.parse(readFileSync(path("typed.json"), "utf8"));
  assert.equal(typed.statistics.observations, 12);
  assert.equal(typed.instrument.serial, "QA 113");
  assert.deepEqual(complaints, []);
  assert.ok(requests.every((url) => /^(file|data|blob):/.test(url)));
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
  // The CSV of the empty sheet has the same columns for the axes.
  assert.equal(readFileSync(path("sheet.csv"), "utf8").split("\n")[0], "run,block,rest,fence,x,y,z,temperature");
  await context.close();
}

try {
  const browser = await launch(folder);
  makeReport();
  assert.ok(statSync(path("report.html")).size < 420e3, "the report of 24 readings is light");
  assert.ok(!/(src|href)=["']?(https?:)?\/\//.test(readFileSync(path("report.html"), "utf8").split("<script")[0]));
  await withScript(browser);
  await contrast(browser);
  await runSheet(browser);
  await withoutScript(browser);
  await browser.close();
  await withoutWebGL();
  console.log("report: all good");
} finally {
  rmSync(scratch, { recursive: true, force: true });
}
