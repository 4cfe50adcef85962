"""The gate: whatever comes over HTTP or a websocket passes here first, the page's own traffic too.

our name?  -  from our page?  -  who?  -  how often?  -  how much, how slowly?  -  (the request)  -  headers  -  note
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ltlplan.service.security.admission import Admission, Rules
from ltlplan.service.security.body_limits import Message, Receive
from ltlplan.service.security.passage import Application, Passage, Send


@dataclass
class Gate:
    """An ASGI application before another.

    Attributes:
        inner: What is asked, once a request is through.
        rules: What it goes by.
    """

    inner: Application
    rules: Rules
    _admission: Admission = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._admission = Admission(self.rules)

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Let a request through, or answer why not."""
        if scope["type"] not in ("http", "websocket"):
            await self.inner(scope, receive, send)
            return
        await Passage(self._admission, self.inner, scope, receive, send).pass_through()
