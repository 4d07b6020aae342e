// SPDX-License-Identifier: Apache-2.0
// The cube of a live session: it turns from how it lies to how it is to lie, the face for the table and
// the face for the fence marked. Without WebGL the words beside it say the same.
import { Color, DoubleSide, Mesh, MeshBasicMaterial, PerspectiveCamera, PlaneGeometry, WebGLRenderer } from "three";
import { makeScene, quaternionOf, standLettersUp } from "./cube.js";

const NORMALS = { "+X": [1, 0, 0], "-X": [-1, 0, 0], "+Y": [0, 1, 0], "-Y": [0, -1, 0], "+Z": [0, 0, 1], "-Z": [0, 0, -1] };
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// Rows x, y, z of the table in the cube's frame: z away from the rest face, y to the fence.
export function rotationOf({ rest, fence }) {
  const z = NORMALS[rest].map((v) => -v);
  const y = NORMALS[fence];
  return [cross(y, z), y, z];
}

const WAIT_S = 0.8;
const TURN_S = 1.6;
const ROUND_S = 5;

// A frame just outside a face.
function marker(color) {
  const mesh = new Mesh(new PlaneGeometry(1.86, 1.86), new MeshBasicMaterial({ color, transparent: true, opacity: 0.55, side: DoubleSide }));
  mesh.visible = false;
  return mesh;
}

function placeMarker(mesh, face) {
  mesh.visible = Boolean(face);
  if (face) {
    const normal = NORMALS[face];
    mesh.position.set(...normal.map((v) => 1.02 * v));
    mesh.lookAt(mesh.parent.localToWorld(mesh.position.clone().multiplyScalar(2)));
  }
}

export function makeGuidedCube(place) {
  let renderer;
  try {
    renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  } catch {
    place.hidden = true;
    return { show() {} };
  }
  place.append(renderer.domElement);
  renderer.domElement.setAttribute("role", "img");
  const { scene, body } = makeScene({});
  const restMark = marker(0x2f7fe0);
  const fenceMark = marker(0xe07a2f);
  body.add(restMark, fenceMark);
  // Where the two marked faces go.
  const onTable = marker(0x2f7fe0);
  onTable.position.set(0, 0, -1.24);
  onTable.scale.setScalar(1.5);
  const atFence = marker(0xe07a2f);
  atFence.position.set(0, 1.24, 0);
  atFence.rotation.x = Math.PI / 2;
  atFence.scale.setScalar(1.5);
  scene.add(onTable, atFence);
  const camera = new PerspectiveCamera(32, 1.5, 0.1, 50);
  camera.up.set(0, 0, 1);
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let from = null;
  let to = null;
  let started = 0;
  let shown = "";

  function draw(time) {
    const width = place.clientWidth || 600;
    const height = Math.max(220, Math.round(width / 1.7));
    const ratio = Math.min(devicePixelRatio, 2);
    if (renderer.domElement.width !== Math.floor(width * ratio)) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
    }
    let share = 1;
    if (to) {
      // It stays as it lies for a while, turns, and stays as it is to lie; then again.
      share = still || !from ? 1 : Math.min(1, Math.max(0, (time - WAIT_S) / TURN_S));
      standLettersUp(body, from && share < 0.5 ? from : to);
      body.quaternion.slerpQuaternions(from ?? to, to, share * share * (3 - 2 * share));
      body.position.z = still || !from || from.angleTo(to) < 0.01 ? 0 : 0.9 * Math.sin(Math.PI * share);
    }
    camera.position.set(4.6, -8.2, 4.6);
    camera.lookAt(0, 0, -0.2);
    scene.background = new Color(getComputedStyle(document.documentElement).getPropertyValue("--panel").trim());
    renderer.render(scene, camera);
  }

  // Some frames a second are enough, and none while nothing moves: the page may run on a small machine.
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
  let looping = false;
  let drawn = "";

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
      started = performance.now();
      body.quaternion.copy(to);
      body.updateMatrixWorld(true);
      placeMarker(restMark, view.wanted?.rest);
      placeMarker(fenceMark, view.wanted?.fence);
      onTable.visible = atFence.visible = Boolean(view.wanted);
      renderer.domElement.setAttribute("aria-label", `Face ${pose.rest} on the table, face ${pose.fence} at the fence`);
      if (!looping) {
        looping = true;
        loop();
      }
    },
  };
}
