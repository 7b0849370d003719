"""Starts at a threshold, of every model: what is within rounding of one is decided once.

Thresholds are the friction of a mass at rest, a stop, the limit of a law, and the contact force 0. A start is put on
one by the number that acts on it, a position, the compression, the input or a velocity, rounded to the precision and
moved by up to 4 units in the last place. The numbers of a robot are decimal ones about those that its model ships with;
dampers are 0 in every other one.
"""

import math
import random
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.derived import MODELS, SHIPPED, built
from tests.seeds import SEED

pytestmark = needs.library
FIRST = ["leg_damper", "servo"]
FILES = {path.stem for path in (*SHIPPED.glob("*.py"), *MODELS.glob("*.py"))} - {"__init__"}
NAMES = FIRST + sorted(FILES - {*FIRST})
"""The first two are tried in every run: a damper between two masses, and one mass under a law."""
UNHELD = ("monoped", "tendon", "rope_drum", "pogo")
"""Models whose second mass no friction holds, and one without a stop."""
STARTS = 120
HORIZON = 0.5
both_precisions = pytest.mark.parametrize("dtype", ["float64", "float32"])
every_model = pytest.mark.parametrize("name", needs.the_first(NAMES, 2))


class Draw(random.Random):
    """Random decimal numbers."""

    def about(self, value: float) -> float:
        return float(f"{value * math.exp(self.uniform(-0.7, 0.7)):.3g}")

    def between(self, low: float, high: float) -> float:
        return float(f"{self.uniform(low, high):.3g}")


class Model:
    """A built model: its robots, and its thresholds as numbers."""

    def __init__(self, folder: Any) -> None:
        self.solver = hopform.load_solver(folder)
        self.shipped = self.solver.load_robot(folder / "robot.toml")
        package, facts = self.shipped.solver.package, self.shipped.solver.facts
        self.formulas, self.fields = package.formulas, package.records.ROBOT_FIELDS
        self.state = package.records.LegState
        self.axes = {axis: str(table["name"]) for axis, table in facts.axes.items()}
        self.driven = bool(facts.inputs)
        self.moving = [n for n in (1, 2) if f"v{n}" in self.axes]
        self.has_law, self.has_contact = bool(facts.currents), "stance" in facts.can

    def robot(self, draw: Draw) -> Any:
        """A robot about the one that ships, without stops; with friction, and with dampers in every other one."""
        values = {}
        damped = draw.random() < 0.5
        for field in self.fields:
            value = draw.about(float(getattr(self.shipped, field.name)))
            if field.domain in ("lower", "upper"):
                value = math.inf if field.domain == "upper" else -math.inf
            elif field.domain == "bound":
                value = draw.about(min(abs(value), 20.0)) if self.has_law else math.inf
            elif field.unit in ("N s/m", "N m s/rad"):
                value = (value or draw.between(0.01, 2.0)) if damped else 0.0
            elif value == 0.0 and field.domain in ("nonnegative", "real") and draw.random() < 0.5:
                value = draw.between(0.01, 0.5)
            values[field.name] = value
        try:
            return self.solver.Robot(**values)
        except hopform.HopformError:  # friction at rest below that in motion
            return self.robot(draw)

    def compressed(self, robot: Any, x1: float, y: float) -> float:
        """The compression: of one mass alone by its position."""
        return y if "y" in self.axes else float(self.formulas.second_position(robot.parameters, x1, 0.0))

    def end(self, side: int) -> str:
        """The parameter of the stop on a side; empty where it is no parameter."""
        return next((field.name for field in self.fields if field.domain == ("lower" if side < 0 else "upper")), "")

    def stop(self, robot: Any, side: int) -> float:
        """Where the stop on a side is."""
        ends = self.formulas.lower_stop, self.formulas.upper_stop
        return float(ends[side > 0](robot.parameters))

    def within(self, robot: Any, x1: float) -> bool:
        """Whether a position is between the stops."""
        return self.stop(robot, -1) <= x1 <= self.stop(robot, 1)

    def ratio(self, robot: Any) -> float:
        """By how much the stretch grows with the first position: 1 but over a gear."""
        return float(getattr(self.formulas.rates_of(robot.parameters), "y_v1", 1.0))

    def levels(self, mass: int) -> list[str]:
        """The parameters of the friction of a mass."""
        values = self.shipped.parameters._asdict()

        def of(changed: dict[str, float]) -> Any:
            robot = type(self.shipped.parameters)(**values | changed)
            excess = self.formulas.excess_of(robot)
            return self.formulas.friction_of(robot)[mass - 1], *excess[2 * mass - 2 : 2 * mass]

        inertias = {field.name for field in self.fields if field.domain == "positive"}
        return [name for name in values if name not in inertias and of({name: values[name] + 1.0}) != of({})]

    def over_level(self, robot: Any, mass: int, side: int, at: dict[str, float]) -> float:
        """Free acceleration of a mass to a side, less its friction at rest, [m/s^2]."""
        parameters, formulas = robot.parameters, self.formulas
        rates = formulas.rates_under_law(parameters) if self.has_law else formulas.rates_of(parameters)
        state = self.state(at["x1"], at["v1"], at["v2"], self.compressed(robot, at["x1"], at["y"]))
        free = formulas.free_accelerations(rates, state, at["u"])[mass - 1]
        excess = formulas.excess_of(parameters)[2 * mass - 1 - (side > 0)]
        return float(side * free - formulas.friction_of(parameters)[mass - 1] - excess)

    def over_limit(self, robot: Any, side: int, at: dict[str, float]) -> float:
        """Pull of a law to a side, less the largest, [N]."""
        state = self.state(at["x1"], at["v1"], at["v2"], 0.0)
        pull = self.formulas.switching_of(robot.parameters, state, at["u"])
        return float(side * pull - self.formulas.switching_levels(robot.parameters).upper)

    def contact(self, robot: Any, at: dict[str, float]) -> float:
        """Contact force over the stiffness of the leg, [m]."""
        return float(self.formulas.contact_of(robot.parameters, self.state(at["x1"], at["v1"], at["v2"], at["y"])))

    def solve(self, robot: Any, at: dict[str, float], dtype: str, horizon: float = HORIZON, *steps: float) -> Any:
        """The motion from a start, its input the same in further steps."""
        start = {name: at[axis] for axis, name in self.axes.items() if axis in at and axis != "x2"}
        u = [(t, at["u"]) for t in (0.0, *steps)] if self.driven else 0.0
        return self.solver.solve_motion(robot, start=start, u=u, horizon=horizon, dtype=dtype, max_phases=64)


@pytest.fixture(scope="module")
def models(store) -> Callable[[str], Model]:
    return lambda name: Model(built(store, name))


def rounded(robot: Any, dtype: str, **changed: float) -> Any:
    """The robot with numbers of a precision, some of them changed."""
    numbers = robot.parameters._asdict() | changed
    return type(robot)(**{name: float(np.dtype(dtype).type(value)) for name, value in numbers.items()})


def put(at: dict[str, float], knob: str, over: Callable[[dict[str, float]], float], dtype: str) -> bool:
    """Put a number of a start where a threshold is, to its last place; False where that does not depend on it."""
    whole = np.dtype(dtype).type
    zero, one = over(at | {knob: 0.0}), over(at | {knob: 1.0})
    slope = one - zero
    if not abs(slope) > 1e-9 * (abs(zero) + abs(one)):
        return False
    value = whole(-zero / slope)
    for _ in range(3):
        value = whole(float(value) - over(at | {knob: float(value)}) / slope)
    at[knob] = float(value)
    return True


def beside(draw: Draw, value: float, dtype: str) -> float:
    """A number within 4 ulp of one; 0 of 0, since what is stretched by 1e-323 m has its events as early as that."""
    near = np.dtype(dtype).type(value)
    for _ in range(draw.randrange(5)):
        near = np.nextafter(near, type(near)(draw.choice([-math.inf, math.inf])))
    return float(near) if value else 0.0


def starts(model: Model, seed: int, count: int, dtype: str) -> Iterator[tuple[Any, dict[str, float]]]:
    """Robots and starts on a threshold: a mass at rest at its friction, the other at rest, at its own or not, or moving;
    a stop that is there; a law at its limit; a leg with a damper that carries nothing.
    """
    draw, whole = Draw(seed), np.dtype(dtype).type
    left = count
    while left:
        robot = rounded(model.robot(draw), dtype)
        at = {
            "x1": draw.between(-0.05, 0.05),
            "y": draw.between(0.001, 0.05),
            "u": draw.between(-2.0, 2.0) * model.driven,
        }
        at |= {"v1": 0.0, "v2": 0.0} | {f"v{n}": draw.between(-1.0, 1.0) for n in model.moving if draw.random() < 0.3}
        at = {axis: float(whole(value)) for axis, value in at.items()}
        kind = draw.choice(["friction", "both", "stop", "limit", "contact"])
        mass, side = draw.choice(model.moving), draw.choice([-1, 1])
        placed = []
        if kind == "limit" and model.has_law:
            placed = [(draw.choice(["u", "x1", "v1"]), lambda at, r=robot, s=side: model.over_limit(r, s, at))]
        elif kind == "contact" and model.has_contact:
            placed = [("v2", lambda at, r=robot: model.contact(r, at))]
        elif kind in ("friction", "both", "stop"):
            for each in model.moving if kind == "both" else (mass,):
                at[f"v{each}"], to = 0.0, draw.choice([-1, 1])
                knob = "u" if each == 1 and draw.random() < 0.7 else "y" if "y" in model.axes else "x1"
                placed += [(knob, lambda at, r=robot, m=each, s=to: model.over_level(r, m, s, at))]
        if not placed or not all(put(at, knob, over, dtype) for knob, over in placed):
            continue
        at |= {knob: beside(draw, at[knob], dtype) for knob, _ in placed}
        if not 0.0 <= at["y"] <= 10.0 or not max(map(abs, at.values())) <= 1e7 or not model.within(robot, at["x1"]):
            continue
        if kind == "stop" and (end := model.end(side)) and at["x1"] != model.stop(robot, -side):
            at["v1"] *= draw.choice([0.0, 1.0])
            robot = rounded(robot, dtype, **{end: at["x1"]})
        left -= 1
        yield robot, at


@every_model
@both_precisions
def test_a_start_on_a_threshold_is_decided_once(models, name, dtype):
    """No event at the start, no phase that ends at once, and no end at once but a take-off or a rest there."""
    model = models(name)
    for robot, at in starts(model, SEED + 1, STARTS, dtype):
        motion = model.solve(robot, at, dtype)
        events, begins = [event.time for event in motion.events], [phase.start for phase in motion.phases]
        at_once = 1e-12 * HORIZON
        assert all(time > 0.0 for time in events), (robot, at, motion.events)
        assert all(later - time > at_once for time, later in pairwise(events)), (robot, at, motion.events)
        assert all(later - time > at_once for time, later in pairwise(begins)), (robot, at, motion.phases)
        assert motion.duration > at_once or (not events and motion.status in ("takeoff", "rest")), (robot, at)


def impacts(model: Model, seed: int, count: int, dtype: str) -> Iterator[tuple[Any, dict[str, float]]]:
    """Robots whose first mass, without friction, is in equilibrium on a stop, by its spring or by the input; the second
    one is held. The first one moves to the stop.
    """
    draw, whole = Draw(seed), np.dtype(dtype).type
    left = count
    while left:
        robot, side = model.robot(draw), draw.choice([-1, 1])
        held = dict.fromkeys(model.levels(1), 0.0) | dict.fromkeys(model.levels(2), 1e5)
        held |= {field.name: math.inf for field in model.fields if field.domain == "bound"}
        robot = rounded(robot, dtype, **held)
        end = model.end(side)
        at = {"x1": draw.between(-0.05, 0.05) if end else model.stop(robot, side), "v1": 0.0, "v2": 0.0}
        at |= {"y": draw.between(0.001, 0.05), "u": draw.choice([0.0, draw.between(-2.0, 2.0)])}
        at = {axis: float(whole(value)) for axis, value in at.items()}
        knob = draw.choice(["u", "y" if "y" in model.axes else "x1" if end else "u"])
        if not put(at, knob, lambda at, r=robot: model.over_level(r, 1, 1, at), dtype) or not 0.0 <= at["y"] <= 10.0:
            continue
        if not math.isfinite(at["x1"]) or not model.within(robot, at["x1"]):
            continue
        robot = rounded(robot, dtype, **({end: at["x1"]} if end else {}))
        x1 = whole(at["x1"] - side * draw.between(1e-3, 0.05))
        at["y"] = float(whole(at["y"] + model.ratio(robot) * (float(x1) - at["x1"])))
        at |= {"x1": float(x1), "v1": float(whole(side * math.exp(draw.uniform(-4.0, 1.5))))}
        if (model.has_contact and at["y"] < 0.0) or not model.within(robot, float(x1)):
            continue
        left -= 1
        yield robot, at


def kinds_of(motion: Any) -> list[str]:
    """What its events are, without the coordinate."""
    return [event.kind.partition("_")[2] for event in motion.events]


@pytest.mark.parametrize("name", needs.the_first([name for name in NAMES if name not in UNHELD], 2))
@both_precisions
def test_a_stop_that_is_an_equilibrium_is_hit_once(models, name, dtype):
    """Then all rests there, also where the input is asked again; before, it may creep, or take off, without an event."""
    model, hits = models(name), 0
    for robot, at in impacts(model, SEED + 2, STARTS, dtype):
        motion = model.solve(robot, at, dtype, 5.0)
        kinds = kinds_of(motion)
        ends = [(["hits_stop"], "rest"), ([], "horizon"), *([([], "takeoff")] if model.has_contact else [])]
        assert (kinds, motion.status) in ends, (robot, at, motion.events)
        if kinds:
            again = model.solve(robot, at, dtype, 10.0, motion.duration + 0.1)
            assert (kinds_of(again), again.status) == (kinds, "rest"), (robot, at, again.events)
        hits += len(kinds)
    assert hits > STARTS // 4
