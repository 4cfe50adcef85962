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
