// Moves the robots along their sampled flights, and says what each shows and what is still to do at that time.
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
  let value = rows.length ? rows[0][1] : "";
  for (const [start, next] of rows) if (start <= time) value = next;
  return value;
}

function show(time) {
  const points = robots.map((name) => at(data.paths[name], time));
  Plotly.restyle("scene", { x: points.map((p) => [p[0]]), y: points.map((p) => [p[1]]), z: points.map((p) => [p[2]]) }, markers);
  document.getElementById("time").textContent = time.toFixed(1) + " s";
  clock.setAttribute("aria-valuetext", time.toFixed(1) + " s");
  robots.forEach((name, i) => {
    document.getElementById("letter" + i).textContent = spell(data.letters[name], time);
  });
  const todo = document.getElementById("todo");
  todo.replaceChildren(...spell(data.todo, time).map(([part, state]) => {
    const item = document.createElement("li");
    const word = document.createElement("b");
    word.textContent = state;
    word.className = state.split(" ")[0];
    const formula = document.createElement("code");
    formula.textContent = part;
    item.append(...(part ? [formula, " "] : []), word);
    return item;
  }));
}

function stop() {
  playing = false;
  play.textContent = "Play";
}

function tick(now) {
  if (!playing) return;
  const next = Number(clock.value) + ((now - last) / 1000) * Number(document.getElementById("speed").value);
  last = now;
  if (next >= Number(clock.max)) { clock.value = clock.max; stop(); }
  else clock.value = next;
  show(Number(clock.value));
  if (playing) requestAnimationFrame(tick);
}

play.addEventListener("click", () => {
  if (playing) { stop(); return; }
  playing = true;
  play.textContent = "Pause";
  if (Number(clock.value) >= Number(clock.max) - 0.01) clock.value = 0;
  last = performance.now();
  requestAnimationFrame(tick);
});
clock.addEventListener("input", () => show(Number(clock.value)));
drawn.then(() => {
  show(Number(clock.value));
  document.body.dataset.ready = "yes";
});
