"use strict";
// Moves the robots along their sampled flights, and says what each shows and what is still to do at that time.
function startPlayer(playing, traces) {
  const scene = document.getElementById("scene");
  const clock = document.getElementById("clock");
  const play = document.getElementById("play");
  const markers = playing.robots.map((_, i) => traces.length - playing.robots.length + i);
  const lasting = traces.flatMap((trace, i) => (trace.meta ? [i] : [])); // what is there for a time only
  let world = "";
  let running = false;
  let last = 0;

  function at(values, time) {
    const share = Math.min(time / playing.step, values.length - 1);
    const low = Math.floor(share);
    const high = Math.min(low + 1, values.length - 1);
    return values[low].map((v, axis) => v + (share - low) * (values[high][axis] - v));
  }

  function spell(rows, time) {
    let value = rows.length ? rows[0][1] : [];
    for (const [start, next] of rows) if (start <= time) value = next;
    return value;
  }

  function item(...parts) {
    const element = document.createElement("li");
    element.append(...parts);
    return element;
  }

  function part([formula, state]) {
    const word = document.createElement("b");
    word.textContent = state;
    word.className = state.split(" ")[0];
    const code = document.createElement("code");
    code.textContent = formula;
    return formula ? item(code, " ", word) : item(word);
  }

  function change(time) {
    const seen = lasting.map((i) => traces[i].meta.since <= time && !(traces[i].meta.until <= time));
    if (!lasting.length || String(seen) === world) return;
    world = String(seen);
    Plotly.restyle(scene, { visible: seen }, lasting);
  }

  function show(time) {
    const points = playing.paths.map((path) => at(path, time));
    if (scene.data) { // a scene far from the screen may not be drawn
      Plotly.restyle(scene, { x: points.map((p) => [p[0]]), y: points.map((p) => [p[1]]), z: points.map((p) => [p[2]]) }, markers);
      change(time);
    }
    document.getElementById("time").textContent = time.toFixed(1) + " s";
    clock.setAttribute("aria-valuetext", time.toFixed(1) + " s");
    document.body.style.setProperty("--now", String(time / Number(clock.max)));
    playing.letters.forEach((rows, i) => { document.getElementById("letter" + i).textContent = spell(rows, time); });
    document.getElementById("todo").replaceChildren(...spell(playing.todo, time).map(part));
    const past = playing.happened.filter(([when]) => when <= time);
    if (!playing.happened.length) return;
    document.getElementById("past").hidden = !past.length;
    document.getElementById("happened").replaceChildren(...past.map(([when, what]) => item(when.toFixed(1) + " s: " + what)));
  }

  function stop() {
    running = false;
    play.textContent = "Play";
  }

  function tick(now) {
    if (!running) return;
    const next = Number(clock.value) + (Math.max(now - last, 0) / 1000) * Number(document.getElementById("speed").value);
    last = now;
    if (next >= Number(clock.max)) { clock.value = clock.max; stop(); }
    else clock.value = next;
    show(Number(clock.value));
    if (running) requestAnimationFrame(tick);
  }

  play.addEventListener("click", () => {
    if (running) { stop(); return; }
    running = true;
    play.textContent = "Pause";
    if (Number(clock.value) >= Number(clock.max) - 0.01) clock.value = 0;
    last = performance.now();
    requestAnimationFrame(tick);
  });
  clock.addEventListener("input", () => show(Number(clock.value)));
  document.body.classList.add("playing");
  show(Number(clock.value));
}
