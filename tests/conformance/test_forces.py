"""Forces of a motion against the mechanism of the integrator: what the equations of motion say at each instant."""

import ctypes
import random
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.zoo import EQUATIONS, Case, cases
from tests.derived import SHIPPED, solver_of

pytestmark = needs.library
DTYPES = np.dtype(np.float64), np.dtype(np.float32)


def solver(store: Any, name: str) -> Any:
    return hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")


def clear_of_events(motion: Any, draw: random.Random, count: int) -> list[float]:
    """Times that are no event's, nor next to one."""
    ends = [phase.start for phase in motion.phases] + [motion.duration]
    inner = [(begin, end) for begin, end in zip(ends, ends[1:], strict=False) if end - begin > 1e-3 * motion.duration]
    return (
        [begin + draw.uniform(0.1, 0.9) * (end - begin) for begin, end in draw.choices(inner, k=count)] if inner else []
    )


def expected(case: Case, motion: Any, t: float) -> tuple[dict[str, float], float]:
    """Forces by the equations at the state of an instant, and the size of what they are sums of."""
    made, state = case.mechanism, motion.at(t)
    names, half = [*case.start], len(case.start) // 2
    q, v = (np.array([float(getattr(state, name)) for name in part]) for part in (names[:half], names[half:]))
    u = next(u for begin, u in reversed(case.steps) if begin <= t)
    smooth, found, size = made.force(q, v, u), dict[str, float](), 1e-300
    for n, mass in enumerate(made.masses):
        size += abs(smooth[n]) + sum(mass.level) + sum(abs(made.force(q, v, 0.0))) + sum(abs(made.force(0 * q, v, 0.0)))
        if v[n] != 0.0:
            found[f"friction_{mass.name}"] = -mass.sliding[0] if v[n] > 0.0 else mass.sliding[1]
            found[f"stop_{mass.name}"] = 0.0
            continue
        carried = float(np.clip(-smooth[n], -mass.level[0], mass.level[1]))
        found[f"friction_{mass.name}"], found[f"stop_{mass.name}"] = carried, -float(smooth[n]) - carried
        at_stop = q[n] in map(float, motion.dtype.type((mass.low, mass.high)))
        assert at_stop or abs(found[f"stop_{mass.name}"]) <= 1e-9 * size, (case, t)
    found["input"] = float(smooth[0] - made.force(q, v, 0.0)[0])
    if made.contact is not None:
        found["contact"] = float(made.contact(q, v))
    return found, size


@pytest.mark.parametrize("name", needs.the_first([each for each in EQUATIONS if each != "servo"]))
def test_forces_are_those_of_the_equations_of_motion(store, name):
    """Friction in motion and held, the stop that holds, input and contact; in single precision to its digits."""
    made, draw, seen = solver(store, name), random.Random(f"{name} forces"), set[str]()
    for case in cases(name, 11, 15, 2e3):
        robot = made.Robot(**case.robot)
        for dtype in DTYPES:
            motion = hopform.solve_motion(robot, start=case.start, u=case.u, horizon=case.horizon, dtype=dtype)
            for t in map(float, np.array(clear_of_events(motion, draw, 8), dtype)):
                forces, (wanted, size) = motion.forces(t), expected(case, motion, t)
                assert set(forces) <= set(wanted)
                for key, value in forces.items():
                    assert abs(value - wanted[key]) <= 4e3 * float(np.finfo(dtype).eps) * size, (key, t, case)
                    seen |= {key} if value else set()
    assert seen >= {key for key in forces if not key.startswith("stop_")}


@pytest.mark.sliced
@pytest.mark.parametrize("dtype", DTYPES, ids=str)
def test_a_stop_carries_what_friction_does_not(store, dtype):
    """A joint that its motor pushes onto a stop, within friction at rest and beyond it, and one that lies free of it."""
    robot = solver(store, "joint").Robot(k_t=0.1, F_p=0.04, F_m=0.03, F_sp=0.02, F_sm=0.01, q_min=-0.5, q_max=0.25)
    for q, u, friction, stop in (
        (0.25, 2.0, -0.06, -0.14), (0.25, 0.5, -0.05, 0.0), (-0.5, -1.0, 0.04, 0.06), (0.1, 0.3, -0.03, 0.0),
    ):  # fmt: skip
        forces = hopform.solve_motion(robot, start={"q": q}, u=u, dtype=dtype).forces(0.0)
        assert {key: float(value) for key, value in forces.items()} == pytest.approx(
            {"friction_q": friction, "stop_q": stop, "input": 0.1 * u}, rel=4 * float(np.finfo(dtype).eps), abs=1e-8
        )


@pytest.mark.sliced
def test_the_input_of_a_law_is_what_it_asks_for_within_its_limit(store):
    made, seen = solver(store, "servo"), set[bool]()
    for case in cases("servo", 11, 20, 2e3):
        of, motion = case.robot, hopform.solve_motion(
            made.Robot(**case.robot), start=case.start, u=case.u, horizon=case.horizon
        )  # fmt: skip
        for t in np.linspace(0.0, 0.999 * motion.duration, 21):
            target = next(u for begin, u in reversed(case.steps) if begin <= t)
            state, most = motion.at(t), abs(of["k_t"]) * of["i_max"]
            asked = of["K_p"] * (target - state.q) - of["K_d"] * state.q_dot
            scale = of["K_p"] * (abs(target) + abs(state.q)) + of["K_d"] * abs(state.q_dot)
            assert abs(motion.forces(t)["input"] - np.clip(asked, -most, most)) <= 1e-12 * scale, (t, case)
            seen.add(abs(asked) < most)
    assert seen == {True, False}


@pytest.mark.parametrize("name", needs.the_first(["hopper", "joint", "cart", "sea"]))
def test_the_state_before_an_event_is_that_of_a_motion_that_stops_short_of_it(store, name):
    """A stop has not yet taken the velocity; its loss is the kinetic energy between; at all others nothing jumps."""
    made, hits = solver(store, name), 0
    for case in cases(name, 13, 60, 2e3):
        robot = made.Robot(**case.robot)
        motion = hopform.solve_motion(robot, start=case.start, u=case.u, horizon=case.horizon)
        solved, kinds = motion._solved, robot.solver.package.records.EVENTS
        for n, row in enumerate(solved.phase_rows()[1:], 1):
            state = solved.types.State()
            solved.call("stance_before", ctypes.c_int32(n), ctypes.byref(state))
            found, behind = (state.x1, state.v1, state.v2, state.y), tuple(row[1])
            if not kinds.get(row[3], "").endswith("hits_stop"):
                assert found == behind
                continue
            hits += 1
            assert (found[0], *found[2:]) == (behind[0], *behind[2:]) and behind[1] == 0.0 != found[1]
            short = hopform.solve_motion(robot, start=case.start, u=case.u, horizon=row[0] * (1.0 - 1e-11))
            assert getattr(short.end, [*case.start][len(case.start) // 2]) == pytest.approx(found[1], rel=1e-5)
            lost = motion.ledger(row[0]).stop_loss - (short.ledger(short.duration).stop_loss)
            assert lost == pytest.approx(-case.mechanism.masses[0].inertia * found[1] ** 2 / 2, rel=1e-9)
    assert hits > 5
