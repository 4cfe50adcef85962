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
input,button{{font:inherit;padding:.5rem;width:100%;box-sizing:border-box;margin:.3rem 0}}[role=alert]{{color:#c22}}
.detail{{white-space:pre-wrap;overflow-wrap:anywhere}}</style></head>
<body><main>{content}</main></body></html>
"""
_LOGIN = """<h1>ltlplan</h1>{said}<form method="post" action="/login"><label for="token">Token</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>
<button>Log in</button></form><p><small>Whoever runs this service makes one: <code>ltlplan serve --new-token NAME</code>.</small></p>"""
_REFUSAL = """<h1>{title}</h1><p class="detail" role="alert">{detail}</p><p><a href="{to}">{words}</a></p>"""


def login_page(said: str = "") -> str:
    """Return the page that asks for a token.

    Args:
        said: Why the last one was rejected.
    """
    alert = f'<p role="alert">{html.escape(said)}</p>' if said else ""
    return _PAGE.format(title="log in", width=26, content=_LOGIN.format(said=alert))


def refusal_page(problem: Problem) -> str:
    """Return a problem as a page, with a way to go on.

    Args:
        problem: What is rejected, and why.
    """
    to, words = ("/login", "Log in") if problem.status == 401 else ("/", "To the first page")
    content = _REFUSAL.format(title=html.escape(problem.title), detail=html.escape(problem.detail), to=to, words=words)
    return _PAGE.format(title=html.escape(problem.title), width=40, content=content)
