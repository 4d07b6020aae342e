// SPDX-License-Identifier: Apache-2.0
// Draws the last half minute of a live session: each axis relative to its mean, and the noise relative to the
// limit of stillness.
const SPAN_MS = 30000;

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function makeTraces(reading, noise) {
  let samples = [];
  let queued = false;

  function begin(canvas) {
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight || 90];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "13px system-ui, sans-serif";
    return { pen, width, height };
  }

  function drawReading() {
    const { pen, width, height } = begin(reading);
    const axes = samples.at(-1).reading.length;
    const recent = samples.slice(-25);
    const names = ["--rest", "--fence", "--good"];
    for (let k = 0; k < axes; ++k) {
      const mean = recent.reduce((sum, one) => sum + one.reading[k], 0) / recent.length;
      const reach = Math.max(...recent.map((one) => Math.abs(one.reading[k] - mean)), 1e-9 * Math.abs(mean), 1e-300);
      const middle = ((k + 0.5) * height) / axes;
      pen.strokeStyle = color(names[k % 3]);
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const one of samples) {
        const x = width - ((samples.at(-1).at - one.at) / SPAN_MS) * width;
        const off = (one.reading[k] - mean) / reach;
        const y = middle - 0.42 * (height / axes) * Math.max(-1, Math.min(1, off));
        Math.abs(off) > 1 ? pen.moveTo(x, y) : pen.lineTo(x, y);  // a gap during motion beyond the scale
      }
      pen.stroke();
      pen.fillStyle = color("--quiet");
      pen.fillText(`${"xyz"[k] ?? k + 1}  \u00b1 ${Number(reach.toPrecision(2))}`, 6, (k * height) / axes + 13);
    }
  }

  // Draws the noise on a logarithmic scale: one decade below the limit of stillness, three decades above.
  function drawNoise() {
    const { pen, width, height } = begin(noise);
    const y = (ratio) => height * (0.75 - 0.25 * Math.log10(Math.min(1000, Math.max(0.1, ratio))));
    pen.strokeStyle = color("--line");
    pen.setLineDash([6, 5]);
    pen.beginPath();
    pen.moveTo(0, y(1));
    pen.lineTo(width, y(1));
    pen.stroke();
    pen.setLineDash([]);
    pen.fillStyle = color("--quiet");
    pen.fillText("below this line: still", 6, y(1) - 4);
    pen.strokeStyle = color(samples.at(-1).stillness > 1 ? "--warn" : "--good");
    pen.lineWidth = 2;
    pen.beginPath();
    for (const one of samples) {
      pen.lineTo(width - ((samples.at(-1).at - one.at) / SPAN_MS) * width, y(one.stillness));
    }
    pen.stroke();
  }

  return {
    add(view) {
      if (view.reading.length === 0 || view.stillness === null) {
        return;
      }
      const now = performance.now();
      samples.push({ at: now, reading: view.reading, stillness: view.stillness });
      samples = samples.filter((one) => now - one.at < SPAN_MS);
      if (!queued && !document.hidden) {
        queued = true;
        requestAnimationFrame(() => {
          queued = false;
          drawReading();
          drawNoise();
        });
      }
    },
  };
}
