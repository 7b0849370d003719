"""What one checkout answers, run in a process of its own:
`python answers.py INPUTS.npz OUT.npz`, the checkout on the path.

Only names that the project promises are used: the C interface by ctypes, `hopform.solve_stances`, `solve_flight`,
`choose_current`.
"""

import ctypes
import sys
from pathlib import Path
from typing import Any

import numpy as np

import hopform
from hopform_solver.records import ROBOT_FIELDS

ROOM = 8
RESULTS = ("status", "duration", "x1", "v1", "x2", "v2", "apex", "aed", "event_count")


class Column(ctypes.Structure):
    _fields_ = [("first", ctypes.c_void_p), ("stride", ctypes.c_ssize_t)]


class In(ctypes.Structure):
    _fields_ = [
        ("robot", Column * len(ROBOT_FIELDS)),
        *((name, Column) for name in ("x1", "v1", "v2", "y", "u", "horizon")),
        ("max_phases", ctypes.c_int32),
    ]


class Out(ctypes.Structure):
    _fields_ = [
        *((name, Column) for name in RESULTS),
        ("phases", ctypes.c_void_p),
        ("phase_capacity", ctypes.c_int32),
        ("event_time", ctypes.c_void_p),
        ("event_kind", ctypes.c_void_p),
        ("event_capacity", ctypes.c_int32),
    ]


def stances_of_c(library: Any, p: Any, dtype: Any) -> dict[str, Any]:
    """All columns of hopform_solve_stances, with the events that fit."""
    suffix = "f32" if dtype == np.float32 else "f64"
    kept = []

    def column(values: Any) -> Column:
        kept.append(np.ascontiguousarray(values, dtype))
        return Column(kept[-1].ctypes.data, kept[-1].itemsize)

    given, out = In(), Out()
    for name in ("x1", "v1", "v2", "y", "u", "horizon"):
        setattr(given, name, column(p[name]))
    for n, field in enumerate(ROBOT_FIELDS):
        given.robot[n] = column(p[field.name])
    given.max_phases = 100
    results = {name: np.zeros(p.size, np.int32 if name in ("status", "event_count") else dtype) for name in RESULTS}
    for name, values in results.items():
        setattr(out, name, Column(values.ctypes.data, values.itemsize))
    times, kinds = np.zeros((p.size, ROOM), dtype), np.zeros((p.size, ROOM), np.int8)
    phases = np.zeros((2 * ROOM + 2, 64), np.uint8)
    out.phases, out.phase_capacity = phases.ctypes.data, len(phases)
    out.event_time, out.event_kind, out.event_capacity = times.ctypes.data, kinds.ctypes.data, ROOM
    getattr(library, f"hopform_solve_stances_{suffix}")(ctypes.c_int64(p.size), ctypes.byref(given), ctypes.byref(out))
    return {**results, "event_time": times, "event_kind": kinds}


def flights(given: Any, **how: Any) -> list[Any]:
    rows = []
    for one in given:
        robot = hopform.Robot(**{field.name: float(one[field.name]) for field in ROBOT_FIELDS})
        start: dict[str, Any] = {name: float(one[name]) for name in ("x1", "v1", "v2")}
        start["x2"] = None if one["y"] == 0.0 else float(one["x1"] - one["y"] + robot.L0 + robot.c)
        gains = float(one["Kp"]), float(one["Kd"])
        try:
            solved = hopform.solve_flight(robot, **start, gains=gains, horizon=3.0, max_phases=200, **how)
        except hopform.HopformError as error:
            rows.append((np.nan, len(str(error))))
            continue
        rows.append((solved.duration, *solved.end[:4], len(solved.events), *(event.time for event in solved.events)))
    return rows


def commands(robots: Any, touchdowns: Any, **how: Any) -> list[Any]:
    rows = []
    for number, (v2, x1, v1, h_des) in enumerate(touchdowns.tolist()):
        command = hopform.choose_current(robots[number % len(robots)], v2=v2, x1=x1, v1=v1, h_des=h_des, **how)
        rows.append((command.u, command.apex, ("reached", "nearest", "no_takeoff").index(command.status)))
    return rows


def as_array(rows: list[Any]) -> Any:
    """Rows of different lengths as one array, NaN behind the end of each."""
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, values in zip(table, rows, strict=True):
        row[: len(values)] = values
    return table


def digest(library: Any, precision: str) -> Any:
    """The hash of hopform_selftest, which takes memory for a search and for 32 phases."""
    function = getattr(library, f"hopform_selftest_{precision}")
    function.restype = ctypes.c_uint32
    return np.array([function((ctypes.c_uint64 * 8192)(), (ctypes.c_uint64 * 1024)(), 32)], np.uint32)


def main(inputs: str, out: str) -> None:
    given = np.load(inputs)
    p = given["stances"]
    found: dict[str, Any] = {}
    library_file = next(Path(hopform.__file__).parent.glob("_libhopform.*"))
    library = ctypes.CDLL(str(library_file))
    for precision, dtype in (("f64", np.float64), ("f32", np.float32)):
        answers = stances_of_c(library, p, dtype)
        found |= {f"stances C {precision}/{column}": values for column, values in answers.items()}
        found[f"selftest {precision}"] = digest(library, precision)
    found["flights C"] = as_array(flights(given["flights"]))
    robots = [hopform.load_robot("hopper_c"), hopform.load_robot("hopper_b")]
    found["commands C"] = as_array(commands(robots, given["touchdowns"]))
    np.savez(out, **{name.replace("/", "|"): values for name, values in found.items()})


if __name__ == "__main__":
    main(*sys.argv[1:])
