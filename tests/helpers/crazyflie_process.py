"""`ltlplan fly RUN --link crazyflie` against vehicles that are simulated in the same process: `python -m tests.helpers.crazyflie_process RUN OUT`.

Prints how they ended, as JSON, when the command has.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tests.helpers.crazyflie_peer import in_the_air
from verify.run_folder import read_folder


def fly(run: Path, out: Path) -> int:
    """Fly a run by an inventory of simulated vehicles; return the command's exit code."""
    from ltlplan.start import main

    plan, team = read_folder(run)
    places = {name: (*path.evaluate(0.0)[:2].tolist(), 0.0) for name, path in team.items()}
    inventory = out.with_suffix(".yaml")
    inventory.write_text("robots:\n" + "".join(f"  {name}: {{uri: 'peer://{name}', mass: 0.0325}}\n" for name in team))
    sys.argv[1:] = ["fly", str(run), "--link", "crazyflie", "--inventory", str(inventory), "--out", str(out)]
    with in_the_air(plan.mission, places) as (air, _):
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        vehicles = air.vehicles.values()
        ended = {
            "spinning": air.spinning,
            "heights": [v.stopped_at for v in vehicles],
            "starts": [len(v.starts) for v in vehicles],
        }
        print(
            json.dumps(
                {
                    **ended,
                    "masses": [v.parameters["ctrlMel.mass"] for v in vehicles],
                    "dropped": any(v.dropped for v in vehicles),
                }
            )
        )
    return code


if __name__ == "__main__":
    sys.exit(fly(Path(sys.argv[1]), Path(sys.argv[2])))
