// SPDX-License-Identifier: Apache-2.0
// The cube of a live session. It turns from the present pose to the requested pose. The face for the table
// and the face for the fence are marked. The text next to it has the same content.
import { angleBetween, between, cross, drawScene, normalOf, quaternionOf } from "./scene.js";

// The rotation matrix table from cube. Its rows are the table's x, y, z axes in the cube's frame: z points away
// from the rest face, y points to the fence.
export function rotationOf({ rest, fence }) {
  const z = normalOf(rest).map((v) => -v);
  const y = normalOf(fence);
  return [cross(y, z), y, z];
}

const WAIT_S = 0.8;
const TURN_S = 1.6;
const ROUND_S = 5;
const VIEW = { around: 0.51, above: 0.45 };

export function makeGuidedCube(place) {
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  place.append(canvas);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let from = null;
  let to = null;
  let marks = {};
  let started = 0;
  let shown = "";
  let drawn = "";
  let looping = false;

  function draw(time) {
    // The animation shows the present pose, the turn and the requested pose, and repeats.
    const share = still || !from ? 1 : Math.min(1, Math.max(0, (time - WAIT_S) / TURN_S));
    const moves = !still && from && angleBetween(from, to) > 0.01;
    drawScene(
      canvas,
      {
        pose: between(from ?? to, to, share * share * (3 - 2 * share)),
        letters: from && share < 0.5 ? from : to,
        lift: moves ? 0.9 * Math.sin(Math.PI * share) : 0,
        view: VIEW,
        ...marks,
      },
      1.7,
    );
  }

  // Draws 20 frames a second, and only while the cube moves, because the page may run on a slow machine.
  function loop() {
    const time = ((performance.now() - started) / 1000) % ROUND_S;
    if (!document.hidden && (drawn !== shown || (time > WAIT_S && time < WAIT_S + TURN_S + 0.2))) {
      draw(time);
      drawn = shown;
    }
    if (!still && from) {
      setTimeout(loop, 50);
    } else {
      looping = false;
    }
  }

  new ResizeObserver(() => to && draw(ROUND_S)).observe(place);

  return {
    show(view) {
      const key = JSON.stringify([view.wanted, view.present, view.phase === "laying"]);
      if (key === shown) {
        return;
      }
      shown = key;
      const pose = view.wanted ?? view.present;
      if (!pose) {
        return;
      }
      to = quaternionOf(rotationOf(pose));
      from = view.present && view.phase !== "dwelling" ? quaternionOf(rotationOf(view.present)) : null;
      marks = { rest: view.wanted?.rest, fence: view.wanted?.fence };
      started = performance.now();
      canvas.setAttribute("aria-label", `Face ${pose.rest} on the table, face ${pose.fence} at the fence`);
      if (!looping) {
        looping = true;
        loop();
      }
    },
  };
}
