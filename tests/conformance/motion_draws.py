"""Random motions of any model as arrays: robots whose poles, friction and springs are of a kind, and starts.

Numbers of a robot are drawn by their units and domains, as those of tests/conformance/zoo.py; of a model that has all
the hopper's parameters those are of tests/conformance/random_stances.py. Then dampers and inertias are set so that the
poles are of the kind, by the masses M, springs K and dampers B of its file, which are affine in each of them.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import hopform
from derive.model.units import dimension
from tests.conformance import random_stances
from tests.conformance.zoo import DRIVES
from tests.derived import built, model_file
from tests.oracle.checker import ROBOT
from tests.oracle.elements import Elements, elements
from tests.oracle.problems import Equations

STEPS = 6
START = ("x1", "v1", "v2", "y")
DAMPING, STIFFNESS = ("N s/m", "N m s/rad"), ("N/m", "N m/rad")
BASE = ((0.02, 1.0), (0.05, 50.0), (0.01, 0.3), (0.1, 10.0), (1.0, 1.0))
"""Length, mass, time, current, angle: the ranges of the sizes of a mechanism, as those of the zoo."""
ULPS = 4
Robot = dict[str, Any]


class Model:
    """A built model as what draws and judges ask of it."""

    def __init__(self, store: Path, name: str) -> None:
        self.name, self.file, self.folder = name, model_file(name), built(store, name)
        solver = hopform.load_solver(self.folder)
        self.records = solver.load_robot(self.folder / "robot.toml").solver.package.records
        self.fields = {field.name: field for field in self.records.ROBOT_FIELDS}
        header = (self.folder / "c" / "include" / "hopform" / "hopform_f64.h").read_text("utf-8")
        state = header[: header.index("} hopform_state_f64")].rpartition("typedef struct")[2]
        said = dict(re.findall(r"double (\w+);\s*/\*\*< \[[^]]*\] (.*) \*/", state))
        self.first_moves, self.second_moves = (not said[of].startswith("0:") for of in ("v1", "v2"))
        self.stretch = said["y"].partition(":")[0]
        self.equations = Equations(self.file, [*self.fields], self.stretch, not self.first_moves)
        self.moving = self.equations.moving
        self.dtype = np.dtype(
            [("robot", "f8", len(self.fields)), ("start", "f8", 4), ("horizon", "f8"), ("t", "f8", STEPS),
             ("u", "f8", STEPS), ("steps", "i8")]
        )  # fmt: skip

    @property
    def is_hopper(self) -> bool:
        return {*ROBOT} <= {*self.fields}

    @property
    def two(self) -> bool:
        return len(self.moving) == 2

    def elements(self, robot: Robot) -> Elements:
        return elements(self.file, robot)

    def stretched(self, robot: Robot, *place: Any) -> Any:
        """y by the coordinates that move."""
        return eval(self.stretch, {**robot, **dict(zip(self.moving, place, strict=True))})  # noqa: S307

    def places(self, robot: Robot, start: Robot) -> list[Any]:
        """The coordinates that move, by a start."""
        if not self.second_moves:
            return [start["x1"]]
        first = [start["x1"]] if self.two else []
        return [*first, self.stretched(robot, *first, 0.0) - start["y"]]


@dataclass
class Physics:
    """M (diagonal), K, B, constant force, force per input; lists of arrays. A law that acts is in K and B if asked."""

    M: list[Any]
    K: list[list[Any]]
    B: list[list[Any]]
    force: list[Any]
    drive: list[Any]
    of: Elements

    @property
    def cubic(self) -> tuple[Any, Any, Any]:
        """s^3 + s_1 s^2 + s_2 s + s_3 of two masses with springs between them alone."""
        (m, n), ((a, k), (_, b)), ((c, d), (_, e)) = self.M, self.K, self.B
        return (
            (m * e + n * c) / (m * n),
            (m * b + n * a + c * e - d * d) / (m * n),
            (c * b + e * a - 2 * d * k) / (m * n),
        )

    @property
    def rates(self) -> list[Any]:
        """Frequency of each mass on its spring with the other one held."""
        return [np.sqrt(self.K[n][n] / self.M[n]) for n in range(len(self.M))]


def physics(model: Model, robot: Robot, lawful: bool = True) -> Physics:
    of = model.elements(robot)
    size, zero = range(len(of.moving)), 0.0 * next(iter(robot.values()))
    zero = np.zeros_like(zero)
    K, B = ([[zero for _ in size] for _ in size] for _ in range(2))
    force, drive = [zero for _ in size], [zero for _ in size]
    for parts, into in ((of.springs, K), (of.dampers, B)):
        for on, value in parts:
            by = of.along(on)
            for i in size:
                for j in size:
                    into[i][j] = into[i][j] + value * by[i] * by[j]
    for on, value in of.springs:
        for i, by in enumerate(of.along(on)):
            force[i] = force[i] - value * on.by.get("", 0.0) * by
    for name, row in of.forces:
        n = of.moving.index(name)
        force[n], drive[n] = force[n] + row.by.get("", 0.0), drive[n] + row.by.get(of.input, 0.0)
    if of.law and lawful:
        K[0][0], B[0][0] = K[0][0] + of.law[0], B[0][0] + of.law[1]
    return Physics([zero + of.coordinates[name][1] for name in of.moving], K, B, force, drive, of)


class Draw:
    """Some lanes of a model: random numbers, sizes by unit."""

    def __init__(self, model: Model, seed: int, name: str, count: int) -> None:
        self.model, self.count = model, count
        self.random = np.random.default_rng([seed, zlib.crc32(f"{model.name} {name}".encode())])
        self.base = [self.over(*ends) for ends in BASE]

    def over(self, low: Any, high: Any, zero: float = 0.0) -> Any:
        value = np.exp(self.random.uniform(np.log(low), np.log(high), self.count))
        return np.where(self.some(zero), 0.0, value)

    def either(self, low: float, high: float) -> Any:
        return self.random.choice([-1.0, 1.0], self.count) * self.over(low, high)

    def some(self, share: float) -> Any:
        return self.random.random(self.count) < share

    def size(self, unit: str) -> Any:
        powers = dimension(unit)
        assert powers is not None, unit
        return np.prod([size ** float(power) for size, power in zip(self.base, powers, strict=True)], axis=0)

    def number(self, name: str, domain: str, unit: str) -> Any:
        size, infinite = self.size(unit), np.full(self.count, np.inf)
        if name in DRIVES:
            return self.over(0.3, 5.0) * size
        return {
            "real": lambda: np.where(self.some(0.5), 0.0, self.either(0.03, 1.0) * size),
            "positive": lambda: self.over(0.1, 10.0) * size,
            "nonnegative": lambda: self.over(1e-3, 0.5, zero=0.2) * size,
            "fraction": lambda: self.random.uniform(0.0, 0.5, self.count),
            "lower": lambda: np.where(self.some(0.5), -infinite, -self.over(0.02, 1.0) * size),
            "upper": lambda: np.where(self.some(0.5), infinite, self.over(0.02, 1.0) * size),
            "bound": lambda: np.where(self.some(0.25), infinite, self.over(0.01, 3.0) * size),
        }[domain]()

    def robot(self) -> Robot:
        """Those that a solver refuses, with less friction at rest than in motion, are replaced by others."""
        drawn = {name: self.number(name, field.domain, field.unit) for name, field in self.model.fields.items()}
        pairs = [pair for both in self.model.elements(drawn).friction.values() for pair in zip(*both, strict=True)]
        fine = np.flatnonzero(
            np.all([rest + 0.0 * self.base[0] >= slides for slides, rest in pairs], axis=0) | np.zeros(self.count, bool)
        )
        lanes = np.resize(fine, self.count)
        self.base = [size[lanes] for size in self.base]
        return {name: value[lanes] for name, value in drawn.items()}

    def start(self, robot: Robot) -> tuple[Robot, Any, Any, Any, Any]:
        """Start, horizon, times and inputs of the steps, and how many there are."""
        of, model = self.model.elements(robot), self.model
        unit = of.coordinates[of.moving[0]][0]
        length, rate = self.size(unit), self.size(unit) / self.size("s")
        low, high = (np.clip(end, -length, length) for end in of.stops.get(of.moving[0], (-np.inf, np.inf)))
        x1 = np.where(
            self.some(0.8),
            self.random.uniform(low + 0 * length, high + 0 * length),
            np.where(self.some(0.5), low, high),
        )
        v1, v2 = (np.where(self.some(0.2), 0.0, self.either(0.03, 3.0) * rate) for _ in range(2))
        y = self.either(1e-3, 1.0) * self.size(of.coordinates[of.moving[-1]][0])
        if of.stands:
            y = np.where(self.some(0.5), 0.0, 0.3 * np.abs(y))
            falls = y == 0.0
            v2 = np.where(falls, -np.abs(v2) - 1e-3 * rate, v2)
            v1 = np.where(falls & (v1 < v2), 0.5 * v2, v1)
        start = {"x1": x1, "v1": v1, "v2": v2, "y": y}
        horizon = self.size("s") * self.random.uniform(5.0, 40.0, self.count)
        unit_of_u = of.coordinates[of.moving[0]][0] if of.law else of.input_unit
        u = self.random.uniform(-1.0, 1.0, (self.count, STEPS)) * (self.size(unit_of_u)[:, None] if of.input else 0.0)
        return settled(model, robot, start), horizon, *self.steps(horizon), u

    def steps(self, horizon: Any) -> tuple[Any, Any]:
        """Times of the steps of the input, and how many: one in half of the lanes."""
        t = np.sort(self.random.uniform(0.02, 0.95, (self.count, STEPS)), axis=1) * horizon[:, None]
        t[:, 0] = 0.0
        return t, np.where(self.some(0.5), 1, self.random.integers(2, STEPS + 1, self.count))


def settled(model: Model, robot: Robot, start: Robot) -> Robot:
    """The start with 0 of what does not move, and with y where that follows from x1."""
    start = dict(start)
    if not model.first_moves:
        start["x1"], start["v1"] = 0.0 * start["x1"], 0.0 * start["v1"]
    if not model.second_moves:
        start["v2"], start["y"] = 0.0 * start["v2"], model.stretched(robot, start["x1"]) + 0.0 * start["x1"]
    return start


# ---- kinds of robots ----


def steer(model: Model, robot: Robot, names: list[str], quantity: Callable[[Robot], Any], target: Any) -> Any:
    """Set the first of some parameters by which an affine quantity becomes its target; the lanes that did."""
    done = np.zeros(len(target), bool)
    for name in names:
        size = np.where(robot[name] > 0.0, robot[name], 1.0)
        one, two, three = (quantity(robot | {name: n * size}) for n in (1.0, 2.0, 3.0))
        slope = two - one
        with np.errstate(all="ignore"):
            value = (target - (one - slope)) / slope * size
            fits = (np.abs(three - two - slope) <= 1e-9 * np.abs(three)) & (slope > 1e-6 * np.abs(two)) & (value > 0.0)
        fits &= np.isfinite(value) & ~done
        robot[name] = np.where(fits, value, robot[name])
        done |= fits
    return done


def of_unit(model: Model, *units: str) -> list[str]:
    return [
        name
        for name, field in model.fields.items()
        if field.unit in units and field.domain in ("nonnegative", "positive")
    ]


def dampers(model: Model, robot: Robot, mass: int) -> list[str]:
    """Parameters that damp a mass, those that damp it alone first."""
    base, found = physics(model, robot), list[tuple[bool, str]]()
    for name in of_unit(model, *DAMPING):
        more = physics(model, robot | {name: robot[name] + 1.0})
        if (more.B[mass][mass] != base.B[mass][mass]).any():
            other = model.two and (more.B[1 - mass][1 - mass] != base.B[1 - mass][1 - mass]).any()
            found.append((bool(other), name))
    return [name for _, name in sorted(found)]


def damp(model: Model, robot: Robot, mass: int, rate: Any) -> Any:
    """Damp a mass that moves alone to b/m = rate."""
    return steer(
        model,
        robot,
        dampers(model, robot, mass),
        lambda r: physics(model, r).B[mass][mass] / physics(model, r).M[mass],
        rate,
    )


def without(model: Model, robot: Robot, *units: str) -> None:
    for name in of_unit(model, *units):
        if model.fields[name].domain == "nonnegative":
            robot[name] = 0.0 * robot[name]


def stiff(draw: Draw, robot: Robot, stiffness: float) -> None:
    """The real pole a is that many times, or up to 3 times that, faster than the frequency w of the last mass."""
    made = physics(draw.model, robot)
    slow = np.maximum(made.rates[-1], 0.1 / draw.size("s"))
    if draw.model.two:
        damp(draw.model, robot, 1, slow * draw.over(1e-4, 0.2))
        damp(draw.model, robot, 0, slow * stiffness * draw.over(1.0, 3.0))
    else:
        damp(draw.model, robot, len(made.M) - 1, slow * np.sqrt(stiffness) * draw.over(1.0, 3.0))


def overdamped(draw: Draw, robot: Robot) -> None:
    """Both masses damped beyond the aperiodic limit, as is the pair of both slipping."""
    made = physics(draw.model, robot)
    whole = np.sqrt(np.sum([rate**2 for rate in made.rates], axis=0))
    for mass in reversed(range(len(made.M))):
        damp(draw.model, robot, mass, whole * draw.over(2.1, 30.0))


def near_equal(draw: Draw, robot: Robot) -> None:
    """Two poles within 1e-12 to 1e-2: of both masses slipping, and in a third of the lanes of each mass alone."""
    model, split = draw.model, draw.over(1e-12, 1e-2) ** 2 * draw.random.choice([-1.0, 1.0], draw.count)
    alone, kept = draw.some(1.0 / 3.0), dict(robot)
    for mass, rate in enumerate(physics(model, robot).rates):
        damp(model, kept, mass, 2.0 * rate * (1.0 + split))
    if not model.two:
        robot.update(kept)
        return
    damp(model, robot, 1, physics(model, robot).rates[1] * draw.over(1e-3, 0.5))
    for name in dampers(model, robot, 0)[:1]:
        robot[name] = double_root(model, robot, name) * (1.0 + split)
    for name in robot:
        robot[name] = np.where(alone, kept[name], robot[name])


def double_root(model: Model, robot: Robot, name: str) -> Any:
    """The least damper on a grid by which two poles of the cubic are equal; where there is none, what it was."""
    wide = {key: np.asarray(value, np.longdouble) for key, value in robot.items()}
    none, one = (physics(model, wide | {name: np.full_like(wide[name], n)}) for n in (0.0, 1.0))

    def discriminant(value: Any) -> Any:
        B = [[p + value * (q - p) for p, q in zip(*rows, strict=True)] for rows in zip(none.B, one.B, strict=True)]
        a, b, c = Physics(none.M, none.K, B, none.force, none.drive, none.of).cubic
        return a * a * b * b - 4 * b**3 - 4 * a**3 * c + 18 * a * b * c - 27 * c * c

    with np.errstate(all="ignore"):
        unit = none.M[0] * none.rates[0] / (one.B[0][0] - none.B[0][0])
    low, high = np.zeros_like(unit), np.zeros_like(unit)
    grid = np.geomspace(1e-2, 1e3, 80)
    for below, above in zip(grid, grid[1:], strict=False):
        here = (high == 0.0) & (discriminant(below * unit) < 0.0) & (discriminant(above * unit) >= 0.0)
        low, high = np.where(here, below * unit, low), np.where(here, above * unit, high)
    for _ in range(64):
        middle = (low + high) / 2
        below = discriminant(middle) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    found = (high > 0.0) & np.isfinite(high)
    return np.where(found, high, wide[name]).astype(float)


def near_triple(draw: Draw, robot: Robot) -> None:
    """Three poles within 1e-8 to 1e-3: M_2 K_11 = 8 M_1 K_22, b_2 = 0, b_1/M_1 = 3 r, r^2 = 3 K_22/M_2."""
    model, near = draw.model, 1.0 + draw.over(1e-24, 1e-9) * draw.random.choice([-1.0, 0.0, 1.0], draw.count)
    without(model, robot, *DAMPING)
    if not model.two:
        near_equal(draw, robot)
        return
    made = physics(model, robot)
    inertias = [
        name for name, field in model.fields.items() if field.domain == "positive" and field.unit in ("kg", "kg m^2")
    ]
    steer(model, robot, inertias, lambda r: physics(model, r).M[1], 8.0 * made.M[0] * made.K[1][1] / made.K[0][0])
    made = physics(model, robot)
    damp(model, robot, 0, 3.0 * np.sqrt(3.0 * made.K[1][1] / made.M[1]) * near)


def loose(draw: Draw, robot: Robot) -> None:
    """Springs of no stiffness, or hardly any."""
    for name in of_unit(draw.model, *STIFFNESS):
        none = draw.some(0.5) & (draw.model.fields[name].domain == "nonnegative")
        robot[name] = np.where(none, 0.0, robot[name] * draw.over(1e-12, 1e-2))


def frictionless(draw: Draw, robot: Robot) -> None:
    """All levels of friction 0: those that a file's friction depends on."""

    def levels(changed: Robot) -> list[Any]:
        return [each for pairs in draw.model.elements(changed).friction.values() for pair in pairs for each in pair]

    ones = {name: np.ones_like(value) for name, value in robot.items()}
    for name, field in draw.model.fields.items():
        if field.domain == "nonnegative":
            moved = levels(ones | {name: 2.0 + ones[name]})
            if any(np.any(p != q) for p, q in zip(moved, levels(ones), strict=True)):
                robot[name] = 0.0 * robot[name]


def undamped(draw: Draw, robot: Robot) -> None:
    without(draw.model, robot, *DAMPING)


KINDS: dict[str, Callable[[Draw, Robot], None]] = {
    "random": lambda draw, robot: None,
    **{f"stiff {times:.0e}": partial(stiff, stiffness=times) for times in (1e3, 1e4, 1e5)},
    "overdamped": overdamped,
    "near-equal": near_equal,
    "near-triple": near_triple,
    "loose": loose,
    "frictionless": frictionless,
    "undamped": undamped,
    "thresholds": lambda draw, robot: None,
}


# ---- starts at thresholds ----


def beside(draw: Draw, value: Any, whole: Any) -> Any:
    """Numbers within 4 units in the last place; 0 of 0."""
    near, ways = value.astype(whole), draw.random.integers(-ULPS, ULPS + 1, draw.count)
    for n in range(ULPS):
        moved = np.nextafter(near, np.where(ways > 0, np.inf, -np.inf).astype(whole))
        near = np.where(np.abs(ways) > n, moved, near)
    return np.where(value != 0.0, near, 0.0).astype(float)


def at_threshold(draw: Draw, robot: Robot, start: Robot, u: Any, whole: Any) -> tuple[Robot, Robot, Any]:
    """Robot, start and first input: at rest and at a level of friction, one mass or both; at a stop; a law at its
    limit; a contact that carries nothing."""
    model, kind = draw.model, draw.random.integers(0, 6, draw.count)
    rests = {n: draw.some(0.7) for n in (1, 2)}
    start = dict(start)
    for n in (1, 2):
        start[f"v{n}"] = np.where(rests[n] & (kind < 4), 0.0, start[f"v{n}"])
    of = model.elements(robot)

    def over(mass: int, side: Any, at: Robot, u: Any) -> Any:
        wide = {name: np.asarray(value, np.longdouble) for name, value in robot.items()}
        made = physics(model, wide, lawful=False)
        q = model.places(wide, {name: np.asarray(value, np.longdouble) for name, value in at.items()})
        v = [at[f"v{n}"] for n in (1, 2) if (model.first_moves, model.second_moves)[n - 1]]
        pushed = made.drive[mass] * law(made, q, v, u)
        force = made.force[mass] + pushed - sum(made.K[mass][j] * q[j] + made.B[mass][j] * v[j] for j in range(len(q)))
        forward, backward = made.of.friction.get(model.moving[mass], (None, (0.0, 0.0)))[1]
        return side * force - np.where(side > 0, forward, backward)

    def law(made: Physics, q: Any, v: Any, u: Any) -> Any:
        if not made.of.law:
            return u
        p, d = made.of.law
        return np.clip((p * (u - q[0]) - d * v[0]) / made.drive[0], -made.of.limit, made.of.limit)

    masses = range(len(model.moving))
    for mass in masses:
        here = (kind < 2) | ((kind == 2) & (draw.some(0.5) if len(masses) == 2 else True))
        side = draw.random.choice([-1.0, 1.0], draw.count)
        speed = f"v{mass + 1}" if model.first_moves else "v2"
        placed = start | {speed: np.where(here, 0.0, start[speed])}
        knob = (
            "u" if mass == 0 and model.first_moves and of.input and not of.law else "y" if model.second_moves else "x1"
        )
        value = solved(lambda x: over(mass, side, placed | {knob: x}, x if knob == "u" else u), whole)  # noqa: B023
        fine = here & np.isfinite(value) & (np.abs(value) < 1e6) & ((value >= 0.0) | (knob != "y") | (not of.stands))
        start[speed] = np.where(fine, 0.0, start[speed])
        if knob == "u":
            u = np.where(fine, beside(draw, np.where(fine, value, 0.0), whole), u)
        else:
            start[knob] = np.where(fine, beside(draw, np.where(fine, value, 0.0), whole), start[knob])
    robot, start = at_stop(draw, robot, start, kind == 3, whole)
    if of.stands:
        touched = kind >= 4
        start["y"] = np.where(touched & (kind == 4), 0.0, start["y"])
        v2 = beside(draw, start["v1"], whole) if model.first_moves else draw.random.choice([0.0, -1e-6], draw.count)
        start["v2"] = np.where(touched & (kind == 4), v2, start["v2"])
    if of.law:
        p, d = of.law
        side = draw.random.choice([-1.0, 1.0], draw.count)
        drive = physics(model, robot, lawful=False).drive[0]
        with np.errstate(all="ignore"):
            target = start["x1"] + (d * start["v1"] + side * of.limit * drive) / p
        fine = (kind >= 4) & np.isfinite(target)
        u = np.where(fine, beside(draw, np.where(fine, target, 1.0), whole), u)
    return robot, settled(model, robot, start), u


def solved(over: Callable[[Any], Any], whole: Any) -> Any:
    """Where an affine function is zero, rounded to a precision."""
    zero, one = over(np.longdouble(0.0)), over(np.longdouble(1.0))
    with np.errstate(all="ignore"):
        slope = one - zero
        value = -zero / slope
        value = value - over(value) / slope
        usable = np.abs(slope) > 1e-9 * (np.abs(zero) + np.abs(one))
    return np.where(usable, value, np.nan).astype(whole).astype(float)


def at_stop(draw: Draw, robot: Robot, start: Robot, here: Any, whole: Any) -> tuple[Robot, Robot]:
    """A stop that is a parameter is put where the first mass is, or up to 4 ulp beyond."""
    robot, upper = dict(robot), draw.some(0.5)
    away = np.abs(beside(draw, start["x1"], whole) - start["x1"]) * draw.some(0.5)
    for name, field in draw.model.fields.items():
        if field.domain in ("lower", "upper"):
            side = 1.0 if field.domain == "upper" else -1.0
            chosen = here & (upper == (side > 0.0))
            robot[name] = np.where(chosen, start["x1"] + side * away, robot[name])
    return robot, start


# ---- all of it ----


def hopper_lanes(draw: Draw, seed: int, kind: str) -> Any:
    """The stances of tests/conformance/random_stances.py, of the kinds that it has; None of others."""
    if not draw.model.is_hopper or (kind != "random" and not kind.startswith("stiff")):
        return None
    if kind == "random":
        return random_stances.draw_stances(seed, draw.count)
    return random_stances.stiff_stances(seed, draw.count, stiffness=float(kind.split()[1]))


def problems(model: Model, kind: str, seed: int, count: int, double: bool) -> Any:
    """Random problems of a kind, with numbers of a precision."""
    draw, whole = Draw(model, seed, kind, count), np.dtype("f8" if double else "f4").type

    def rounded(values: Robot) -> Robot:
        return {name: np.asarray(value, float).astype(whole).astype(float) for name, value in values.items()}

    with np.errstate(all="ignore"):
        robot = draw.robot()
        KINDS[kind](draw, robot)
        start, horizon, t, steps, u = draw.start(robot)
        lanes = hopper_lanes(draw, seed, kind)
        if lanes is not None:
            robot |= {name: lanes[name] for name in ROBOT}
            start, horizon = {name: lanes[name] for name in START}, lanes["horizon"]
            t, steps = draw.steps(horizon)
            u = np.abs(lanes["u"])[:, None] * draw.random.uniform(-1.0, 1.0, u.shape)
            u[:, 0] = lanes["u"]
        robot, start = rounded(robot), settled(model, rounded(robot), rounded(start))
        t, u = rounded({"t": t, "u": u}).values()
        if kind == "thresholds":
            robot, start, first = at_threshold(draw, robot, start, u[:, 0], whole)
            robot, start, u[:, 0] = rounded(robot), rounded(start), first
        start = rounded(settled(model, robot, start))
    found = np.zeros(count, model.dtype)
    found["robot"] = np.stack([np.broadcast_to(robot[name], count) for name in model.fields], axis=1)
    found["start"] = np.stack([np.broadcast_to(start[name], count) for name in START], axis=1)
    found["horizon"], found["t"], found["u"], found["steps"] = rounded({"h": horizon})["h"], t, u, steps
    return found
