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
    if (motion.measured) this.layers.push(this.dots("measured", motion.measured, n, "gray", 0.0085 * size));
    if (motion.simulated) this.layers.push(this.dots("simulated", motion.simulated, n, "accent", 0.0075 * size));
    if (motion.baseline) this.layers.push(this.dots("no physics", motion.baseline, n, "sun", 0.005 * size));
    if (motion.measured && motion.simulated) this.layers.push(this.errors());
    for (const layer of this.layers) this.scene.add(layer.object);
    this.look();
    this.resize();
  }

  look() {
    const up = new THREE.Vector3(...this.motion.up);
    if (up.length() === 0) up.set(0, 0, 1);
    // across: the horizontal direction that is widest over all frames
    const across = this.widest(up), toward = new THREE.Vector3().crossVectors(across, up).normalize();
    const away = (1.05 * this.motion.extent) / Math.min(1, this.host.clientWidth / Math.max(this.host.clientHeight, 1));
    this.camera.up.copy(up);
    this.camera.position.copy(toward.multiplyScalar(1.6 * away).addScaledVector(across, 0.5 * away).addScaledVector(up, 0.45 * away));
    this.controls.target.set(0, 0, 0);
    this.camera.near = 1e-3 * this.motion.extent;
    this.camera.far = 50 * this.motion.extent;
    this.controls.update();
  }

  widest(up) {
    const parts = [...this.motion.sheets, ...this.motion.lines].map((p) => p.places);
    const all = parts.length ? parts : [this.motion.measured || new Float32Array(3)];
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const x of all)
      for (let i = 0; i < x.length; ++i)
        if (x[i] === x[i]) { low[i % 3] = Math.min(low[i % 3], x[i]); high[i % 3] = Math.max(high[i % 3], x[i]); }
    const axes = [0, 1, 2].sort((a, b) => Math.abs(this.motion.up[a]) - Math.abs(this.motion.up[b]) || high[b] - low[b] - (high[a] - low[a]));
    const axis = new THREE.Vector3(), pick = high[axes[0]] - low[axes[0]] >= high[axes[1]] - low[axes[1]] ? axes[0] : axes[1];
    axis.setComponent(pick, 1).addScaledVector(up, -up.getComponent(pick)).normalize();
    return axis;
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
    const tone = part.name === "twist" ? "warm" : "gray"; // any other name is a collider's
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
    return { name: "cloth", tone: "accent", object: mesh, at };
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
