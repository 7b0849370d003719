"""Stances and flights of the 50-digit reference, commands in double precision:
`python -m tests.conformance.firmware.vectors` writes them.

A row of numbers each, one behind the other, as answers.c reads them: what goes in, what must come out, and the
condition number by which an error may grow. Random robots are those of tests/conformance/random_stances.py and
tests/conformance/flights.py.
"""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import hopform
from derive.model.selftest import CASES, ROBOTS
from hopform_solver.records import Robot
from tests.conformance import flights
from tests.conformance.firmware.golden import ENDINGS, KINDS, folded
from tests.conformance.random_stances import draw_stances
from tests.oracle import reference
from tests.oracle.reference.flight import solve_flight

HEADER = Path(__file__).with_name("vectors.h")
STANCES, FLIGHTS = 70, 50
MOST_EVENTS = 24
LEDGER = ("motor_work", "offset_work", "viscous_1", "viscous_2", "coulomb_1", "coulomb_2", "spring_work")
FLIGHT_KINDS = {"u_saturates": 8, "u_desaturates": 9} | {kind: 1 + n for n, kind in enumerate(KINDS)}
FLIGHT_ENDINGS = {"touchdown": 1, "tripped": 2, "horizon": 3, "too_many_phases": 4}
COMMANDS = {"reached": 1, "nearest": 2, "no_takeoff": 3}
CREEPING = {"m_eff": 1.0, "m_s": 1.0, "k": 900.0, "L0": 0.3, "b1": 400.0, "b2": 300.0, "gamma2": 65.0}
"""A leg without weight that is damped far more than critically."""
MOST_CONDITION = 1e4

Row = list[Any]


def fields(robot: dict[str, float]) -> dict[str, float]:
    return {name: float(robot.get(name, 0.0)) for name in Robot._fields}


def stance_inputs() -> list[tuple[dict[str, float], dict[str, Any]]]:
    """The selftest's cases, drops of its first robots, then random ones."""
    found = []
    for case in CASES:
        start = {name: getattr(case, name) for name in ("x1", "v1", "v2", "y", "horizon")}
        found.append((fields(ROBOTS[case.robot]), start | {"u": [(0.0, case.u), (case.later, case.then)]}))
    for n, robot in enumerate((*ROBOTS[:2], ROBOTS[7], ROBOTS[8])):
        for v2, u in ((-0.7, -1.0), (-1.93, 0.5), (-2.6, 2.75), (-0.3, 0.1 * n)):
            found.append((fields(robot), {"x1": 0.0, "v1": 0.0, "v2": v2, "y": 0.0, "horizon": 2.0, "u": [(0.0, u)]}))
    limits = {"x1_min": -math.inf, "x1_max": math.inf, "u_max": 1.0}
    for f2, rest in ((0.0, 1e-6), (0.0, 3e-8), (1e3, 1e-6)):  # take-offs where all but that share of y has faded
        start = {"x1": 0.0, "v1": 0.0, "v2": 0.0, "y": 0.05, "horizon": 50.0}
        current = rest * 0.05 * CREEPING["k"] / CREEPING["gamma2"]
        found.append((fields(CREEPING | limits | {"f2": f2}), start | {"u": [(0.0, current)]}))
    for p in draw_stances(20260, STANCES):
        robot = {name: float(p[name]) for name in Robot._fields if name in p.dtype.names}
        start = {name: float(p[name]) for name in ("x1", "v1", "v2", "y", "horizon")}
        found.append((fields(robot), start | {"u": [(0.0, float(p["u"]))]}))
    return found


def stance_row(robot: dict[str, float], start: dict[str, Any]) -> Row | None:
    """None where an error would say too little: too many events, or a condition that forgives anything."""
    arguments = start | {"max_phases": MOST_EVENTS + 1}
    exact = reference.solve(robot, **arguments)
    if exact.status == "too_many_phases" or float(exact.margin) < 1e-9:
        return None
    if (
        exact.status == "rest" and len(start["u"]) > 1
    ):  # a step that finds the robot at rest and leaves it there moves nothing
        arguments["u"] = start["u"][:1]
        exact = reference.solve(robot, **arguments)
    conditions = [max(1.0, reference.condition(robot, of=of, **arguments)) for of in ("state", "aed")]
    if not max(conditions) < MOST_CONDITION:
        return None
    unit = reference.scales(robot, exact, start["v2"])
    steps = arguments["u"]
    row: Row = [1, *robot.values(), *(start[name] for name in ("x1", "v1", "v2", "y")), len(steps), *sum(steps, ())]
    row += [start["horizon"], ENDINGS[exact.status], len(exact.events)]
    for event in exact.events:
        row += [1 + KINDS.index(event.kind), event.time]
    apex = exact.apex if robot["g"] and exact.apex is not None else 0.0
    row += [exact.duration, exact.final.x1, exact.final.v1, exact.final.v2, exact.end.y, exact.aed, apex]
    row += [unit["time"], unit["energy"], *conditions]
    times = [float(exact.duration) * share for share in (0.137, 0.41, 0.83)]
    row.append(len(times))
    for t in times:
        state, ledger = exact.at(t), exact.ledger(t)
        y = exact.point(t)[1].y
        row += [
            t,
            state.x1,
            state.v1,
            state.v2,
            y,
            *exact.energy(t),
            *(ledger[name] for name in LEDGER),
            ledger["stop_loss"],
        ]
    return row


def flight_row(seed: int) -> Row | None:
    robot, inputs = flights.random_flight(seed)
    rounded = {field.name: float(getattr(robot, field.name)) for field in robot.fields()}
    exact = solve_flight(rounded, **inputs)
    if exact.status == "too_many_phases" or len(exact.events) > MOST_EVENTS:
        return None
    size = max(1.0, flights.condition(robot, inputs, float, exact))
    if not size < MOST_CONDITION:
        return None
    row: Row = [2, *fields(rounded).values(), *(inputs[name] for name in ("x1", "v1", "v2", "y")), *inputs["gains"]]
    row += [inputs["horizon"], FLIGHT_ENDINGS[exact.status], len(exact.events)]
    for event in exact.events:
        row += [FLIGHT_KINDS[event.kind], event.time]
    fastest = max(abs(inputs["v1"]), abs(inputs["v2"]), 1.0)
    energy = max(max(robot.m_s, robot.m_eff) * fastest**2, inputs["gains"][0] * inputs["x1"] ** 2) / 2.0
    time = max(float(exact.duration), math.sqrt(robot.m_s / robot.k))
    return [*row, exact.duration, *exact.end, *exact.ledger, time, energy, size]


def command_rows() -> Iterator[Row]:
    """What the controller chooses in double precision: within reach, beyond it, in a gap, with a margin, from a moving actuator."""
    for name in ("hopper_c", "hopper_b"):
        robot = hopform.load_robot(name)
        for v2, h_des, x1, v1, margin in (
            (-1.93, 0.15, 0.0, 0.0, 0.0), (-1.93, 0.5, 0.0, 0.0, 0.001), (-0.62, 0.012, 0.0, 0.0, 0.0),
            (-1.4, 0.1, 0.01, 0.05, 0.02), (-2.2, 0.05, 0.03, -0.1, 0.0), (-0.62, 0.024, 0.0, 0.0, 0.0),
        ):  # fmt: skip
            found = hopform.choose_current(robot, x1=x1, v1=v1, v2=v2, h_des=h_des, stop_margin=margin, horizon=2.0)
            inputs = {field.name: float(getattr(robot, field.name)) for field in robot.fields()}
            apex = found.apex if math.isfinite(found.apex) else 0.0
            numbers = (x1, v1, v2, 0.0, h_des, margin, 2.0, found.u, apex)
            yield [3, *fields(inputs).values(), *numbers, COMMANDS[found.status]]


def number(value: Any) -> str:
    value = float(value)
    return repr(value) if math.isfinite(value) else ("ENDLESS" if value > 0.0 else "-ENDLESS")


def line(make: Callable[..., Row | None], *arguments: Any) -> str | None:
    """A row as text; mpmath's numbers do not go from process to process."""
    row = make(*arguments)
    return None if row is None else folded(["    " + ", ".join(map(number, row)) + ","])


def text() -> str:
    inputs = stance_inputs()
    with ProcessPoolExecutor(2) as pool:
        stances = list(pool.map(partial(line, stance_row), *zip(*inputs, strict=True)))
        flown = list(pool.map(partial(line, flight_row), range(FLIGHTS)))
    commands = [line(list, row) for row in command_rows()]
    body = "\n".join(filter(None, (*stances, *flown, *commands)))
    return f"""/* Written by `python -m tests.conformance.firmware.vectors`. Do not edit. */
#ifndef VECTORS_H
#define VECTORS_H

#define ENDLESS 9e307 /* stands for infinity, which is no constant to every compiler */

static const double vectors[] = {{
{body}
    0,
}};

#endif
"""


if __name__ == "__main__":
    HEADER.write_text(text(), "utf-8")
