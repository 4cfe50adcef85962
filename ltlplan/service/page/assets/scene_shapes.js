// Shapes of a 3-D scene: lines, meshes, words, and robots to scale.
import { CSS2DObject, THREE } from "nicegui-scene";
import { HALO } from "scene_names";

const REACH = 0.62 + 0.3 + 0.045; // of a robot as it is modelled below: from its middle to the outside of its rotors

export function css(name) {
  return getComputedStyle(document.body).getPropertyValue(name).trim() || "#808080";
}

export function points(trace) {
  return Array.from(trace.x, (x, i) => new THREE.Vector3(x, trace.y[i], trace.z[i]));
}

export function tag(text, kind, at) {
  const element = document.createElement("div");
  element.className = "tag3d " + kind;
  element.textContent = text;
  const label = new CSS2DObject(element);
  if (at) label.position.copy(at);
  return label;
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
export function lineGeometry(path, radius, sides = 6) {
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

export function meshGeometry(trace) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(trace.x.flatMap((x, i) => [x, trace.y[i], trace.z[i]]), 3));
  geometry.setIndex(trace.i.flatMap((a, n) => [a, trace.j[n], trace.k[n]]));
  geometry.computeVertexNormals();
  return geometry;
}

// A robot as large as its radius says (m), and a ring of a few pixels that shows where it is where that is too small to be seen.
export function robotBody(colour, radius) {
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

export function dots(path, colour) {
  const geometry = new THREE.BufferGeometry().setFromPoints(path);
  return new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size: 2.5, sizeAttenuation: false }));
}
