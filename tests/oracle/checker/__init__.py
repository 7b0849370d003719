"""The checker: judges stances in 113 bits, in C of its own that shares nothing with the solvers.

checker.c follows the chain of phases and the rules, walk.h pushes the state, bounds.c proves that nothing happens
between two events, poles.c finds the poles. `certify` compiles it with $CC when it is first used.
"""

import ctypes
import os
import shlex
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
ROBOT = (
    "m_eff",
    "m_s",
    "k",
    "L0",
    "c",
    "b1",
    "b2",
    "f1",
    "f2",
    "gamma2",
    "g",
    "x1_min",
    "x1_max",
    "u_max",
    "impact_loss",
    "f1_excess",
    "f2_excess",
)
START = ("x1", "v1", "v2", "y")

PROBLEM = np.dtype([(name, "f8") for name in (*ROBOT, *START, "u", "horizon")])
PHASE = np.dtype(
    [*((name, "f8") for name in ("t", "x1", "v1", "v2", "y")), ("mode", "i1"), ("event", "i1"), ("step", "u2")],
    align=True,
)
ANSWER = np.dtype(
    [*((name, "f8") for name in ("duration", *START, "aed")), ("ending", "i4"), ("count", "i4"), ("first", "i8")]
)
VERDICT = np.dtype(
    [
        *((name, "i4") for name in ("outcome", "reason", "phase", "windows")),
        *((name, "f8") for name in ("error_state", "error_aed", "condition_state", "condition_aed")),
    ]
)

CERTIFIED, UNSETTLED, WRONG = range(3)
REASONS = ("", "modes at the start", "take-off at 0", "an event these modes cannot have", "no zero where the event is",
           "time runs back", "hold rule", "a crossing that is none", "a stop passed", "an event missed", "no rest",
           "not at the horizon", "poles", "too many steps")  # fmt: skip


@cache
def _library() -> Any:
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "checker.so"
        sources = map(str, sorted(HERE.glob("*.c")))
        subprocess.run(
            [*shlex.split(os.environ.get("CC") or "cc"), *FLAGS, *sources, "-o", str(target), "-lm"], check=True
        )
        return ctypes.CDLL(str(target))


def certify(problems: Any, answers: Any, phases: Any, condition: bool = True) -> Any:
    """A VERDICT per stance; `answers` say with `first` and `count` which of `phases` are theirs."""
    columns = [np.ascontiguousarray(a, dtype) for a, dtype in ((problems, PROBLEM), (answers, ANSWER), (phases, PHASE))]
    verdicts = np.zeros(len(problems), VERDICT)
    _library().checker_judge(
        *(ctypes.c_void_p(column.ctypes.data) for column in columns), ctypes.c_int64(len(problems)),
        ctypes.c_int32(condition), ctypes.c_void_p(verdicts.ctypes.data),
    )  # fmt: skip
    return verdicts
