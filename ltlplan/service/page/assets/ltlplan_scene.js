// A 3-D scene to scale, made of the figures that the reports are made of. It draws only when something changed.
import { CSS2DObject, CSS2DRenderer, OrbitControls, THREE } from "nicegui-scene";
import { cameraKeys, HALO, SceneNames, SEEN_TO_SCALE } from "scene_names";
import { css, dots, lineGeometry, meshGeometry, points, robotBody, tag } from "scene_shapes";
import { SceneView } from "scene_view";

export const RING_WORDS = "Robots are to scale: a ring stands for one too small to be seen, and is no size."; // beside every scene

// Numbers at the axes give way to names and to one another.
function partTicks(all, names) {
  const seen = names.filter(Boolean), around = all.getBoundingClientRect();
  for (const element of all.querySelectorAll(".tag3d.tick, .tag3d.axis")) {
    if (element.style.display === "none") continue;
    const box = element.getBoundingClientRect();
    const own = { left: box.left - around.left, right: box.right - around.left, top: box.top - around.top, bottom: box.bottom - around.top };
    const over = seen.some((o) => own.left < o.right && o.left < own.right && own.top < o.bottom && o.top < own.bottom);
    element.classList.toggle("crowded", over);
    if (!over) seen.push(own);
  }
}

function tickStep(span, most) {
  const rough = span / most, power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((f) => f * power).find((step) => step >= rough * 0.999);
}

export class Scene extends SceneView {
  constructor(holder) {
    super(holder);
    holder.scene3d = this;
    this.scene = new THREE.Scene();
    this.robots = [];
    this.waiting = false;
    try {
      this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    } catch {
      const note = document.createElement("p");
      note.className = "warning";
      note.textContent = "The 3-D picture needs WebGL, which this browser does not have; times, labels and claims do not.";
      holder.append(note);
      return;
    }
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.labels = new CSS2DRenderer();
    this.labels.domElement.className = "tags3d";
    holder.append(this.renderer.domElement, this.labels.domElement);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => { this.gliding = null; });
    this.names = new SceneNames(holder);
    this.named = [];
    cameraKeys(holder, (how) => this.moveCamera(how), () => { this.lookAtAll(); this.draw(); });
    this.scene.add(new THREE.AmbientLight(0xffffff, 2.2));
    const light = new THREE.DirectionalLight(0xffffff, 1.6);
    light.position.set(1, -2, 4);
    this.scene.add(light);
    this.content = new THREE.Group();
    this.marks = new THREE.Group();
    this.added = new THREE.Group();
    this.scene.add(this.content, this.marks, this.added);
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(holder);
    this.dark = window.matchMedia("(prefers-color-scheme: dark)");
    this.repaint = () => { this.drawRoom(); this.draw(); };
    this.dark.addEventListener("change", this.repaint);
  }

  dispose() {
    if (!this.renderer) return;
    this.sizes.disconnect();
    this.dark.removeEventListener("change", this.repaint);
    this.clear(this.content);
    this.clear(this.marks);
    this.clear(this.added);
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.holder.replaceChildren();
  }

  clear(group) {
    group.traverse((object) => {
      if (object.isCSS2DObject) object.element.remove();
      if (object.geometry) object.geometry.dispose();
      if (object.material) object.material.dispose();
    });
    group.clear();
  }

  // Shows a figure: `traces` and `layout` as the reports have them; its last traces are the robots, one each, of these radii (m).
  show(figure, robots, paths, radii) {
    if (!this.renderer) return;
    this.clear(this.content);
    this.clear(this.marks);
    this.clear(this.added);
    this.named = [];
    this.names.clear();
    const axes = figure.layout.scene;
    const ranges = ["xaxis", "yaxis", "zaxis"].map((axis) => axes[axis].range);
    this.low = new THREE.Vector3(...ranges.map((r) => r[0]));
    this.high = new THREE.Vector3(...ranges.map((r) => r[1]));
    const span = new THREE.Vector3().subVectors(this.high, this.low);
    this.size = span.length();
    const same = this.bounds && this.bounds.low.equals(this.low) && this.bounds.high.equals(this.high);
    this.bounds = { low: this.low.clone(), high: this.high.clone() };
    const moving = robots ? robots.length : 0;
    const still = moving ? figure.traces.slice(0, -moving) : figure.traces;
    for (const trace of still) this.addTrace(trace, robots || []);
    this.robots = (robots || []).map((name, i) => this.addRobot(name, figure.traces[figure.traces.length - moving + i], paths && paths[i], radii && radii[i]));
    this.room = new THREE.Group();
    this.content.add(this.room);
    this.drawRoom();
    if (!same) this.lookAtAll();
    this.resize();
  }

  addTrace(trace, robots) {
    if (trace.visible === false) return;
    const group = trace.legendgroup || trace.name;
    let object = null;
    if (trace.type === "mesh3d") {
      const clear = (trace.opacity ?? 1) < 1;
      object = new THREE.Mesh(meshGeometry(trace), new THREE.MeshLambertMaterial({
        color: trace.color, transparent: clear, opacity: trace.opacity ?? 1, depthWrite: !clear, side: THREE.DoubleSide,
      }));
      object.renderOrder = clear ? 2 : 0;
    } else if (trace.mode === "text") {
      object = new THREE.Object3D();
      object.position.copy(points(trace)[0]);
      this.named.push({ name: trace.text[0], kind: "region", object });
    } else if (trace.mode && trace.mode.startsWith("lines")) {
      if (robots.includes(trace.name)) return; // its path is drawn with the robot
      const dotted = trace.line && trace.line.dash && trace.line.dash !== "solid";
      if (dotted) object = dots(points(trace), trace.line.color);
      else {
        const geometry = lineGeometry(points(trace), 0.0022 * this.size);
        if (geometry) object = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: trace.line.color }));
      }
    } else if (trace.mode === "markers") {
      object = new THREE.Group();
      for (const at of points(trace)) {
        const mark = new THREE.Mesh(new THREE.OctahedronGeometry(0.007 * this.size), new THREE.MeshLambertMaterial({ color: trace.marker.color }));
        mark.position.copy(at);
        object.add(mark);
      }
    }
    if (!object) return;
    object.userData.group = group;
    this.content.add(object);
  }

  addRobot(name, trace, path, radius) {
    const colour = trace.marker.color;
    const body = robotBody(colour, radius || 0);
    body.position.copy(points(trace)[0]);
    this.named.push({ name, kind: "robot", object: body });
    const drop = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, -1)]),
      new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.45 }));
    body.add(drop);
    const robot = { name, body, drop, group: name, samples: path ? path.length : 0 };
    if (path) {
      const whole = lineGeometry(path.map((p) => new THREE.Vector3(...p)), 0.003 * this.size);
      if (whole) {
        const past = new THREE.BufferGeometry();
        past.setAttribute("position", whole.getAttribute("position"));
        past.setIndex(whole.getIndex());
        const ahead = new THREE.Mesh(whole, new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.35 }));
        robot.past = new THREE.Mesh(past, new THREE.MeshBasicMaterial({ color: colour }));
        robot.past.scale.setScalar(1);
        for (const part of [ahead, robot.past]) { part.userData.group = name; this.content.add(part); }
      }
    }
    body.userData.group = name;
    this.content.add(body);
    return robot;
  }

  // Floor, edges and figures of the workspace, in the reader's light or dark colours.
  drawRoom() {
    if (!this.room) return;
    this.clear(this.room);
    const { low, high } = this, grey = css("--soft"), faint = css("--line");
    const line = (a, b) => [new THREE.Vector3(...a), new THREE.Vector3(...b)];
    const floor = [];
    const label = (text, at, kind = "tick") => this.room.add(tag(text, kind, new THREE.Vector3(...at)));
    for (const [axis, other] of [["x", "y"], ["y", "x"]]) {
      const step = tickStep(high[axis] - low[axis], 6);
      for (let v = Math.ceil(low[axis] / step - 1e-9) * step; v <= high[axis] + 1e-9; v += step) {
        const a = { [axis]: v, [other]: low[other] }, b = { [axis]: v, [other]: high[other] };
        floor.push(...line([a.x, a.y, low.z], [b.x, b.y, low.z]));
        const out = 0.018 * this.size;
        if (axis === "x") label(String(+v.toFixed(3)), [v, low.y - out, low.z]);
        else label(String(+v.toFixed(3)), [high.x + out, v, low.z]);
      }
    }
    const stepZ = this.above ? Infinity : tickStep(high.z - low.z, 4); // from above nobody sees heights
    for (let v = this.above ? Infinity : Math.ceil(low.z / stepZ - 1e-9) * stepZ; v <= high.z + 1e-9; v += stepZ) {
      if (v - low.z > 0.3 * stepZ) label(String(+v.toFixed(3)), [low.x - 0.018 * this.size, low.y, v]);
    }
    const far = 0.055 * this.size;
    label("x (m)", [(low.x + high.x) / 2, low.y - far, low.z], "axis");
    label("y (m)", [high.x + far, (low.y + high.y) / 2, low.z], "axis");
    if (!this.above) label("z (m)", [low.x - far, low.y, (low.z + high.z) / 2], "axis");
    this.room.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(floor), new THREE.LineBasicMaterial({ color: faint })));
    const box = new THREE.Box3(low.clone(), high.clone());
    const frame = new THREE.Box3Helper(box, new THREE.Color(grey));
    frame.material.transparent = true;
    frame.material.opacity = 0.35;
    this.room.add(frame);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (!this.renderer || !width || !height) return;
    const first = !this.seen && this.low;
    this.renderer.setSize(width, height);
    this.labels.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (first) { this.seen = true; this.lookAtAll(); }
    this.draw();
  }

  // Moves the robots; `share` of the samples are behind them, or so many of each robot's. Robots without a place are not shown.
  move(places, share) {
    let moved = false;
    places.forEach((p, i) => {
      const robot = this.robots[i];
      if (!robot) return;
      moved ||= robot.body.visible !== (p !== null) || (p !== null && robot.body.position.distanceTo(new THREE.Vector3(...p)) > 1e-4);
      robot.body.visible = p !== null;
      if (p === null) return;
      if (robot.name === this.followed && this.low) this.followTo(robot.body.position, p);
      robot.body.position.set(...p);
      robot.drop.scale.z = Math.max(p[2] - this.low.z, 1e-3);
      const behind = Array.isArray(share) ? Math.min(share[i], robot.samples - 1) : share * (robot.samples - 1);
      if (robot.past) robot.past.geometry.setDrawRange(0, Math.max(Math.floor(behind), 0) * 36);
    });
    if (moved) this.draw();
  }

  // Draws a translucent tube of a radius in m around each robot's path.
  addTubes(robots, paths, radius) {
    if (!this.renderer || !radius) return;
    robots.forEach((name, i) => {
      const geometry = paths[i] && lineGeometry(paths[i].map((p) => new THREE.Vector3(...p)), radius, 8);
      if (!geometry) return;
      const { colour } = this.robots[i].body.userData;
      const tube = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.13, depthWrite: false }));
      tube.renderOrder = 3;
      tube.userData.group = name;
      this.content.add(tube);
    });
    this.draw();
  }

  // Puts a handle onto each body, at its centre in m: dragged, or moved by arrow keys, it says where to. The body itself stays.
  dragBodies(bodies, moved) {
    if (!this.renderer) return;
    for (const [name, { center }] of Object.entries(bodies)) {
      const handle = document.createElement("button");
      handle.type = "button";
      handle.className = "tag3d handle";
      handle.setAttribute("aria-label", "Move " + name + " by dragging, or with the arrow keys");
      handle.title = "Move " + name;
      const label = new CSS2DObject(handle);
      label.position.set(...center);
      this.content.add(label);
      const tell = () => moved(name, [label.position.x, label.position.y, center[2]].map((v) => Math.round(100 * v) / 100));
      const to = (x, y) => {
        label.position.x = Math.min(Math.max(x, this.low.x), this.high.x);
        label.position.y = Math.min(Math.max(y, this.low.y), this.high.y);
        this.draw();
      };
      handle.addEventListener("pointerdown", (event) => {
        event.preventDefault();
        handle.focus();
        handle.setPointerCapture(event.pointerId);
      });
      handle.addEventListener("pointermove", (event) => {
        if (!handle.hasPointerCapture(event.pointerId)) return;
        const at = this.onLevel(event, center[2]);
        if (at) to(at.x, at.y);
      });
      handle.addEventListener("pointerup", (event) => { if (handle.hasPointerCapture(event.pointerId)) tell(); });
      handle.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!step) return;
        event.preventDefault();
        event.stopPropagation();
        to(label.position.x + 0.05 * step[0], label.position.y + 0.05 * step[1]);
        tell();
      });
    }
    this.draw();
  }

  // Shows or hides everything of a robot or a region.
  toggle(group, shown) {
    this.content.traverse((object) => {
      if (object.userData.group === group) object.visible = shown;
    });
    this.draw();
  }

  // Marks places: rings with words, and a line between two of them.
  mark(places, words) {
    this.clear(this.marks);
    for (const place of places) this.marks.add(tag("", "ring", new THREE.Vector3(...place)));
    if (places.length > 1) {
      const ends = places.slice(0, 2).map((p) => new THREE.Vector3(...p));
      const geometry = lineGeometry(ends, 0.002 * this.size);
      if (geometry) this.marks.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: css("--mark") })));
    }
    if (places.length && words) {
      const at = new THREE.Vector3();
      for (const place of places) at.add(new THREE.Vector3(...place));
      const label = tag(words, "callout", at.multiplyScalar(1 / places.length));
      label.center.set(0.5, -0.9);
      this.marks.add(label);
    }
    this.draw();
  }

  // Shows recorded places as dots.
  addDots(tracks) {
    this.clear(this.added);
    for (const { colour, path } of tracks) this.added.add(dots(path.map((p) => new THREE.Vector3(...p)), colour));
    this.draw();
  }

  ringRobots() {
    this.camera.updateMatrixWorld();
    for (const { body } of this.robots) {
      const { radius, halo } = body.userData;
      body.userData.reach = radius * this.pixels(body.position);
      halo.visible = body.userData.reach < SEEN_TO_SCALE;
    }
  }

  // Writes the names of what is seen; returns where.
  putNames() {
    const { clientWidth: width, clientHeight: height } = this.holder, at = new THREE.Vector3();
    const things = this.named.filter(({ object }) => object.visible).flatMap(({ name, kind, object }) => {
      at.copy(object.position).project(this.camera);
      if (Math.abs(at.z) > 1) return [];
      const reach = kind === "robot" ? Math.max(object.userData.reach, HALO) : 0;
      return [{ name, kind, x: ((1 + at.x) * width) / 2, y: ((1 - at.y) * height) / 2, reach, rank: kind === "robot" ? 1 : 0 }];
    });
    return this.names.put(things, width, height);
  }

  draw() {
    if (this.waiting || !this.renderer) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (!this.holder.isConnected || !this.holder.clientWidth) return;
      this.ringRobots();
      this.renderer.render(this.scene, this.camera);
      this.labels.render(this.scene, this.camera);
      partTicks(this.labels.domElement, this.putNames());
      this.holder.dataset.drawn = "yes";
    });
  }
}
