// From the packed JSON (sheetbend/page/packed.py) to numbers.
"use strict";

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}

// (frames * nodes * 3) meters about the motion's middle; NaN where a marker was not seen.
function places(motion, base64) {
  if (!base64) return null;
  const numbers = new Int16Array(bytesOf(base64)), out = new Float32Array(numbers.length);
  for (let i = 0; i < numbers.length; ++i) out[i] = numbers[i] === -32768 ? NaN : numbers[i] * motion.scale;
  return out;
}

function decoded(motion) {
  const layer = (part) => ({ ...part, places: places(motion, part.places) });
  return {
    ...motion,
    extent: 65534 * motion.scale,
    masses: places(motion, motion.masses),
    measured: places(motion, motion.measured),
    simulated: places(motion, motion.simulated),
    baseline: places(motion, motion.baseline),
    lines: motion.lines.map(layer),
    ticks: motion.ticks.map(layer),
    sheets: motion.sheets.map((sheet) => ({
      ...layer(sheet),
      triangles: new Uint32Array(bytesOf(sheet.triangles)),
      strain: new Uint8Array(bytesOf(sheet.strain)),
    })),
    residual: motion.residual && {
      largest: motion.residual.largest,
      distances: new Uint16Array(bytesOf(motion.residual.distances)),
    },
  };
}

// Distance of a marker in a frame, m; NaN where it was not seen.
function distance(motion, frame, marker) {
  const number = motion.residual.distances[frame * motion.markers.length + marker];
  return number === 65535 ? NaN : (number / 65534) * motion.residual.largest;
}

// A round length in m as people write it.
function length(x) {
  const [unit, times] = x < 0.0099 ? ["mm", 1e3] : x < 0.99 ? ["cm", 1e2] : ["m", 1];
  return `${Number((x * times).toPrecision(3))} ${unit}`;
}

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

// From a calm shade over the accent to the warm color: t from 0 to 1.
function shade(t) {
  const mix = (a, b, s) => a.map((v, k) => Math.round(v + (b[k] - v) * s));
  const rgb = (name) => [1, 3, 5].map((k) => parseInt(color(name).slice(k, k + 2), 16));
  return t < 0.5 ? mix(rgb("calm"), rgb("accent"), 2 * t) : mix(rgb("accent"), rgb("warm"), 2 * t - 1);
}
