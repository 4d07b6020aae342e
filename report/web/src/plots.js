// SPDX-License-Identifier: Apache-2.0
// uPlot in the place of each drawn figure: points, curves, bands, bars and heat maps in one style, the
// drawing's own. A reading that is pointed at is shown in all plots of its run. The drawing stays for
// printing.
import uPlot from "uplot";

const DARK = matchMedia("(prefers-color-scheme: dark)");
const MARK = 4;

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function numberText(value, digits = 4) {
  return value == null ? "\u2013" : String(Number(value.toPrecision(digits))).replaceAll("-", "\u2212");
}

function span(values) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value != null && Number.isFinite(value)) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

function padded([low, high], share) {
  const room = high > low ? share * (high - low) : Math.max(1e-12, 0.1 * Math.abs(low));
  return [low - room, high + room];
}

// What is drawn, and where its axes go: the three kinds of figures as one.
function pictureOf(figure) {
  if (figure.heat) {
    const step = (values) => (values.length > 1 ? values[1] - values[0] : 1);
    const edges = (values) => [values[0] - step(values) / 2, values.at(-1) + step(values) / 2];
    return { x: edges(figure.columns), y: edges(figure.lines), points: [], draw: drawHeat };
  }
  if (figure.bars) {
    const high = span(figure.values.flat())[1];
    return { x: [-0.5, figure.bars.length - 0.5], y: [0, 1.06 * high], names: figure.bars, points: barPoints(figure), draw: drawBars };
  }
  const all = figure.series.filter((one) => one.x.length > 0);
  const xs = all.flatMap((one) => one.x);
  const ys = all.flatMap((one) => [...one.y, ...one.high]);
  const points = [];
  figure.series.forEach((one) => {
    if (one.high.length === 0) {
      one.x.forEach((x, i) => one.y[i] != null && !one.line && points.push({ x, y: one.y[i], run: one.runs[i], name: one.name, style: one.style }));
    }
  });
  const log = figure.logarithmic;
  const range = (values, share) => {
    const [low, high] = span(log ? values.filter((v) => v > 0).map(Math.log10) : values);
    const [a, b] = padded([low, high], share);
    return log ? [10 ** a, 10 ** b] : [a, b];
  };
  return { x: range(xs, 0.05), y: range(ys, 0.07), names: figure.x_names.length > 0 ? figure.x_names : null, points, draw: drawSeries };
}

// ---- drawing, in device pixels ----

// Circle, square or triangle: colours alone do not tell series apart.
function marker(pen, style, x, y, size) {
  pen.beginPath();
  if (style % 3 === 0) {
    pen.arc(x, y, size, 0, 2 * Math.PI);
  } else if (style % 3 === 1) {
    pen.rect(x - 0.9 * size, y - 0.9 * size, 1.8 * size, 1.8 * size);
  } else {
    pen.moveTo(x, y - 1.2 * size);
    pen.lineTo(x + 1.15 * size, y + 0.9 * size);
    pen.lineTo(x - 1.15 * size, y + 0.9 * size);
    pen.closePath();
  }
}

function drawSeries(pen, figure, place, scale) {
  figure.series.forEach((one) => {
    const stroke = color(`--series-${one.style % 6}`);
    if (one.high.length > 0) {
      pen.fillStyle = color("--band");
      pen.beginPath();
      one.x.forEach((x, i) => pen.lineTo(...place(x, one.y[i])));
      for (let i = one.x.length - 1; i >= 0; --i) {
        pen.lineTo(...place(one.x[i], one.high[i]));
      }
      pen.fill();
    } else if (one.line) {
      pen.strokeStyle = stroke;
      pen.lineWidth = 2 * scale;
      pen.beginPath();
      let open = false;
      one.x.forEach((x, i) => {
        if (one.y[i] == null) {
          open = false;
        } else {
          pen[open ? "lineTo" : "moveTo"](...place(x, one.y[i]));
          open = true;
        }
      });
      pen.stroke();
    } else {
      pen.fillStyle = stroke;
      const size = (one.x.length > 150 ? 2.4 : MARK) * scale;
      one.x.forEach((x, i) => {
        if (one.y[i] != null) {
          marker(pen, one.style, ...place(x, one.y[i]), size);
          pen.fill();
        }
      });
    }
  });
  pen.fillStyle = color("--soft");
  pen.font = `${12 * scale}px system-ui, sans-serif`;
  pen.textAlign = "left";
  figure.labels.forEach((label) => {
    const [x, y] = place(label.x, label.y);
    pen.fillText(label.text.replaceAll("-", "\u2212"), x + 7 * scale, y - 6 * scale);
  });
}

function barPlace(figure, group, source) {
  const width = 0.8 / figure.sources.length;
  return { from: group - 0.4 + source * width, to: group - 0.4 + (source + 0.92) * width };
}

function barPoints(figure) {
  return figure.values.flatMap((row, group) =>
    row.map((value, source) => {
      const { from, to } = barPlace(figure, group, source);
      return { x: (from + to) / 2, y: value, name: `${figure.bars[group]}, ${figure.sources[source]}`, style: source, bar: true };
    }),
  );
}

function drawBars(pen, figure, place) {
  figure.values.forEach((row, group) =>
    row.forEach((value, source) => {
      if (value != null) {
        const { from, to } = barPlace(figure, group, source);
        const [left, bottom] = place(from, 0);
        const [right, top] = place(to, value);
        pen.fillStyle = color(`--series-${source % 6}`);
        pen.fillRect(left, top, right - left, bottom - top);
      }
    }),
  );
}

function drawHeat(pen, figure, place) {
  const [low, high] = span(figure.heat.flat());
  const half = (values) => (values.length > 1 ? (values[1] - values[0]) / 2 : 0.5);
  const [dx, dy] = [half(figure.columns), half(figure.lines)];
  pen.fillStyle = color("--heat");
  figure.lines.forEach((y, j) =>
    figure.columns.forEach((x, i) => {
      const value = figure.heat[j][i];
      if (value != null) {
        const [left, bottom] = place(x - dx, y - dy).map(Math.round);
        const [right, top] = place(x + dx, y + dy).map(Math.round);
        pen.globalAlpha = 0.06 + 0.94 * (high > low ? (value - low) / (high - low) : 0);
        pen.fillRect(left, top, right - left, bottom - top);
      }
    }),
  );
  pen.globalAlpha = 1;
}

// ---- charts ----

// The run that is pointed at, in whichever plot.
let pointed = null;
const charts = [];

function pointAt(run) {
  if (run !== pointed) {
    pointed = run;
    charts.forEach(({ chart, picture }) => picture.points.some((point) => point.run != null) && chart.redraw(false));
    document.querySelectorAll("[data-run]").forEach((row) => row.classList.toggle("pointed", row.dataset.run === String(run)));
  }
}

function drawPointed(pen, picture, place, scale) {
  if (pointed == null) {
    return;
  }
  pen.strokeStyle = color("--ink");
  pen.lineWidth = 2 * scale;
  for (const point of picture.points) {
    if (point.run === pointed) {
      pen.beginPath();
      pen.arc(...place(point.x, point.y), 8 * scale, 0, 2 * Math.PI);
      pen.stroke();
    }
  }
}

function wordsOf(figure, point) {
  const name = figure.x_names?.[point.x];
  const where = point.bar ? "" : `${figure.x_label} ${name ?? numberText(point.x)}, `;
  const run = point.run != null && figure.x_label !== "run" ? `run ${point.run}, ` : "";
  return `${point.name}: ${run}${where}${figure.value_label ?? figure.y_label} ${numberText(point.y)}`;
}

// What the cursor is over: the nearest point, or the cell of a heat map.
function readout(figure, picture, chart) {
  const { left, top } = chart.cursor;
  if (left == null || left < 0) {
    return { text: "", run: null };
  }
  if (figure.heat) {
    const nearest = (values, at) => values.reduce((best, value, i) => (Math.abs(value - at) < Math.abs(values[best] - at) ? i : best), 0);
    const i = nearest(figure.columns, chart.posToVal(left, "x"));
    const j = nearest(figure.lines, chart.posToVal(top, "y"));
    return { text: `${figure.x_label} ${numberText(figure.columns[i])}, ${figure.y_label} ${numberText(figure.lines[j])}: ${figure.value_label} ${numberText(figure.heat[j][i], 3)}`, run: null };
  }
  let best = null;
  let least = 24;
  for (const point of picture.points) {
    const dx = chart.valToPos(point.x, "x") - left;
    const dy = point.bar ? 0 : chart.valToPos(point.y, "y") - top;
    const distance = Math.hypot(dx, dy);
    if (distance < least) {
      [least, best] = [distance, point];
    }
  }
  return best ? { text: wordsOf(figure, best), run: best.run ?? null } : { text: "", run: null };
}

const heightOf = (figure, width) => Math.round(figure.narrow ? Math.min(340, 0.84 * width) : Math.min(360, 0.56 * width));

// Equal lengths for equal values along both axes.
function evened([low, high], perPixel, wanted) {
  const more = 0.5 * (wanted / perPixel - 1) * (high - low);
  return [low - more, high + more];
}

function optionsOf(figure, picture, width, say) {
  const axis = (label, names, size) => ({
    label,
    size,
    stroke: () => color("--ink"),
    grid: { stroke: () => color("--grid"), width: 1 },
    ticks: { stroke: () => color("--grid"), width: 1 },
    font: "12px system-ui, sans-serif",
    labelFont: "13px system-ui, sans-serif",
    ...(names
      ? { splits: () => names.map((_, i) => i), values: (_, at) => at.map((i) => (names[i] ?? "").replace("-", "\u2212")) }
      : { values: (_, at) => at.map((v) => (v == null ? "" : numberText(v))) }),
  });
  const ranges = (u) => {
    if (!figure.equal_aspect || !u.bbox?.width) {
      return picture;
    }
    const perX = (picture.x[1] - picture.x[0]) / u.bbox.width;
    const perY = (picture.y[1] - picture.y[0]) / u.bbox.height;
    const wanted = Math.max(perX, perY);
    return { x: evened(picture.x, perX, wanted), y: evened(picture.y, perY, wanted) };
  };
  // A drag zooms: then the scale is what was chosen, until a double click.
  const full = (which) => (u, min, max) => (zoomed(u) ? [min, max] : ranges(u)[which]);
  const zoomed = (u) => u.axiscalZoom === true;
  const scale = (which) => (figure.logarithmic ? { distr: 3, range: full(which) } : { time: false, range: full(which) });
  return {
    width,
    height: heightOf(figure, width),
    scales: { x: scale("x"), y: scale("y") },
    axes: [axis(figure.x_label, picture.names, 38), axis(figure.value_label && figure.bars ? figure.value_label : figure.y_label, null, 62)],
    legend: { show: false },
    cursor: { drag: { x: true, y: true, uni: 20, setScale: true }, points: { show: false } },
    series: [{}, { paths: () => null, points: { show: false } }],
    hooks: {
      draw: [
        (u) => {
          const scale = devicePixelRatio;
          const place = (x, y) => [u.valToPos(x, "x", true), u.valToPos(y, "y", true)];
          u.ctx.save();
          u.ctx.beginPath();
          u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
          u.ctx.clip();
          picture.draw(u.ctx, figure, place, scale);
          drawPointed(u.ctx, picture, place, scale);
          u.ctx.restore();
        },
      ],
      setCursor: [(u) => say(readout(figure, picture, u))],
      setSelect: [(u) => (u.axiscalZoom = u.select.width > 0 || u.select.height > 0)],
    },
  };
}

function showFigure(figure) {
  const element = document.getElementById(figure.id);
  const place = element?.querySelector(".live");
  const width = element?.querySelector(".plot")?.clientWidth - 16;
  if (!place || !(width > 0) || !element.checkVisibility() || element.classList.contains("is-live")) {
    return false;
  }
  const picture = pictureOf(figure);
  const words = document.createElement("p");
  words.className = "readout";
  words.textContent = "\u00a0";
  const say = ({ text, run }) => {
    words.textContent = text || "\u00a0";
    pointAt(run);
  };
  const data = [picture.x, picture.y];
  const chart = new uPlot(optionsOf(figure, picture, width, say), data, place);
  chart.over.addEventListener("dblclick", () => {
    chart.axiscalZoom = false;
    chart.redraw(false, true);
    chart.setData(data);
  });
  chart.over.addEventListener("mouseleave", () => say({ text: "", run: null }));
  chart.root.querySelectorAll("canvas").forEach((canvas) => canvas.setAttribute("aria-hidden", "true"));
  place.after(words);
  element.classList.add("is-live");
  charts.push({ chart, picture });
  chart.setData(data); // once more: equal scales need the plot's size
  new ResizeObserver(() => {
    const now = place.parentElement.clientWidth - 16;
    if (now > 0 && Math.abs(now - chart.width) > 1) {
      chart.setSize({ width: now, height: heightOf(figure, now) });
      chart.setData(data);
    }
  }).observe(place.parentElement);
  return true;
}

// Plots in parts that are folded are made when they are opened.
export function showPlots(figures) {
  const show = () => figures.forEach(showFigure);
  show();
  document.querySelectorAll("details.part").forEach((part) => part.addEventListener("toggle", show));
  DARK.addEventListener("change", () => charts.forEach(({ chart }) => chart.redraw(false, true)));
  return () => charts.length;
}
