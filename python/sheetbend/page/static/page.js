// What the reader does: choose a recording, play, scrub, show and hide, save.
"use strict";

const page = {
  data: JSON.parse(document.getElementById("data").textContent),
  frame: 0,
  element: (id) => document.getElementById(id),

  start() {
    this.motions = this.data.motions.map(decoded).filter((m) => m.extent > 0);
    if (this.motions.length) {
      this.element("motion").hidden = false;
      try {
        this.space = new Space(this.element("space"));
      } catch (error) {
        this.space = new Stills(this.element("space"));
        this.element("space").before("This browser has no WebGL: four moments are drawn instead.");
      }
      const recording = this.element("recording");
      this.motions.forEach((m, k) => recording.add(new Option(m.name, k)));
      this.element("which").hidden = this.motions.length < 2;
      recording.onchange = () => this.choose(Number(recording.value));
      this.element("scrub").oninput = (e) => { this.stop(); this.to(Number(e.target.value)); };
      this.element("play").onclick = () => (this.playing ? this.stop() : this.play());
      this.element("marker").onchange = (e) => this.mark(Number(e.target.value));
      const moving = Math.max(0, this.motions.findIndex((m) => m.frames > 1));
      recording.value = moving;
      this.choose(moving);
      addEventListener("resize", () => this.charts());
    }
    if (this.data.correlations) {
      this.element("matrix").hidden = false;
      correlationMap(this.data.correlations);
    }
    if (this.element("save")) this.element("save").onclick = () => this.save();
    document.title += " \u2713"; // everything is drawn
  },

  choose(k) {
    this.stop();
    this.motion = this.motions[k];
    this.frame = 0;
    const { motion } = this, scrub = this.element("scrub");
    scrub.max = motion.frames - 1;
    this.element("controls").hidden = motion.frames < 2; // a shape at rest has nothing to play
    this.element("motion").querySelector("h2").textContent = motion.frames < 2 ? "Shape at rest" : "Motion";
    this.space.show(motion);
    this.switches();
    const strained = motion.sheets.filter((s) => s.largestStrain > 0), about = [
      this.space.cell && `Drag to turn, scroll to zoom. A cell of the floor is ${length(this.space.cell)}.`,
      motion.frames < motion.recorded && `${motion.frames} of ${motion.recorded} frames are drawn.`,
      motion.hasBodies && "A rigid body is drawn as the box of even density that has its mass and inertia, with a line to the origin of its frame.",
      ...strained.map((s) => `${s.name}: the warmest color is a strain of ${(100 * s.largestStrain).toPrecision(2)} %.`),
      motion.heldOut.some(Boolean) && motion.frames > 1 && "Shaded times were held out: the fit did not see them.",
    ];
    this.element("about-motion").textContent = about.filter(Boolean).join(" ");
    const marker = this.element("marker");
    marker.replaceChildren(...motion.markers.map((name, m) => new Option(name, m)));
    // Points of a cloud are other ones in every frame: only their distances mean something over time.
    this.element("residuals").hidden = !(motion.measured && motion.frames > 1 && (motion.residual || !motion.isCloud));
    this.element("of-marker").hidden = motion.isCloud;
    this.element("what").textContent = motion.isCloud ? "points" : "markers";
    this.element("residuals").querySelector("h2").textContent = motion.simulated ? "Measured against simulated" : "Markers over time";
    this.charts();
    const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t")); // page.html#t=0.8 opens at 0.8 s
    this.to(Math.max(0, motion.times.findIndex((t) => t >= asked)));
  },

  // One switch for each kind of thing that is drawn.
  switches() {
    const names = new Map(this.space.layers.map((layer) => [layer.name, layer.tone]));
    this.element("layers").replaceChildren(...[...names].map(([name, tone]) => {
      const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("i");
      box.type = "checkbox";
      box.checked = !this.space.hidden.has(name);
      box.onchange = () => { this.space.hidden[box.checked ? "delete" : "add"](name); this.space.draw(this.frame); };
      swatch.className = "swatch";
      swatch.style.background = `var(--${tone})`;
      label.append(box, swatch, name);
      return label;
    }));
  },

  charts() {
    if (this.element("residuals").hidden) return;
    const residual = Boolean(this.motion.residual);
    this.element("over-time").closest("figure").hidden = !residual;
    this.element("per-marker").closest("figure").hidden = !residual || this.motion.isCloud;
    if (residual) residualCharts(this.motion);
    if (!this.motion.isCloud) markerCharts(this.motion, Number(this.element("marker").value));
  },

  mark(marker) {
    this.element("marker").value = marker;
    markerCharts(this.motion, marker);
  },

  to(frame) {
    this.frame = Math.max(0, Math.min(this.motion.frames - 1, frame));
    this.element("scrub").value = this.frame;
    this.element("clock").textContent = `${this.motion.times[this.frame].toFixed(3)} s`;
    this.space.draw(this.frame);
    redrawCurves();
  },

  play() {
    const { times, frames } = this.motion, from = this.frame === frames - 1 ? 0 : this.frame;
    let time = times[from], last = performance.now();
    this.playing = true;
    this.element("play").textContent = "pause";
    const step = (now) => {
      if (!this.playing) return;
      time += (Number(this.element("speed").value) * (now - last)) / 1e3;
      last = now;
      let frame = this.frame > from || time >= times[from] ? this.frame : from;
      if (time < times[frame]) frame = from;
      while (frame < frames - 1 && times[frame + 1] <= time) ++frame;
      this.to(frame);
      if (frame === frames - 1) return this.stop();
      requestAnimationFrame(step);
    };
    this.to(from);
    requestAnimationFrame(step);
  },

  stop() {
    this.playing = false;
    this.element("play").textContent = "play";
  },

  async save() {
    const packed = new Blob([bytesOf(this.data.fit)]).stream().pipeThrough(new DecompressionStream("gzip"));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await new Response(packed).blob());
    link.download = "fit.json";
    link.click();
    URL.revokeObjectURL(link.href);
  },
};

page.start();
