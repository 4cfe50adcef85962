"""Drafts: missions as they are being written, of whoever asks alone."""

from __future__ import annotations

import asyncio
import time
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from ltlplan.service.api.request_parsing import json_answer, json_list, principal_of, read_mission_text, service_of
from ltlplan.service.api.schema import problems
from ltlplan.service.people_models import DraftTold
from ltlplan.service.storage.drafts import Draft

router = APIRouter(prefix="/api/drafts", tags=["missions"])


@router.get("", response_model=tuple[DraftTold, ...], responses=problems())
async def list_drafts(request: Request) -> Response:
    """List your drafts with their texts, the one that was changed last first; `job-ID` is the text that a job was made of."""
    found = await asyncio.to_thread(service_of(request).drafts.of, principal_of(request).user)
    newest = sorted(found.items(), key=lambda each: each[1].changed, reverse=True)
    return json_list([DraftTold(id=name, text=each.text, changed=each.changed) for name, each in newest])


@router.put(
    "/{draft}",
    response_model=DraftTold,
    responses=problems(body=True),
    openapi_extra={
        "requestBody": {
            "required": True,
            "description": "YAML; it may have faults.",
            "content": {"application/yaml": {"schema": {"type": "string"}}},
        }
    },
)
async def keep_draft(
    request: Request,
    draft: Annotated[str, Path(description="names it among yours", max_length=100)],
    changed: Annotated[float | None, Query(description="when it was changed, ms since 1970; now by default", ge=0)] = None,
) -> Response:
    """Keep a draft, unless it was changed later elsewhere: what is kept is the answer. The 40 newest are kept."""
    drafts, user = service_of(request).drafts, principal_of(request).user
    text = await read_mission_text(request)
    await asyncio.to_thread(drafts.keep, user, draft, Draft(text, time.time() * 1000 if changed is None else changed))
    kept = (await asyncio.to_thread(drafts.of, user)).get(draft, Draft("", 0.0))
    return json_answer(DraftTold(id=draft, text=kept.text, changed=kept.changed))
