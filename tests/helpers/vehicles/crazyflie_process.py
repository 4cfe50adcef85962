"""The command line against Crazyflies that are simulated in the same process: `python -m tests.helpers.vehicles.crazyflie_process SOURCE OUT`.

SOURCE is a run's folder, which is flown (`ltlplan fly`), or a mission's file, which is flown online (`ltlplan online --certified`). Prints
how they ended, as JSON, when the command has.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tests.helpers.vehicles.crazyflie_peer import in_the_air
from verify.data.files.mission_file import load_mission_file
from verify.run_folder import read_folder


def fly(source: Path, out: Path, *more: str) -> int:
    """Fly by an inventory of simulated vehicles; return the command's exit code."""
    from ltlplan.start import main

    if source.is_dir():
        plan, team = read_folder(source)
        mission, command = plan.mission, ["fly", str(source)]
        places = {name: (*path.evaluate(0.0)[:2].tolist(), 0.0) for name, path in team.items()}
    else:
        mission, command = load_mission_file(source), ["online", str(source), "--certified"]
        places = {name: (*agent.start[:2], 0.0) for name, agent in mission.agents.items()}
    inventory = out.with_suffix(".yaml")
    inventory.write_text("robots:\n" + "".join(f"  {name}: {{uri: 'peer://{name}', mass: 0.0325}}\n" for name in places))
    sys.argv[1:] = [
        *command,
        "--link",
        "crazyflie",
        "--unchecked",
        "battery",
        "--inventory",
        str(inventory),
        "--out",
        str(out),
        *more,
    ]
    with in_the_air(mission, places) as (air, _):
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
            "streamed": [len(v.streamed.kept) for v in vehicles],
            "locked": [v.locked for v in vehicles],
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
    sys.exit(fly(Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:]))
