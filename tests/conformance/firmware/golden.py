"""Golden vectors for the emulated processors, from the 50-digit reference:
`python -m tests.conformance.firmware.golden` writes tables/golden.csv.

Inputs are rounded to single precision first. Each stance carries the condition number of its state and of its AED, at
least 1: the error that a target may show is 1e-5 of the scale times that.
"""

from typing import Any

import numpy as np

from tests.conformance.firmware import headers
from tests.conformance.firmware.cases import Start, inputs
from tests.oracle import reference


def row(robot: dict[str, float], start: Start) -> headers.Row:
    """One stance as a row of the table."""
    exact = reference.solve(robot, **start)
    if exact.status == "rest":  # a step that finds the robot at rest and leaves it there moves nothing
        start = {**start, "u": [start["u"][0], (100.0, 0.0)]}
        exact = reference.solve(robot, **start)
    events = exact.events[: start["max_phases"] - 1]
    assert len(events) <= headers.MOST_EVENTS or exact.status == "too_many_phases"
    unit = reference.scales(robot, exact, start["v2"])
    (_, u), (later, then) = start["u"]
    numbers = {
        **robot, **{name: start[name] for name in ("x1", "v1", "v2", "y")},
        "u": u, "later": later, "then": then, "horizon": start["horizon"],
    }  # fmt: skip
    answer = {
        "duration": exact.duration, "x1_end": exact.final.x1, "v1_end": exact.final.v1, "v2_end": exact.final.v2,
        "y_end": exact.end.y, "aed": exact.aed, "apex": exact.apex if exact.apex is not None else 0.0,
        "time_scale": unit["time"], "energy_scale": unit["energy"],
        "condition": max(1.0, reference.condition(robot, of="state", **start)),
        "condition_aed": max(1.0, reference.condition(robot, of="aed", **start)),
    }  # fmt: skip
    listed = ";".join(f"{event.kind} {number(event.time)}" for event in events[: headers.MOST_EVENTS])
    words = {"ending": exact.status, "events": listed}
    return (
        {name: number(value) for name, value in numbers.items()}
        | words
        | {name: number(value) for name, value in answer.items()}
    )


def number(value: Any) -> str:
    """In single precision."""
    return str(np.float32(float(value)))


if __name__ == "__main__":
    headers.write("golden", [row(robot, start) for robot, start in inputs()])
