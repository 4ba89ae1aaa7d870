// Shows a run: page.py says what is in it. Angles, axes and units are those of particlesim: SI, z up.
"use strict";

const DRAG = 4; // how far the pointer may move in a click [pixels]
const FIELD_OF_VIEW = 35; // degrees
const PICKED = [1.0, 0.05, 0.05]; // colour of the particle whose numbers are shown, linear

async function unpacked(run) {
  const text = atob(document.getElementById("arrays").textContent);
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const types = { uint8: Uint8Array, uint16: Uint16Array, int16: Int16Array, uint32: Uint32Array, float32: Float32Array };
  const arrays = {};
  for (const { name, type, start, count } of run.arrays) arrays[name] = new types[type](buffer, start, count);
  return arrays;
}

// A surface: corners and normals, three numbers each, and the corners of its triangles.
function surface(positions, normals, triangles) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(positions), 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(Float32Array.from(normals), 3));
  geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(triangles), 1));
  return geometry;
}

// The obstacles, each a mesh by itself.
class Obstacles {
  constructor(run, arrays) {
    this.poses = arrays.obstacle_pose; // of each in each frame: where it is, and the quaternion x, y, z, w
    this.meshes = run.obstacles.map(({ colour, opacity, two_sided: twoSided }, k) => {
      const [positions, normals, triangles] = ["position", "normal", "triangles"].map(
        (name) => arrays[`obstacle_${k}_${name}`]);
      const clear = opacity < 1;
      return new THREE.Mesh(surface(positions, normals, triangles), new THREE.MeshLambertMaterial({
        color: colour, side: twoSided ? THREE.DoubleSide : THREE.FrontSide,
        opacity, transparent: clear, depthWrite: !clear, // what is behind glass is drawn, whichever comes first
      }));
    });
  }

  show(frame) {
    this.meshes.forEach((mesh, k) => {
      const start = 7 * (frame * this.meshes.length + k);
      mesh.position.fromArray(this.poses, start);
      mesh.quaternion.fromArray(this.poses, start + 3);
    });
  }
}

// The particles as instanced meshes, one mesh for each shape.
class Particles {
  constructor(run, arrays) {
    this.run = run;
    this.arrays = arrays;
    this.number = arrays.shape.length;
    this.picked = -1;
    this.step = run.lower.map((low, axis) => (run.upper[axis] - low) / 65535);
    this.linear = Float32Array.from({ length: 256 }, (_, level) => (level / 255) ** 2.2);
    this.meshes = run.shapes.map((shape, row) => {
      const ids = [];
      arrays.shape.forEach((its, id) => { if (its === row) ids.push(id); });
      const geometry = surface(shape.position, shape.normal, shape.triangles);
      const mesh = new THREE.InstancedMesh(geometry, new THREE.MeshLambertMaterial(), ids.length);
      mesh.setColorAt(0, new THREE.Color());
      mesh.frustumCulled = false;
      mesh.userData.ids = ids;
      return mesh;
    });
  }

  position(frame, id) {
    const start = 3 * (frame * this.number + id);
    return [0, 1, 2].map((axis) => this.run.lower[axis] + this.step[axis] * this.arrays.position[start + axis]);
  }

  velocity(frame, id) {
    const start = 3 * (frame * this.number + id);
    return [0, 1, 2].map((axis) => (this.run.fastest * this.arrays.velocity[start + axis]) / 32767);
  }

  show(frame) {
    const { lower } = this.run;
    const { position, orientation, colour, size, there } = this.arrays;
    const first = frame * this.number;
    const colours = colour.length === 3 * this.number ? 0 : 3 * first;
    for (const mesh of this.meshes) {
      const to = mesh.instanceMatrix.array;
      const tint = mesh.instanceColor.array;
      const { ids } = mesh.userData;
      for (let k = 0; k < ids.length; k++) {
        const id = ids[k];
        const scale = there.length && !there[first + id] ? 0 : size[id];
        const p = 3 * (first + id);
        const q = 4 * (first + id);
        const w = orientation[q] / 32767;
        const x = orientation[q + 1] / 32767;
        const y = orientation[q + 2] / 32767;
        const z = orientation[q + 3] / 32767;
        // By columns: the axes of the particle, and where it is.
        const m = 16 * k;
        to[m] = scale * (1 - 2 * (y * y + z * z));
        to[m + 1] = scale * 2 * (x * y + w * z);
        to[m + 2] = scale * 2 * (x * z - w * y);
        to[m + 4] = scale * 2 * (x * y - w * z);
        to[m + 5] = scale * (1 - 2 * (x * x + z * z));
        to[m + 6] = scale * 2 * (y * z + w * x);
        to[m + 8] = scale * 2 * (x * z + w * y);
        to[m + 9] = scale * 2 * (y * z - w * x);
        to[m + 10] = scale * (1 - 2 * (x * x + y * y));
        for (let axis = 0; axis < 3; axis++) {
          to[m + 12 + axis] = lower[axis] + this.step[axis] * position[p + axis];
          const level = colour[colours + 3 * id + axis];
          tint[3 * k + axis] = id === this.picked ? PICKED[axis] : this.linear[level];
        }
        to[m + 15] = 1;
      }
      mesh.instanceMatrix.needsUpdate = true;
      mesh.instanceColor.needsUpdate = true;
      mesh.boundingSphere = null; // of another frame
    }
  }

  rows(frame, id) {
    const { run, arrays } = this;
    const shown = (values) => values.map((value) => value.toPrecision(4)).join(", ");
    const velocity = this.velocity(frame, id);
    return [
      ["particle", id],
      ["shape", run.shapes[arrays.shape[id]].name],
      ["group", run.groups[arrays.group[id]]],
      ["size", arrays.size[id].toPrecision(4)],
      ["mass", `${arrays.mass[id].toPrecision(4)} kg`],
      ["position", `${shown(this.position(frame, id))} m`],
      ["velocity", `${shown(velocity)} m/s`],
      ["speed", `${Math.hypot(...velocity).toPrecision(4)} m/s`],
    ];
  }
}

class Viewer {
  constructor(run, arrays) {
    this.run = run;
    this.frame = 0;
    this.since = null; // when the present frame was shown while it plays [ms]
    this.particles = new Particles(run, arrays);
    this.obstacles = new Obstacles(run, arrays);
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(run.background);
    const meshes = [...this.particles.meshes, ...this.obstacles.meshes];
    this.scene.add(...meshes, new THREE.HemisphereLight(0xffffff, 0xb0a8a0, 2.0));
    const [low, high] = run.subject;
    const centre = low.map((value, axis) => 0.5 * (value + high[axis]));
    const reach = Math.hypot(...low.map((value, axis) => high[axis] - value));
    const light = new THREE.DirectionalLight(0xffffff, 2.0);
    light.position.set(0.4 * reach, -0.6 * reach, reach);
    this.scene.add(light);
    if (run.box) {
      const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry(...run.world));
      this.scene.add(new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ color: run.lines })));
    }
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.001 * reach, 1000 * reach);
    this.camera.up.set(0, 0, 1);
    const [azimuth, elevation] = run.seen.map((degrees) => (degrees * Math.PI) / 180);
    const away = (0.55 * reach) / Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180);
    this.camera.position.set(
      centre[0] + away * Math.cos(elevation) * Math.cos(azimuth),
      centre[1] + away * Math.cos(elevation) * Math.sin(azimuth),
      centre[2] + away * Math.sin(elevation));
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    document.body.prepend(this.renderer.domElement);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.target.set(...centre);
    this.controls.update();
    this.controls.addEventListener("change", () => this.draw());
    this.listen();
    this.resize();
    this.show(0);
  }

  listen() {
    const canvas = this.renderer.domElement;
    const slider = document.getElementById("frame");
    slider.max = this.run.times.length - 1;
    slider.addEventListener("input", () => { this.pause(); this.show(Number(slider.value)); });
    document.getElementById("play").addEventListener("click", () => this.toggle());
    let down = [0, 0];
    canvas.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", (event) => {
      if (Math.hypot(event.clientX - down[0], event.clientY - down[1]) < DRAG) this.pick(event.clientX, event.clientY);
    });
    window.addEventListener("resize", () => { this.resize(); this.draw(); });
    window.addEventListener("keydown", (event) => {
      if (event.key === " ") { event.preventDefault(); this.toggle(); }
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step && event.target !== slider) { this.pause(); this.show(this.frame + step); }
    });
  }

  resize() {
    this.camera.aspect = window.innerWidth / window.innerHeight;
    this.camera.updateProjectionMatrix();
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.renderer.setSize(window.innerWidth, window.innerHeight);
  }

  show(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.run.times.length - 1);
    this.particles.show(this.frame);
    this.obstacles.show(this.frame);
    document.getElementById("frame").value = this.frame;
    const { times } = this.run;
    document.getElementById("time").textContent =
      `${times[this.frame].toFixed(3)} of ${times[times.length - 1].toFixed(3)} s`;
    this.tell();
    this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
  }

  toggle() {
    if (this.since !== null) { this.pause(); return; }
    if (this.frame === this.run.times.length - 1) this.show(0);
    this.since = performance.now();
    document.getElementById("play").textContent = "Pause";
    requestAnimationFrame((now) => this.play(now));
  }

  pause() {
    this.since = null;
    document.getElementById("play").textContent = "Play";
  }

  // Frames come at the rate of the movie; what the machine is too slow for is left out.
  play(now) {
    if (this.since === null) return;
    const passed = Math.floor((now - this.since) * this.run.rate / 1000);
    if (passed > 0) {
      this.since += passed * 1000 / this.run.rate;
      this.show(this.frame + passed);
      if (this.frame === this.run.times.length - 1) { this.pause(); return; }
    }
    requestAnimationFrame((later) => this.play(later));
  }

  // Show the numbers of the particle at a place of the window [pixels], or none.
  pick(x, y) {
    const pointer = new THREE.Vector2(2 * x / window.innerWidth - 1, 1 - 2 * y / window.innerHeight);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(pointer, this.camera);
    const hit = ray.intersectObjects(this.particles.meshes)[0];
    this.particles.picked = hit ? hit.object.userData.ids[hit.instanceId] : -1;
    this.show(this.frame);
  }

  tell() {
    const table = document.createElement("table");
    const { picked } = this.particles;
    for (const row of picked < 0 ? [] : this.particles.rows(this.frame, picked)) {
      const line = table.insertRow();
      for (const text of row) line.insertCell().textContent = text;
    }
    document.getElementById("picked").replaceChildren(...(picked < 0 ? [] : [table]));
  }
}

const run = JSON.parse(document.getElementById("run").textContent);
unpacked(run).then((arrays) => { window.viewer = new Viewer(run, arrays); }).catch((error) => {
  document.getElementById("picked").textContent = `cannot be shown here: ${error.message}`;
});
