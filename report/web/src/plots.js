// SPDX-License-Identifier: Apache-2.0
// Readouts for the figures. The values of the mark next to the pointer are displayed below the figure, and
// its run is highlighted in all figures and tables.
const REACH_PX = 24;
let pointed = null;

function pointAt(run) {
  if (run !== pointed) {
    pointed = run;
    document.querySelectorAll("[data-run]").forEach((one) => one.classList.toggle("pointed", one.dataset.run === run));
  }
}

// Distance from a point to a box, in the drawing's units; 0 inside the box.
function distance({ x, y }, box) {
  const past = (at, from, size) => Math.max(from - at, 0, at - from - size);
  return Math.hypot(past(x, box.x, box.width), past(y, box.y, box.height));
}

function nearest(marks, event, svg) {
  const toDrawing = svg.getScreenCTM().inverse();
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(toDrawing);
  let best = null;
  let least = REACH_PX * toDrawing.a;
  for (const mark of marks) {
    const far = distance(at, mark.box);
    if (far < least) {
      [least, best] = [far, mark];
    }
  }
  return best;
}

function showFigure(svg) {
  // Removes the tooltips of the marks, because the readout displays the same text.
  const marks = [...svg.querySelectorAll("title")].map((title) => {
    const element = title.parentElement;
    title.remove();
    return { element, words: title.textContent, box: null };
  });
  if (marks.length === 0) {
    return;
  }
  const words = document.createElement("p");
  words.className = "readout";
  words.textContent = "\u00a0";
  svg.closest(".plot").after(words);
  const say = (mark) => {
    words.textContent = mark?.words ?? "\u00a0";
    pointAt(mark?.element.dataset.run ?? null);
  };
  svg.addEventListener("pointermove", (event) => {
    marks.forEach((mark) => (mark.box ??= mark.element.getBBox()));
    say(nearest(marks, event, svg));
  });
  svg.addEventListener("pointerleave", () => say(null));
}

// Adds a button that enlarges a figure to the width of the page.
function addEnlarging(figure) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "enlarge";
  const name = () => (button.textContent = figure.classList.contains("large") ? "Smaller" : "Larger");
  button.addEventListener("click", () => {
    figure.classList.toggle("large");
    name();
  });
  name();
  figure.querySelector("figcaption")?.append(button);
}

export function showPlots() {
  const drawn = document.querySelectorAll("svg.drawn");
  drawn.forEach(showFigure);
  document.querySelectorAll(".plots > figure").forEach(addEnlarging);
  return () => drawn.length;
}
