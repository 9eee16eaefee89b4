// The motion in space, with three.js.
"use strict";

class Space {
  constructor(host) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true }); // throws without WebGL
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    host.append(this.renderer.domElement);
    this.host = host;
    this.camera = new THREE.PerspectiveCamera(35, 1, 1e-4, 1e4);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.render());
    new ResizeObserver(() => this.resize()).observe(host);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.motion && this.show(this.motion));
    this.hidden = new Set();
  }

  resize() {
    const { clientWidth: w, clientHeight: h } = this.host;
    if (!w || !h) return;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.render();
  }

  // A new motion: everything is made anew and seen from a place that holds all of it.
  show(motion) {
    this.motion = motion;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(color("ground"));
    this.scene.add(new THREE.AmbientLight(0xffffff, 1.6));
    const light = new THREE.DirectionalLight(0xffffff, 1.6);
    this.camera.add(light);
    this.scene.add(this.camera);
    const size = motion.extent;
    this.layers = [];
    for (const sheet of motion.sheets) this.layers.push(this.sheet(sheet));
    for (const line of motion.lines) this.layers.push(this.line(line, 0.0035 * size));
    for (const tick of motion.ticks) this.layers.push(this.ticks(tick));
    const n = motion.markers.length;
    if (motion.masses) this.layers.push(this.dots("mass", motion.masses, motion.masses.length / 3 / motion.frames, "ink", 0.016 * size));
    if (motion.measured) this.layers.push(this.dots("measured", motion.measured, n, "gray", 0.0085 * size));
    if (motion.simulated) this.layers.push(this.dots("simulated", motion.simulated, n, "accent", 0.0075 * size));
    if (motion.baseline) this.layers.push(this.dots("no physics", motion.baseline, n, "sun", 0.005 * size));
    if (motion.measured && motion.simulated) this.layers.push(this.errors());
    this.box = this.bounds();
    this.layers.push(this.floor());
    for (const layer of this.layers) this.scene.add(layer.object);
    this.look();
    this.resize();
  }

  // Upward; z where the motion does not tell.
  get up() {
    const up = new THREE.Vector3(...this.motion.up);
    return up.length() === 0 ? up.set(0, 0, 1) : up;
  }

  // The lowest and highest coordinates of all that is drawn, over all frames.
  bounds() {
    const { masses, measured, simulated, baseline, sheets, lines, ticks } = this.motion;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const x of [masses, measured, simulated, baseline, ...[...sheets, ...lines, ...ticks].map((part) => part.places)])
      for (let i = 0; x && i < x.length; ++i)
        if (x[i] === x[i]) { low[i % 3] = Math.min(low[i % 3], x[i]); high[i % 3] = Math.max(high[i % 3], x[i]); }
    return { low, high };
  }

  corners() {
    const { low, high } = this.box;
    return Array.from({ length: 8 }, (_, k) => new THREE.Vector3(...[0, 1, 2].map((c) => ((k >> c) & 1 ? high : low)[c])));
  }

  // From the side on which the motion is widest, so far away that all of it is in the picture. A cloth often swings
  // along its normal, so it is seen half from there.
  look() {
    const { up, camera } = this, across = this.widest(up), toward = new THREE.Vector3().crossVectors(across, up).normalize();
    const [side, ahead] = this.motion.sheets.length ? [1.2, 1.2] : [1.6, 0.5];
    const from = toward.multiplyScalar(side).addScaledVector(across, ahead).addScaledVector(up, 0.45).normalize();
    const right = new THREE.Vector3().crossVectors(up, from).normalize(), above = new THREE.Vector3().crossVectors(from, right);
    const middle = new THREE.Vector3(...this.box.low.map((low, c) => 0.5 * (low + this.box.high[c])));
    const half = Math.tan((0.5 * camera.fov * Math.PI) / 180), aspect = this.host.clientWidth / Math.max(this.host.clientHeight, 1) || 1;
    const needed = this.corners().map((corner) => {
      const p = corner.sub(middle);
      return p.dot(from) + Math.max(Math.abs(p.dot(right)) / aspect, Math.abs(p.dot(above))) / half;
    });
    camera.up.copy(up);
    camera.position.copy(middle).addScaledVector(from, 1.1 * Math.max(...needed));
    this.controls.target.copy(middle);
    camera.near = 1e-3 * this.motion.extent;
    camera.far = 50 * this.motion.extent;
    this.controls.update();
  }

  // The horizontal direction in which the motion is widest.
  widest(up) {
    const size = (axis) => this.box.high[axis] - this.box.low[axis];
    const axes = [0, 1, 2].sort((a, b) => Math.abs(up.getComponent(a)) - Math.abs(up.getComponent(b)) || size(b) - size(a));
    const axis = new THREE.Vector3(), pick = size(axes[0]) >= size(axes[1]) ? axes[0] : axes[1];
    return axis.setComponent(pick, 1).addScaledVector(up, -up.getComponent(pick)).normalize();
  }

  // A level grid below everything, which shows the scale: cells of 1, 2 or 5 times a power of ten.
  floor() {
    const { up } = this, heights = this.corners().map((corner) => corner.dot(up)), rough = this.motion.extent / 8;
    const decade = 10 ** Math.floor(Math.log10(rough));
    this.cell = decade * [1, 2, 5, 10].find((times) => times * decade >= rough);
    const object = new THREE.GridHelper(10 * this.cell, 10, color("calm"), color("pale"));
    object.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    object.position.copy(up).multiplyScalar(Math.min(...heights) - 0.02 * this.motion.extent);
    return { name: "floor", tone: "calm", object, at() {} };
  }

  line(part, radius) {
    const edges = part.nodes - 1, geometry = new THREE.CylinderGeometry(radius, radius, 1, 8, 1);
    const mesh = new THREE.InstancedMesh(geometry, new THREE.MeshLambertMaterial({ color: color("accent") }), edges);
    mesh.frustumCulled = false;
    const a = new THREE.Vector3(), b = new THREE.Vector3(), m = new THREE.Matrix4(), q = new THREE.Quaternion();
    const y = new THREE.Vector3(0, 1, 0), d = new THREE.Vector3(), s = new THREE.Vector3();
    const at = (frame) => {
      const first = 3 * frame * part.nodes;
      for (let k = 0; k < edges; ++k) {
        a.fromArray(part.places, first + 3 * k);
        b.fromArray(part.places, first + 3 * k + 3);
        d.subVectors(b, a);
        const length = d.length();
        q.setFromUnitVectors(y, d.divideScalar(length || 1));
        mesh.setMatrixAt(k, m.compose(a.add(b).multiplyScalar(0.5), q, s.set(1, length, 1)));
      }
      mesh.instanceMatrix.needsUpdate = true;
    };
    return { name: part.kind, tone: "accent", object: mesh, at };
  }

  segments(count, tone) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * count), 3));
    const object = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: color(tone) }));
    object.frustumCulled = false;
    return object;
  }

  ticks(part) {
    const tone = part.name === "twist" ? "warm" : "ink"; // any other name is a body's or a collider's
    const object = this.segments(part.nodes / 2, tone), position = object.geometry.attributes.position;
    const at = (frame) => {
      position.array.set(part.places.subarray(3 * frame * part.nodes, 3 * (frame + 1) * part.nodes));
      position.needsUpdate = true;
    };
    return { name: part.name, tone, object, at };
  }

  dots(name, x, count, tone, radius) {
    const material = new THREE.MeshLambertMaterial({ color: color(tone) });
    const mesh = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, 14, 10), material, count);
    mesh.frustumCulled = false;
    const m = new THREE.Matrix4();
    const at = (frame) => {
      for (let k = 0; k < count; ++k) {
        const i = 3 * (frame * count + k), seen = x[i] === x[i];
        if (seen) m.makeTranslation(x[i], x[i + 1], x[i + 2]);
        else m.makeScale(0, 0, 0);
        mesh.setMatrixAt(k, m);
      }
      mesh.instanceMatrix.needsUpdate = true;
    };
    return { name, tone, object: mesh, at };
  }

  errors() {
    const { measured, simulated, markers } = this.motion, n = markers.length;
    const object = this.segments(n, "warm"), position = object.geometry.attributes.position;
    const at = (frame) => {
      for (let k = 0; k < n; ++k) {
        const i = 3 * (frame * n + k), seen = measured[i] === measured[i] && simulated[i] === simulated[i];
        for (let c = 0; c < 3; ++c) {
          position.array[6 * k + c] = seen ? measured[i + c] : 0;
          position.array[6 * k + 3 + c] = seen ? simulated[i + c] : 0;
        }
      }
      position.needsUpdate = true;
    };
    return { name: "error", tone: "warm", object, at };
  }

  sheet(part) {
    const count = part.triangles.length / 3, geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(9 * count), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(9 * count), 3));
    const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide, flatShading: count < 3000 });
    const mesh = new THREE.Mesh(geometry, material), { position, color: tint } = geometry.attributes;
    mesh.frustumCulled = false;
    const table = Array.from({ length: 256 }, (_, k) => {
      const [r, g, b] = shade(k / 255);
      return new THREE.Color(`rgb(${r},${g},${b})`);
    });
    const at = (frame) => {
      const first = 3 * frame * part.nodes;
      for (let t = 0; t < count; ++t) {
        const c = table[part.strain[frame * count + t]];
        for (let v = 0; v < 3; ++v) {
          const from = first + 3 * part.triangles[3 * t + v], to = 9 * t + 3 * v;
          position.array.set(part.places.subarray(from, from + 3), to);
          tint.array[to] = c.r; tint.array[to + 1] = c.g; tint.array[to + 2] = c.b;
        }
      }
      position.needsUpdate = tint.needsUpdate = true;
      geometry.computeVertexNormals();
    };
    return { name: part.kind, tone: "accent", object: mesh, at };
  }

  draw(frame) {
    this.frame = frame;
    for (const layer of this.layers) {
      layer.object.visible = !this.hidden.has(layer.name);
      if (layer.object.visible) layer.at(frame);
    }
    this.render();
  }

  render() {
    if (this.scene) this.renderer.render(this.scene, this.camera);
  }
}
