"""The headers that programs of this folder include, made when they are compiled: golden.h and vectors.h of the tables,
cost_cases.h of cases.py.

A row of a table is a case. A cell holds a number, with the fewest digits that give it back in its precision, a word for
an ending, an event or a status, or a list: its items stand apart by `;`, the numbers of one by spaces.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from threading import get_native_id

import numpy as np

from derive.model.selftest import CASES, HOPPER_C, ROBOTS
from hopform_solver.records import Robot
from tests.conformance.firmware.cases import DROPS, HOPS, REGIMES, Start, fields, inputs

TABLES = Path(__file__).with_name("tables")
VECTORS = ("stances", "flights", "commands")
"""The tables of vectors.h. Rows of the first begin with 1, those of the second with 2."""
LISTS = ("steps", "events", "samples")
"""Columns of lists."""
MOST_EVENTS = 16
"""In a golden vector."""
WORDS = {
    **{"takeoff": 1, "rest": 2, "horizon": 3, "too_many_phases": 4, "touchdown": 1, "tripped": 2},
    **{"x1_reverses": 1, "x1_sticks": 2, "x1_slips": 3, "x1_hits_stop": 4, "x2_reverses": 5, "x2_sticks": 6},
    **{"x2_slips": 7, "u_saturates": 8, "u_desaturates": 9, "reached": 1, "nearest": 2, "no_takeoff": 3},
}
"""Numbers in the C library: of endings of stances and flights, of events, of a command's statuses."""

Row = Mapping[str, str]


def read(table: str) -> list[dict[str, str]]:
    """The rows of a table."""
    with (TABLES / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(table: str, rows: Sequence[Row]) -> None:
    """A table anew."""
    with (TABLES / f"{table}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def items(cell: str) -> list[list[str]]:
    """A list's items."""
    return [item.split() for item in cell.split(";") if item]


# ---- in C ----


def double(text: object) -> str:
    """A number or word in double precision; infinity is no constant to every compiler."""
    return repr(float(WORDS.get(str(text), text))).replace("inf", "ENDLESS")


def vector(kind: int, row: Row) -> str:
    """A row as answers.c takes it: its numbers one behind the other, those of a list behind the count of its items."""
    found: list[object] = [kind]
    for name, cell in row.items():
        listed = items(cell)
        found += [len(listed), *sum(listed, [])] if name in LISTS else [cell]
    return ", ".join(map(double, found))


def vectors_h() -> str:
    rows = [vector(kind, row) for kind, table in enumerate(VECTORS, start=1) for row in read(table)]
    return f"""#define ENDLESS 9e307 /* stands for infinity */
static const double vectors[] = {{
{lines(rows)}
    0,
}};
"""


def single(values: Iterable[object]) -> str:
    """Numbers in single precision."""
    return ", ".join(f"{np.float32(value)!s}f" for value in values)


def lines(rows: Iterable[str]) -> str:
    return "\n".join(f"    {row}," for row in rows)


def golden(row: Row) -> str:
    """A row as an initialiser."""
    names = list(row)
    robot, inputs_of = len(Robot._fields), names.index("ending")
    values, events = list(row.values()), items(row["events"])
    kinds, times = ", ".join(str(WORDS[kind]) for kind, _ in events), single(time for _, time in events)
    given = f"{{{single(values[:robot])}}}, {single(values[robot:inputs_of])}"
    listed = f"{WORDS[row['ending']]}, {len(events)}, {{{kinds or 0}}}, {{{times or 0}}}"
    return f"{{{given}, {listed}, {single(values[inputs_of + 2 :])}}}"


def golden_h() -> str:
    return f"""#include <stdint.h>

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
{lines(map(golden, read("golden")))}
}};
"""


def cost_case(robot: int, start: Start) -> str:
    (_, u), (later, then) = start["u"]
    numbers = [*(start[name] for name in ("x1", "v1", "v2", "y")), u, later, then, start["horizon"]]
    return f"{{{robot}, {single(numbers)}}}"


def cost_cases_h() -> str:
    """The robots and starts that are counted."""
    robots = [*(case.robot for case in CASES), *(ROBOTS.index(robot) for robot, _, _ in DROPS)]
    cases = [cost_case(robot, start) for robot, (_, start) in zip(robots, inputs(), strict=True)]
    return f"""#include "hopform/hopform.h"

typedef struct {{
    int robot;
    float x1, v1, v2, y, u, later, then, horizon;
}} cost_case;

static const hopform_robot_f32 cost_robots[] = {{
{lines(f"{{{single(fields(robot).values())}}}" for robot in ROBOTS)}
}};

static const cost_case cost_cases_modes[] = {{
{lines(cases[: len(CASES)])}
}};

static const cost_case cost_cases_drops[] = {{
{lines(cases[len(CASES) :])}
}};

/* Robots of which the drops are counted apart, and those drops. */
typedef struct {{
    const char *name;
    hopform_robot_f32 robot;
}} cost_regime;

static const cost_regime cost_regimes[] = {{
{lines(f'{{"{name}", {{{single(fields(robot).values())}}}}}' for name, robot in REGIMES)}
}};

typedef struct {{
    float v2, u;
}} cost_drop;

static const cost_drop cost_drops[] = {{
{lines(f"{{{single((v2, u))}}}" for robot, v2, u in DROPS if robot is HOPPER_C)}
}};

/* Heights of a run of hops [m]. */
static const float cost_hops[] = {{{single(HOPS)}}};
"""


def make(folder: Path) -> None:
    """Write the headers that a folder has not; whoever makes them at the same time sees no half of one."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in {"golden.h": golden_h(), "vectors.h": vectors_h(), "cost_cases.h": cost_cases_h()}.items():
        target = folder / name
        if not target.exists() or target.read_text("utf-8") != text:
            aside = folder / f"{name}.{get_native_id()}"
            aside.write_text(text, "utf-8")
            aside.replace(target)
