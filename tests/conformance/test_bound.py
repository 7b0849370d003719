"""Where a phase needs more intervals than the bound allows, the stance ends there and is right up to there.

The solver is compiled with a bound that random stances do meet; NumPy, with the same bound, ends where it does.
"""

import ctypes
import os
import shlex
import subprocess

import numpy as np
import pytest

from hopform._solver import c as native
from hopform_solver import events
from hopform_solver.records import ENDINGS, EVENTS, ROBOT_FIELDS
from tests import needs
from tests.conformance.firmware.targets import C
from tests.conformance.random_stances import draw_stances, solve_with_numpy

pytestmark = needs.library

CAPACITY, COUNT = 200, 600
UNCERTIFIED = next(number for number, word in ENDINGS.items() if word == "uncertified")


@pytest.fixture(scope="module")
def bounded(tmp_path_factory):
    """A solver of stances that certifies one interval of a phase at most."""
    target = tmp_path_factory.mktemp("bounded") / "bounded.so"
    compiler = shlex.split(os.environ.get("CC") or "cc")
    flags = ["-std=c99", "-O1", "-fPIC", "-shared", "-ffp-contract=off", "-DHOPFORM_MOST_INTERVALS=1"]
    subprocess.run(
        [*compiler, *flags, "-I", C / "include", C / "src" / "hopform_f64.c", "-o", target, "-lm"], check=True
    )
    return ctypes.CDLL(str(target))


def solve(library, p):
    """The stance, and its phases as (time, mode, event)."""
    types = native.library().types(np.dtype(np.float64))
    plan, stance, phases = types.Plan(), types.Stance(), (types.Phase * CAPACITY)()
    robot = types.Robot(*(float(p[field.name]) for field in ROBOT_FIELDS))
    assert library.hopform_plan_init_f64(ctypes.byref(plan), ctypes.byref(robot)) == 0
    start = types.State(*(float(p[name]) for name in ("x1", "v1", "v2", "y")))
    step, horizon = types.Step(0.0, float(p["u"])), ctypes.c_double(p["horizon"])
    status = library.hopform_solve_stance_f64(
        ctypes.byref(plan), ctypes.byref(start), ctypes.byref(step), 1, horizon, CAPACITY - 1, phases, CAPACITY,
        ctypes.byref(stance),
    )  # fmt: skip
    assert status == 0
    return stance, [(phase.t, phase.mode, phase.event) for phase in phases[: stance.phase_count]]


def test_a_stance_ends_uncertified_where_the_bound_is_met(bounded):
    met = 0
    for p in draw_stances(20261123, COUNT):
        whole, all_phases = solve(native.library()._handle, p)
        part, phases = solve(bounded, p)
        assert whole.ending != UNCERTIFIED
        if part.ending == UNCERTIFIED:
            met += 1
            assert phases == all_phases[: len(phases)]
            assert phases[-1][0] <= part.duration <= whole.duration
            assert part.event_count == sum(event in EVENTS for _, _, event in phases)
            assert part.apex == 0.0
        else:
            assert (part.ending, phases) == (whole.ending, all_phases)
    assert COUNT // 20 < met < COUNT


def test_numpy_meets_the_bound_where_c_does(bounded, monkeypatch):
    """Or before: C asks no certificate of functions that are monotone. Up to there both list the same."""
    monkeypatch.setattr(events, "MOST_INTERVALS", 1)
    drawn = draw_stances(20261124, COUNT)
    met = 0
    answers, phases = solve_with_numpy(drawn)
    for p, answer in zip(drawn, answers, strict=True):
        stance, listed = solve(bounded, p)
        own = phases[answer["first"] : answer["first"] + answer["count"]]
        seen = list(zip(own["mode"], own["event"], strict=True))
        assert [(mode, event) for _, mode, event in listed][: len(seen)] == seen
        if answer["ending"] != UNCERTIFIED:
            assert (answer["ending"], len(seen)) == (stance.ending, len(listed))
        if len(seen) == len(listed) and stance.ending == answer["ending"]:
            assert answer["duration"] == pytest.approx(stance.duration, rel=1e-9)
        met += stance.ending == UNCERTIFIED
    assert COUNT // 20 < met < COUNT
