// A page whose session has ended goes to where one logs in; one that lost the service for another reason waits for it, as NiceGUI does.
(() => {
  const look = () =>
    fetch("/api/jobs?limit=1", { headers: { accept: "application/json" } })
      .then((answer) => { if (answer.status === 401) location.assign("/login"); })
      .catch(() => {});
  const begin = () => {
    if (!window.socket) { setTimeout(begin, 100); return; }
    window.socket.on("disconnect", look);
    window.socket.on("connect_error", look);
  };
  begin();
})();

// What drops down from the page closes by Escape, by a click elsewhere and by a choice made in it.
const closeDrops = (kept) => {
  for (const open of document.querySelectorAll(".gallery details[open]")) if (!kept || !open.contains(kept)) open.open = false;
};
document.addEventListener("click", (event) => closeDrops(event.target.closest(".drop li") ? null : event.target));
document.addEventListener("keydown", (event) => {
  const open = event.key === "Escape" && event.target.closest(".gallery details[open]");
  if (!open) return;
  open.firstElementChild.focus();
  closeDrops();
});

// Clocks of what is running go on from what the service said, whether it has time to say more or not.
setInterval(() => {
  for (const clock of document.querySelectorAll("[data-ran]")) {
    if (clock.ran !== clock.dataset.ran) Object.assign(clock, { ran: clock.dataset.ran, began: performance.now() - 1000 * clock.dataset.ran });
    const seconds = Math.floor((performance.now() - clock.began) / 1000);
    clock.textContent = seconds < 100 ? `${seconds} s` : `${Math.floor(seconds / 60)} min ${seconds % 60} s`;
  }
}, 250);

// Tab goes round within a dialog that is open.
document.addEventListener("keydown", (event) => {
  const dialog = [...document.querySelectorAll("[role=dialog]")].at(-1);
  if (event.key !== "Tab" || !dialog) return;
  const stops = [...dialog.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]")]
    .filter((each) => each.tabIndex >= 0 && !each.disabled && each.checkVisibility());
  const at = stops.indexOf(document.activeElement), last = event.shiftKey ? 0 : stops.length - 1;
  if (!stops.length || (at >= 0 && at !== last)) return;
  event.preventDefault();
  stops[event.shiftKey ? stops.length - 1 : 0].focus();
});

// Each view has its address. A new one comes into the history; one that is gone back to is as it was, as far as it was scrolled.
(() => {
  const PATIENCE = 20000; // ms that a view may take until it is as long as it was
  const STEADY = 1000; // ms for which it is as long as it was, so that nothing of it comes and goes any more
  let keeping = null, reaching = 0, goes = 0;
  history.scrollRestoration = "manual";
  const keep = () => history.replaceState({ ...history.state, y: scrollY }, "");
  const reach = () => {
    const goal = history.state?.y ?? 0, end = performance.now() + PATIENCE, mine = (reaching = ++goes);
    let there = Infinity; // since when
    const step = (now) => {
      if (mine !== reaching) return;
      scrollTo(0, goal);
      there = Math.abs(scrollY - goal) > 1 ? Infinity : Math.min(there, now);
      if (now - there > STEADY || now > end) reaching = 0;
      else requestAnimationFrame(step);
    };
    step(performance.now());
  };
  addEventListener("scroll", () => {
    clearTimeout(keeping);
    if (!reaching) keeping = setTimeout(keep, 150);
  }, { passive: true });
  for (const kind of ["wheel", "touchstart", "keydown", "pointerdown"]) addEventListener(kind, () => { reaching = 0; }, { passive: true, capture: true });
  addEventListener("popstate", () => {
    clearTimeout(keeping);
    reaching = -1; // what it is scrolled to until the view is there is none of a reader's doing
    emitEvent("went", location.pathname);
  });
  // Notes what is seen: `new` in the history, `instead` of what was seen before, or as it was when one came `back` to it.
  window.noteView = (path, how) => {
    clearTimeout(keeping);
    if (how === "new" && path !== location.pathname) {
      reaching = 0;
      history.pushState({}, "", path);
      scrollTo(0, 0);
      return;
    }
    if (how !== "back") history.replaceState(history.state, "", path);
    if (how !== "new") reach();
  };
})();

// A double click acts once, as one click does. Who stops a flight may press as often as they like.
addEventListener("click", (event) => {
  const pressed = event.target instanceof Element ? event.target.closest("button, a[href]") : null;
  if (event.detail < 2 || !pressed || pressed.closest(".stops")) return;
  event.preventDefault();
  event.stopImmediatePropagation();
}, true);
