// The names of a scene's things: placed beside them, none over another, with a line where one stands farther off; those that have no room are
// counted and listed in a corner. The reports' scenes and the service's have the same. Everything is in CSS pixels of the scene.
const NAME_GAP = 3; // between a thing and its name, and between two names
const NAME_RINGS = [16, 30, 48, 70, 96]; // how far from its thing a name is tried with a line
const NAME_WAYS = [[0, -1], [1, 0], [-1, 0], [0, 1], [0.75, -0.75], [-0.75, -0.75], [0.75, 0.75], [-0.75, 0.75], [0.4, -1], [-0.4, -1], [0.4, 1], [-0.4, 1]];
export const HALO = 7; // radius of the ring around a robot that is too small to be seen to scale
export const SEEN_TO_SCALE = 5; // radius from which a robot needs no ring

function boxesMeet(a, b, gap = 0) {
  return a.left < b.right + gap && b.left < a.right + gap && a.top < b.bottom + gap && b.top < a.bottom + gap;
}

// Whether a line from one point to another passes through a box.
function lineMeets([x1, y1, x2, y2], box) {
  let from = 0, to = 1;
  for (const [at, step, low, high] of [[x1, x2 - x1, box.left, box.right], [y1, y2 - y1, box.top, box.bottom]]) {
    if (Math.abs(step) < 1e-9) { if (at <= low || at >= high) return false; continue; }
    const [near, far] = [(low - at) / step, (high - at) / step].sort((a, b) => a - b);
    from = Math.max(from, near);
    to = Math.min(to, far);
    if (from >= to) return false;
  }
  return true;
}

const holds = (box, { x, y }) => box.left <= x && x <= box.right && box.top <= y && y <= box.bottom;

function nameTries(thing) {
  const { x, y, reach, width, height } = thing;
  const tries = reach ? [] : [{ left: x - width / 2, top: y - height / 2, far: false }];
  for (const ring of [0, ...NAME_RINGS]) for (const [dx, dy] of NAME_WAYS) {
    const out = reach + NAME_GAP + ring;
    tries.push({ left: x + dx * (out + width / 2) - width / 2, top: y + dy * (out + height / 2) - height / 2, far: ring > 0 });
  }
  return tries;
}

// Returns for each thing the box of its name, with the line to it where it is not beside it; null where there is no room. Things are
// placed by their rank, greatest first, then in their order: the same things are named the same way.
export function placeNames(things, width, height) {
  const placed = things.map(() => null), boxes = [], lines = [];
  const bodies = things.map((thing) => {
    const reach = Math.max(thing.reach, NAME_GAP);
    return { thing, left: thing.x - reach, right: thing.x + reach, top: thing.y - reach, bottom: thing.y + reach };
  });
  const order = things.map((_, i) => i).sort((a, b) => things[b].rank - things[a].rank || a - b);
  for (const index of order) {
    const thing = things[index];
    for (const over of [false, true]) { // over other things only where there is no other place
      for (const each of nameTries(thing)) {
        const box = { left: each.left, top: each.top, right: each.left + thing.width, bottom: each.top + thing.height, line: null };
        if (box.left < 0 || box.top < 0 || box.right > width || box.bottom > height) continue;
        if (boxes.some((other) => boxesMeet(box, other, NAME_GAP)) || lines.some((line) => lineMeets(line, box))) continue;
        if (!over && bodies.some((body) => body.thing !== thing && boxesMeet(box, body))) continue;
        if (each.far) {
          box.line = [thing.x, thing.y, Math.min(Math.max(thing.x, box.left), box.right), Math.min(Math.max(thing.y, box.top), box.bottom)];
          if (boxes.some((other) => lineMeets(box.line, other) && !holds(other, thing))) continue;
          lines.push(box.line);
        }
        boxes.push(box);
        placed[index] = box;
        break;
      }
      if (placed[index]) break;
    }
  }
  return placed;
}

// Names over a scene. `put` takes things with `name`, `kind`, place and reach, and writes each where there is room for it.
export class SceneNames {
  constructor(holder) {
    this.holder = holder;
    this.layer = document.createElement("div");
    this.layer.className = "scene-names";
    this.layer.setAttribute("aria-hidden", "true"); // all are said beside the scene
    this.lines = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.layer.append(this.lines);
    this.left = document.createElement("details");
    this.left.className = "names-left";
    this.left.hidden = true;
    this.count = document.createElement("summary");
    this.listed = document.createElement("p");
    this.left.append(this.count, this.listed);
    holder.append(this.layer, this.left);
    this.shown = new Map();
  }

  element(name, kind) {
    const key = kind + " " + name;
    let found = this.shown.get(key);
    if (!found) {
      const element = document.createElement("span");
      element.className = "scene-name " + kind;
      element.textContent = name;
      this.layer.append(element);
      found = { element, width: Math.ceil(element.offsetWidth), height: Math.ceil(element.offsetHeight) };
      this.shown.set(key, found);
    }
    return found;
  }

  // `discs` are robots to scale, drawn below the names where the scene itself does not draw them so.
  put(things, width, height, discs = []) {
    const seen = things.filter((thing) => thing.x >= 0 && thing.y >= 0 && thing.x <= width && thing.y <= height);
    const own = seen.map((thing) => this.element(thing.name, thing.kind));
    const placed = placeNames(seen.map((thing, i) => ({ ...thing, width: own[i].width, height: own[i].height })), width, height);
    for (const { element } of this.shown.values()) element.style.visibility = "hidden";
    const lines = [];
    placed.forEach((box, i) => {
      if (!box) return;
      own[i].element.style.visibility = "visible";
      own[i].element.style.transform = `translate(${box.left.toFixed(1)}px, ${box.top.toFixed(1)}px)`;
      own[i].element.dataset.at = seen[i].x.toFixed(1) + " " + seen[i].y.toFixed(1) + " " + seen[i].reach.toFixed(1);
      if (box.line) lines.push("M" + box.line.slice(0, 2).map((v) => v.toFixed(1)) + "L" + box.line.slice(2).map((v) => v.toFixed(1)));
    });
    const round = discs.map(({ x, y, radius, colour }) => `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="${Math.max(radius, 2).toFixed(1)}" fill="${colour}"/>`);
    this.lines.innerHTML = [...round, ...lines.map((line) => `<path d="${line}"/>`)].join("");
    const missing = seen.filter((_, i) => !placed[i]).map((thing) => thing.name);
    const said = missing.join(", ");
    if (this.said === said) return placed;
    this.said = said;
    this.left.hidden = !missing.length;
    this.count.textContent = missing.length + (missing.length === 1 ? " name has" : " names have") + " no room";
    this.listed.textContent = said;
    return placed;
  }

  clear() {
    for (const { element } of this.shown.values()) element.remove();
    this.shown.clear();
    this.lines.replaceChildren();
  }
}

// Has a scene's camera moved by keys while the scene has the focus: `move` takes how far to turn (rad), to shift (share of the picture) and to
// come near (factor).
export function cameraKeys(holder, move, whole) {
  holder.tabIndex = 0;
  holder.setAttribute("role", "group");
  holder.setAttribute("aria-roledescription", "scene");
  holder.setAttribute("aria-keyshortcuts", "ArrowLeft ArrowRight ArrowUp ArrowDown Shift+ArrowLeft Shift+ArrowRight Shift+ArrowUp Shift+ArrowDown + - 0");
  holder.addEventListener("keydown", (event) => {
    if (event.target !== holder || event.ctrlKey || event.metaKey || event.altKey) return;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const nearer = { "+": 0.85, "=": 0.85, "-": 1 / 0.85 }[event.key];
    if (event.key === "0") whole();
    else if (way && event.shiftKey) move({ turn: [0, 0], shift: way.map((v) => 0.08 * v), nearer: 1 });
    else if (way) move({ turn: way.map((v) => 0.12 * v), shift: [0, 0], nearer: 1 });
    else if (nearer) move({ turn: [0, 0], shift: [0, 0], nearer });
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
}
