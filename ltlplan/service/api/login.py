"""Forms by which a browser says who asks: a password, a token, a new password; and the end of its session."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from urllib.parse import parse_qs

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from ltlplan.service.api.request_parsing import service_of
from ltlplan.service.people.openid import BEGUN_SECONDS, OpenId
from ltlplan.service.people.sessions import OPENID_SECONDS, SESSION_SECONDS
from ltlplan.service.problems import NotAuthenticated, NotFound, TooManyRequests
from ltlplan.service.security.asker import COOKIE, LOGIN, OPENID, OPENID_BACK, PASSWORD
from ltlplan.service.security.plain_pages import PLAIN_POLICY, entered_page, login_page, password_page
from ltlplan.service.security.refusals import refusal
from verify.data.errors import BadInput

router = APIRouter(include_in_schema=False)

_BEGUN = "ltlplan_login"
_MOST = 4096
_TEMPORARY = "This password was drawn for you. Choose your own now; it has at least 12 letters."


@router.get(LOGIN)
async def login_form(request: Request) -> Response:
    """Ask for a password or a token."""
    return _login(request)


def _login(request: Request, said: str = "", status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    people = service_of(request).people
    page = login_page(said, passwords=people.accounts.needed, tokens=people.tokens.needed, openid=people.openid)
    return _page(page, status, headers)


def _page(content: str, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    return HTMLResponse(content, status, {"content-security-policy": PLAIN_POLICY, **(headers or {})})


@router.post(LOGIN)
async def log_in(request: Request) -> Response:
    """Give a browser a session. Its cookie holds no secret of anybody's, and no script can read it."""
    given = await _given(request)
    name = given.get("name", "").strip()
    try:
        if "name" in given:
            return await _by_password(request, name, given.get("password", ""))
        return await _by_token(request, given.get("token", "").strip())
    except (NotAuthenticated, TooManyRequests) as error:
        await _note_refused(request, name)
        return _login(request, str(error), *_told(error))


async def _note_refused(request: Request, name: str) -> None:
    """Log a login that was rejected; a name that is none of ours may be a password that was typed in the wrong place."""
    people = service_of(request).people
    account = await asyncio.to_thread(people.accounts.find, name) if name else None
    if account is not None:
        await asyncio.to_thread(people.log.write, None, "log in refused", account.name, request.state.asker.address)


async def _by_password(request: Request, name: str, password: str) -> Response:
    people = service_of(request).people
    request.state.admission.require_guess(name, request.state.asker.address)
    account = await asyncio.to_thread(people.accounts.check, name, password)
    if account.temporary:
        return _page(password_page(_TEMPORARY, name=account.name))
    session = await asyncio.to_thread(people.sessions.begin_of_account, account.name)
    return await _logged_in(request, session)


async def _by_token(request: Request, token: str) -> Response:
    holder = request.state.admission.holder_of(token, request.state.asker.address)
    return await _logged_in(request, await asyncio.to_thread(service_of(request).people.sessions.begin, holder.token))


async def _logged_in(request: Request, session: str) -> Response:
    people = service_of(request).people
    principal = people.of_session(session, request.state.asker.address)
    await asyncio.to_thread(people.log.write, principal, "log in", "", request.state.asker.address)
    answer = RedirectResponse("/", status_code=303)
    set_session(answer, request, session)
    return answer


def set_session(answer: Response, request: Request, session: str, seconds: int = SESSION_SECONDS) -> None:
    """Give a browser a session's cookie: no script reads it, no other site sends it, and over TLS it goes over nothing else.

    Args:
        answer: The response that brings it.
        request: What it answers.
        session: The session.
        seconds: How long the browser keeps it, in s.
    """
    secure = request.url.scheme == "https"
    answer.set_cookie(COOKIE, session, max_age=seconds, httponly=True, samesite="strict", secure=secure)


@router.get(OPENID)
async def begin_openid(request: Request) -> Response:
    """Send a browser to the lab's own login."""
    openid = _openid(request)
    try:
        request.state.admission.require_login(request.state.asker.address)
        place, browser = await openid.begin(f"{request.url.scheme}://{request.headers['host']}{OPENID_BACK}")
    except (BadInput, TooManyRequests) as error:
        return _login(request, str(error), *_told(error))
    answer = RedirectResponse(place, status_code=303)
    secure = request.url.scheme == "https"
    answer.set_cookie(
        _BEGUN, browser, max_age=BEGUN_SECONDS, path=OPENID_BACK, httponly=True, samesite="lax", secure=secure
    )  # it comes back from another site, which a strict cookie would not
    return answer


@router.get(OPENID_BACK)
async def finish_openid(request: Request) -> Response:
    """Give a browser a session that comes back from the lab's own login."""
    openid, people = _openid(request), service_of(request).people
    try:
        request.state.admission.require_login(request.state.asker.address)
        told = dict(request.query_params)
        account = await openid.finish(told, request.cookies.get(_BEGUN, ""), people)
    except BadInput as error:
        answer = _login(request, str(error), *_told(error))
    else:
        session = await asyncio.to_thread(people.sessions.begin_of_account, account.name, OPENID_SECONDS)
        await asyncio.to_thread(people.log.write, people.of_session(session), "log in", "", request.state.asker.address)
        answer = _page(entered_page())  # a redirect would still be another site's, without the strict cookie
        set_session(answer, request, session, OPENID_SECONDS)
    answer.delete_cookie(_BEGUN, path=OPENID_BACK, httponly=True, samesite="lax")
    return answer


def _openid(request: Request) -> OpenId:
    found = service_of(request).openid
    if found is None:
        raise NotFound("This service has no login by OpenID Connect.")
    return found


@router.get(PASSWORD)
async def password_form() -> Response:
    """Ask for a new password."""
    return _page(password_page())


@router.post(PASSWORD)
async def change_password(request: Request) -> Response:
    """Change a password by the one before; all sessions of the account end, and the browser has a new one.

    Raises:
        BadInput: The form is none of ours; what is wrong with a password stands on the page.
    """
    given, people = await _given(request), service_of(request).people
    name = given.get("name", "").strip()
    try:
        if given.get("new", "") != given.get("again", ""):
            raise BadInput("The two new passwords differ.")
        request.state.admission.require_guess(name, request.state.asker.address)
        account = await asyncio.to_thread(
            people.accounts.change_password, name, given.get("password", ""), given.get("new", "")
        )
    except (BadInput, NotAuthenticated, TooManyRequests) as error:
        return _page(password_page(str(error), name=name), *_told(error))
    session = await asyncio.to_thread(people.sessions.begin_of_account, account.name)
    await asyncio.to_thread(people.log.write, people.of_session(session), "change password", account.name)
    return await _logged_in(request, session)


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """End a browser's session, and all pages that are open in it."""
    people = service_of(request).people
    if request.state.principal is not None:
        await asyncio.to_thread(people.log.write, request.state.principal, "log out")
    await asyncio.to_thread(people.sessions.end, request.state.asker.session)
    answer = RedirectResponse(LOGIN, status_code=303)
    answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
    return answer


async def _given(request: Request) -> dict[str, str]:
    """Return the fields of a form, the first of each name."""
    body = await request.body()
    try:
        fields = parse_qs(body[:_MOST].decode("latin-1"), keep_blank_values=True, max_num_fields=20)
    except ValueError:
        raise BadInput("This is none of the forms of this page.") from None
    return {name: values[0] for name, values in fields.items()}


def _told(error: BadInput) -> tuple[int, dict[str, str]]:
    told = refusal(error, {})
    return told.status, {name: value for name, value in told.headers.items() if name == "retry-after"}
