"""Pages for people who are not in yet, or were rejected: plain HTML that needs nothing else, for strangers too."""

from __future__ import annotations

import html
from importlib import resources

from ltlplan.service.models import Problem

PLAIN_POLICY = "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
"""What such a page may load: nothing."""

_COLOURS = "".join(
    line
    for sheet in ("report/style.css", "service/page/assets/page.css")
    for line in (resources.files("ltlplan") / sheet).read_text("utf-8").splitlines()
    if ":root" in line
)
"""Colours of reports and of the page, light and dark."""
_STYLE = """*{box-sizing:border-box}
body{font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;max-width:WIDTHrem;margin:12vh auto;padding:0 16px;background:var(--paper);color:var(--ink)}
h1{font-size:26px;line-height:1.3;letter-spacing:-.01em;margin:0 0 12px}a{color:var(--accent)}small,summary{color:var(--soft)}
label{display:block;color:var(--soft);margin-top:10px}form{margin:0 0 12px}summary{cursor:pointer}
input,button,.button{display:block;font:inherit;width:100%;padding:7px 12px;border:1px solid var(--line);border-radius:6px;background:var(--paper);color:var(--ink);text-align:center;text-decoration:none}
input{text-align:left;border-color:var(--soft)}button{margin-top:16px;cursor:pointer;background:var(--accent);border-color:var(--accent);color:var(--accent-ink);font-weight:600}
.button{background:var(--panel)}.button:hover{background:var(--press)}button:hover{filter:brightness(1.08)}
:focus-visible{outline:2px solid var(--accent);outline-offset:2px}
[role=alert]{color:var(--bad)}.detail{white-space:pre-wrap;overflow-wrap:anywhere}code{font-size:13px;background:var(--panel);border-radius:4px;padding:1px 5px}
"""
_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>ltlplan: {title}</title>
<style>{style}</style></head>
<body><main>{content}</main></body></html>
"""
_PASSWORD_FORM = """<form method="post" action="/login"><label for="name">Name</label>
<input id="name" name="name" autocomplete="username" autocapitalize="none" maxlength="60" required autofocus><label for="password">Password</label>
<input id="password" name="password" type="password" autocomplete="current-password" maxlength="200" required><button>Log in</button></form>
<p><small>Forgotten? An admin of this service can reset it. <a href="/password">Change your password</a></small></p>"""
_TOKEN_FORM = """<form method="post" action="/login"><label for="token">Token</label>
<input id="token" name="token" type="password" autocomplete="current-password" required{focus}>
<button>{words}</button></form><p><small>Whoever runs this service makes one: <code>ltlplan serve --new-token NAME</code>.</small></p>"""
_OPENID = """<p><a class="button" href="/login/openid">Log in by the lab's own login</a></p>"""
_NEW_PASSWORD = """<h1>A new password</h1>{said}<form method="post" action="/password"><label for="name">Name</label>
<input id="name" name="name" autocomplete="username" autocapitalize="none" maxlength="60" required value="{name}">
<label for="password">Present password</label>
<input id="password" name="password" type="password" autocomplete="current-password" maxlength="200" required{focus}>
<label for="new">New password (12 letters or more)</label>
<input id="new" name="new" type="password" autocomplete="new-password" minlength="12" maxlength="200" required>
<label for="again">New password, once more</label>
<input id="again" name="again" type="password" autocomplete="new-password" minlength="12" maxlength="200" required>
<button>Change it</button></form><p><small>This logs you out everywhere else. <a href="/login">Log in</a></small></p>"""
_ENTERED = """<h1>ltlplan</h1><p>You are logged in. <a href="/">To the first page</a></p>"""
_ON = '<meta http-equiv="refresh" content="0;url=/">'
_REFUSAL = """<h1>{title}</h1><p class="detail" role="alert">{detail}</p><p><a href="{to}">{words}</a></p>"""


def login_page(said: str = "", *, passwords: bool = False, tokens: bool = True, openid: bool = False) -> str:
    """Return the page that asks who somebody is.

    Args:
        said: Why the last try was rejected.
        passwords: Whether there are accounts.
        tokens: Whether there are tokens.
        openid: Whether there is a login by OpenID Connect.
    """
    content = f"<h1>ltlplan</h1>{_alert(said)}"
    content += _OPENID if openid else ""
    content += _PASSWORD_FORM if passwords else ""
    if tokens and passwords:
        content += f"<details><summary>By a token</summary>{_TOKEN_FORM.format(focus='', words='Log in by token')}</details>"
    elif tokens or not openid:
        content += "" if passwords else _TOKEN_FORM.format(focus=" autofocus", words="Log in")
    return _page("log in", content)


def password_page(said: str = "", *, name: str = "") -> str:
    """Return the page that changes a password.

    Args:
        said: Why it is asked for, or the last try was rejected.
        name: Of the account, where it is known.
    """
    focus = " autofocus" if name else ""
    content = _NEW_PASSWORD.format(said=_alert(said), name=html.escape(name, quote=True), focus=focus)
    return _page("a new password", content)


def entered_page() -> str:
    """Return the page that leads on after a login elsewhere."""
    return _page("logged in", _ENTERED).replace("<title>", _ON + "<title>")


def _page(title: str, content: str, *, width: int = 26) -> str:
    return _PAGE.format(title=title, style=_COLOURS + _STYLE.replace("WIDTH", str(width)), content=content)


def _alert(said: str) -> str:
    return f'<p role="alert">{html.escape(said)}</p>' if said else ""


def refusal_page(problem: Problem) -> str:
    """Return a problem as a page, with a way to go on.

    Args:
        problem: What is rejected, and why.
    """
    to, words = ("/login", "Log in") if problem.status == 401 else ("/", "To the first page")
    content = _REFUSAL.format(title=html.escape(problem.title), detail=html.escape(problem.detail), to=to, words=words)
    return _page(html.escape(problem.title), content, width=40)
