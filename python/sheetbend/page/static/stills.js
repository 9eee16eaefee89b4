// Four moments as plain drawings, where the browser has no WebGL.
"use strict";

class Stills {
  constructor(host) {
    host.classList.add("stills");
    this.host = host;
    this.layers = [];
    this.hidden = new Set();
  }

  show(motion) {
    this.host.replaceChildren();
    const across = motion.up[0] ? 1 : 0, upright = motion.up[0] ? 0 : motion.up[1] ? 1 : 2;
    const sign = motion.up[upright] < 0 ? -1 : 1;
    for (let k = 0; k < 4; ++k) {
      const frame = Math.round((k * (motion.frames - 1)) / 3), canvas = document.createElement("canvas");
      canvas.width = canvas.height = 300;
      canvas.style.cssText = "width:300px;height:300px;display:inline-block";
      this.host.append(canvas);
      const pen = canvas.getContext("2d"), s = 270 / motion.extent;
      const at = (x, i) => [150 + s * x[i + across], 150 - s * sign * x[i + upright]];
      pen.fillStyle = color("gray");
      pen.fillText(`${motion.times[frame].toFixed(2)} s`, 6, 14);
      pen.strokeStyle = color("accent");
      for (const part of motion.lines) this.path(pen, at, part, frame);
      for (const part of motion.sheets) this.wires(pen, at, part, frame);
      for (const part of motion.ticks) this.ticks(pen, at, part, frame);
      this.points(pen, at, motion.masses, motion.masses ? motion.masses.length / 3 / motion.frames : 0, frame, "ink", 5);
      this.points(pen, at, motion.measured, motion.markers.length, frame, "gray");
      this.points(pen, at, motion.simulated, motion.markers.length, frame, "accent");
    }
  }

  path(pen, at, part, frame) {
    pen.beginPath();
    for (let n = 0; n < part.nodes; ++n) pen.lineTo(...at(part.places, 3 * (frame * part.nodes + n)));
    pen.stroke();
  }

  // Twist of rods, and the outlines of what they touch.
  ticks(pen, at, part, frame) {
    pen.strokeStyle = color(part.name === "twist" ? "warm" : "ink");
    pen.beginPath();
    for (let n = 0; n < part.nodes; n += 2) {
      pen.moveTo(...at(part.places, 3 * (frame * part.nodes + n)));
      pen.lineTo(...at(part.places, 3 * (frame * part.nodes + n + 1)));
    }
    pen.stroke();
    pen.strokeStyle = color("accent");
  }

  wires(pen, at, part, frame) {
    pen.lineWidth = 0.4;
    for (let t = 0; t < part.triangles.length; t += 3) {
      pen.beginPath();
      for (let v = 0; v < 3; ++v) pen.lineTo(...at(part.places, 3 * (frame * part.nodes + part.triangles[t + v])));
      pen.closePath();
      pen.stroke();
    }
    pen.lineWidth = 1;
  }

  points(pen, at, x, count, frame, tone, radius = 2.2) {
    if (!x) return;
    pen.fillStyle = color(tone);
    for (let n = 0; n < count; ++n) {
      const i = 3 * (frame * count + n);
      if (x[i] !== x[i]) continue;
      pen.beginPath();
      pen.arc(...at(x, i), radius, 0, 7);
      pen.fill();
    }
  }

  draw() {}
}
