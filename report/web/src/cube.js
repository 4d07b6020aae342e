// SPDX-License-Identifier: Apache-2.0
// Draws the cube on its table in the pose of the selected reading. Dragging and arrow keys turn the view.
// Without scripts, the page shows the drawings of the poses.
import { between, drawScene, quaternionOf } from "./scene.js";

const TURN_MS = 600;

export function showCube(cube) {
  const place = document.getElementById("cube-view");
  if (!place || !cube || cube.readings.length === 0) {
    return null;
  }
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  canvas.tabIndex = 0;
  place.append(canvas);
  document.getElementById("cube").classList.add("is-live");
  const view = { around: -0.6, above: 0.42 };
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let from = [1, 0, 0, 0];
  let to = from;
  let pose = from;
  let started = 0;
  let chosen = -1;

  function draw(now) {
    const share = still ? 1 : Math.max(0, Math.min(1, (now - started) / TURN_MS));
    pose = between(from, to, share * share * (3 - 2 * share));
    drawScene(canvas, { pose, letters: to, view, field: cube.field_in_table }, 1.6);
    if (share < 1) {
      requestAnimationFrame(draw);
    }
  }
  const redraw = () => requestAnimationFrame(draw);

  const details = document.getElementById("cube-reading");
  const rows = [...document.querySelectorAll("[data-reading]")];
  function choose(index) {
    const first = chosen < 0;
    chosen = index;
    const reading = cube.readings[index];
    from = pose;
    to = quaternionOf(reading.rotation_table_from_positioner);
    started = performance.now() - (first ? TURN_MS : 0);
    rows.forEach((row) => row.setAttribute("aria-pressed", String(Number(row.dataset.reading) === index)));
    details.textContent = reading.text;
    canvas.setAttribute("aria-label", reading.text);
    redraw();
  }
  rows.forEach((row) => row.addEventListener("click", () => choose(Number(row.dataset.reading))));
  for (const [id, step] of [["cube-back", -1], ["cube-next", 1]]) {
    const count = cube.readings.length;
    document.getElementById(id).addEventListener("click", () => choose((chosen + step + count) % count));
  }

  let grip = null;
  function look(around, above) {
    view.around = around;
    view.above = Math.max(0, Math.min(1.5, above));
    redraw();
  }
  canvas.addEventListener("pointerdown", (event) => {
    grip = { x: event.clientX, y: event.clientY, ...view };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (grip) {
      look(grip.around - (event.clientX - grip.x) * 0.01, grip.above + (event.clientY - grip.y) * 0.01);
    }
  });
  canvas.addEventListener("pointerup", () => (grip = null));
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const move = moves[event.key];
    if (move) {
      event.preventDefault();
      look(view.around + move[0], view.above + move[1]);
    }
  });
  new ResizeObserver(redraw).observe(place);
  choose(0);
  return { choose, view: () => ({ ...view }), chosen: () => chosen };
}
