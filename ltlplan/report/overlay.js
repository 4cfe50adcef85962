"use strict";
// Draws many robots over a scene while they move, as discs to scale in rings of a few pixels: the scene behind them, all paths and regions, stays as it is drawn, and
// is drawn anew by plotly where its camera turns. A phone draws a hundred circles in a millisecond, and the scene in a tenth of a second.
function makeOverlay(place, colours, radii) {
  const canvas = document.createElement("canvas");
  canvas.className = "overlay";
  const pen = canvas.getContext("2d");

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
    const seen = points.flatMap((point, i) => {
      const at = point && onPicture(drawn, point, [width, height]);
      return at ? [{ ...at, colour: colours[i], radius: radiusOnPicture(drawn, point, radii[i], [width, height]) }] : [];
    });
    seen.sort((one, other) => other.w - one.w);
    pen.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.lineWidth = 2;
    for (const { x, y, colour, radius } of seen) {
      pen.beginPath();
      pen.arc(x, y, Math.max(radius, 2), 0, 2 * Math.PI);
      pen.fillStyle = pen.strokeStyle = colour;
      pen.fill();
      pen.beginPath();
      pen.arc(x, y, HALO, 0, 2 * Math.PI);
      pen.stroke();
    }
    place.dataset.drawn = String(1 + Number(place.dataset.drawn || 0));
  }

  return { draw, clear: () => canvas.remove(), shown: () => canvas.isConnected };
}
