"""The printed engine beside the compiled one: each call of both, and every bit of what comes out.

Memory of a call is made of the table of structs, once with ctypes and once of the printed classes.
"""

import ctypes
import math
import random
import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hopform._solver import c
from hopform._solver.package import COLUMNS, ROWS
from hopform_solver import engine_f32, engine_f64
from hopform_solver.records import LegState

ENGINES = {"f32": engine_f32, "f64": engine_f64}
REAL = {"f32": np.float32, "f64": float}
CAPACITY, AXES = 65, len(LegState._fields)


def numbers(memory: Any) -> Iterator[Any]:
    """The numbers in a struct, an object or an array of such; not what lies behind a pointer."""
    if isinstance(memory, ctypes.Structure):
        for name, kind in memory._fields_:
            yield from numbers(getattr(memory, name)) if kind is not ctypes.c_void_p else ()
    elif hasattr(memory, "SIZE"):
        for name in (name for kind in reversed(type(memory).__mro__) for name in getattr(kind, "__slots__", ())):
            yield from numbers(getattr(memory, name)) if name != "plan" else ()
    elif isinstance(memory, (ctypes.Array, list, tuple)):
        for each in memory:
            yield from numbers(each)
    else:
        yield memory


def bits(memory: Any) -> list[Any]:
    """Whole numbers, and of the others their bits; a NaN's are fixed by no rule."""
    return [
        "nan" if math.isnan(x) else struct.pack("d", x) if isinstance(x, (float, np.floating)) else int(x)
        for x in numbers(memory)
    ]


class Both:
    """The calls of one robot in one precision; `differ` has the names of those whose answers are not the same."""

    def __init__(self, suffix: str, robot: Sequence[float]) -> None:
        self.types = c.library().types(np.dtype({"f32": np.float32, "f64": np.float64}[suffix]))
        self.engine, self.real = ENGINES[suffix], REAL[suffix]
        self.differ: list[str] = []
        self.plan = self.made("Plan")
        self.status = self.call("plan_init", self.plan, self.made("Robot", *robot))

    def made(self, name: str, *values: float) -> tuple[Any, Any]:
        """A struct of a name, in C and in Python."""
        inner = getattr(self.types, name)(*values)
        return inner, getattr(self.engine, name)(*map(self.real, values))

    def many(self, name: str, count: int, *rows: Sequence[float]) -> tuple[Any, Any]:
        ours = [getattr(self.engine, name)(*map(self.real, row)) for row in rows]
        ours += [getattr(self.engine, name)() for _ in range(count - len(rows))]
        kind = getattr(self.types, name)
        return (kind * count)(*(kind(*row) for row in rows)), ours

    def reals(self, *values: float, count: int = 0) -> tuple[Any, Any]:
        array = (self.types.real * max(count, len(values)))(*values)
        return array, [self.real(x) for x in array]

    def call(self, name: str, *arguments: Any) -> int:
        """The status of a function; whatever it was given must hold the same afterwards."""
        both = [each if isinstance(each, tuple) else (each, each) for each in arguments]
        compiled = [
            self.types.real(self.real(each)) if isinstance(each, float)
            else ctypes.byref(each) if isinstance(each, ctypes.Structure) else each
            for each, _ in both
        ]  # fmt: skip
        status: int = self.types.library.function(name, self.types)(*compiled)
        with np.errstate(all="ignore"):
            printed = getattr(self.engine, name)(*(self.real(x) if isinstance(x, float) else x for _, x in both))
        same = all(bits(one) == bits(other) for one, other in both if hasattr(other, "SIZE") or isinstance(other, list))
        if status != printed or not same:
            self.differ.append(name)
        return status

    def solve(self, start: Sequence[float], steps: Sequence[Any], horizon: float, most: int, capacity: int) -> int:
        """A stance, which `read` reads."""
        self.phases, self.stance = self.many("Phase", CAPACITY), self.made("Stance")
        self.steps = self.many("Step", len(steps), *steps)
        return self.call(
            "solve_stance", self.plan, self.made("State", *start), self.steps, len(steps), horizon, most, self.phases,
            capacity, self.stance,
        )  # fmt: skip

    def read(self, shares: Sequence[float]) -> None:
        """All readings of the stance, at shares of its duration."""
        of = self.plan, self.steps, self.phases, self.stance
        duration, count = float(self.stance[0].duration), len(shares)
        times = self.reals(*(self.real(share) * self.real(duration) for share in shares))
        for t in times[0]:
            self.call("stance_at", *of, float(t), self.made("State"))
        self.call("stance_states", *of, times, count, *self.columns(count))
        energies = self.many("Energy", count), self.many("Ledger", count), self.reals(count=count)
        self.call("stance_energy", *of, times, count, *energies)
        self.call("stance_sensitivities", *of, self.reals(count=len(ROWS) * len(COLUMNS)))
        tangents = self.many("State", count), self.reals(count=count * AXES * len(COLUMNS))
        self.call("stance_tangents", *of, times, count, *tangents)
        self.call("stance_compression", *of, self.reals(count=1))
        for grid in (5, 150):
            self.call("stance_grid", *of, 0.0, duration / grid, grid, *self.columns(grid))

    def columns(self, count: int) -> list[tuple[Any, Any]]:
        made = [self.reals(count=count) for _ in range(AXES)]
        self.kept = made
        addresses = (ctypes.c_void_p * AXES)(*(ctypes.addressof(column) for column, _ in made))
        return [(_Columns(addresses, [column for column, _ in made]), [column for _, column in made])]

    def fly(self, start: Sequence[float], ground: float, gains: Any, horizon: float, most: int, capacity: int) -> None:
        """A flight, and its readings."""
        phases, flight = self.many("FlightPhase", CAPACITY), self.made("Flight")
        law = None if gains is None else self.made("Gains", *gains)
        asked = self.made("State", *start), ground, law, horizon, most
        if self.call("solve_flight", self.plan, *asked, phases, capacity, flight) != 0:
            return
        duration = float(flight[0].duration)
        times = self.reals(0.0, duration / 3, duration)
        self.call("flight_at", self.plan, phases, flight, times, 3, self.many("State", 3))
        energies = self.many("Energy", 3), self.many("FlightLedger", 3), self.reals(count=3)
        self.call("flight_energy", self.plan, phases, flight, times, 3, *energies)

    def choose(
        self, start: Sequence[float], target: Sequence[float], capacity: int, steps: int = 4096, near: float = 0.0
    ) -> None:
        """A command, one candidate after the other; then some trials."""
        search, phases, command = self.made("Search"), self.many("Phase", CAPACITY), self.made("Command")
        begin = self.plan, self.made("State", *start), self.made("Target", *target)
        status = self.call("choose_current_begin", search, *begin, command)
        self.call("choose_current_near", search, near)
        for _ in range(steps):
            if status != self.engine.SEARCHING:
                break
            status = self.call("choose_current_step", search, phases, capacity, command)
        u = float(self.plan[0].robot.u_max)
        tried = self.many("State", 1, start), 1, self.reals(0.0, u, -0.5 * u), 3, float(target[3])
        self.call("try_currents", self.plan, *tried, phases, capacity, self.many("Trial", 3))
        self.call("design_return", self.plan, 0.1, self.made("Gains"))


class _Columns(list[Any]):
    """The columns that a function of C puts numbers into, and their addresses for it."""

    def __init__(self, addresses: Any, columns: list[Any]) -> None:
        super().__init__(columns)
        self._as_parameter_ = addresses


# ---- random robots, and what fuzzing has found ----


def spread(draw: random.Random, low: float, high: float) -> float:
    return low * (high / low) ** draw.random()


def drawn(draw: random.Random, suffix: str) -> Both:
    """A robot, any stance of it with its readings, the flight behind it, and now and then a command."""

    def maybe(value: float, none: float = 0.15) -> float:
        return 0.0 if draw.random() < none else value

    def current() -> float:
        return draw.uniform(-1.0, 1.0) * u_max

    m_s, k, u_max = spread(draw, 0.1, 10.0), spread(draw, 1e2, 1e5), spread(draw, 0.5, 20.0)
    damping = m_s * math.sqrt(k / m_s)
    x1_min, x1_max = draw.choice([(-0.01, 0.08), (-0.01, 0.08), (0.0, 0.08), (0.0, 0.0), (-1e30, 1e30)])
    robot = (
        m_s * spread(draw, 1e-2, 1e2), m_s, k, 0.4, maybe(draw.uniform(-0.01, 0.01), 0.5),
        maybe(damping * spread(draw, 1e-3, 30.0)), maybe(damping * spread(draw, 1e-3, 3.0)),
        maybe(spread(draw, 1e-2, 10.0)), maybe(spread(draw, 1e-2, 3.0)), -spread(draw, 1.0, 100.0), maybe(9.81, 0.03),
        x1_min, x1_max, u_max, draw.choice([0.0, 0.05, 0.3]), maybe(spread(draw, 1e-3, 5.0), 0.6),
        maybe(spread(draw, 1e-3, 3.0), 0.6),
    )  # fmt: skip
    both = Both(suffix, robot)
    low, high = max(x1_min, -0.1), min(x1_max, 0.1)
    x1, v1 = draw.choice([low, high, draw.uniform(low, high)]), draw.choice([0.0, draw.uniform(-1.0, 1.0)])
    v2 = -spread(draw, 0.05, 4.0) * draw.choice([1.0, 1.0, 1.0, -1.0])
    steps = [(0.0, current())]
    for _ in range(draw.choice([0, 0, 1, 3])):
        steps.append((steps[-1][0] + spread(draw, 1e-3, 0.2), current()))
    y = draw.choice([0.0, 0.0, 0.0, draw.uniform(0.0, 0.02)])
    most = draw.choice([4096, 4096, 5])
    if both.solve((x1, v1, v2, y), steps, draw.choice([2.0, 0.1, 10.0]), most, CAPACITY - 1) == 0:
        both.read([*sorted(draw.random() for _ in range(4)), 1.0])
        end = [float(x) for x in numbers(both.stance[0].end)]
        gains = draw.choice([None, (spread(draw, 10.0, 1e4), spread(draw, 1.0, 1e3))])
        both.fly(end, draw.uniform(-0.05, 0.05), gains, draw.choice([2.0, 0.2]), 64, CAPACITY)
        if draw.random() < 0.2:
            both.choose((x1, v1, -abs(v2), 0.0), (spread(draw, 1e-3, 0.5), 0.0, draw.choice([0.0, 1e-3]), 2.0), 64,
                        near=draw.uniform(-4.0, 4.0))  # fmt: skip
    return both


class Source:
    """The bytes of a finding as numbers, as tests/fuzz/source.h reads them."""

    def __init__(self, data: bytes, suffix: str) -> None:
        self.data, self.format = data, "f" if suffix == "f32" else "d"
        self.kind = self.byte()
        self.sensible = bool(self.kind & 1)

    def byte(self) -> int:
        first, self.data = self.data[:1], self.data[1:]
        return first[0] if first else 0

    def real(self, sensible: bool, positive: bool = False) -> float:
        if sensible:
            size = self.byte()
            if size < 16 and not positive:
                return 0.0
            return (-1.0 if size % 2 and not positive else 1.0) * 10.0 ** ((size // 2 - 64) / 16.0)
        taken: float = struct.unpack(self.format, bytes(self.byte() for _ in range(struct.calcsize(self.format))))[0]
        return taken

    def robot(self, names: Sequence[str]) -> list[float]:
        fields = dict.fromkeys(names, 0.0)
        for n, name in enumerate(names if self.kind & 128 else names[:-2]):
            fields[name] = self.real(self.sensible, n < 3)
        if self.sensible:
            fields |= {name: abs(fields[name]) for name in ("b1", "b2", "f1", "f2", "g", "u_max", *names[-2:])}
            free = bool(self.kind & 2)
            fields |= {"x1_min": -math.inf if free else -abs(fields["x1_min"])}
            fields |= {"x1_max": math.inf if free else abs(fields["x1_max"]), "impact_loss": 0.0}
        return list(fields.values())

    def start(self) -> list[float]:
        x1 = 0.0 if self.sensible else self.real(False)
        v1, v2 = self.real(self.sensible), self.real(self.sensible)
        return [x1, v1, v2, 0.0 if self.sensible and self.kind & 4 else self.real(self.sensible, self.sensible)]


def bounded(horizon: float, robot: Sequence[float], half_periods: float) -> float:
    """At most so many half periods of the stiffest oscillation."""
    m_eff, m_s, k = robot[:3]
    with np.errstate(all="ignore"):
        rate = math.sqrt(max(float(np.float64(k) / m_eff + np.float64(k) / m_s), 0.0))
    most = half_periods * math.pi / rate if rate > 0 else 1e30
    return most if math.isfinite(horizon) and horizon > most > 0 else horizon


def found(data: bytes, suffix: str) -> Iterator[Both]:
    """What was found, as each of the programs that look for more reads it."""
    names = [name for name, *_ in c.library().types(np.dtype("f8")).Robot._fields_]
    for reads in ("stance", "flight", "control"):
        source = Source(data, suffix)
        sensible, robot = source.sensible, source.robot(names)
        both = Both(suffix, robot)
        yield both
        start = source.start()
        if reads == "stance" and both.status == 0:
            steps = [(0.0, source.real(sensible)), (source.real(sensible, True), source.real(sensible))]
            most = 1 + source.byte() % 64
            capacity = source.byte() % 64 if source.kind & 16 else CAPACITY
            horizon = bounded(source.real(sensible, True), robot, 300.0)
            if both.solve(start, steps[: 2 if source.kind & 8 else 1], horizon, most, capacity) >= 0:
                both.read((1 / 3, 1.0))
        elif reads == "flight" and both.status == 0:
            gains = source.real(sensible, True), source.real(sensible, True)
            most = 1 + source.byte() % 64
            capacity = source.byte() % 64 if source.kind & 16 else CAPACITY
            both.fly(start, 0.0, None if source.kind & 8 else gains, source.real(sensible, True), most, capacity)
        elif reads == "control":
            target = [source.real(sensible, True), 0.0 if source.kind & 8 else source.real(sensible)]
            target += [0.0 if source.kind & 16 else source.real(sensible, True), source.real(sensible, True)]
            target[3] = bounded(target[3], robot, 30.0) if both.status == 0 else target[3]
            both.choose(start, target, 1 + source.byte() % 64, source.byte() % 4)
