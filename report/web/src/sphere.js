// SPDX-License-Identifier: Apache-2.0
// The sphere of a session without a cube: the readings, glowing regions without readings, and a marker at the
// current direction of the instrument. It is drawn on a 2D canvas thirty times a second, without WebGL.
const FRAME_MS = 33;
const CELLS = 160; // number of regions of the sphere
const NEAR = Math.cos((20 * Math.PI) / 180); // cosine of the angle within which a reading fills a region

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// Returns directions that are evenly spread over the sphere (golden spiral).
function directions(count) {
  const golden = Math.PI * (3 - Math.sqrt(5));
  return Array.from({ length: count }, (_, i) => {
    const z = 1 - (2 * i + 1) / count;
    const r = Math.sqrt(1 - z * z);
    return [r * Math.cos(golden * i), r * Math.sin(golden * i), z];
  });
}

export function makeSphere(canvas) {
  const cells = directions(CELLS);
  let raw = []; // readings in the order received
  let onSphere = new Float32Array(0);
  let filled = new Array(CELLS).fill(false);
  let free = null;
  let mapKey = "";
  let turn = 0.6;
  let tilt = 0.35;
  let grip = null;
  let frames = [];

  const toSphere = (v) => free.to_sphere.map((row) => row[0] * (v[0] - free.centre[0]) + row[1] * (v[1] - free.centre[1]) + row[2] * (v[2] - free.centre[2]));

  function fill(from) {
    for (let i = from; i < raw.length; ++i) {
      const p = toSphere(raw[i]);
      onSphere.set(p, 3 * i);
      const length = Math.hypot(...p) || 1;
      cells.forEach((cell, k) => {
        if (!filled[k] && (cell[0] * p[0] + cell[1] * p[1] + cell[2] * p[2]) / length > NEAR) {
          filled[k] = true;
        }
      });
    }
  }

  function draw(now) {
    const ratio = Math.min(devicePixelRatio, 2);
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    // The CPU draws thousands of small squares faster than a graphics card does.
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const radius = 0.42 * Math.min(width, height);
    const [cx, cy] = [width / 2, height / 2];
    const [ct, st, ca, sa] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    // Projects a direction to the canvas: x right, y up, depth towards the viewer.
    const seen = (x, y, z) => {
      const right = ct * x + st * y;
      const away = -st * x + ct * y;
      return [cx + radius * right, cy - radius * (ca * z + sa * away), sa * z - ca * away];
    };
    pen.fillStyle = color("--panel");
    pen.beginPath();
    pen.arc(cx, cy, radius, 0, 2 * Math.PI);
    pen.fill();
    // Draws the gaps with a pulsating glow.
    const breath = 0.55 + 0.25 * Math.sin(now / 350);
    pen.fillStyle = color("--fence");
    cells.forEach((cell, k) => {
      if (!filled[k]) {
        const [x, y, depth] = seen(...cell);
        pen.globalAlpha = (depth > 0 ? 0.5 : 0.14) * breath;
        pen.beginPath();
        pen.arc(x, y, 0.12 * radius, 0, 2 * Math.PI);
        pen.fill();
      }
    });
    const size = raw.length > 1500 ? 2 : 3;
    pen.fillStyle = color("--rest");
    // Draws the readings at the back of the sphere first, then those at the front.
    for (const front of [false, true]) {
      pen.globalAlpha = front ? 0.9 : 0.25;
      for (let i = 0; i < 3 * raw.length; i += 3) {
        const [px, py, pz] = [onSphere[i], onSphere[i + 1], onSphere[i + 2]];
        const away = ct * py - st * px;
        if (sa * pz - ca * away > 0 === front) {
          pen.fillRect(cx + radius * (ct * px + st * py) - size / 2, cy - radius * (ca * pz + sa * away) - size / 2, size, size);
        }
      }
    }
    pen.globalAlpha = 1;
    pen.strokeStyle = color("--line");
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(cx, cy, radius, 0, 2 * Math.PI);
    pen.stroke();
    pen.font = "600 15px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.fillStyle = color("--quiet");
    [[1.15, 0, 0, "x"], [0, 1.15, 0, "y"], [0, 0, 1.15, "z"]].forEach(([x, y, z, name]) => {
      const [px, py] = seen(x, y, z);
      pen.fillText(name, px, py + 5);
    });
    if (free) {
      const mark = (v, style, fillIt) => {
        const length = Math.hypot(...v) || 1;
        const [x, y, depth] = seen(v[0] / length, v[1] / length, v[2] / length);
        pen.globalAlpha = depth > 0 ? 1 : 0.45;
        pen.strokeStyle = pen.fillStyle = color(style);
        pen.lineWidth = 3;
        pen.beginPath();
        pen.arc(x, y, 11, 0, 2 * Math.PI);
        fillIt ? pen.fill() : pen.stroke();
      };
      if (!free.enough && free.count > 0) {
        mark(free.gap, "--fence", false);
      }
      mark(toSphere(free.now), "--good", true);
      pen.globalAlpha = 1;
    }
  }

  let drawn = 0;
  function loop(now) {
    requestAnimationFrame(loop);
    if (document.hidden || !canvas.isConnected || canvas.clientWidth === 0 || !free || now - drawn < FRAME_MS - 4) {
      return;
    }
    if (!grip && !matchMedia("(prefers-reduced-motion: reduce)").matches) {
      turn += 0.0016 * Math.min(100, now - drawn) * 0.25;
    }
    drawn = now;
    frames.push(now);
    frames = frames.filter((time) => now - time < 2000);
    draw(now);
  }
  requestAnimationFrame(loop);

  canvas.addEventListener("pointerdown", (event) => {
    grip = { x: event.clientX, y: event.clientY, turn, tilt };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (grip) {
      turn = grip.turn + (event.clientX - grip.x) * 0.01;
      tilt = Math.max(-1.5, Math.min(1.5, grip.tilt + (event.clientY - grip.y) * 0.01));
    }
  });
  canvas.addEventListener("pointerup", () => (grip = null));

  return {
    // Takes the new readings and the current map to the sphere.
    take(view, from, points) {
      if (from !== raw.length) {
        raw = raw.slice(0, from);
      }
      const first = raw.length;
      raw.push(...points);
      const map = JSON.stringify([view.centre, view.to_sphere]);
      free = view;
      if (onSphere.length < 3 * raw.length) {
        const larger = new Float32Array(6 * raw.length + 300);
        larger.set(onSphere);
        onSphere = larger;
      }
      if (map !== mapKey || from < first) {
        mapKey = map;
        filled = new Array(CELLS).fill(false);
        fill(0);
      } else {
        fill(first);
      }
    },
    framesPerSecond: () => frames.length / 2,
    filled: () => filled.filter(Boolean).length / CELLS,
    points: () => raw.length,
  };
}
