"""Stances and flights of the 50-digit reference, commands in double precision:
`python -m tests.conformance.firmware.vectors` writes them into tables/{stances,flights,commands}.csv.

A row holds what goes in, what must come out, and the condition number by which an error may grow. Random robots are
those of tests/conformance/random_stances.py and tests/conformance/flights.py.
"""

import math
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import hopform
from derive.model.selftest import CASES, ROBOTS
from hopform_solver.records import Robot
from tests.conformance import flights
from tests.conformance.firmware import headers
from tests.conformance.random_stances import draw_stances
from tests.oracle import reference
from tests.oracle.reference.flight import solve_flight

STANCES, FLIGHTS = 70, 50
MOST_EVENTS = 24
LEDGER = ("motor_work", "offset_work", "viscous_1", "viscous_2", "coulomb_1", "coulomb_2", "spring_work")
CREEPING = {"m_eff": 1.0, "m_s": 1.0, "k": 900.0, "L0": 0.3, "b1": 400.0, "b2": 300.0, "gamma2": 65.0}
"""A leg without weight that is damped far more than critically."""
MOST_CONDITION = 1e4


def number(value: Any) -> str:
    """In double precision."""
    return repr(float(value))


def items(rows: Any) -> str:
    """A list, of words and numbers."""
    return ";".join(" ".join(value if isinstance(value, str) else number(value) for value in row) for row in rows)


def texts(row: dict[str, Any]) -> headers.Row:
    """A row with its numbers as text: mpmath's do not go from process to process."""
    return {name: value if isinstance(value, str) else number(value) for name, value in row.items()}


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


def stance_row(robot: dict[str, float], start: dict[str, Any]) -> headers.Row | None:
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
    end = {"x1_end": exact.final.x1, "v1_end": exact.final.v1, "v2_end": exact.final.v2, "y_end": exact.end.y}
    apex = exact.apex if robot["g"] and exact.apex is not None else 0.0
    samples = []
    for t in (float(exact.duration) * share for share in (0.137, 0.41, 0.83)):
        state, ledger = exact.at(t), exact.ledger(t)
        y = exact.point(t)[1].y
        works = (ledger[name] for name in LEDGER)
        samples.append([t, state.x1, state.v1, state.v2, y, *exact.energy(t), *works, ledger["stop_loss"]])
    return texts(
        {
            **robot, **{name: start[name] for name in ("x1", "v1", "v2", "y")}, "steps": items(arguments["u"]),
            "horizon": start["horizon"], "ending": exact.status,
            "events": items((event.kind, event.time) for event in exact.events),
            "duration": exact.duration, **end, "aed": exact.aed, "apex": apex,
            "time_scale": unit["time"], "energy_scale": unit["energy"],
            "condition": conditions[0], "condition_aed": conditions[1], "samples": items(samples),
        }
    )  # fmt: skip


def flight_row(seed: int) -> headers.Row | None:
    robot, inputs = flights.random_flight(seed)
    rounded = {field.name: float(getattr(robot, field.name)) for field in robot.fields()}
    exact = solve_flight(rounded, **inputs)
    if exact.status == "too_many_phases" or len(exact.events) > MOST_EVENTS:
        return None
    size = max(1.0, flights.condition(robot, inputs, float, exact))
    if not size < MOST_CONDITION:
        return None
    fastest = max(abs(inputs["v1"]), abs(inputs["v2"]), 1.0)
    energy = max(max(robot.m_s, robot.m_eff) * fastest**2, inputs["gains"][0] * inputs["x1"] ** 2) / 2.0
    return texts(
        {
            **fields(rounded), **{name: inputs[name] for name in ("x1", "v1", "v2", "y")},
            **dict(zip(("Kp", "Kd"), inputs["gains"], strict=True)), "horizon": inputs["horizon"],
            "ending": exact.status, "events": items((event.kind, event.time) for event in exact.events),
            "duration": exact.duration, **dict(zip(("x1_end", "v1_end", "v2_end", "y_end"), exact.end, strict=True)),
            **exact.ledger._asdict(),
            "time_scale": max(float(exact.duration), math.sqrt(robot.m_s / robot.k)), "energy_scale": energy,
            "condition": size,
        }
    )  # fmt: skip


def command_rows() -> Iterator[headers.Row]:
    """What the controller chooses in double precision: within reach, beyond it, in a gap, with a margin, from a moving actuator."""
    for name in ("hopper_c", "hopper_b"):
        robot = hopform.load_robot(name)
        for v2, h_des, x1, v1, margin in (
            (-1.93, 0.15, 0.0, 0.0, 0.0), (-1.93, 0.5, 0.0, 0.0, 0.001), (-0.62, 0.012, 0.0, 0.0, 0.0),
            (-1.4, 0.1, 0.01, 0.05, 0.02), (-2.2, 0.05, 0.03, -0.1, 0.0), (-0.62, 0.024, 0.0, 0.0, 0.0),
        ):  # fmt: skip
            found = hopform.choose_current(robot, x1=x1, v1=v1, v2=v2, h_des=h_des, stop_margin=margin, horizon=2.0)
            inputs = {field.name: float(getattr(robot, field.name)) for field in robot.fields()}
            yield texts(
                {
                    **fields(inputs), "x1": x1, "v1": v1, "v2": v2, "y": 0.0, "h_des": h_des, "stop_margin": margin,
                    "horizon": 2.0, "u": found.u, "apex": found.apex if math.isfinite(found.apex) else 0.0,
                    "status": found.status,
                }
            )  # fmt: skip


if __name__ == "__main__":
    with ProcessPoolExecutor(2) as pool:
        stances = pool.map(stance_row, *zip(*stance_inputs(), strict=True))
        flown = pool.map(flight_row, range(FLIGHTS))
        headers.write("stances", [row for row in stances if row])
        headers.write("flights", [row for row in flown if row])
    headers.write("commands", [*command_rows()])
