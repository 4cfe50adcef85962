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
