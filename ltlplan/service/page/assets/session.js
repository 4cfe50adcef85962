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
