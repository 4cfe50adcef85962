"use strict";
// Unpacks what the page carries, and draws its figures in the reader's light or dark colours.
const DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;,=>?@^_`{|}~";
const MOST_SCENES = 8; // a browser takes the picture away from the oldest of 16 scenes, a phone sooner
const WIDE = 1.45; // a scene narrower than this is looked at from farther away, so that its axes are in the picture
const CONFIG = { displaylogo: false, displayModeBar: false };
const CROWD = 20; // robots; scenes of more are drawn in single pixels instead of quarters, which is what drawing them costs
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const places = Array.from(document.querySelectorAll(".figure"));
const alive = new Set(); // scenes that are drawn
const near = new Set(); // scenes on the screen, or about to be
let data = null;

function bytes(text) {
  const values = new Uint8Array(128);
  for (let i = 0; i < DIGITS.length; i++) values[DIGITS.charCodeAt(i)] = i;
  const missing = (5 - (text.length % 5)) % 5;
  const padded = text + "~".repeat(missing);
  const view = new DataView(new ArrayBuffer((padded.length / 5) * 4));
  for (let i = 0, at = 0; i < padded.length; at += 4) {
    let word = 0;
    for (const end = i + 5; i < end; i++) word = word * 85 + values[padded.charCodeAt(i)];
    view.setUint32(at, word);
  }
  return new Uint8Array(view.buffer, 0, view.byteLength - missing);
}

async function unpack(id) {
  const packed = new Blob([bytes(document.getElementById(id).textContent)]);
  return new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

// Undoes what `stepped` of inline.py did to long rows of numbers.
function unfolded(value) {
  if (value === null || typeof value !== "object") return value;
  if (Array.isArray(value)) return value.map(unfolded);
  if (value.columns) {
    const columns = value.columns.map(unfolded);
    return columns[0].map((_, row) => columns.map((column) => column[row]));
  }
  if (value.of) {
    const row = value.of.slice();
    for (let sums = 0; sums < value.sums; sums++) for (let i = 1; i < row.length; i++) row[i] += row[i - 1];
    return row.map((whole) => whole / value.per);
  }
  return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, unfolded(part)]));
}

function colours(layout) {
  const found = { "font.color": dark.matches ? "#e4e7ee" : "#1d2330" };
  if (layout.scene) {
    for (const axis of ["xaxis", "yaxis", "zaxis"]) {
      found["scene." + axis + ".color"] = dark.matches ? "#aab2c0" : "#5a6272";
      found["scene." + axis + ".gridcolor"] = dark.matches ? "#363c48" : "#d5d9e2";
    }
  }
  return found;
}

function set(layout, name, value) {
  const path = name.split(".");
  const last = path.pop();
  path.reduce((part, key) => (part[key] = part[key] || {}), layout)[last] = value;
}

function stepBack(place, layout) {
  const camera = layout.scene && layout.scene.camera;
  const shape = place.clientWidth / place.clientHeight;
  if (!camera || shape >= WIDE || place.dataset.seen) return;
  for (const axis of ["x", "y", "z"]) camera.eye[axis] *= WIDE / shape;
}

async function put(place) {
  const { data: traces, layout } = data.figures[place.id];
  for (const [name, value] of Object.entries(colours(layout))) set(layout, name, value);
  stepBack(place, layout);
  if (layout.scene) alive.add(place);
  const crowd = data.player && data.player.robots.length > CROWD;
  const words = layout.scene ? (place.words ||= takeNames(traces)) : [];
  await Plotly.newPlot(place, traces, layout, crowd ? { ...CONFIG, plotGlPixelRatio: 1 } : CONFIG); // a reader's own camera comes back in the layout
  if (layout.scene) {
    nameScene(place, words);
    if (!place.dataset.seen) keysOf(place);
  }
  place.dataset.seen = "yes";
}

// Scenes are drawn when they come near the screen, one after another; those farthest in the past make room.
async function putNear() {
  for (const place of near) {
    if (alive.has(place)) continue;
    for (const other of alive) {
      if (alive.size < MOST_SCENES) break;
      if (near.has(other)) continue;
      alive.delete(other);
      Plotly.purge(other);
    }
    await put(place);
  }
}

let queue = Promise.resolve();
function drawLater() {
  queue = queue.then(putNear);
  return queue;
}

function watchScenes(scenes) {
  return new Promise((seen) => {
    if (!scenes.length) seen();
    const watcher = new IntersectionObserver((entries) => {
      for (const entry of entries) (entry.isIntersecting ? near.add(entry.target) : near.delete(entry.target));
      drawLater().then(seen);
    }, { rootMargin: "25% 0%" });
    for (const place of scenes) watcher.observe(place);
  });
}

async function start() {
  data = unfolded(JSON.parse(await unpack("data")));
  for (const figure of Object.values(data.figures)) figure.data = figure.data.map((i) => structuredClone(data.traces[i]));
  const script = document.createElement("script");
  script.textContent = await unpack("plotly");
  document.head.append(script);
  const isScene = (place) => Boolean(data.figures[place.id].layout.scene);
  await watchScenes(places.filter(isScene));
  for (const place of places) if (!isScene(place)) await put(place);
  const sizes = new ResizeObserver((entries) => {
    for (const { target } of entries) if (target.data) Plotly.Plots.resize(target);
  });
  for (const place of places) sizes.observe(place);
  dark.addEventListener("change", () => {
    for (const place of places) if (place.data) Plotly.relayout(place, colours(place.layout));
  });
  if (data.player) startPlayer(data.player, data.figures.scene.data);
  document.body.dataset.ready = "yes";
}

function say(sentence) {
  const unseen = document.getElementById("unseen");
  unseen.textContent = sentence;
  unseen.hidden = false;
  document.body.dataset.unseen = "yes";
}

if (typeof DecompressionStream === "undefined") {
  say("This browser is too old for the pictures: they are packed, and it has no DecompressionStream to unpack them. Chromium, " +
    "Chrome and Edge have it from 80 on, Safari from 16.4, Firefox from 113. Bars, tables and words need nothing.");
} else {
  start().catch((error) => {
    say("The pictures cannot be drawn: " + error.message);
    throw error;
  });
}
