// Curves over time by uPlot, and two maps: residuals by marker, correlations by pair.
"use strict";

const drawn = {}; // charts by the id of their place

// Curves [{label, tone, values, dashed}] over times, with the part that was held out shaded and a line at the frame shown.
function curves(id, motion, series, height) {
  const host = document.getElementById(id);
  if (drawn[id]) drawn[id].destroy();
  const axis = () => ({ stroke: color("gray"), grid: { stroke: color("pale"), width: 1 }, ticks: { show: false }, font: "11px system-ui", size: 46 });
  const options = {
    width: host.clientWidth || 400,
    height,
    legend: { show: false },
    cursor: { y: false },
    scales: { x: { time: false }, y: { range: (u, low, high) => (low < high ? uPlot.rangeNum(low, high, 0.1, true) : [low - 1e-2, low + 1e-2]) } },
    axes: [{ ...axis(), size: 28 }, { ...axis(), size: 52 }].map((one) => ({ ...one, values: ticks })),
    series: [{}, ...series.map((s) => ({ label: s.label, stroke: color(s.tone), width: s.width || 1.6, dash: s.dashed ? [4, 4] : undefined, spanGaps: false }))],
    hooks: { drawClear: [(u) => shadeHeldOut(u, motion)], draw: [(u) => frameLine(u, motion)] },
  };
  const values = series.map((s) => Array.from(s.values, (v) => (v === v ? v : null)));
  drawn[id] = new uPlot(options, [motion.times, ...values], host);
  drawn[id].over.addEventListener("click", () => page.to(drawn[id].cursor.idx));
}

// Labels of an axis with as many decimals as its steps have; uPlot rounds to three, so that neighbors may read alike.
function ticks(u, values) {
  const step = Math.abs(values[1] - values[0]) || 1, decimals = Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
  return values.map((v) => (v === null ? "" : String(Number(v.toFixed(decimals + 1)))));
}

function shadeHeldOut(u, motion) {
  const { ctx, bbox } = u;
  ctx.fillStyle = color("pale");
  motion.heldOut.forEach((held, k) => {
    if (!held || k === 0) return;
    const a = u.valToPos(motion.times[k - 1], "x", true), b = u.valToPos(motion.times[k], "x", true);
    ctx.fillRect(a, bbox.top, b - a + 1, bbox.height);
  });
}

function frameLine(u, motion) {
  const { ctx, bbox } = u, x = u.valToPos(motion.times[page.frame], "x", true);
  ctx.save(); // the pen has the width and the dashes of the last curve
  Object.assign(ctx, { strokeStyle: color("ink"), lineWidth: window.devicePixelRatio });
  ctx.setLineDash([]);
  ctx.beginPath();
  ctx.moveTo(x, bbox.top);
  ctx.lineTo(x, bbox.top + bbox.height);
  ctx.stroke();
  ctx.restore();
}

function redrawCurves() {
  for (const chart of Object.values(drawn)) chart.redraw(false, false);
}

function residualCharts(motion) {
  const rms = motion.times.map((_, f) => {
    let sum = 0, count = 0;
    for (let m = 0; m < motion.markers.length; ++m) {
      const d = distance(motion, f, m);
      if (d === d) { sum += d * d; ++count; }
    }
    return count ? 1e3 * Math.sqrt(sum / count) : NaN;
  });
  curves("over-time", motion, [{ label: "rms", tone: "accent", values: rms }], 200);
  const map = document.getElementById("per-marker"), pen = map.getContext("2d");
  map.width = motion.frames;
  map.height = motion.markers.length;
  const image = pen.createImageData(map.width, map.height), shades = Array.from({ length: 64 }, (_, k) => shade(k / 63));
  for (let f = 0; f < motion.frames; ++f)
    for (let m = 0; m < motion.markers.length; ++m) {
      const d = distance(motion, f, m), at = 4 * (m * motion.frames + f);
      if (d !== d) continue;
      image.data.set([...shades[Math.round((63 * d) / (motion.residual.largest || 1))], 255], at);
    }
  pen.putImageData(image, 0, 0);
  document.getElementById("warmest").textContent = `${(1e3 * motion.residual.largest).toPrecision(3)} mm`;
  const names = motion.markers;
  document.getElementById("rows").textContent = names.length > 1 ? `rows from ${names[0]} to ${names[names.length - 1]}` : names[0];
  map.onclick = (e) => {
    const box = map.getBoundingClientRect();
    page.to(Math.floor(((e.clientX - box.left) / box.width) * motion.frames));
    page.mark(Math.floor(((e.clientY - box.top) / box.height) * motion.markers.length));
  };
}

function markerCharts(motion, marker) {
  ["x", "y", "z"].forEach((axis, c) => {
    const of = (x) => motion.times.map((_, f) => x[3 * (f * motion.markers.length + marker) + c] + motion.middle[c]);
    const series = [];
    if (motion.measured) series.push({ label: "measured", tone: "gray", values: of(motion.measured), width: 3 });
    if (motion.simulated) series.push({ label: "simulated", tone: "accent", values: of(motion.simulated) });
    if (motion.baseline) series.push({ label: "no physics", tone: "sun", values: of(motion.baseline), dashed: true });
    curves(axis, motion, series, 170);
  });
}

// A matrix of colors. Few parameters are named beside their rows; the columns have the same order.
function correlationMap(matrix) {
  const canvas = document.getElementById("correlations"), n = matrix.names.length, pen = canvas.getContext("2d");
  const list = document.getElementById("pairs"), cell = 24;
  canvas.width = canvas.height = n;
  canvas.style.width = canvas.style.height = `${Math.min(520, cell * n)}px`;
  list.hidden = cell * n > 520;
  list.replaceChildren(...matrix.names.map((name) => Object.assign(document.createElement("li"), { textContent: name })));
  list.style.lineHeight = `${cell}px`;
  const image = pen.createImageData(n, n), rgb = (name) => [1, 3, 5].map((k) => parseInt(color(name).slice(k, k + 2), 16));
  matrix.values.forEach((row, i) => row.forEach((v, j) => {
    const to = rgb(v < 0 ? "accent" : "warm"), from = rgb("ground");
    image.data.set([...from.map((a, k) => Math.round(a + (to[k] - a) * Math.abs(v))), 255], 4 * (i * n + j));
  }));
  pen.putImageData(image, 0, 0);
  canvas.onpointermove = canvas.onpointerdown = (e) => {
    const box = canvas.getBoundingClientRect(), at = (p, size) => Math.min(n - 1, Math.max(0, Math.floor((p / size) * n)));
    const i = at(e.clientY - box.top, box.height), j = at(e.clientX - box.left, box.width);
    document.getElementById("pair").textContent = `${matrix.names[i]} and ${matrix.names[j]}: ${matrix.values[i][j].toFixed(2)}`;
  };
  document.getElementById("pair").textContent = "Warm is positive, blue is negative; columns have the order of the rows. Point at a field for its pair.";
}
