// SPDX-License-Identifier: Apache-2.0
// uPlot in the place of each drawn plot; the drawing stays for printing.
import uPlot from "uplot";

const DARK = matchMedia("(prefers-color-scheme: dark)");

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// All series of a plot over one list of x, as uPlot wants them; gaps are null.
function aligned(plot) {
  const xs = [...new Set(plot.series.flatMap((series) => series.x))].sort((a, b) => a - b);
  const place = new Map(xs.map((x, i) => [x, i]));
  const columns = plot.series.flatMap((series) => {
    const put = (values) => {
      const column = new Array(xs.length).fill(series.line ? undefined : null);
      series.x.forEach((x, i) => (column[place.get(x)] = values[i]));
      return column;
    };
    return series.high.length > 0 ? [put(series.y), put(series.high)] : [put(series.y)];
  });
  return [xs, ...columns];
}

// Several points at one x cannot be aligned: those plots keep their drawing.
function isFunction(plot) {
  return plot.series.every((series) => new Set(series.x).size === series.x.length);
}

// The point markers of the drawings: circle, square, triangle, one for each series.
function drawMarkers(shape) {
  return (u, seriesIndex) => {
    const { ctx } = u;
    const size = 4 * devicePixelRatio;
    const [xs, ys] = [u.data[0], u.data[seriesIndex]];
    ctx.save();
    ctx.fillStyle = u.series[seriesIndex].stroke();
    xs.forEach((x, i) => {
      if (ys[i] == null) {
        return;
      }
      const cx = u.valToPos(x, "x", true);
      const cy = u.valToPos(ys[i], "y", true);
      ctx.beginPath();
      if (shape === 0) {
        ctx.arc(cx, cy, size, 0, 2 * Math.PI);
      } else if (shape === 1) {
        ctx.rect(cx - size, cy - size, 2 * size, 2 * size);
      } else {
        ctx.moveTo(cx, cy - size * 1.2);
        ctx.lineTo(cx + size * 1.2, cy + size);
        ctx.lineTo(cx - size * 1.2, cy + size);
      }
      ctx.fill();
    });
    ctx.restore();
    return null;
  };
}

// uPlot's own texts have three decimals, whatever the size of the numbers.
function numberText(value) {
  return value == null ? "\u2013" : String(Number(value.toPrecision(4))).replace("-", "\u2212");
}

function optionsOf(plot, width) {
  const axis = (label, names) => ({
    label,
    stroke: () => color("--ink"),
    grid: { stroke: () => color("--grid"), width: 1 },
    ticks: { stroke: () => color("--grid"), width: 1 },
    ...(names.length > 0
      ? { splits: () => names.map((_, i) => i), values: (_, at) => at.map((i) => names[i] ?? "") }
      : { values: (_, at) => at.map((v) => (v == null ? "" : numberText(v))) }),
  });
  const value = (_, at) => numberText(at);
  const series = [{ label: plot.x_label, value }];
  const bands = [];
  plot.series.forEach((one, k) => {
    const stroke = () => color(`--series-${k % 6}`);
    const common = { value, stroke, width: one.line ? 2 : 0, spanGaps: false };
    if (one.high.length > 0) {
      bands.push({ series: [series.length + 1, series.length], fill: () => color("--band") });
      series.push({ ...common, label: `${one.name}, low`, points: { show: false } });
      series.push({ ...common, label: `${one.name}, high`, points: { show: false } });
    } else if (one.line) {
      series.push({ ...common, label: one.name, points: { show: false } });
    } else {
      series.push({ ...common, label: one.name, paths: () => null, points: { show: drawMarkers(k % 3) } });
    }
  });
  const pad = (min, max) => {
    const room = max > min ? 0.06 * (max - min) : 1;
    return [min - room, max + room];
  };
  return {
    width,
    height: Math.round(Math.min(360, 0.55 * width)),
    scales: {
      x: { time: false, ...(plot.logarithmic ? { distr: 3 } : { range: (_, min, max) => pad(min, max) }) },
      y: plot.logarithmic ? { distr: 3 } : { range: (_, min, max) => pad(min, max) },
    },
    axes: [axis(plot.x_label, plot.x_names), { ...axis(plot.y_label, []), size: 70 }],
    cursor: { drag: { x: true, y: true, uni: 20 } },
    series,
    bands,
  };
}

export function showPlots(plots) {
  const shown = [];
  for (const plot of plots) {
    const figure = document.getElementById(plot.id);
    const place = figure?.querySelector(".live");
    if (!place || plot.equal_aspect || !isFunction(plot)) {
      continue;
    }
    const chart = new uPlot(optionsOf(plot, place.clientWidth || 640), aligned(plot), place);
    figure.classList.add("is-live");
    shown.push(chart);
    new ResizeObserver(() => {
      const width = place.clientWidth;
      if (width > 0 && Math.abs(width - chart.width) > 1) {
        chart.setSize({ width, height: Math.round(Math.min(360, 0.55 * width)) });
      }
    }).observe(place);
  }
  DARK.addEventListener("change", () => shown.forEach((chart) => chart.redraw(false, true)));
  return shown.length;
}
