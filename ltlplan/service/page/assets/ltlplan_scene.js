// A 3-D scene to scale, made of the figures that the reports are made of. It draws only when something changed.
import { CSS2DObject, CSS2DRenderer, OrbitControls, THREE } from "nicegui-scene";
import { cameraKeys, HALO, SceneNames, SEEN_TO_SCALE } from "scene_names";

export const RING_WORDS = "Robots are to scale: a ring stands for one too small to be seen, and is no size."; // beside every scene
const FOV = 32; // degrees
const REACH = 0.62 + 0.3 + 0.045; // of a robot as it is modelled below: from its middle to the outside of its rotors
const DOWN = new THREE.Vector3(0, -1e-4, 1).normalize(); // from straight above, y up in the picture
const EYE = new THREE.Vector3(0.8, -1.7, 1.0).normalize(); // where the reports' scenes are looked at from

function css(name) {
  return getComputedStyle(document.body).getPropertyValue(name).trim() || "#808080";
}

function points(trace) {
  return Array.from(trace.x, (x, i) => new THREE.Vector3(x, trace.y[i], trace.z[i]));
}

function tag(text, kind, at) {
  const element = document.createElement("div");
  element.className = "tag3d " + kind;
  element.textContent = text;
  const label = new CSS2DObject(element);
  if (at) label.position.copy(at);
  return label;
}

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

// A ring of a few pixels, drawn once.
let ringPicture = null;
function ring() {
  if (ringPicture) return ringPicture;
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.width = canvas.height = 64;
  pen.lineWidth = 9;
  pen.strokeStyle = pen.fillStyle = "#fff";
  pen.arc(32, 32, 26, 0, 2 * Math.PI);
  pen.stroke();
  pen.beginPath();
  pen.arc(32, 32, 6, 0, 2 * Math.PI);
  pen.fill();
  return (ringPicture = canvas);
}

// A round line: browsers draw lines of one pixel only.
function lineGeometry(path, radius, sides = 6) {
  const corners = [], index = [];
  let tangent = new THREE.Vector3(1, 0, 0), across = new THREE.Vector3(), moved = false;
  for (let i = 0; i < path.length; i++) {
    const way = new THREE.Vector3().subVectors(path[Math.min(i + 1, path.length - 1)], path[Math.max(i - 1, 0)]);
    if (way.length() > 1e-6) { tangent = way.normalize(); moved = true; }
    across.copy(Math.abs(tangent.z) < 0.9 ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(1, 0, 0)).cross(tangent).normalize();
    const up = new THREE.Vector3().crossVectors(tangent, across);
    for (let k = 0; k < sides; k++) {
      const angle = (2 * Math.PI * k) / sides;
      const c = radius * Math.cos(angle), s = radius * Math.sin(angle);
      corners.push(path[i].x + c * across.x + s * up.x, path[i].y + c * across.y + s * up.y, path[i].z + c * across.z + s * up.z);
      if (i + 1 < path.length) {
        const a = i * sides + k, b = i * sides + ((k + 1) % sides);
        index.push(a, b, a + sides, b, b + sides, a + sides);
      }
    }
  }
  if (!moved) return null;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.setIndex(index);
  return geometry;
}

function meshGeometry(trace) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(trace.x.flatMap((x, i) => [x, trace.y[i], trace.z[i]]), 3));
  geometry.setIndex(trace.i.flatMap((a, n) => [a, trace.j[n], trace.k[n]]));
  geometry.computeVertexNormals();
  return geometry;
}

function tickStep(span, most) {
  const rough = span / most, power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((f) => f * power).find((step) => step >= rough * 0.999);
}

// A robot as large as its radius says (m), and a ring of a few pixels that shows where it is where that is too small to be seen.
function robotBody(colour, radius) {
  const body = new THREE.Group(), size = radius / REACH;
  const place = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3()]);
  const across = 2 * HALO * Math.min(window.devicePixelRatio, 2);
  const halo = new THREE.Points(place, new THREE.PointsMaterial({
    color: colour, size: across, sizeAttenuation: false, map: new THREE.CanvasTexture(ring()), transparent: true, depthWrite: false, alphaTest: 0.1,
  }));
  body.add(halo);
  body.userData = { radius, halo, colour };
  if (!radius) return body;
  const paint = new THREE.MeshLambertMaterial({ color: colour });
  const dark = new THREE.MeshLambertMaterial({ color: new THREE.Color(colour).multiplyScalar(0.55) });
  body.add(new THREE.Mesh(new THREE.SphereGeometry(0.24 * size, 16, 12), paint));
  for (const angle of [0.25, 0.75, 1.25, 1.75]) {
    const x = 0.62 * size * Math.cos(angle * Math.PI), y = 0.62 * size * Math.sin(angle * Math.PI);
    const arm = new THREE.Mesh(new THREE.CylinderGeometry(0.06 * size, 0.06 * size, 0.62 * size), dark);
    arm.rotation.z = Math.PI / 2 + angle * Math.PI + Math.PI;
    arm.position.set(x / 2, y / 2, 0);
    const rotor = new THREE.Mesh(new THREE.TorusGeometry(0.3 * size, 0.045 * size, 6, 20), paint);
    rotor.position.set(x, y, 0.08 * size);
    body.add(arm, rotor);
  }
  return body;
}

export class Scene {
  constructor(holder) {
    this.holder = holder;
    holder.scene3d = this;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FOV, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
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
      if (dotted) object = this.dots(points(trace), trace.line.color);
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

  dots(path, colour) {
    const geometry = new THREE.BufferGeometry().setFromPoints(path);
    return new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size: 2.5, sizeAttenuation: false }));
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

  lookAtAll() {
    const middle = new THREE.Vector3().addVectors(this.low, this.high).multiplyScalar(0.5);
    const shape = (this.holder.clientWidth || 4) / (this.holder.clientHeight || 3);
    const half = (FOV / 360) * Math.PI;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * shape));
    this.distance = ((shape < 1.3 ? 0.52 : 0.43) * this.size) / Math.sin(narrow);
    this.controls.target.copy(middle);
    if (this.above) { // the upper face of the room fits, which is nearest
      const across = Math.max((this.high.x - this.low.x) / shape, this.high.y - this.low.y) / 2;
      this.distance = (1.22 * across) / Math.tan(half) + (this.high.z - this.low.z) / 2;
    }
    this.camera.position.copy(middle).addScaledVector(this.above ? DOWN : EYE, this.distance);
    this.camera.near = 0.01 * this.distance;
    this.camera.far = 20 * this.distance;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.gliding = null;
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

  // Has the camera follow a robot, or nobody.
  follow(name) {
    this.followed = name;
    const robot = this.robots.find((each) => each.name === name);
    if (robot) this.glideTo(robot.body.position.toArray());
  }

  followTo(from, to) {
    if (this.gliding) return;
    const way = new THREE.Vector3(...to).sub(from);
    this.camera.position.add(way);
    this.controls.target.add(way);
    this.controls.update();
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

  // Returns where a pointer is at a height, m; null where it is nowhere there.
  onLevel(event, height) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), -height), new THREE.Vector3());
  }

  // Looks straight down from now on, y up; it is moved and zoomed, not turned.
  lookFromAbove() {
    if (!this.renderer) return;
    this.above = true;
    this.controls.enableRotate = false;
    this.controls.mouseButtons = { LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN };
    this.controls.touches = { ONE: THREE.TOUCH.PAN, TWO: THREE.TOUCH.DOLLY_PAN };
    if (this.low) this.lookAtAll();
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
    for (const { colour, path } of tracks) this.added.add(this.dots(path.map((p) => new THREE.Vector3(...p)), colour));
    this.draw();
  }

  glideTo(place) {
    const to = new THREE.Vector3(...place);
    const from = this.controls.target.clone();
    const away = this.camera.position.clone().sub(from);
    const nearer = away.clone().setLength(Math.min(away.length(), 0.62 * this.distance));
    const begin = performance.now();
    const span = window.matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 450;
    const glide = (this.gliding = (now) => {
      if (this.gliding !== glide) return;
      const s = Math.min((now - begin) / span, 1), share = s * s * (3 - 2 * s);
      this.controls.target.lerpVectors(from, to, share);
      this.camera.position.copy(this.controls.target).add(away.clone().lerp(nearer, share));
      this.controls.update();
      this.draw();
      if (s < 1) requestAnimationFrame(glide);
    });
    requestAnimationFrame(glide);
  }

  // Moves the camera as keys ask.
  moveCamera({ turn, shift, nearer }) {
    if (!this.low) return;
    this.gliding = null;
    const { target } = this.controls, away = this.camera.position.clone().sub(target).multiplyScalar(nearer);
    const [right, up] = [0, 1].map((axis) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, axis));
    if (this.above && (turn[0] || turn[1])) shift = turn; // from above nothing turns
    else if (turn[0] || turn[1]) {
      const round = new THREE.Spherical().setFromVector3(new THREE.Vector3(away.x, away.z, -away.y)); // its poles are along y
      round.theta += turn[0];
      round.phi -= turn[1];
      const to = new THREE.Vector3().setFromSpherical(round.makeSafe());
      away.set(to.x, -to.z, to.y);
    }
    const width = 2 * away.length() * Math.tan((FOV / 360) * Math.PI);
    target.addScaledVector(right, shift[0] * width).addScaledVector(up, shift[1] * width);
    this.camera.position.copy(target).add(away);
    this.controls.update();
    this.draw();
  }

  // Returns how many pixels wide a metre is at a place.
  pixels(place) {
    const depth = new THREE.Vector3().subVectors(place, this.camera.position).dot(this.camera.getWorldDirection(new THREE.Vector3()));
    return this.holder.clientHeight / (2 * Math.max(depth, 1e-6) * Math.tan((FOV / 360) * Math.PI));
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
