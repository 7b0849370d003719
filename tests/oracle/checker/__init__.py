"""The checker: judges stances in 113 bits, in C of its own that shares nothing with the solvers.

checker.c follows the chain of phases and the rules, walk.h pushes the state, bounds.c proves that nothing happens
between two events, poles.c finds the poles. motion.c finds the events of a motion of any mechanism of one or two
masses, by the same bounds. `certify` and `motions` compile them with $CC when they are first used.
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

MASSES, STEPS = 2, 6
MOTION_PROBLEM = np.dtype(
    [
        *(
            (name, np.longdouble, shape)
            for name, shape in {
                "m": MASSES, "K": (MASSES, MASSES), "B": (MASSES, MASSES), "F": MASSES, "F_size": MASSES, "g": MASSES,
                "slides": (MASSES, 2), "rests": (MASSES, 2), "low": MASSES, "high": MASSES, "lift": 2 * MASSES,
                "lift_0": (), "p": (), "d": (), "limit": (), "q": (), "v": MASSES, "horizon": (), "t": STEPS, "u": STEPS,
            }.items()
        ),
        *((name, "i8") for name in ("size", "stands", "lawful", "steps")),
    ],
    align=True,
)  # fmt: skip
"""A motion from q(0): motion.c has the equation; places and limits less q(0), forces at the start."""
MOTION_EVENT = np.dtype([("t", "f8"), ("kind", "i8")])
MOTION_ANSWER = np.dtype(
    [("duration", "f8"), *((name, "i8") for name in ("ending", "outcome", "count", "first", "phases", "windows"))]
)
MOTION_KINDS = ("reverses", "sticks", "slips", "hits_stop")
"""Of mass n an event is len(MOTION_KINDS) n + its place here."""
MOTION_OUTCOMES = ("found", "mode", "zero", "tie", "poles")
"""What stays unsettled in a motion, but for the first."""
MOST_EVENTS = 400
"""Of a motion: two in each of the phases after which motion.c gives up."""

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


def motions(problems: Any) -> tuple[Any, Any]:
    """A MOTION_ANSWER per MOTION_PROBLEM, and the MOTION_EVENTs of all."""
    given = np.ascontiguousarray(problems, MOTION_PROBLEM)
    answers, events = np.zeros(len(given), MOTION_ANSWER), np.zeros(MOST_EVENTS * len(given), MOTION_EVENT)
    find = _library().checker_motions
    find.restype = ctypes.c_int64
    count = find(
        *(ctypes.c_void_p(given.ctypes.data), ctypes.c_int64(len(given)), ctypes.c_void_p(answers.ctypes.data)),
        *(ctypes.c_void_p(events.ctypes.data), ctypes.c_int64(len(events))),
    )
    assert count <= len(events)
    return answers, events[:count]
