"""Action that each route asks for, in one table, and the dependency of the whole application that decides on each request.

A route that is not in the table is answered to nobody: it cannot be forgotten without being noticed.
"""

from __future__ import annotations

from fastapi.requests import HTTPConnection

from ltlplan.service.people.roles import Action, require
from ltlplan.service.problems import Forbidden
from ltlplan.service.security.asker import LOGIN, OPENID, OPENID_BACK, PASSWORD

_OPEN, _READ, _ASK, _PLAN, _FLY, _ADMINISTER = tuple(Action)

ACTIONS: dict[tuple[str, str], Action] = {
    ("GET", "/health"): _OPEN,
    ("GET", "/metrics"): _READ,
    ("GET", "/api/limits"): _READ,
    ("GET", "/docs"): _OPEN,
    ("GET", "/docs/start.js"): _OPEN,
    ("GET", "/docs/{name}"): _OPEN,
    ("GET", "/problems/{kind}"): _OPEN,
    ("GET", LOGIN): _OPEN,
    ("POST", LOGIN): _OPEN,
    ("GET", OPENID): _OPEN,
    ("GET", OPENID_BACK): _OPEN,
    ("GET", PASSWORD): _OPEN,
    ("POST", PASSWORD): _OPEN,
    ("POST", "/logout"): _OPEN,
    ("GET", "/"): _READ,
    ("GET", "/api/missions"): _READ,
    ("POST", "/api/missions/check"): _ASK,
    ("POST", "/api/words/check"): _ASK,
    ("POST", "/api/flights/judge"): _ASK,
    ("POST", "/api/jobs"): _PLAN,
    ("GET", "/api/jobs"): _READ,
    ("GET", "/api/jobs/{job}"): _READ,
    ("DELETE", "/api/jobs/{job}"): _PLAN,
    ("POST", "/api/jobs/{job}/cancel"): _PLAN,
    ("POST", "/api/jobs/{job}/stop"): _PLAN,
    ("POST", "/api/jobs/{job}/project"): _PLAN,
    ("GET", "/api/jobs/{job}/events"): _READ,
    ("GET", "/api/jobs/{job}/files"): _READ,
    ("GET", "/api/jobs/{job}/files/{name:path}"): _READ,
    ("GET", "/api/jobs/{job}/report"): _READ,
    ("GET", "/api/jobs/{job}/certificate"): _READ,
    ("GET", "/api/jobs/{job}/mission"): _READ,
    ("GET", "/api/jobs/{job}/plan"): _READ,
    ("GET", "/api/jobs/{job}/archive"): _ASK,
    ("GET", "/api/jobs/{job}/proof"): _ASK,
    ("POST", "/api/jobs/{job}/recheck"): _ASK,
    ("GET", "/api/exports"): _READ,
    ("GET", "/api/jobs/{job}/exports/{target}"): _PLAN,
    ("POST", "/api/jobs/{job}/exports/{target}"): _PLAN,
    ("GET", "/api/jobs/{job}/derived"): _READ,
    ("POST", "/api/jobs/{job}/campaigns"): _PLAN,
    ("POST", "/api/jobs/{job}/rehearsals"): _PLAN,
    ("POST", "/api/jobs/{job}/recordings"): _PLAN,
    ("GET", "/api/projects"): _READ,
    ("PUT", "/api/projects/{name:path}"): _PLAN,
    ("GET", "/api/drafts"): _READ,
    ("PUT", "/api/drafts/{draft}"): _ASK,
    ("GET", "/api/stored"): _READ,
    ("POST", "/api/stored"): _PLAN,
    ("GET", "/api/stored/{mission}"): _READ,
    ("PUT", "/api/stored/{mission}"): _PLAN,
    ("PATCH", "/api/stored/{mission}"): _PLAN,
    ("DELETE", "/api/stored/{mission}"): _PLAN,
    ("GET", "/api/stored/{mission}/versions"): _READ,
    ("GET", "/api/stored/{mission}/versions/{number}"): _READ,
    ("GET", "/api/stored/{mission}/difference"): _READ,
    ("POST", "/api/stored/{mission}/versions/{number}/plan"): _PLAN,
    ("GET", "/api/studies"): _READ,
    ("POST", "/api/studies"): _PLAN,
    ("GET", "/api/studies/{study}"): _READ,
    ("DELETE", "/api/studies/{study}"): _PLAN,
    ("GET", "/api/studies/{study}/table"): _READ,
    ("GET", "/api/studies/{study}/plot"): _READ,
    ("POST", "/api/studies/{study}/cancel"): _PLAN,
    ("GET", "/api/jobs/{job}/compare/{other}"): _ASK,
    ("GET", "/api/live"): _READ,
    ("GET", "/api/live/{name}"): _READ,
    ("GET", "/api/live/{name}/events"): _READ,
    ("PUT", "/api/live/{name}"): _FLY,
    ("POST", "/api/live/{name}/events"): _FLY,
    ("POST", "/api/live/{name}/answers"): _FLY,
    ("POST", "/api/live/{name}/end"): _FLY,
    ("WEBSOCKET", "/api/live/{name}/feed"): _FLY,
    ("WEBSOCKET", "/api/live/{name}/watch"): _READ,
    ("POST", "/api/live/{name}/stop"): _FLY,
    ("POST", "/api/live/{name}/control"): _FLY,
    ("GET", "/api/live/{name}/runs"): _READ,
    ("POST", "/api/live/{name}/foretell"): _ASK,
    ("GET", "/api/live/{name}/replays/{run}"): _READ,
    ("GET", "/api/account"): _READ,
    ("POST", "/api/account/tokens"): _READ,
    ("DELETE", "/api/account/tokens/{name}"): _READ,
    ("DELETE", "/api/account/sessions"): _READ,
    ("GET", "/api/webhooks"): _READ,
    ("POST", "/api/webhooks"): _PLAN,
    ("DELETE", "/api/webhooks/{webhook}"): _PLAN,
    ("GET", "/api/accounts"): _ADMINISTER,
    ("POST", "/api/accounts"): _ADMINISTER,
    ("PATCH", "/api/accounts/{name}"): _ADMINISTER,
    ("POST", "/api/accounts/{name}/password"): _ADMINISTER,
    ("DELETE", "/api/accounts/{name}/sessions"): _ADMINISTER,
    ("GET", "/api/log"): _ADMINISTER,
}
"""By method and path; sockets have the method "WEBSOCKET"."""
REST = "/api/{rest:path}"
"""Path of the route that says that there is nothing."""


async def decide(request: HTTPConnection) -> None:
    """Reject a request whose user may not make it.

    Raises:
        Forbidden: The role is not enough, or nobody may.
    """
    path = request.scope["route"].path
    method = request.scope.get("method", "WEBSOCKET")
    method = "GET" if method == "HEAD" else method
    if path == REST:
        return
    request.state.route = path
    action = ACTIONS.get((method, path))
    if action is None:
        raise Forbidden("No role may do this.")
    require(request.state.principal, action)
