"use strict";
// Draws the figures that the page carries as data and moves the robots along their sampled flights.
const data = JSON.parse(document.getElementById("data").textContent);
const config = { responsive: true, displaylogo: false, displayModeBar: false };
for (const [id, figure] of Object.entries(data.figures)) {
  Plotly.newPlot(id, figure.data, figure.layout, config);
}
const robots = Object.keys(data.paths);
const traces = data.figures.scene.data.length;
const markers = robots.map((_, i) => traces - robots.length + i);
const clock = document.getElementById("clock");
const play = document.getElementById("play");
let playing = false;
let last = 0;

function at(values, time) {
  const share = Math.min(time / data.step, values.length - 1);
  const low = Math.floor(share);
  const high = Math.min(low + 1, values.length - 1);
  return values[low].map((v, axis) => v + (share - low) * (values[high][axis] - v));
}

function spell(rows, time) {
  let text = rows.length ? rows[0][1] : "";
  for (const [start, value] of rows) if (start <= time) text = value;
  return text;
}

function show(time) {
  const points = robots.map((name) => at(data.paths[name], time));
  Plotly.restyle("scene", { x: points.map((p) => [p[0]]), y: points.map((p) => [p[1]]), z: points.map((p) => [p[2]]) }, markers);
  document.getElementById("time").textContent = time.toFixed(1) + " s";
  const list = document.getElementById("letters");
  list.replaceChildren();
  robots.forEach((name, i) => {
    const term = document.createElement("dt");
    const dot = document.createElement("i");
    dot.style.background = data.colours[i];
    term.append(dot, name);
    const letter = document.createElement("dd");
    letter.textContent = spell(data.letters[name], time);
    list.append(term, letter);
  });
  document.getElementById("todo").textContent = spell(data.todo, time);
}

function tick(now) {
  if (!playing) return;
  const next = Number(clock.value) + ((now - last) / 1000) * Number(document.getElementById("speed").value);
  last = now;
  if (next >= Number(clock.max)) { clock.value = clock.max; playing = false; play.textContent = "Play"; }
  else clock.value = next;
  show(Number(clock.value));
  if (playing) requestAnimationFrame(tick);
}

play.addEventListener("click", () => {
  playing = !playing;
  play.textContent = playing ? "Pause" : "Play";
  if (playing && Number(clock.value) >= Number(clock.max) - 0.01) clock.value = 0;
  last = performance.now();
  if (playing) requestAnimationFrame(tick);
});
clock.addEventListener("input", () => show(Number(clock.value)));
show(0);
document.body.dataset.ready = "yes";
