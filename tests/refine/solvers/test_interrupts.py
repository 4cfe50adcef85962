"""Ctrl-C ends a programme that is being solved, and no other one begins."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

SOLVES = """
import signal
import refine
from refine.solvers import nlp
from tests.helpers.motion.plans_by_hand import sequence_plan

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it

def solve(*given, **named):
    print("solving", flush=True)
    while True:
        usual(*given, **named)

usual, nlp.solve = nlp.solve, solve
refine.refine(sequence_plan(), pace=1)
"""


def test_ctrl_c_ends_a_solve_at_once() -> None:
    with subprocess.Popen([sys.executable, "-c", SOLVES], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "solving\n"
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        try:
            _, said = process.communicate(timeout=60)
        finally:
            process.kill()
        assert process.returncode != 0
    assert said.rstrip().endswith("KeyboardInterrupt")
