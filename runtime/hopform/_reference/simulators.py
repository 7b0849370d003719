"""hopform itself as a simulator to score: a case in the names of a model that ships, solved exactly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import accumulate
from typing import Any

import hopform
from hopform._reference.cases import Case, case_named

Numbers = Mapping[str, float]
Columns = Mapping[str, Mapping[str, float]]
"""What a number of a case moves in its robot: columns of derivatives by the number's name, each with its factor."""

JOINT = {"J": "J", "b": "b", "k": "k", "q_min": "q_min", "q_max": "q_max", "K_p": "K_p", "K_d": "K_d"}
SEA = ("J_m", "J_l", "k", "d", "b_m", "b_l", "F_m", "F_l")
LEG = {"k": "k", "L": "L0", "b_1": "b1", "b_2": "b2", "g": "g", "x1_min": "x1_min", "x1_max": "x1_max"}


def solve(case: Case) -> dict[str, Any]:
    """hopform's own answer to a case: states, events, values, and derivatives but of a hop, which is three motions.

    A joint, a servo and a series-elastic actuator are models that ship. Their solvers are built once, which needs a C
    compiler and the extra `derive`. Raises HopformError where a solver cannot be built.

    >>> from hopform.reference import cases
    >>> (drop,) = cases("drop")
    >>> round(solve(drop)["events"][-1][0], 9)
    0.185303102
    """
    return {"stance": _stance, "hop": _hop}.get(case.family, _motion)(case)


def _named(factor_of: Mapping[str, str]) -> dict[str, dict[str, float]]:
    return {ours: {theirs: 1.0} for ours, theirs in factor_of.items()}


# ---- joint, servo, series-elastic actuator ----


def _robot(case: Case) -> tuple[Any, Any]:
    """The solver of a case without a contact, and its robot: the input is a torque, 1 N m per unit."""
    p = case.parameters
    if case.family == "sea":
        solver: Any = hopform.load_solver("sea")
        return solver, solver.Robot(**{name: p[name] for name in SEA}, N=1.0, k_m=1.0)
    solver = hopform.load_solver("servo" if case.family == "servo" else "joint")
    numbers = {theirs: p[ours] for ours, theirs in JOINT.items() if ours in p}
    numbers |= {"F_p": p["F"], "F_m": p["F"], "k_t": p["k"] if case.family == "driven joint" else 1.0}
    numbers |= {"F_sp": p["F_s"], "F_sm": p["F_s"]} if "F_s" in p else {}
    return solver, solver.Robot(**numbers, **({"i_max": p["tau_max"]} if "tau_max" in p else {}))


def _columns(case: Case, names: Mapping[str, str]) -> Columns:
    """The columns of what a case without a contact is differentiated by; names: of its states in the model."""
    if case.family == "sea":
        return _named({**names, **{name: name for name in SEA}, "tau": "i"})
    columns = _named({**names, **JOINT, "tau": "i", "phi": "i", "target": "target", "tau_max": "i_max"})
    columns |= {"F": {"F_p": 1.0, "F_m": 1.0}, "F_s": {"F_sp": 1.0, "F_sm": 1.0}}
    return columns | ({"k": {"k": 1.0, "k_t": 1.0}} if case.family == "driven joint" else {})


def _motion(case: Case) -> dict[str, Any]:
    """A motion of one or two coordinates."""
    solver, robot = _robot(case)
    names = {q: q for q in case.positions}
    names |= {v: f"{q}_dot" for q, v in zip(case.positions, case.velocities, strict=True)}
    start = {names[name]: value for name, value in case.start.items()}
    motion = solver.solve_motion(robot, start=start, u=list(case.steps), horizon=float(case.times[-1]))
    states, derivatives = motion.at(case.times), motion.sensitivities
    rows = {"time_to_rest": "T"} | {f"{ours}_end": theirs for ours, theirs in names.items()}
    return {
        "states": {name: getattr(states, names[name]) for name in case.outputs},
        "events": [(event.time, event.kind) for event in motion.events],
        "values": {"time_to_rest": motion.duration} if "time_to_rest" in case.values else {},
        "gradients": _gradients(case, _columns(case, names), lambda of, by: derivatives[rows[of], by]),
    }


def _gradients(case: Case, columns: Columns, derivative: Callable[[str, str], float]) -> list[float]:
    """The derivatives that the answer has, each a sum over columns of the robot."""
    return [
        sum(factor * derivative(each.of, column) for column, factor in columns[each.by].items())
        for each in case_named(case.name).exact.gradients
    ]


# ---- hopper ----


def _leg(p: Numbers) -> Any:
    """The hopper of a case: friction is per mass there, and the input a force, 1 N per unit."""
    numbers: dict[str, Any] = {theirs: p[ours] for ours, theirs in LEG.items()}
    numbers |= {"m_eff": p["m_1"], "m_s": p["m_2"], "f1": p["F_1"] / p["m_1"], "f2": p["F_2"] / p["m_2"]}
    numbers |= {"gamma2": -1.0, "impact_loss": p.get("loss", 0.0), "u_max": p.get("u_max", math.inf)}
    return hopform.Robot(**numbers)


def _columns_of_leg(case: Case) -> Columns:
    p = case.parameters
    friction = {f"F_{n}": {f"f{n}": 1.0 / p[f"m_{n}"]} for n in (1, 2)}
    masses = {f"m_{n}": {name: 1.0, f"f{n}": -p[f"F_{n}"] / p[f"m_{n}"] ** 2} for n, name in ((1, "m_eff"), (2, "m_s"))}
    return _named(LEG | {name: name for name in (*case.outputs, case.input)}) | friction | masses


def _stance(case: Case) -> dict[str, Any]:
    """A stance up to its take-off."""
    start: dict[str, Any] = dict(case.start)
    if start["x2"] == start["x1"] + case.parameters["L"]:
        del start["x2"]  # the contact force is 0, exactly
    robot, u = _leg(case.parameters), list(case.steps)
    stance = hopform.solve_stance(robot, **start, u=u)
    ends = hopform.solve_stance(robot, **start, u=u, horizon=float(case.times[-1])).sensitivities
    states, rows = stance.at(case.times), {"takeoff": "T", "apex": "apex"}

    def derivative(of: str, by: str) -> float:
        if of in rows:
            return stance.sensitivities[rows[of], by]
        return ends[of.removesuffix("_end"), by]

    values = {"takeoff": stance.duration, "apex": stance.apex}
    return {
        "states": {name: getattr(states, name) for name in case.outputs},
        "events": [*((event.time, event.kind) for event in stance.events), (stance.duration, "takeoff")],
        "values": {name: value for name, value in values.items() if name in case.values},
        "gradients": _gradients(case, _columns_of_leg(case), derivative),
    }


def _hop(case: Case) -> dict[str, Any]:
    """Flight, stance, flight."""
    robot, law = _leg(case.parameters), (case.parameters["K_p"], case.parameters["K_d"])
    start: dict[str, Any] = dict(case.start)
    fall = hopform.solve_flight(robot, **start, gains=law)
    landed: Any = fall.touchdown
    stance = hopform.solve_stance(robot, x1=landed.x1, v1=landed.v1, v2=landed.v2, u=list(case.steps))
    rise = hopform.solve_flight(robot, x1=stance.end.x1, v1=stance.end.v1, v2=stance.end.v2, gains=law)
    touchdown, takeoff, end = accumulate((fall.duration, stance.duration, rise.duration))
    parts: list[tuple[float, Any]] = [(0.0, fall), (touchdown, stance), (takeoff, rise)]
    table, events = list[list[float]](), list[tuple[float, str]]()
    for t in map(float, case.times):
        begin, part = [each for each in parts if each[0] <= t][-1]
        state = part.at(min(t - begin, part.duration))
        table.append([float(getattr(state, name)) for name in case.outputs])
    for begin, part in parts:
        events += [(begin + each.time, each.kind) for each in part.events if each.kind.startswith(("x1_", "x2_"))]
    return {
        "states": table,
        "events": [*events, (touchdown, "touchdown"), (takeoff, "takeoff"), (end, "touchdown")],
        "values": {"takeoff": takeoff, "apex": stance.apex, "touchdown": end},
    }
