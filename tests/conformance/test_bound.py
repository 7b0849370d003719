"""Where a phase needs more intervals than the bound allows, a stance ends there and is right up to there, and a flight
is refused.

The solver is compiled with a bound that random stances and flights do meet.
"""

import ctypes
import dataclasses
import os
import shlex
import subprocess

import numpy as np
import pytest

from hopform._solver import c as native
from hopform_solver.records import ENDINGS, EVENTS, ROBOT_FIELDS, STATUSES
from tests import needs
from tests.conformance.firmware.targets import C
from tests.conformance.flights import random_flight
from tests.conformance.random_stances import draw_stances

pytestmark = needs.library

CAPACITY, COUNT = 200, 600
ERROR_NUMBERS = next(code for code, word in STATUSES.items() if word == "error_numbers")
UNCERTIFIED = next(number for number, word in ENDINGS.items() if word == "uncertified")


def bounded_by(most, target):
    """A solver that certifies so many intervals of a phase at most."""
    compiler = shlex.split(os.environ.get("CC") or "cc")
    flags = ["-std=c99", "-O0", "-fPIC", "-shared", "-ffp-contract=off", f"-DHOPFORM_MOST_INTERVALS={most}"]
    subprocess.run(
        [*compiler, *flags, "-I", C / "include", C / "src" / "hopform_f64.c", "-o", target, "-lm"], check=True
    )
    return ctypes.CDLL(str(target))


@pytest.fixture(scope="module")
def bounded(tmp_path_factory):
    """One that certifies one interval."""
    return bounded_by(1, tmp_path_factory.mktemp("bounded") / "bounded.so")


def begin(library, numbers, start):
    """The types of the library, the plan of a robot and a state, both from the numbers of their fields by name."""
    types = native.library().types(np.dtype(np.float64))
    plan = types.Plan()
    robot = types.Robot(*(float(numbers[field.name]) for field in ROBOT_FIELDS))
    assert library.hopform_plan_init_f64(ctypes.byref(plan), ctypes.byref(robot)) == 0
    return types, plan, types.State(*(float(start[name]) for name in ("x1", "v1", "v2", "y")))


def solve(library, p):
    """The stance, and its phases as (time, mode, event)."""
    types, plan, start = begin(library, p, p)
    stance, phases = types.Stance(), (types.Phase * CAPACITY)()
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


def test_a_contact_force_that_fades_below_its_rounding_takes_few_intervals(tmp_path):
    """The body creeps to where it bears nothing for hundreds of half periods, each certified by rule 2."""
    numbers = {field.name: 0.0 for field in ROBOT_FIELDS} | {
        "m_eff": 3.24, "m_s": 0.154, "k": 534400.0, "L0": 0.4, "b2": 498.8, "f2": 0.0224, "gamma2": -3.6, "g": 9.81,
        "x1_min": -np.inf, "x1_max": np.inf, "u_max": 3.0,
    }  # fmt: skip
    start = {"x1": 0.0, "v1": 0.909, "v2": -1.597, "y": 0.0, "u": 0.0, "horizon": 2.0}
    stance, _ = solve(bounded_by(100, tmp_path / "bounded.so"), numbers | start)
    assert ENDINGS[stance.ending] == "horizon"


def fly(library, seed):
    """Status of a flight, its phases as (time, velocity, side, limit, event), and its numbers."""
    robot, inputs = random_flight(seed)
    types, plan, start = begin(library, dataclasses.asdict(robot), inputs)
    flight, phases, law = types.Flight(), (types.FlightPhase * CAPACITY)(), types.Gains(*inputs["gains"])
    status = library.hopform_solve_flight_f64(
        ctypes.byref(plan), ctypes.byref(start), ctypes.c_double(0.0), ctypes.byref(law),
        ctypes.c_double(inputs["horizon"]), CAPACITY - 1, phases, CAPACITY, ctypes.byref(flight),
    )  # fmt: skip
    kept = [(each.t, each.v1, each.side, each.limit, each.event) for each in phases[: flight.phases_kept]]
    return status, kept, bytes(flight)


def test_a_flight_is_refused_where_the_bound_is_met(tmp_path):
    met, bounded = 0, bounded_by(2, tmp_path / "bounded.so")
    for seed in range(COUNT):
        status, phases, flight = fly(bounded, seed)
        expected, all_phases, whole = fly(native.library()._handle, seed)
        assert expected == 0
        if status == ERROR_NUMBERS:
            met += 1
            assert not phases and not any(flight)
        else:
            assert (status, phases, flight) == (expected, all_phases, whole)
    assert COUNT // 20 < met < COUNT - COUNT // 20
