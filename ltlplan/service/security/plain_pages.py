"""Pages for people who are not in yet, or were rejected: plain HTML that needs nothing else, for strangers too."""

from __future__ import annotations

import html

from ltlplan.service.models import Problem

PLAIN_POLICY = "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
"""What such a page may load: nothing."""

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><title>ltlplan: {title}</title>
<style>body{{font:1rem/1.5 system-ui,sans-serif;max-width:{width}rem;margin:15vh auto;padding:0 1rem}}
input,button{{font:inherit;padding:.5rem;width:100%;box-sizing:border-box;margin:.3rem 0}}[role=alert]{{color:#b3261e}}
html{{background:#fff;color:#1d2330}}a{{color:#2765d3}}
@media(prefers-color-scheme:dark){{html{{background:#14171d;color:#e4e7ee}}a{{color:#7aa7f7}}[role=alert]{{color:#ff8a80}}}}
.button{{display:block;text-align:center;padding:.5rem;border:1px solid;border-radius:.2rem;text-decoration:none}}form{{margin-bottom:1rem}}
.detail{{white-space:pre-wrap;overflow-wrap:anywhere}}</style></head>
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
<button>Change it</button></form><p><small>You are logged out everywhere else. <a href="/login">Log in</a></small></p>"""
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
    return _PAGE.format(title="log in", width=26, content=content)


def password_page(said: str = "", *, name: str = "") -> str:
    """Return the page that changes a password.

    Args:
        said: Why it is asked for, or the last try was rejected.
        name: Of the account, where it is known.
    """
    focus = " autofocus" if name else ""
    content = _NEW_PASSWORD.format(said=_alert(said), name=html.escape(name, quote=True), focus=focus)
    return _PAGE.format(title="a new password", width=26, content=content)


def entered_page() -> str:
    """Return the page that leads on after a login elsewhere."""
    return _PAGE.format(title="logged in", width=26, content=_ENTERED).replace("<title>", _ON + "<title>")


def _alert(said: str) -> str:
    return f'<p role="alert">{html.escape(said)}</p>' if said else ""


def refusal_page(problem: Problem) -> str:
    """Return a problem as a page, with a way to go on.

    Args:
        problem: What is rejected, and why.
    """
    to, words = ("/login", "Log in") if problem.status == 401 else ("/", "To the first page")
    content = _REFUSAL.format(title=html.escape(problem.title), detail=html.escape(problem.detail), to=to, words=words)
    return _PAGE.format(title=html.escape(problem.title), width=40, content=content)
