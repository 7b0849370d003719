"""Golden vectors for the emulated processors, from the 50-digit reference:
`python -m tests.conformance.firmware.golden` writes golden.h.

cost_cases.h, written beside it, holds what is counted: the selftest's stances (set `modes`) and drops of both hoppers
(set `drops`), of which the paper's sequence of signs is the common case; the robots of each regime, whose drops are
counted apart; and the heights of a run of hops, whose flights are.

Inputs are rounded to single precision first. Each stance carries the condition number of its state and of its AED, at
least 1: the error that a target may show is 1e-5 of the scale times that.
"""

import struct
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from derive.model.selftest import CASES, HOPPER_B, HOPPER_C, ROBOTS
from hopform_solver.records import Robot
from tests.oracle import reference

HEADER = Path(__file__).with_name("golden.h")
COST_HEADER = Path(__file__).with_name("cost_cases.h")
ENDINGS = {"takeoff": 1, "rest": 2, "horizon": 3, "too_many_phases": 4}
KINDS = ("x1_reverses", "x1_sticks", "x1_slips", "x1_hits_stop", "x2_reverses", "x2_sticks", "x2_slips")
MOST_EVENTS = 16
DROPS = tuple((robot, v2, u) for robot in (HOPPER_C, HOPPER_B) for v2 in (-0.7, -1.93, -2.6) for u in (-1.0, 0.5, 2.75))

REGIMES = (
    ("a/w=0.26", HOPPER_C),
    ("a/w=3", HOPPER_C | {"b1": 1529.0}),
    ("a/w=6", HOPPER_C | {"b1": 3020.0}),
    ("a/w=30", HOPPER_C | {"b1": 15000.0}),
    ("a/w=33", HOPPER_C | {"b1": 16500.0}),
    ("a/w=60", HOPPER_C | {"b1": 30000.0}),
    ("three_real_poles", HOPPER_C | {"b1": 900.0, "b2": 400.0}),
    ("near-equal_poles", HOPPER_C | {"m_eff": 3.0, "m_s": 24.0, "k": 801.0, "b1": 90.5, "b2": 1.0, "gamma2": -8.0}),
    ("friction_at_rest", HOPPER_C | {"f1_excess": 0.4, "f2_excess": 0.3}),
)
"""Robots between the same stops, a their real pole and w = sqrt(q) the frequency of their pair: `hopper_c` with ever more
viscous friction of the actuator, past the threshold of the modal form in single precision, and those of other poles and
friction."""

HOPS = (0.15, 0.15, 0.12, 0.1, 0.12, 0.15, 0.18, 0.2, 0.17, 0.14, 0.11, 0.12)
"""[m] Heights that `hopper_c` is asked for one after the other, thrown up by the first."""


def single(value: float) -> float:
    return float(struct.unpack("f", struct.pack("f", value))[0])


def fields(robot: dict[str, float]) -> dict[str, float]:
    """All parameters, rounded."""
    return {name: single(robot.get(name, 0.0)) for name in Robot._fields}


def inputs() -> list[tuple[dict[str, float], dict[str, Any]]]:
    """Robots and starts: the selftest's, and drops of both hoppers under constant currents."""
    found = []
    for case in CASES:
        start = {name: single(getattr(case, name)) for name in ("x1", "v1", "v2", "y", "horizon")}
        steps = [(0.0, single(case.u)), (single(case.later), single(case.then))]
        found.append((fields(ROBOTS[case.robot]), {**start, "u": steps, "max_phases": 32}))
    for robot, v2, u in DROPS:
        start = {"x1": 0.0, "v1": 0.0, "v2": single(v2), "y": 0.0, "horizon": 2.0, "max_phases": 32}
        found.append((fields(robot), {**start, "u": [(0.0, single(u)), (100.0, 0.0)]}))
    return found


def number(value: Any) -> str:
    return f"{single(float(value)):.9g}f" if "." in f"{single(float(value)):.9g}" else f"{single(float(value)):.9e}f"


def folded(rows: Iterable[str]) -> str:
    """Rows of numbers, none wider than a source line may be."""
    lines = "\n".join(rows).splitlines()
    return "\n".join(textwrap.fill(line, 120, subsequent_indent="     ", break_on_hyphens=False) for line in lines)


def row(robot: dict[str, float], start: dict[str, Any]) -> str:
    """One stance as an initialiser."""
    exact = reference.solve(robot, **start)
    if exact.status == "rest":  # a step that finds the robot at rest and leaves it there moves nothing
        start = {**start, "u": [start["u"][0], (100.0, 0.0)]}
        exact = reference.solve(robot, **start)
    events = exact.events[: start["max_phases"] - 1]
    assert len(events) <= MOST_EVENTS or exact.status == "too_many_phases"
    events = events[:MOST_EVENTS]
    conditions = [max(1.0, reference.condition(robot, of=of, **start)) for of in ("state", "aed")]
    unit = reference.scales(robot, exact, start["v2"])
    y = exact.end.y
    (_, u), (later, then) = start["u"]
    numbers = [start["x1"], start["v1"], start["v2"], start["y"], u, later, then, start["horizon"]]
    answer = [exact.duration, exact.final.x1, exact.final.v1, exact.final.v2, y, exact.aed]
    answer += [exact.apex if exact.apex is not None else 0.0]
    line = (
        "    {{" + ", ".join(map(number, robot.values())) + "},\n     "
        + ", ".join(map(number, numbers)) + f", {ENDINGS[exact.status]}, {len(events)},\n     {{"
        + ", ".join(str(1 + KINDS.index(event.kind)) for event in events or ()) + ("" if events else "0") + "},\n     {"
        + ", ".join(number(event.time) for event in events) + ("" if events else "0.0f") + "},\n     "
        + ", ".join(map(number, answer)) + ",\n     "
        + ", ".join(map(number, [unit["time"], unit["energy"], *conditions])) + "},"
    )  # fmt: skip
    return folded([line])


def text() -> str:
    rows = "\n".join(row(robot, start) for robot, start in inputs())
    return f"""/* Written by `python -m tests.conformance.firmware.golden` from the 50-digit reference. Do not edit. */
#ifndef GOLDEN_H
#define GOLDEN_H

#include <stdint.h>

enum {{ MOST_EVENTS = {MOST_EVENTS} }};

typedef struct {{
    float robot[{len(Robot._fields)}];
    float x1, v1, v2, y, u, later, then, horizon;
    int32_t ending, event_count;
    int32_t event_kind[MOST_EVENTS];
    float event_time[MOST_EVENTS];
    float duration, x1_end, v1_end, v2_end, y_end, aed, apex;
    float time_scale, energy_scale, condition, condition_aed;
}} golden;

static const golden goldens[] = {{
{rows}
}};

#endif
"""


def cost_row(robot: int, start: dict[str, Any]) -> str:
    (_, u), (later, then) = start["u"]
    numbers = [start["x1"], start["v1"], start["v2"], start["y"], u, later, then, start["horizon"]]
    return f"    {{{robot}, " + ", ".join(map(number, numbers)) + "},"


def cost_text() -> str:
    """The robots and starts that are counted, as C."""
    robots = folded("    {" + ", ".join(map(number, fields(robot).values())) + "}," for robot in ROBOTS)
    given = [start for _, start in inputs()]
    modes = folded(cost_row(case.robot, start) for case, start in zip(CASES, given, strict=False))
    places = [ROBOTS.index(robot) for robot, _, _ in DROPS]
    drops = folded(cost_row(robot, start) for robot, start in zip(places, given[len(CASES) :], strict=True))
    regimes = "\n".join(
        f'    {{"{name}",\n{folded(["     {" + ", ".join(map(number, fields(robot).values())) + "}},"])}'
        for name, robot in REGIMES
    )
    starts = folded(f"    {{{number(v2)}, {number(u)}}}," for of, v2, u in DROPS if of is HOPPER_C)
    hops = folded(["    " + ", ".join(map(number, HOPS))])
    return f"""/* Written by `python -m tests.conformance.firmware.golden`. Do not edit. */
#ifndef COST_CASES_H
#define COST_CASES_H

#include "hopform/hopform.h"

typedef struct {{
    int robot;
    float x1, v1, v2, y, u, later, then, horizon;
}} cost_case;

static const hopform_robot_f32 cost_robots[] = {{
{robots}
}};

static const cost_case cost_cases_modes[] = {{
{modes}
}};

static const cost_case cost_cases_drops[] = {{
{drops}
}};

/* Robots of which the drops are counted apart, and those drops. */
typedef struct {{
    const char *name;
    hopform_robot_f32 robot;
}} cost_regime;

static const cost_regime cost_regimes[] = {{
{regimes}
}};

typedef struct {{
    float v2, u;
}} cost_drop;

static const cost_drop cost_drops[] = {{
{starts}
}};

/* Heights of a run of hops [m]. */
static const float cost_hops[] = {{
{hops}
}};

#endif
"""


if __name__ == "__main__":
    HEADER.write_text(text(), "utf-8")
    COST_HEADER.write_text(cost_text(), "utf-8")
