// SPDX-License-Identifier: Apache-2.0
// The cube on its table, in the pose of the reading that is chosen; drag turns the view. Without WebGL
// the drawn poses stay.
import {
  AmbientLight,
  ArrowHelper,
  BoxGeometry,
  CanvasTexture,
  Color,
  DirectionalLight,
  Group,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Quaternion,
  Scene,
  SphereGeometry,
  Vector3,
  WebGLRenderer,
} from "three";

const FACES = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"]; // as three orders a box's sides

function faceTexture(name) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 128;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "#f6f2e8";
  pen.fillRect(0, 0, 128, 128);
  pen.strokeStyle = "#3a3a3a";
  pen.lineWidth = 4;
  pen.strokeRect(2, 2, 124, 124);
  pen.fillStyle = "#1a1a1a";
  pen.font = "600 52px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(name.replace("-", "\u2212"), 64, 68);
  return new CanvasTexture(canvas);
}

export function makeScene(cube) {
  const scene = new Scene();
  scene.up.set(0, 0, 1);
  scene.add(new AmbientLight(0xffffff, 1.6));
  const sun = new DirectionalLight(0xffffff, 1.8);
  sun.position.set(3, -5, 8);
  scene.add(sun);
  const table = new Mesh(new BoxGeometry(5, 4, 0.1), new MeshLambertMaterial({ color: 0x9aa7b4 }));
  table.position.set(0, 0, -1.3);
  const fence = new Mesh(new BoxGeometry(5, 0.12, 1.6), new MeshLambertMaterial({ color: 0x7f8c99 }));
  fence.position.set(0, 1.31, -0.45);
  scene.add(table, fence);
  const body = new Group();
  body.add(
    new Mesh(
      new BoxGeometry(2, 2, 2),
      FACES.map((name) => new MeshLambertMaterial({ map: faceTexture(name) })),
    ),
  );
  const ball = new SphereGeometry(0.12, 16, 12);
  const steel = new MeshLambertMaterial({ color: 0x555b61 });
  for (let axis = 0; axis < 3; ++axis) {
    for (const side of [1, -1]) {
      for (const [u, v] of [[0.7, 0.7], [-0.7, 0.7], [0, -0.7]]) {
        const foot = new Mesh(ball, steel);
        const at = [0, 0, 0];
        at[axis] = side * 1.12;
        at[(axis + 1) % 3] = u;
        at[(axis + 2) % 3] = v;
        foot.position.set(...at);
        body.add(foot);
      }
    }
  }
  scene.add(body);
  if (cube.field_in_table) {
    const field = new Vector3(...cube.field_in_table).normalize();
    const arrow = new ArrowHelper(field, new Vector3(-2, -1.2, -1.2), 2.2, 0x0b57b0, 0.35, 0.2);
    scene.add(arrow);
  }
  return { scene, body };
}

// A box's sides, in the order of FACES: their normal, and how the letters stand on them (right, up).
const LETTERS = [
  { normal: [1, 0, 0], right: [0, 0, -1], up: [0, 1, 0] },
  { normal: [-1, 0, 0], right: [0, 0, 1], up: [0, 1, 0] },
  { normal: [0, 1, 0], right: [1, 0, 0], up: [0, 0, -1] },
  { normal: [0, -1, 0], right: [1, 0, 0], up: [0, 0, 1] },
  { normal: [0, 0, 1], right: [1, 0, 0], up: [0, 1, 0] },
  { normal: [0, 0, -1], right: [-1, 0, 0], up: [0, 1, 0] },
];

// Turns the letters so that they stand upright in a pose: up at the sides, away from the one who
// looks on the top.
export function standLettersUp(body, pose) {
  body.children[0].material.forEach((material, i) => {
    const turned = (v) => new Vector3(...v).applyQuaternion(pose);
    const top = Math.abs(turned(LETTERS[i].normal).z) > 0.7;
    const wanted = top ? new Vector3(0, 1, 0) : new Vector3(0, 0, 1);
    const angle = -Math.atan2(wanted.dot(turned(LETTERS[i].right)), wanted.dot(turned(LETTERS[i].up)));
    material.map.center.set(0.5, 0.5);
    material.map.rotation = Math.round((2 * angle) / Math.PI) * (Math.PI / 2);
  });
}

export function quaternionOf(rotation) {
  const [a, b, c] = rotation;
  const matrix = new Matrix4().set(a[0], a[1], a[2], 0, b[0], b[1], b[2], 0, c[0], c[1], c[2], 0, 0, 0, 0, 1);
  return new Quaternion().setFromRotationMatrix(matrix);
}

export function showCube(cube) {
  const place = document.getElementById("cube-view");
  if (!place || !cube || cube.readings.length === 0) {
    return null;
  }
  let renderer;
  try {
    renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  } catch {
    return null; // no WebGL: the drawings stay
  }
  place.append(renderer.domElement);
  document.getElementById("cube").classList.add("is-live");
  renderer.domElement.setAttribute("role", "img");
  const { scene, body } = makeScene(cube);
  const camera = new PerspectiveCamera(35, 1.5, 0.1, 50);
  camera.up.set(0, 0, 1);
  const view = { around: -0.6, above: 0.42, distance: 10.5 };
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let from = new Quaternion();
  let to = new Quaternion();
  let started = 0;
  let chosen = -1;

  function draw(now) {
    const width = place.clientWidth || 600;
    const height = Math.round(width / 1.6);
    if (renderer.domElement.clientWidth !== width || renderer.domElement.clientHeight !== height) {
      renderer.setPixelRatio(devicePixelRatio);
      renderer.setSize(width, height);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
    }
    const share = still ? 1 : Math.min(1, (now - started) / 600);
    body.quaternion.slerpQuaternions(from, to, share * share * (3 - 2 * share));
    camera.position.set(
      view.distance * Math.cos(view.above) * Math.sin(view.around),
      -view.distance * Math.cos(view.above) * Math.cos(view.around),
      view.distance * Math.sin(view.above),
    );
    camera.lookAt(0, 0, -0.35);
    scene.background = new Color(
      getComputedStyle(document.documentElement).getPropertyValue("--panel").trim(),
    );
    renderer.render(scene, camera);
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
    from = body.quaternion.clone();
    to = quaternionOf(reading.rotation_table_from_positioner);
    standLettersUp(body, to);
    started = performance.now() - (first ? 1000 : 0);
    rows.forEach((row) => row.setAttribute("aria-pressed", String(Number(row.dataset.reading) === index)));
    details.textContent = reading.text;
    renderer.domElement.setAttribute("aria-label", reading.text);
    redraw();
  }
  rows.forEach((row) => row.addEventListener("click", () => choose(Number(row.dataset.reading))));
  for (const [id, step] of [["cube-back", -1], ["cube-next", 1]]) {
    const count = cube.readings.length;
    document.getElementById(id).addEventListener("click", () => choose((chosen + step + count) % count));
  }

  let grip = null;
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.addEventListener("pointerdown", (event) => {
    grip = { x: event.clientX, y: event.clientY, ...view };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (grip) {
      view.around = grip.around - (event.clientX - grip.x) * 0.01;
      view.above = Math.max(-0.1, Math.min(1.5, grip.above + (event.clientY - grip.y) * 0.01));
      redraw();
    }
  });
  canvas.addEventListener("pointerup", () => (grip = null));
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const move = moves[event.key];
    if (move) {
      view.around += move[0];
      view.above = Math.max(-0.1, Math.min(1.5, view.above + move[1]));
      event.preventDefault();
      redraw();
    }
  });
  new ResizeObserver(redraw).observe(place);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  choose(0);
  return { choose, view: () => ({ ...view }), chosen: () => chosen };
}
