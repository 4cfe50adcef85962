"use strict";
// Moves the robots along their sampled flights, and says what each shows and what is still to do at that time.
function startPlayer(playing, traces) {
  const scene = document.getElementById("scene");
  const clock = document.getElementById("clock");
  const play = document.getElementById("play");
  // Of many robots all paths are one trace and all markers another, whose customdata says of each point whose it is.
  const together = traces.flatMap((trace, i) => (trace.customdata ? [i] : []));
  const crowd = together.length > 0;
  const hidden = new Set(); // robots of a crowd
  const paths = together.slice(0, -1);
  const whole = paths.map((i) => traces[i].x.slice()); // plotly keeps its changes in the traces that it was given
  const overlay = crowd ? makeOverlay(scene, traces[together.at(-1)].marker.color, traces[together.at(-1)].meta.radii) : null;
  const markers = crowd ? together.slice(-1) : playing.robots.map((_, i) => traces.length - playing.robots.length + i);
  const lasting = traces.flatMap((trace, i) => (trace.meta && "since" in trace.meta ? [i] : [])); // what is there for a time only
  const clockFace = document.getElementById("time");
  const letters = playing.robots.map((_, i) => document.getElementById("letter" + i));
  const charts = document.querySelectorAll(".bars");
  let world = "";
  let todo = null;
  let happened = 0;
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

  // Puts the markers where the robots are: into the scene's own objects where it has them as we know them, because plotly goes
  // through every trace of a scene for a single new point; and into the figure's data, for whatever draws it anew.
  function place(points) {
    const drawn = scene._fullLayout && scene._fullLayout.scene && scene._fullLayout.scene._scene;
    const known = drawn && drawn.traces && drawn.glplot && typeof drawn.glplot.redraw === "function";
    const mine = points.map((p, i) => (hidden.has(playing.robots[i]) ? null : p));
    if (crowd && known && running) { // the markers stay out of the scene until the robots stand still
      if (!overlay.shown()) put(drawn, [[]]);
      overlay.draw(drawn, mine);
      return;
    }
    if (crowd) overlay.clear();
    const at = crowd ? [mine.map((p) => p || [null, null, null])] : points.map((p) => [p]);
    if (known) { put(drawn, at); return; }
    const axis = (k) => at.map((trace) => trace.map((p) => p[k]));
    Plotly.restyle(scene, { x: axis(0), y: axis(1), z: axis(2) }, markers);
  }

  function put(drawn, at) {
    at.forEach((trace, i) => move(drawn, markers[i], trace));
    drawn.glplot.redraw();
  }

  function move(drawn, index, points) {
    const full = scene._fullData[index];
    const [x, y, z] = [0, 1, 2].map((axis) => points.map((p) => p[axis]));
    for (const trace of [scene.data[index], full]) Object.assign(trace, { x, y, z });
    if (drawn.traces[full.uid]) drawn.traces[full.uid].update(full); // a hidden robot has none
  }

  // Hides what a robot has in the scene, or shows it again: as a click on its name in the legend does, where there is one.
  function toggle(button, name) {
    if (!scene.data) return;
    if (crowd) {
      if (!hidden.delete(name)) hidden.add(name);
      button.setAttribute("aria-pressed", String(!hidden.has(name)));
      const left = whole.map((row, i) => row.map((x, k) => (hidden.has(traces[paths[i]].customdata[k]) ? null : x)));
      Plotly.restyle(scene, { x: left }, paths);
      show(Number(clock.value));
      return;
    }
    const own = scene.data.flatMap((trace, i) => (trace.name === name || trace.legendgroup === name ? [i] : []));
    const hide = scene.data[own[0]].visible !== "legendonly";
    button.setAttribute("aria-pressed", String(!hide));
    Plotly.restyle(scene, { visible: hide ? "legendonly" : true }, own);
  }

  function write(element, text) {
    if (element.textContent !== text) element.textContent = text;
  }

  function show(time) {
    if (scene.data) { // a scene far from the screen may not be drawn
      place(playing.paths.map((path) => at(path, time)));
      change(time);
    }
    write(clockFace, time.toFixed(1) + " s");
    clock.setAttribute("aria-valuetext", time.toFixed(1) + " s");
    for (const chart of charts) chart.style.setProperty("--now", String(time / Number(clock.max)));
    playing.letters.forEach((rows, i) => write(letters[i], spell(rows, time)));
    const next = spell(playing.todo, time);
    if (next !== todo) document.getElementById("todo").replaceChildren(...next.map(part));
    todo = next;
    const past = playing.happened.filter(([when]) => when <= time);
    if (past.length === happened) return;
    happened = past.length;
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
    if (running) { stop(); show(Number(clock.value)); return; }
    running = true;
    play.textContent = "Pause";
    if (Number(clock.value) >= Number(clock.max) - 0.01) clock.value = 0;
    last = performance.now();
    requestAnimationFrame(tick);
  });
  document.querySelectorAll("#letters button").forEach((button, i) => {
    button.addEventListener("click", () => toggle(button, playing.robots[i]));
  });
  clock.addEventListener("input", () => show(Number(clock.value)));
  document.body.classList.add("playing");
  show(Number(clock.value));
}
