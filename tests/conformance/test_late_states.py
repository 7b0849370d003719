"""States late in a phase beside a real pole that is far beyond the pair, in both precisions, against 60 digits.

There the velocity of the actuator is what the spring makes it creep, a small part of what it had: as a difference of
what is left of that it has no digits. And events of a ring that has faded below the digits of the state.
"""

import ctypes
import math
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest

import hopform
from hopform._solver import c as native
from tests.conformance.random_stances import MAX_PHASES, stiff_stances
from tests.conformance.test_single_precision import FIELDS, in_single
from tests.derived import built

STIFF = (1e3, 1e4, 1e5)
FADED = (6.0, 30.0, 1e3)
"""Times of the real pole since the phase began."""
mp = mpmath.mp.clone()
mp.dps = 60


def exactly(robot: Any, phase: Any, u: float, t: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """The state so long after a phase of both slipping began, and what its errors are measured by."""
    r = {name: mp.mpf(getattr(robot, name)) for name, *_ in robot._fields_}
    side_1, side_2 = phase.mode // 3 - 1, phase.mode % 3 - 1
    pull, frequency = r["k"] / r["m_eff"], mp.sqrt(r["k"] / r["m_s"])
    matrix = mp.matrix([[0, 1, -1], [-pull, -r["b1"] / r["m_eff"], 0], [frequency**2, 0, -r["b2"] / r["m_s"]]])
    push = pull * r["c"] - r["gamma2"] * mp.mpf(u) / r["m_eff"] - r["f1"] * side_1
    start = mp.matrix([phase.y, phase.v1, phase.v2])
    end = -mp.lu_solve(matrix, mp.matrix([0, push, -r["g"] - r["f2"] * side_2]))
    stays = mp.expm(matrix * t)
    y, v1, v2 = end + stays * (start - end)
    moved = end[1] * t + mp.lu_solve(matrix, (stays - mp.eye(3)) * (start - end))[1]
    a = -matrix[1, 1]
    stretched = max(abs(start[0]), abs(y))
    creeps = (pull * max(stretched, abs(start[2]) / frequency) + abs(push)) / a
    transient = abs(matrix[1, 0] * start[0] + matrix[1, 1] * start[1] + push) / a
    sizes = {
        "y": max(stretched, abs(start[2]) * min(t, 1 / frequency)),
        "v1": creeps + transient * mp.exp(-a * t),
        "v2": max(abs(start[2]), abs(v2)),
        "x1": abs(phase.x1) + abs(start[1]) / a + creeps * t,
    }
    return {"y": y, "v1": v1, "v2": v2, "x1": phase.x1 + moved}, sizes


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_states_late_in_a_stiff_phase_have_their_digits(kind):
    library, worst, count = native.library(), dict.fromkeys(("y", "v1", "v2", "x1"), 0.0), 0
    types = library.types(np.dtype(kind))
    plan, stance, step, state = types.Plan(), types.Stance(), types.Step(0.0, 0.0), types.State()
    phases = (types.Phase * (MAX_PHASES + 1))()
    for problem in np.concatenate([in_single(stiff_stances(11, 12, stiffness)) for stiffness in STIFF]):
        known = {name: float(problem[name]) for name in FIELDS}
        robot = types.Robot(*(known.get(name, 0.0) for name, *_ in types.Robot._fields_))
        start = types.State(*(known[name] for name, *_ in types.State._fields_))
        step.u = known["u"]
        library.call("plan_init", types, ctypes.byref(plan), ctypes.byref(robot))
        library.call(
            "solve_stance", types, ctypes.byref(plan), ctypes.byref(start), ctypes.byref(step), 1, types.real(1.0),
            MAX_PHASES, phases, MAX_PHASES + 1, ctypes.byref(stance),
        )  # fmt: skip
        first = phases[0]
        until = phases[1].t if stance.phases_kept > 1 else stance.duration
        for times in FADED:
            t = float(kind(times / plan.poles[0].a))
            if first.mode % 2 or not t < until:  # one of them is held, or the phase is over
                continue
            library.call(
                "stance_at", types, ctypes.byref(plan), ctypes.byref(step), phases, ctypes.byref(stance),
                types.real(t), ctypes.byref(state),
            )  # fmt: skip
            exact, sizes = exactly(robot, first, step.u, t)
            for name, value in exact.items():
                error = abs(mp.mpf(getattr(state, name)) - value) / sizes[name]
                worst[name] = max(worst[name], float(error) / float(np.finfo(kind).eps))
            count += 1
    assert count > 40
    assert max(worst[name] for name in ("y", "v2", "x1")) < 16 and worst["v1"] < 40, worst


@pytest.mark.sliced
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_what_rings_alone_turns_at_equal_times_however_far_it_has_faded(store, dtype):
    """Nothing holds it, and steps of the input change no force; every half period takes 3/4 of the amplitude."""
    solver = hopform.load_solver(built(store, "slide"))
    m, k, half = 0.5, 200.0, math.pi / math.sqrt(200.0 / 0.5)
    b = 2.0 * m * math.log(4.0) / half
    frequency = math.sqrt(k / m - (b / m / 2.0) ** 2)
    robot = solver.Robot(m=m, k=k, x_0=0.0, b=b, F=0.0, F_s=0.0, k_f=2.0, load=0.0)
    steps = [(0.0, 0.0), *((each * math.pi / frequency, 0.0) for each in (20.4, 31.7, 35.2, 44.6))]
    motion = solver.solve_motion(
        robot, start={"x": 0.03, "v": 0.0}, u=steps, horizon=60.3 * math.pi / frequency, dtype=dtype
    )
    assert [event.kind for event in motion.events] == ["x_reverses"] * 60
    times = [event.time for event in motion.events]
    off = [later - time - math.pi / frequency for time, later in pairwise(times)]
    assert max(map(abs, off)) < 60.0 * float(np.finfo(dtype).eps) * times[-1], max(map(abs, off))
