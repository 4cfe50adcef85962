"""People: one's own account and its tokens, projects, and for admins all accounts and the log of who did what."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from ltlplan.service.api.answers import AccountAdded, AccountChange, ProjectChange, TokenAdded, WebhookAdded
from ltlplan.service.api.request_parsing import json_answer, json_list, principal_of, read_json, service_of
from ltlplan.service.api.schema import json_body, problems
from ltlplan.service.people.administration import Administration
from ltlplan.service.people.audit_log import LogQuery
from ltlplan.service.people_models import AccountTold, LogEntry, Project, Secret, Webhook, WhoAmI

router = APIRouter(prefix="/api", tags=["people"])

Name = Annotated[str, Path(description="the account's name", max_length=60)]


def _office(request: Request) -> Administration:
    return Administration(service_of(request).people, principal_of(request), request.state.asker.session)


@router.get("/account", response_model=WhoAmI, responses=problems())
async def get_account(request: Request) -> Response:
    """Return who asks, and what they may do."""
    return json_answer(await asyncio.to_thread(_office(request).who))


@router.post(
    "/account/tokens",
    response_model=Secret,
    status_code=201,
    responses=problems(409, body=True),
    openapi_extra=json_body("TokenAdded", "The token."),
)
async def add_token(request: Request) -> Response:
    """Make a token of your own account, `USER.LABEL`; it is shown once. Who came by a token makes none."""
    asked = await read_json(request, TokenAdded)
    return json_answer(await asyncio.to_thread(_office(request).new_token, asked.label), 201)


@router.delete("/account/tokens/{name}", status_code=204, responses=problems(404, changing=True))
async def revoke_token(
    request: Request, name: Annotated[str, Path(description="the token's name", max_length=100)]
) -> Response:
    """Revoke a token of yours; who uses it is rejected at once."""
    await asyncio.to_thread(_office(request).revoke_token, name)
    return Response(status_code=204)


@router.delete("/account/sessions", status_code=204, responses=problems(changing=True))
async def end_own_sessions(request: Request) -> Response:
    """Log out everywhere else: end all other sessions of your account."""
    await asyncio.to_thread(_office(request).end_own_sessions)
    return Response(status_code=204)


@router.get("/webhooks", response_model=tuple[Webhook, ...], responses=problems())
async def list_webhooks(request: Request) -> Response:
    """List your webhooks, each with what came of the last try."""
    return json_list(await asyncio.to_thread(service_of(request).people.webhooks.listed, principal_of(request)))


@router.post(
    "/webhooks",
    response_model=Secret,
    status_code=201,
    responses=problems(body=True),
    openapi_extra=json_body("WebhookAdded", "The address."),
)
async def add_webhook(request: Request) -> Response:
    """Add an address that hears of the ends of jobs that you submit from now on; its id and its secret, which is shown once.

    It is sent `{"id": ..., "state": ...}` over HTTPS, signed as standardwebhooks.com says, and six times at most until it answers with success.
    """
    asked, service = await read_json(request, WebhookAdded), service_of(request)
    hosts = service.sender.allowed.hosts
    made, secret = await asyncio.to_thread(service.people.webhooks.add, principal_of(request), asked.url, hosts)
    return json_answer(Secret(name=str(made.id), secret=secret), 201)


@router.delete("/webhooks/{webhook}", status_code=204, responses=problems(404, changing=True))
async def delete_webhook(
    request: Request, webhook: Annotated[int, Path(description="the webhook's id", ge=1, le=2**62)]
) -> Response:
    """Delete a webhook of yours, with what is still to be sent to it."""
    await asyncio.to_thread(service_of(request).people.webhooks.delete, principal_of(request), webhook)
    return Response(status_code=204)


@router.get("/projects", response_model=tuple[Project, ...], responses=problems())
async def list_projects(request: Request) -> Response:
    """List your projects and those that are shared."""
    return json_list(_office(request).projects())


@router.put(
    "/projects/{name:path}",
    response_model=Project,
    responses=problems(404, body=True),
    openapi_extra=json_body("ProjectChange", "What it is to be."),
)
async def put_project(
    request: Request, name: Annotated[str, Path(description="the project's name", max_length=60)]
) -> Response:
    """Share a project with everybody who may log in, or make it private; one that there is not yet is made."""
    asked = await read_json(request, ProjectChange)
    return json_answer(await asyncio.to_thread(_office(request).share, name, asked.shared))


@router.get("/accounts", response_model=tuple[AccountTold, ...], responses=problems())
async def list_accounts(request: Request) -> Response:
    """List all accounts."""
    return json_list(await asyncio.to_thread(_office(request).accounts))


@router.post(
    "/accounts",
    response_model=Secret,
    status_code=201,
    responses=problems(409, 501, body=True),
    openapi_extra=json_body("AccountAdded", "The account."),
)
async def add_account(request: Request) -> Response:
    """Make an account; its temporary password is shown once, and changed by its owner at the first login."""
    asked = await read_json(request, AccountAdded)
    return json_answer(await asyncio.to_thread(_office(request).add_account, asked.name, asked.role), 201)


@router.patch(
    "/accounts/{name}",
    response_model=AccountTold,
    responses=problems(404, 409, body=True),
    openapi_extra=json_body("AccountChange", "What changes."),
)
async def change_account(request: Request, name: Name) -> Response:
    """Give an account another role, disable it, or enable it again. Its sessions end at once."""
    asked, office = await read_json(request, AccountChange), _office(request)
    if asked.role is not None:
        await asyncio.to_thread(office.set_role, name, asked.role)
    if asked.disabled is not None:
        await asyncio.to_thread(office.set_disabled, name, asked.disabled)
    return json_answer(await asyncio.to_thread(office.account, name))


@router.post("/accounts/{name}/password", response_model=Secret, responses=problems(404, 409, 501, changing=True))
async def reset_password(request: Request, name: Name) -> Response:
    """Give an account a temporary password, which is shown once. Its sessions end at once."""
    return json_answer(await asyncio.to_thread(_office(request).reset_password, name))


@router.delete("/accounts/{name}/sessions", status_code=204, responses=problems(404, changing=True))
async def end_sessions(request: Request, name: Name) -> Response:
    """Log an account out everywhere."""
    await asyncio.to_thread(_office(request).end_sessions, name)
    return Response(status_code=204)


@router.get("/log", response_model=tuple[LogEntry, ...], responses=problems())
async def read_log(
    request: Request,
    user: Annotated[str | None, Query(description="only of this user", max_length=100)] = None,
    action: Annotated[str | None, Query(description="only this, such as `tell`", max_length=60)] = None,
    limit: Annotated[int, Query(description="at most so many", ge=1, le=1000)] = 100,
    before: Annotated[int | None, Query(description="only entries of smaller numbers", ge=0, le=2**62)] = None,
) -> Response:
    """Return who did what, the newest first."""
    return json_list(await asyncio.to_thread(_office(request).log, LogQuery(user, action, limit, before)))
