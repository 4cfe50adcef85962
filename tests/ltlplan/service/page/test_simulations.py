"""Options of simulations as people type them."""

from __future__ import annotations

import pytest

from ltlplan.service.api.answers import CampaignAsked, RehearsalAsked
from ltlplan.service.page.simulations_tab import options_of
from verify.data import BadInput


def test_what_is_empty_is_not_said() -> None:
    assert options_of(CampaignAsked, {"runs": " 30 ", "wind": "1,0.5,0", "noise": "", "seed": "7"}) == {
        "runs": 30,
        "wind": "1,0.5,0",
        "seed": 7,
    }
    told = options_of(RehearsalAsked, {"masses": "0.95, 1", "winds": "0, 0.5+0.3", "controllers": "lee"})
    assert (told["masses"], told["winds"], told["controllers"]) == ([0.95, 1.0], ["0", "0.5+0.3"], ["lee"])


@pytest.mark.parametrize("fields", [{"runs": "many"}, {"runs": "0"}, {"latency": "1e999"}, {"seed": "-1"}])
def test_what_cannot_be_is_told(fields: dict[str, str]) -> None:
    with pytest.raises(BadInput, match=next(iter(fields))):
        options_of(CampaignAsked, fields)
