// Names, and robots to scale, over plotly's own scenes: plotly writes names over one another, and draws marks of so many pixels.
const SPIN = 0.02; // rad from the poles, where the camera stops

function drawnScene(place) {
  const drawn = place._fullLayout && place._fullLayout.scene && place._fullLayout.scene._scene;
  return drawn && drawn.glplot && drawn.glplot.cameraParams && drawn.dataScale ? drawn : null;
}

function onto(matrix, v) {
  return [0, 1, 2, 3].map((i) => matrix[i] * v[0] + matrix[4 + i] * v[1] + matrix[8 + i] * v[2] + matrix[12 + i] * v[3]);
}

// Returns where a point is in a picture of a size, and how far it is from the camera; null where it is behind it.
function onPicture(drawn, point, [width, height]) {
  const { model, view, projection } = drawn.glplot.cameraParams;
  const [x, y, , w] = onto(projection, onto(view, onto(model, [...point.map((v, axis) => v * drawn.dataScale[axis]), 1])));
  return w > 0 ? { x: ((1 + x / w) * width) / 2, y: ((1 - y / w) * height) / 2, w } : null;
}

// Returns the radius in pixels of a ball of a radius in m: of three ways across each other, the squares as they are seen are twice its own.
function radiusOnPicture(drawn, point, radius, size) {
  const middle = onPicture(drawn, point, size);
  let squares = 0;
  for (let axis = 0; axis < 3 && middle; axis++) {
    const end = onPicture(drawn, point.map((v, k) => v + (k === axis ? radius : 0)), size);
    if (end) squares += (end.x - middle.x) ** 2 + (end.y - middle.y) ** 2;
  }
  return Math.sqrt(squares / 2);
}

const isShown = (trace) => trace.visible !== false && trace.visible !== "legendonly";

// Takes the words out of a scene that is about to be drawn; returns where they were.
function takeNames(traces) {
  return traces.flatMap((trace, i) => {
    if (trace.type !== "scatter3d" || trace.mode !== "text") return [];
    const words = trace.text;
    trace.text = words.map(() => "");
    return words.map((name, k) => ({ trace: i, point: k, name }));
  });
}

function nameScene(place, words) {
  const drawn = drawnScene(place);
  if (!drawn) { for (const { trace, name } of words) Plotly.restyle(place, { text: [[name]] }, [trace]); return; }
  place.sceneNames?.layer.remove();
  place.sceneNames?.left.remove();
  const names = (place.sceneNames = new SceneNames(place)), own = drawn.glplot.onrender;
  const at = (trace, k) => [trace.x[k], trace.y[k], trace.z[k]];
  let before = "";
  function put() {
    const box = drawn.glplot.canvas.getBoundingClientRect(), around = place.getBoundingClientRect(), size = [box.width, box.height];
    const things = [], discs = [];
    for (const { trace, point, name } of words) {
      const seen = isShown(place.data[trace]) && onPicture(drawn, at(place.data[trace], point), size);
      if (seen) things.push({ name, kind: "region", x: seen.x, y: seen.y, reach: 0, rank: 0 });
    }
    for (const trace of place.data) {
      if (!trace.meta || !trace.meta.robots || !isShown(trace)) continue;
      trace.meta.robots.forEach((name, k) => {
        const point = at(trace, k), seen = typeof point[0] === "number" && onPicture(drawn, point, size);
        if (!seen) return;
        const radius = radiusOnPicture(drawn, point, trace.meta.radii[k], size), colour = trace.marker.color;
        discs.push({ x: seen.x, y: seen.y, radius, colour: Array.isArray(colour) ? colour[k] : colour });
        if (trace.meta.robots.length === 1) things.push({ name, kind: "robot", x: seen.x, y: seen.y, reach: Math.max(radius, HALO), rank: 1 });
      });
    }
    const now = JSON.stringify([things, discs, size, box.left - around.left, box.top - around.top]);
    if (now === before) return;
    before = now;
    const style = { left: box.left - around.left - place.clientLeft, top: box.top - around.top - place.clientTop, width: box.width, height: box.height };
    for (const [name, value] of Object.entries(style)) names.layer.style[name] = value + "px";
    names.put(things, box.width, box.height, discs);
  }
  drawn.glplot.onrender = () => { if (own) own(); put(); };
  put();
}

// Moves plotly's camera as keys ask.
function keysOf(place) {
  const first = structuredClone(place.layout.scene.camera);
  cameraKeys(place, ({ turn, shift, nearer }) => {
    const { eye, center, up } = structuredClone(place._fullLayout.scene.camera);
    const away = ["x", "y", "z"].map((axis) => (eye[axis] - center[axis]) * nearer), far = Math.hypot(...away);
    const theta = Math.atan2(away[1], away[0]) + turn[0];
    const phi = Math.min(Math.max(Math.acos(away[2] / far) - turn[1], SPIN), Math.PI - SPIN);
    const way = [Math.sin(phi) * Math.cos(theta), Math.sin(phi) * Math.sin(theta), Math.cos(phi)];
    const right = [-Math.sin(theta), Math.cos(theta), 0];
    const above = [-Math.cos(phi) * Math.cos(theta), -Math.cos(phi) * Math.sin(theta), Math.sin(phi)];
    ["x", "y", "z"].forEach((axis, k) => {
      center[axis] += far * (shift[0] * right[k] + shift[1] * above[k]);
      eye[axis] = center[axis] + far * way[k];
    });
    Plotly.relayout(place, { "scene.camera": { eye, center, up } });
  }, () => Plotly.relayout(place, { "scene.camera": structuredClone(first) }));
}
