// Where a 3-D scene is looked at from: all of it, from above, along with a robot, or as keys and pointers ask.
import { THREE } from "nicegui-scene";

const FOV = 32; // degrees
const DOWN = new THREE.Vector3(0, -1e-4, 1).normalize(); // from straight above, y up in the picture
const EYE = new THREE.Vector3(0.8, -1.7, 1.0).normalize(); // where the reports' scenes are looked at from

// What a scene looks through; the scene itself has `controls`, `low` and `high` (its corners, m), `size`, `robots` and `draw`.
export class SceneView {
  constructor(holder) {
    this.holder = holder;
    this.camera = new THREE.PerspectiveCamera(FOV, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
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

  // Looks straight down from now on, y up; it is moved and zoomed, not turned.
  lookFromAbove() {
    if (!this.renderer) return;
    this.above = true;
    this.controls.enableRotate = false;
    this.controls.mouseButtons = { LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN };
    this.controls.touches = { ONE: THREE.TOUCH.PAN, TWO: THREE.TOUCH.DOLLY_PAN };
    if (this.low) this.lookAtAll();
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

  // Returns where a pointer is at a height, m; null where it is nowhere there.
  onLevel(event, height) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), -height), new THREE.Vector3());
  }
}
