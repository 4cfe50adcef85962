"""Write the golden results anew: only when a new set of cases is begun."""

from __future__ import annotations

import json

from tests.golden import RESULTS, cases, result

RESULTS.write_text("{\n" + ",\n".join(f" {json.dumps(case)}: {json.dumps(result(case))}" for case in cases()) + "\n}\n")
