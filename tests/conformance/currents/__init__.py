"""Brute force against the controller: every current of a fine grid is tried, at random touchdown states.

`compare` draws touchdowns, asks the controller, scans the currents (scan.c), and says where the scan found an
admissible current that is smaller, or an apex that is nearer by more than 1e-9 m.
`python -m tests.conformance.currents --count 10000` does many.
"""

import ctypes
import math
import os
import shlex
import subprocess
import tempfile
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import hopform
from hopform._control import choose_current
from hopform._solver import c as native
from hopform._solver import library as libraries
from hopform._stance import start_of

HERE = Path(__file__).parent
C = HERE.parents[2] / "generated" / "c"
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno"]
NEARER = 1e-9  # [m]
SMALLER = 1e-6  # [A]
FLAT = 1e-12  # [m] between two roots that are one, the apex staying what is wanted to rounding
SINGLE = 1e-5  # [m]


class _Task(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_double) for name in ("x1", "v1", "v2", "y", "wanted", "limit", "u_max", "stop", "nearer")),
        ("grid", ctypes.c_int),
    ]


class _Result(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("gap", "u", "root")]


@cache
def _library() -> Any:
    """scan.c, which calls the compiled library that Python has loaded; the library is not built a second time."""
    native.library()
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "scan.so"
        command = [*shlex.split(os.environ.get("CC") or "cc"), *FLAGS, "-I", str(C / "include"), str(HERE / "scan.c")]
        subprocess.run([*command, str(libraries.LIBRARY), "-o", str(target), "-lm"], check=True)
        library = ctypes.CDLL(str(target))
    library.scan_gap.restype = ctypes.c_double
    return library


@dataclass(frozen=True)
class Touchdown:
    """What the controller is asked: a state after the impact, and what is wanted."""

    x1: float
    v1: float
    v2: float
    y: float
    h_des: float
    datum: float
    stop_margin: float

    def x2(self, robot: hopform.Robot) -> float | None:
        return None if self.y == 0.0 else self.x1 - self.y + robot.L0 + robot.c

    def ask(self, robot: hopform.Robot, **how: Any) -> hopform.Command:
        return choose_current(
            robot, x1=self.x1, v1=self.v1, v2=self.v2, x2=self.x2(robot), h_des=self.h_des, datum=self.datum,
            stop_margin=self.stop_margin, **how,
        )  # fmt: skip


def draw_robot(seed: int, at_rest: bool = False) -> hopform.Robot:
    """A robot from parameters x 1/3 to 3 or 1/10 to 10, an actuator of 1/20 to 20 times the body's mass, and a stroke
    that is about what a drop makes of it; each friction is left out one time in four. With `at_rest` there is more
    friction at rest than in motion, of the actuator, of the body or of both."""
    draw = np.random.default_rng(seed)
    spread = float(draw.choice((3.0, 10.0)))

    def scaled(value: float, by: float = spread) -> float:
        return float(value * by ** draw.uniform(-1.0, 1.0))

    def often(value: float) -> float:
        return float(value * (draw.random() < 0.75))

    m_s = scaled(3.0)
    m_eff = scaled(m_s, 20.0)
    fields = {
        "m_eff": m_eff, "m_s": m_s, "k": scaled(1200.0), "L0": 0.4, "c": often(draw.uniform(-0.005, 0.005)),
        "b1": often(scaled(6.0 * m_eff)), "b2": often(scaled(5.0)), "f1": often(scaled(0.78)), "f2": often(scaled(0.6)),
        "gamma2": float(draw.choice((-1.0, 1.0))) * scaled(2.6 * m_eff), "g": 9.81, "u_max": scaled(3.0),
        "impact_loss": 0.05, "x1_min": -often(draw.uniform(0.0, 0.05)),
    }  # fmt: skip
    if at_rest:
        which = draw.integers(1, 4)
        fields |= {f"f{n}_excess": float(scaled(0.6) if which & n else 0.0) for n in (1, 2)}
    free = hopform.Robot(**fields, x1_max=0.3)
    v2 = hopform.touchdown_velocity(free, draw.uniform(0.02, 0.4))
    stance = hopform.solve_stance(free, v2=v2, u=draw.uniform(-1.0, 1.0) * free.u_max)
    used = max(stance.end.x1, *(phase.state.x1 for phase in stance.phases))
    stroke = max(used, 1e-3) * draw.uniform(0.4, 1.3)
    return hopform.Robot(**fields, x1_max=float(stroke if draw.random() < 0.8 else scaled(0.05)))


def draw_touchdowns(robot: hopform.Robot, seed: int, count: int) -> list[Touchdown]:
    """Drops from 0 to 40 cm with the actuator anywhere and moving or not;
    half of what is wanted is what some current gives.
    """
    draw = np.random.default_rng(seed)
    found: list[Touchdown] = []
    while len(found) < count:
        height = draw.uniform(0.0, 0.4) ** draw.choice((1, 2))
        x1 = draw.choice((robot.x1_min, draw.uniform(robot.x1_min, robot.x1_max)))
        v1 = draw.choice((0.0, draw.normal(0.0, 0.2)))
        v2 = hopform.touchdown_velocity(robot, height)
        y = draw.choice((0.0, 0.0, 0.0, draw.uniform(0.0, 0.01)))
        if not v2 < v1 - 1e-6:
            continue
        y = 0.0 if y == 0.0 else float(x1 - (x1 - y + robot.L0 + robot.c) + robot.L0 + robot.c)
        h_des = draw.uniform(0.0, 0.4)
        if draw.random() < 0.5:
            height_of = None if y == 0.0 else x1 - y + robot.L0 + robot.c
            u = draw.uniform(-robot.u_max, robot.u_max)
            apex = hopform.solve_stance(robot, x1=x1, v1=v1, v2=v2, x2=height_of, u=u).apex
            h_des = apex if apex >= 0.0 else h_des
        datum = draw.choice((0.0, draw.uniform(-h_des, 0.05)))
        margin = draw.choice((0.0, draw.uniform(0.0, 0.02)))
        found.append(Touchdown(*map(float, (x1, v1, v2, y, h_des - datum, datum, margin))))
    return found


CURRENTS_AT_JUMPS, MOST_AT_JUMPS = 1601, 3


def draw_at_jumps(robot: hopform.Robot, seed: int) -> list[Touchdown]:
    """Up to three drops with a desired apex beside one at which the apex jumps over the current, if it does anywhere."""
    draw, found = np.random.default_rng(seed), list[Touchdown]()
    u = np.linspace(-robot.u_max, robot.u_max, CURRENTS_AT_JUMPS)
    for drop in draw_touchdowns(robot, seed, 12):
        start = {"x1": drop.x1, "v1": drop.v1, "v2": drop.v2, "x2": drop.x2(robot)}
        apex = hopform.solve_stances(robot, u=u, **{key: q for key, q in start.items() if q is not None}).apex
        steps = np.abs(np.diff(apex))
        known = np.isfinite(steps)
        usual = float(np.median(steps[known])) if known.any() else math.inf
        jumps = np.flatnonzero(known & (steps > 30.0 * usual + 1e-5))
        for n in draw.permutation(jumps)[:2]:
            wanted = float(apex[n + draw.integers(2)] + draw.choice((-1.0, 0.0, 1.0)) * draw.uniform(0.0, 3.0) * usual)
            if wanted >= 0.0 and len(found) < MOST_AT_JUMPS:
                found.append(replace(drop, h_des=wanted, datum=0.0, stop_margin=0.0))
    return found


@dataclass
class Findings:
    """What was seen in a number of touchdowns."""

    statuses: dict[str, int] = field(default_factory=dict)
    solved: list[int] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    smaller: list[tuple[Touchdown, Any]] = field(default_factory=list)
    nearer: list[tuple[Touchdown, Any]] = field(default_factory=list)
    untrue: list[tuple[Touchdown, Any]] = field(default_factory=list)
    single: list[tuple[Touchdown, Any]] = field(default_factory=list)
    worst_single: float = 0.0

    def add(self, other: "Findings") -> None:
        for status, number in other.statuses.items():
            self.statuses[status] = self.statuses.get(status, 0) + number
        for name in ("solved", "words", "smaller", "nearer", "untrue", "single"):
            getattr(self, name).extend(getattr(other, name))
        self.worst_single = max(self.worst_single, other.worst_single)


class CurrentScan:
    """The scan of one robot in double precision."""

    def __init__(self, robot: hopform.Robot) -> None:
        self.robot, self.library = robot, _library()
        types = native.library().types(np.dtype(np.float64))
        self.plan = native.plan_of(types, robot.parameters)

    def task(self, touchdown: Touchdown, stop: float, nearer: float, step: float) -> Any:
        robot = self.robot
        limit = robot.x1_max - touchdown.stop_margin if robot.x1_min < robot.x1_max else math.inf
        # what the controller is asked, to the last bit: a jump shows it
        start = start_of(robot, touchdown.x1, touchdown.v1, touchdown.x2(robot), touchdown.v2)
        return _Task(
            *start, touchdown.h_des + touchdown.datum, limit, robot.u_max,
            stop, nearer, math.ceil(robot.u_max / step),
        )  # fmt: skip

    def gap(self, touchdown: Touchdown, u: float) -> float:
        """Apex less what is wanted [m]; NaN if u is not admissible."""
        task = self.task(touchdown, math.inf, math.inf, 1.0)
        return float(self.library.scan_gap(self.plan, ctypes.byref(task), ctypes.c_double(u)))

    def scan(self, touchdown: Touchdown, stop: float, nearer: float, step: float) -> Any:
        """The least root below `stop` [A], and the least gap below `nearer` [m], of the admissible currents."""
        result = _Result()
        task = self.task(touchdown, stop, nearer, step)
        self.library.scan(self.plan, ctypes.byref(task), ctypes.byref(result))
        return result


def compare(robot: hopform.Robot, touchdowns: list[Touchdown], step: float, **how: Any) -> Findings:
    """The controller's answers against a scan of the currents in steps [A]."""
    scan, found = CurrentScan(robot), Findings()
    for touchdown in touchdowns:
        command = touchdown.ask(robot, **how)
        gap = math.inf if command.status == "no_takeoff" else scan.gap(touchdown, command.u)
        reached = command.status == "reached"
        stop, nearer = (abs(command.u), 0.0) if reached else (math.inf, abs(gap) - NEARER)
        result = scan.scan(touchdown, stop, nearer, step)
        answer = (command, (result.gap, result.u, result.root))
        if not _is_true(robot, touchdown, command, gap):
            found.untrue.append((touchdown, answer))
        smaller = reached and result.root < abs(command.u) - SMALLER
        if smaller and not _is_flat(scan, touchdown, command.u, result.root):
            found.smaller.append((touchdown, answer))
        if not reached and (result.gap < math.inf or result.root < math.inf):
            found.nearer.append((touchdown, answer))
        found.statuses[command.status] = found.statuses.get(command.status, 0) + 1
        found.solved.append(command.solved)
        found.words.append(command.status)
    return found


def _is_flat(scan: CurrentScan, touchdown: Touchdown, u: float, root: float) -> bool:
    """Whether the apex does not change between a command and a smaller root of that sign:
    rounding has the choice there.
    """
    between = np.linspace(root, abs(u), 9) * math.copysign(1.0, u)
    return all(abs(scan.gap(touchdown, each)) <= FLAT for each in between)


def _is_true(robot: hopform.Robot, touchdown: Touchdown, command: hopform.Command, gap: float) -> bool:
    """Whether a command has the apex that it returns; its gap is NaN if it is not admissible."""
    if command.status == "no_takeoff":
        return command.u == 0.0 and math.isnan(command.apex)
    predicted = abs(gap - (command.apex - touchdown.h_des)) <= 1e-12
    return predicted and abs(command.u) <= robot.u_max and (command.status != "reached" or abs(gap) <= NEARER)


def compare_single(robot: hopform.Robot, touchdowns: list[Touchdown]) -> Findings:
    """The controller in single precision: its currents in the model in double precision."""
    scan, found = CurrentScan(robot), Findings()
    for touchdown in touchdowns:
        command = touchdown.ask(robot, dtype=np.float32)
        if command.status == "no_takeoff":
            continue
        gap = scan.gap(touchdown, command.u)
        reached = command.status == "reached"
        if not abs(command.u) <= robot.u_max or math.isnan(gap) or (reached and abs(gap) > SINGLE):
            found.single.append((touchdown, (command, gap)))
        elif reached:
            found.worst_single = max(found.worst_single, abs(gap))
    return found
