// SPDX-License-Identifier: Apache-2.0
// Lets a person fill in the run sheet on a phone. The browser stores the typed values. The page saves them as
// the CSV that `axiscal calibrate` reads. Without this script the sheet can be printed and filled in by hand.
(() => {
  const form = document.getElementById("sheet");
  const inputs = [...form.querySelectorAll("input")];
  const key = `axiscal ${location.pathname} ${form.dataset.header} ${form.dataset.seed}`;
  const stored = (() => {
    try {
      return JSON.parse(localStorage.getItem(key) ?? "{}");
    } catch {
      return {};
    }
  })();
  const tell = (text) => (document.getElementById("told").textContent = text);
  // Replaces a decimal comma by a point.
  const number = (text) => text.trim().replace(/^\u2212/, "-").replace(",", ".");
  const isNumber = (text) => text !== "" && Number.isFinite(Number(text));

  function keep() {
    try {
      localStorage.setItem(key, JSON.stringify(Object.fromEntries(inputs.map((input) => [input.name, input.type === "checkbox" ? input.checked : input.value]))));
    } catch {
      // The browser does not allow storage. Typed values are lost when the page is closed.
    }
  }

  function show() {
    const steps = [...form.querySelectorAll("li")];
    let next = null;
    let filled = 0;
    for (const step of steps) {
      const readings = [...step.querySelectorAll("input[data-axis]")];
      const wrong = readings.filter((input) => input.value.trim() !== "" && !isNumber(number(input.value)));
      readings.forEach((input) => input.setAttribute("aria-invalid", String(wrong.includes(input))));
      const done = readings.every((input) => isNumber(number(input.value)));
      step.classList.toggle("done", done);
      filled += done ? 1 : 0;
      next = next ?? (done ? null : step);
    }
    steps.forEach((step) => step.classList.toggle("next", step === next));
    tell(`${filled} of ${steps.length} readings`);
    return { steps, filled };
  }

  // @return the CSV of the complete readings, their number (kept), and the number of steps (all). The CSV may
  // contain a part of the run.
  function csv() {
    const readings = (step) => [...step.querySelectorAll("input[data-axis]")].map((input) => number(input.value));
    const steps = [...form.querySelectorAll("li")].filter((step) => readings(step).every(isNumber));
    const temperature = (step) => number(step.querySelector("input[data-temperature]")?.value ?? "");
    const withTemperature = steps.length > 0 && steps.every((step) => isNumber(temperature(step)));
    // Each row repeats the serial number, the operator and the date. The record takes its serial number from here.
    const about = ["serial", "operator", "date"].filter((name) => form.elements[name].value.trim() !== "");
    const head = [form.dataset.header, ...form.dataset.axes.split("\t").map(cell), ...(withTemperature ? ["temperature"] : []), ...about];
    const lines = [head.join(",")];
    for (const step of steps) {
      const cells = [...readings(step), ...(withTemperature ? [temperature(step)] : [])];
      lines.push([step.dataset.cells, ...cells, ...about.map((name) => cell(form.elements[name].value.trim()))].join(","));
    }
    return { text: `${lines.join("\n")}\n`, kept: steps.length, all: form.querySelectorAll("li").length };
  }
  const cell = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

  form.classList.add("live");
  for (const input of inputs) {
    if (input.name in stored) {
      input.type === "checkbox" ? (input.checked = stored[input.name]) : (input.value = stored[input.name]);
    }
    input.addEventListener("input", () => {
      keep();
      show();
    });
  }
  form.addEventListener("submit", (event) => event.preventDefault());
  document.getElementById("save").addEventListener("click", () => {
    const { text, kept, all } = csv();
    if (kept === 0) {
      tell("no reading is complete yet: a value is missing or is not a number");
      return;
    }
    const serial = form.elements.serial.value.trim().replace(/[^\w.-]+/g, "_");
    const link = document.createElement("a");
    link.href = `data:text/csv;charset=utf-8,${encodeURIComponent(text)}`;
    link.download = `${serial || "run"}.csv`;
    link.click();
    const some = kept < all ? `${kept} of ${all} readings ` : "";
    const { instrument, unit } = form.dataset;
    const options = `--instrument ${instrument || "accelerometer"}${unit === "1" ? "" : ` --unit ${unit}`}`;
    const record = link.download.replace(/csv$/, "json");
    tell(`${some}saved as ${link.download}: axiscal calibrate ${link.download} ${options} -o ${record}`);
  });
  document.getElementById("clear").addEventListener("click", () => {
    if (confirm("Delete all typed values?")) {
      form.reset();
      keep();
      show();
    }
  });
  show();
})();
