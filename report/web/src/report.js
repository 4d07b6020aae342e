// SPDX-License-Identifier: Apache-2.0
// The page is complete without this script. The script displays the values of marks, turns the cube, copies
// tables, and opens folded parts for links and for printing.
import { showCube } from "./cube.js";
import { showPlots } from "./plots.js";

const data = JSON.parse(document.getElementById("report-data").textContent);

function addCopyButtons() {
  for (const table of document.querySelectorAll("table[data-copy]")) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "copy";
    button.textContent = "Copy table";
    button.addEventListener("click", async () => {
      const text = [...table.rows]
        .map((row) => [...row.cells].map((cell) => cell.dataset.value ?? cell.textContent).join("\t"))
        .join("\n");
      button.textContent = (await copied(text)) ? "Copied" : "Select and copy by hand";
      setTimeout(() => (button.textContent = "Copy table"), 2000);
    });
    table.after(button);
  }
}

// A page from a file may not have access to the clipboard API. The fallback copies a selection.
async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    return done;
  }
}

const partOf = (hash) => (/^#[a-z]+$/.test(hash) ? document.querySelector(`${hash} > details.part`) : null);

function openPart(hash) {
  const part = partOf(hash);
  if (part) {
    part.open = true;
  }
}

document.querySelectorAll("nav a").forEach((link) => link.addEventListener("click", () => openPart(link.hash)));
openPart(location.hash);

// Opens all folded parts for printing, and folds them again afterwards.
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details.part:not([open])")];
  folded.forEach((part) => (part.open = true));
});
addEventListener("afterprint", () => folded.forEach((part) => (part.open = false)));

// Makes tables that are wider than the page focusable, so that keys can scroll them.
function reachWideTables() {
  for (const table of document.querySelectorAll("table")) {
    if (table.closest("details:not([open])")) {
      continue; // measuring a folded table would take seconds in a large report
    }
    table.scrollWidth > table.clientWidth ? table.setAttribute("tabindex", "0") : table.removeAttribute("tabindex");
  }
}
addEventListener("resize", reachWideTables);
document.querySelectorAll("details").forEach((part) => part.addEventListener("toggle", reachWideTables));

addCopyButtons();
reachWideTables();
const plots = showPlots();
const cube = showCube(data.cube);
document.documentElement.dataset.ready = "yes";
// For tests.
window.axiscalReport = { plots, cube };
