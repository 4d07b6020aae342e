// SPDX-License-Identifier: Apache-2.0
// Draws the cube on its table in front of the fence, on a canvas in parallel projection. Table frame: x right,
// y to the fence, z up. A pose is a unit quaternion [w, x, y, z], the rotation table from cube.
const FACES = {
  "+X": [[1, 0, 0], [0, 1, 0]],
  "-X": [[-1, 0, 0], [0, 1, 0]],
  "+Y": [[0, 1, 0], [0, 0, 1]],
  "-Y": [[0, -1, 0], [0, 0, 1]],
  "+Z": [[0, 0, 1], [1, 0, 0]],
  "-Z": [[0, 0, -1], [1, 0, 0]],
}; // the normal and the direction of an edge of each face
const FEET = [[0.7, 0.7], [-0.7, 0.7], [0, -0.7]];
const RADIANS_AT_REST = 1e-9;

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const times = (a, factor) => a.map((v) => v * factor);
const plus = (...all) => [0, 1, 2].map((i) => all.reduce((sum, v) => sum + v[i], 0));
export const normalOf = (face) => FACES[face][0];

// Converts a rotation matrix, given by its rows, to a quaternion.
export function quaternionOf([a, b, c]) {
  const parts = [
    [1 + a[0] + b[1] + c[2], c[1] - b[2], a[2] - c[0], b[0] - a[1]],
    [c[1] - b[2], 1 + a[0] - b[1] - c[2], b[0] + a[1], a[2] + c[0]],
    [a[2] - c[0], b[0] + a[1], 1 - a[0] + b[1] - c[2], c[1] + b[2]],
    [b[0] - a[1], a[2] + c[0], c[1] + b[2], 1 - a[0] - b[1] + c[2]],
  ];
  const largest = parts.reduce((best, part, i) => (part[i] > best[0] ? [part[i], part] : best), [-1, null])[1];
  const length = Math.hypot(...largest);
  return largest.map((v) => v / length);
}

export function turned([w, ...q], v) {
  const t = times(cross(q, v), 2);
  return plus(v, times(t, w), cross(q, t));
}

const fourDot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
export const angleBetween = (a, b) => 2 * Math.acos(Math.min(1, Math.abs(fourDot(a, b))));

// Interpolates between two poses along the shorter way (slerp).
export function between(from, to, share) {
  const sign = fourDot(from, to) < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(1, Math.abs(fourDot(from, to))));
  const part = (t) => (angle < RADIANS_AT_REST ? t : Math.sin(t * angle) / Math.sin(angle));
  const mixed = from.map((v, i) => part(1 - share) * v + sign * part(share) * to[i]);
  const length = Math.hypot(...mixed);
  return mixed.map((v) => v / length);
}

// Selects one of the four orientations of the letters on a face: upright on the sides, away from the viewer on
// the top.
function lettersOf(face, pose) {
  const [normal, edge] = FACES[face];
  const wanted = Math.abs(turned(pose, normal)[2]) > 0.7 ? [0, 1, 0] : [0, 0, 1];
  const ups = [edge, cross(normal, edge), times(edge, -1), cross(edge, normal)];
  const up = ups.reduce((best, one) => (dot(turned(pose, one), wanted) > dot(turned(pose, best), wanted) ? one : best));
  return { right: cross(up, normal), up };
}

// Draws the scene and fits the canvas to its width.
// @param scene  pose: pose of the cube; letters: pose in which the letters are upright; lift: height above the
//               table; view: angles {around, above} in radians; field: arrow in the table's frame; rest,
//               fence: faces to be marked. The places on the table and at the fence are marked too.
export function drawScene(canvas, scene, aspect) {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = canvas.clientWidth || 600;
  const height = Math.round(width / aspect);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    canvas.style.height = `${height}px`;
  }
  const pen = canvas.getContext("2d");
  const { around, above } = scene.view;
  const eye = [Math.cos(above) * Math.sin(around), -Math.cos(above) * Math.cos(around), Math.sin(above)];
  const right = [Math.cos(around), Math.sin(around), 0];
  const up = cross(eye, right);
  const size = ratio * Math.min(width / 5.6, height / 4.4);
  const flat = (v) => [size * dot(right, v), -size * dot(up, v)];
  const place = (p) => {
    const [x, y] = flat(plus(p, [0, 0, 0.35]));
    return [0.5 * ratio * width + x, 0.5 * ratio * height + y];
  };
  const shade = (normal, [r, g, b]) => {
    const light = 0.62 + 0.38 * Math.max(0, dot(normal, [0.3, -0.5, 0.81]));
    return `rgb(${r * light} ${g * light} ${b * light})`;
  };
  const polygon = (corners, fill) => {
    pen.beginPath();
    corners.forEach((corner) => pen.lineTo(...place(corner)));
    pen.closePath();
    pen.fillStyle = fill;
    pen.fill();
  };
  const square = (centre, a, b) => [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([u, v]) => plus(centre, times(a, u), times(b, v)));
  const box = (centre, half, color) => {
    for (const [normal, edge] of Object.values(FACES)) {
      if (dot(normal, eye) > 0) {
        const other = cross(normal, edge);
        const scaled = (v) => v.map((one, i) => one * half[i]);
        polygon(square(plus(centre, scaled(normal)), scaled(edge), scaled(other)), shade(normal, color));
      }
    }
  };
  const foot = (at) => {
    const [x, y] = place(at);
    const ball = pen.createRadialGradient(x - 0.04 * size, y - 0.05 * size, 0, x, y, 0.13 * size);
    ball.addColorStop(0, "#a9afb5");
    ball.addColorStop(1, "#4a5056");
    pen.beginPath();
    pen.arc(x, y, 0.12 * size, 0, 2 * Math.PI);
    pen.fillStyle = ball;
    pen.fill();
  };
  const centre = [0, 0, scene.lift ?? 0];
  const inTable = (v) => plus(centre, turned(scene.pose, v));
  const fence = () => {
    box([0, 1.31, -0.45], [2.5, 0.06, 0.8], [127, 140, 153]);
    if (scene.fence && eye[1] < 0) {
      polygon(square([0, 1.24, 0], [1.3, 0, 0], [0, 0, 1.2]), "rgb(224 122 47 / 0.5)");
    }
  };
  const face = (name) => {
    const [normal, edge] = FACES[name];
    const corners = square(inTable(normal), turned(scene.pose, edge), turned(scene.pose, cross(normal, edge)));
    polygon(corners, shade(turned(scene.pose, normal), [246, 242, 232]));
    pen.strokeStyle = "#3a3a3a";
    pen.lineWidth = 0.03 * size;
    pen.stroke();
    const mark = name === scene.rest ? "rgb(47 127 224 / 0.55)" : name === scene.fence ? "rgb(224 122 47 / 0.55)" : null;
    if (mark) {
      polygon(corners, mark);
    }
    const letters = lettersOf(name, scene.letters ?? scene.pose);
    const [ux, uy] = flat(turned(scene.pose, letters.right));
    const [vx, vy] = flat(turned(scene.pose, letters.up));
    pen.save();
    pen.transform(ux / 100, uy / 100, -vx / 100, -vy / 100, ...place(inTable(normal)));
    pen.fillStyle = "#1a1a1a";
    pen.font = "600 80px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(name.replace("-", "\u2212"), 0, 5);
    pen.restore();
  };
  const arrow = (field) => {
    const start = [-2, -1.2, -1.2];
    const end = plus(start, times(field, 2.2 / Math.hypot(...field)));
    const [[x, y], [tipX, tipY]] = [place(start), place(end)];
    const length = Math.hypot(tipX - x, tipY - y);
    const [dx, dy] = length > 0 ? [(tipX - x) / length, (tipY - y) / length] : [0, 0];
    const head = Math.min(0.35 * size, length);
    pen.strokeStyle = pen.fillStyle = "#0b57b0";
    pen.lineWidth = 0.05 * size;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(tipX - head * dx, tipY - head * dy);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(tipX, tipY);
    pen.lineTo(tipX - head * dx + 0.45 * head * dy, tipY - head * dy - 0.45 * head * dx);
    pen.lineTo(tipX - head * dx - 0.45 * head * dy, tipY - head * dy + 0.45 * head * dx);
    pen.fill();
  };

  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  box([0, 0, -1.3], [2.5, 2, 0.05], [154, 167, 180]);
  if (scene.rest && eye[2] > 0) {
    polygon(square([0, 0, -1.24], [1.4, 0, 0], [0, 1.4, 0]), "rgb(47 127 224 / 0.5)");
  }
  if (eye[1] <= 0) {
    fence();
  }
  // Draws the feet of the hidden faces, then the visible faces, then their feet.
  const seen = Object.keys(FACES).filter((name) => dot(turned(scene.pose, normalOf(name)), eye) > 0);
  const feetOf = (name) => {
    const [normal, edge] = FACES[name];
    FEET.forEach(([u, v]) => foot(inTable(plus(times(normal, 1.12), times(edge, u), times(cross(normal, edge), v)))));
  };
  Object.keys(FACES).filter((name) => !seen.includes(name)).forEach(feetOf);
  seen.forEach(face);
  seen.forEach(feetOf);
  if (scene.field) {
    arrow(scene.field);
  }
  if (eye[1] > 0) {
    fence();
  }
}
