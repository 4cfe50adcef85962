"use strict";
// Draws many robots over a scene while they move, as plain circles: the scene behind them, all paths and regions, stays as it is drawn, and
// is drawn anew by plotly where its camera turns. A phone draws a hundred circles in a millisecond, and the scene in a tenth of a second.
function makeOverlay(place, colours) {
  const RADIUS = 6.5; // CSS pixels, of plotly's markers of size 8
  const canvas = document.createElement("canvas");
  canvas.className = "overlay";
  const pen = canvas.getContext("2d");

  function times(matrix, v) {
    return [0, 1, 2, 3].map((i) => matrix[i] * v[0] + matrix[4 + i] * v[1] + matrix[8 + i] * v[2] + matrix[12 + i] * v[3]);
  }

  function fit(drawn) {
    const box = drawn.glplot.canvas.getBoundingClientRect();
    const around = place.getBoundingClientRect();
    const size = [Math.round(box.width * devicePixelRatio), Math.round(box.height * devicePixelRatio)];
    if (!canvas.isConnected) place.append(canvas);
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const style = { left: box.left - around.left - place.clientLeft, top: box.top - around.top - place.clientTop, width: box.width, height: box.height };
    for (const [name, value] of Object.entries(style)) canvas.style[name] = value + "px";
    return [box.width, box.height];
  }

  // Draws points as the scene's camera sees them, the nearest last; a robot that is hidden has no point.
  function draw(drawn, points) {
    const [width, height] = fit(drawn);
    const { model, view, projection } = drawn.glplot.cameraParams;
    const seen = points.flatMap((point, i) => {
      if (!point) return [];
      const [x, y, , w] = times(projection, times(view, times(model, [...point.map((v, axis) => v * drawn.dataScale[axis]), 1])));
      return w > 0 ? [{ x: ((1 + x / w) * width) / 2, y: ((1 - y / w) * height) / 2, w, colour: colours[i] }] : [];
    });
    seen.sort((one, other) => other.w - one.w);
    pen.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = "#222";
    for (const { x, y, colour } of seen) {
      pen.beginPath();
      pen.arc(x, y, RADIUS, 0, 2 * Math.PI);
      pen.fillStyle = colour;
      pen.fill();
      pen.stroke();
    }
    place.dataset.drawn = String(1 + Number(place.dataset.drawn || 0));
  }

  return { draw, clear: () => canvas.remove(), shown: () => canvas.isConnected };
}
