"""Across every case distinction of the solver, from a factor of several down to the last bit: `make scans`.

A parameter is swept through each switch-over. On both sides, and from each floating point number to the next one around
it, W'', W', W and its two integrals are compared with 50 digits, by the kernels of the engine in C and by those of the NumPy
package, and a whole stance in C, in both precisions. The error of a function is divided by its largest magnitude up to t, and by the condition number of the five
where that is above 1; that of a stance is scaled as everywhere (tests/conformance/errors.py). Writes
docs/developers/switchovers.png and docs/developers/switchovers.md.
"""

import argparse
import ctypes
import math
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

import hopform
from derive.model.precisions import F32, F64, FAR
from hopform._solver import c as native
from hopform_solver.kernels import basis_at, factor_cubic
from hopform_solver.records import Poles
from tests.conformance.errors import TOLERANCE, plain_errors, reference_for, rounded, state_error
from tests.oracle import reference

ROOT = Path(__file__).resolve().parents[2]
DTYPES = {"f64": np.float64, "f32": np.float32}
EVALUATORS = ("C", "NumPy")
"""Of the basis; whole stances are C."""
CURVES = [(by, precision) for precision in DTYPES for by in EVALUATORS]
NEIGHBOURS = 8
"""How many floating point numbers in succession are looked at on each side of a switch."""


@dataclass(frozen=True)
class Switch:
    """A case distinction of the basis: the parameter at which it is made,
    and the cubic and the time as functions of it.
    """

    name: str
    where: str
    at: Callable[[Any], float]  # of the precision
    problem: Callable[[float], tuple[float, float, float, float]]  # s_1, s_2, s_3, t
    reach: float = 2.0  # natural logarithm of the largest factor
    libraries: tuple[str, ...] = EVALUATORS


@dataclass(frozen=True)
class StanceSwitch:
    """The same for whole stances: a robot as a function of the parameter, and a start."""

    name: str
    where: str
    at: Callable[[Any], float]
    robot: Callable[[float], hopform.Robot]
    start: dict[str, float]
    reach: float = 2.0
    libraries: tuple[str, ...] = ("C",)
    reads: float | None = None  # [s] a time at which the state is read, in place of the end


@dataclass
class Scan:
    """Errors of one curve: `distance` is the parameter over that of the switch, less one."""

    distance: Any
    error: Any
    jump: float  # the largest change of the error from one floating point number to the next at the switch

    @property
    def below(self) -> float:
        return float(self.error[self.distance <= 0.0].max())

    @property
    def above(self) -> float:
        return float(self.error[self.distance >= 0.0].max())


@dataclass
class Swept:
    """A switch with its curves."""

    switch: Any
    curves: dict[tuple[str, str], Scan] = field(default_factory=dict)


# ---- the switches ----


def factors(a: float, p: float, q: float, t: float) -> tuple[float, float, float, float]:
    """The cubic (s + a)(s^2 + p s + q), and t."""
    return a + p, q + a * p, a * q, t


def over_time(a: float, p: float, q: float) -> Callable[[float], tuple[float, float, float, float]]:
    return lambda t: factors(a, p, q, t)


def constant(value: float) -> Callable[[Any], float]:
    return lambda dtype: value


def chi(a: float, p: float, q: float) -> float:
    return a * a - p * a + q


# With a = 0, as where one mass is held, W is the integral of R: what happens in the pair is seen alone.
SWITCHES = (
    Switch("series | split poles", "chi t^2 = 1, s_1 t < 4", constant(chi(1.0, 0.2, 40.0) ** -0.5),
           over_time(1.0, 0.2, 40.0)),
    Switch("close poles | split poles", "chi t^2 = 1, s_1 t > 4", constant(1.0), over_time(30.0, 61.0, 931.0)),
    Switch("series | close poles", "s_1 t = 4, chi t^2 < 1", constant(4.0 / 90.0),
           over_time(30.0, 60.0, 900.0001), 1.0),
    Switch(
        "recursion | integrals by parts", "chi = 0.05 q", constant(1.0 - math.sqrt(0.05)),
        lambda a: factors(a, 2.0, 1.0001, 10.0), 0.2,
    ),
    Switch("pair, complex: series | sine", "q t^2 = 1", constant(0.5), over_time(0.0, 1.0, 4.0)),
    Switch("pair, real: series | distinct", "fast t = 2, half t > 0.5", constant(0.2), over_time(0.0, 11.0, 10.0)),
    Switch("pair, real: series | close", "fast t = 2, half t < 0.5", constant(2.0 / 5.5),
           over_time(0.0, 10.0, 24.75), 0.5),
    Switch("pair, real: close | distinct", "half t = 0.5, fast t > 2", constant(0.5), over_time(0.0, 10.0, 24.0)),
    Switch("pair: real | complex", "p^2 = 4 q, one mass held", constant(1.0), lambda q: (2.0, q, 0.0, 3.0)),
    Switch("pair: real | complex, a third pole", "p^2 = 4 q, a = 9", constant(1.0),
           lambda q: factors(9.0, 2.0, q, 3.0)),
    Switch("decay: series | exponential", "a t = 1", constant(0.5), over_time(2.0, 1.0, 100.0)),
    Switch(
        "the most isolated root: slowest | fastest", "roots 1, 2, 3", constant(2.0),
        lambda b: (4.0 + b, 3.0 + 4.0 * b, 3.0 * b, 1.5), 0.3,
    ),
    Switch("a triple root", "(s + 30)^3", constant(1.0), lambda x: (90.0, 2700.0 * x, 27000.0, 0.1), 1.0),
    Switch("two roots and a third at nearly the same", "(s + 30)^2 (s + b)", constant(30.0),
           lambda b: (60.0 + b, 900.0 + 60.0 * b, 900.0 * b, 0.1), 1.0),
    Switch("a slow pole | none", "a from 1 down to 0 over", lambda dtype: 1e4 * float(np.finfo(dtype).tiny),
           lambda a: (0.5 + a, 4.0 + 0.5 * a, 4.0 * a, 3.0), 85.0),
    Switch("sine: another quarter turn", "omega t = 3 pi/4", constant(0.75 * math.pi / 2.0),
           over_time(0.0, 0.0, 4.0), 0.5),
    Switch("exponential: another power of two", "a t = 10.5 ln 2", constant(10.5 * math.log(2.0) / 8.0),
           over_time(8.0, 1.0, 4.0), 0.3),
    Switch("exponential | zero", "a t = 708 (f32: 87)", lambda dtype: (87.0 if dtype is np.float32 else 708.0) / 400.0,
           over_time(400.0, 1.0, 4.0), 1.0, ("C",)),
    Switch("sine | an angle without a digit", "omega t = 1e15 (f32: 1e6)",
           lambda dtype: (1e6 if dtype is np.float32 else 1e15) / 2.0, over_time(0.0, 0.0, 4.0), 1.0, ("C",)),
)  # fmt: skip

FREE = hopform.Robot(m_eff=3.0, m_s=24.0, k=800.0, L0=0.4, b1=90.0, gamma2=-65.0, f1=0.1, f2=0.1)
HELD = hopform.Robot(m_eff=1.0, m_s=1.0, k=100.0, L0=0.4, b2=20.0, x1_min=0.0, x1_max=0.0)
TWINS = hopform.Robot(m_eff=1.0, m_s=1.0, k=100.0, L0=0.4, b1=20.0, b2=20.0, gamma2=-20.0)


def like(robot: hopform.Robot, **changes: float) -> hopform.Robot:
    values = {f.name: getattr(robot, f.name) for f in robot.fields()} | changes
    return hopform.Robot(**values)


def by_damping(b1: float) -> hopform.Robot:
    """`hopper_c` with this damping of the actuator."""
    return like(hopform.load_robot("hopper_c"), b1=b1)


@cache
def turns_at(holds: Callable[[Any, Any], bool], dtype: Any) -> float:
    """The damping of the actuator of `hopper_c` from which on something holds of its plan, to the last bit of the
    precision."""
    types = native.library().types(np.dtype(dtype))
    plan = types.Plan()

    def holds_of(b1: Any) -> bool:
        known = rounded(by_damping(float(b1)), dtype)
        made = types.Robot(*(known[name] for name, *_ in types.Robot._fields_))
        native.library().call("plan_init", types, ctypes.byref(plan), ctypes.byref(made))
        return holds(plan, dtype)

    low, high = dtype(1e2), dtype(1e6)
    assert holds_of(high) and not holds_of(low)
    while np.nextafter(low, high) < high:
        middle = dtype(0.5) * (low + high)
        low, high = (low, middle) if holds_of(middle) else (middle, high)
    return float(low)


def where(holds: Callable[[Any, Any], bool]) -> Callable[[Any], float]:
    return lambda dtype: turns_at(holds, dtype)


def fades_in_a_node(plan: Any, dtype: Any) -> bool:
    return bool(dtype(plan.transition.fastest) * dtype(plan.transition.h) > dtype(0.8))


def is_apart(plan: Any, dtype: Any) -> bool:
    return bool(plan.transition.apart)


SHORT = 0.03
"""[s] A horizon in the first interval of a drop: its end is a short series, or E and Phi."""


def is_long(plan: Any, dtype: Any) -> bool:
    return bool(dtype(SHORT) > dtype(plan.transition.is_short_over))


def is_far(plan: Any, dtype: Any) -> bool:
    a, q = dtype(plan.poles[0].a), dtype(plan.poles[0].q)
    return bool(a * a > dtype(FAR.of(F32 if dtype is np.float32 else F64)) * q)


@cache
def symmetric() -> float:
    """The b1 at which the three roots of FREE with k = 500 lie evenly: there another one becomes the most isolated."""

    def lopsided(b1: float) -> float:
        s_1, s_2, s_3 = b1 / 3.0, 500.0 / 3.0 + 500.0 / 24.0, 500.0 * b1 / 72.0
        return s_3 - s_1 / 3.0 * (s_2 - 2.0 * (s_1 / 3.0) ** 2)

    low, high = 60.0, 200.0
    assert lopsided(low) * lopsided(high) < 0.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lopsided(low) * lopsided(middle) > 0.0 else (low, middle)
    return low


STANCES = (
    StanceSwitch("stance: a triple root, by its damper", "b1 = 90", constant(90.0), lambda b1: like(FREE, b1=b1),
                 {"v2": -1.3, "v1": 0.2, "u": 0.4, "horizon": 0.3}, 0.7),
    StanceSwitch("stance: a triple root, by its spring", "k = 800", constant(800.0), lambda k: like(FREE, k=k),
                 {"v2": -1.3, "v1": 0.2, "horizon": 0.3}, 0.7),
    StanceSwitch("stance: the most isolated root", "b1 at three even roots", lambda dtype: symmetric(),
                 lambda b1: like(FREE, k=500.0, b1=b1), {"v2": -1.3, "u": 0.4, "horizon": 0.3}, 0.3),
    StanceSwitch("stance: a double root", "k = 100, m_s = m_eff, b1 = b2", constant(100.0), lambda k: like(TWINS, k=k),
                 {"v2": -1.3, "v1": 0.2, "u": 0.4}, 0.7),
    StanceSwitch("stance: a locked leg, critically damped", "b2^2 = 4 k m_s", constant(20.0),
                 lambda b2: like(HELD, b2=b2), {"v2": -1.3, "horizon": 0.4}, 0.7),
    StanceSwitch("stance: short series | E and Phi", "a h = 0.8, h = pi/(4 sqrt(q))", where(fades_in_a_node),
                 by_damping, {"v2": -1.9, "v1": 0.3, "u": 2.0}),
    StanceSwitch("stance: an interval by short series | E and Phi", "a t = 1", where(is_long),
                 by_damping, {"v2": -1.9, "v1": 0.3, "u": 2.0, "horizon": SHORT}, 0.5),
    StanceSwitch("stance: a real pole | one far beyond the pair", "a^2 = 4 q", where(is_apart),
                 by_damping, {"v2": -1.9, "v1": 0.3, "u": 2.0}, 1.0),
    StanceSwitch("state late in a phase: from its start | from its end", "a^2 = 1e4 q (f32: 1e3 q)", where(is_far),
                 by_damping, {"v2": -1.9, "v1": 0.3, "u": 2.0}, 1.0, reads=0.04),
    StanceSwitch("stance: friction | none", "b1 + b2 down to 0 over", lambda dtype: 1e4 * float(np.finfo(dtype).tiny),
                 lambda b: like(hopform.load_robot("hopper_c"), b1=b, b2=b), {"v2": -1.9, "u": 2.0}, 85.0),
    StanceSwitch("stance: friction of the body | none", "b2 down to 0 over",
                 lambda dtype: 1e4 * float(np.finfo(dtype).tiny),
                 lambda b: like(hopform.load_robot("hopper_c"), b2=b), {"v2": -1.9, "u": -2.0}, 85.0),
)  # fmt: skip


# ---- truth ----

Truth = list[mpmath.mpf]


def by_series(s: tuple[Any, Any, Any], t: Any, extent: float) -> Truth:
    """W'', W', W and its two integrals by the power series of W''' = -s_1 W'' - s_2 W' - s_3 W, W''(0) = 1."""
    h, hh, hhh = s[0] * t, s[1] * t**2, s[2] * t**3
    term, once, twice, n = mpmath.mpf(1), mpmath.mpf(0), mpmath.mpf(0), 0
    sums, small = [mpmath.mpf(0)] * 5, mpmath.mpf(10) ** (-50 - int(extent))
    while n < 8 or max(abs(term), abs(once), abs(twice)) > small:
        part = term
        for order in range(5):
            sums[order] += part
            part /= n + order + 1
        n += 1
        term, once, twice = -(h * term + (hh * once + hhh * twice / max(n - 2, 1)) / max(n - 1, 1)) / n, term, once
    return [value * t**order for order, value in enumerate(sums)]


def by_roots(s: tuple[Any, Any, Any], t: Any) -> Truth:
    """The same from the roots, which must differ; for times at which the series is long."""
    roots = mpmath.polyroots([1, *s] if s[2] else [1, *s[:2]], maxsteps=500, extraprec=400)
    residues = [1 / mpmath.fprod(r - other for j, other in enumerate(roots) if j != i) for i, r in enumerate(roots)]
    grown = [mpmath.exp(r * t) for r in roots]
    shift = 0 if s[2] else 1  # the transform of R has one order less
    values = []
    for order in (2, 1, 0, -1, -2):
        power = order - shift
        if power >= 0:
            terms = [c * r**power * e for c, r, e in zip(residues, roots, grown, strict=True)]
        else:  # integrals from 0
            terms = [
                c * r**power * (e - mpmath.fsum((r * t) ** j / mpmath.factorial(j) for j in range(-power)))
                for c, r, e in zip(residues, roots, grown, strict=True)
            ]
        values.append(mpmath.re(mpmath.fsum(terms)))
    return values


def truth(s: tuple[Any, Any, Any], t: Any) -> Truth:
    """W'', W', W and its two integrals to at least 40 digits; exact inputs."""
    extent = float((s[0] + mpmath.sqrt(s[1])) * t)
    if extent < 150.0:
        with mpmath.workdps(110 + int(extent)):
            return by_series(s, t, extent)
    with mpmath.workdps(150):
        return by_roots(s, t)


def condition(s: tuple[Any, Any, Any], t: Any, here: Truth, scales: list[float]) -> float:
    """The most that a relative change of a coefficient or of the time does to a function,
    in units of its largest magnitude.
    """
    worst, step = 0.0, mpmath.mpf(10) ** -20
    for place in range(4):
        moved = [*s, t]
        if not moved[place]:
            continue
        with mpmath.workdps(60):
            moved[place] *= 1 + step
        there = truth((moved[0], moved[1], moved[2]), moved[3])
        for order, (p, q) in enumerate(zip(here, there, strict=True)):
            worst = max(worst, float(abs(p - q) / step) / scales[order])
    return worst


# ---- the solvers ----


@cache
def compiled() -> ctypes.CDLL:
    """The kernels in C, compiled as the library is."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "scan.so"
        sources = ROOT / "generated" / "c"
        subprocess.run(
            [*shlex.split(os.environ.get("CC") or "cc"), "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared",
             f"-I{sources / 'include'}", f"-I{sources / 'src'}", str(Path(__file__).with_name("switchover_kernels.c")),
             "-o", str(target), "-lm"],
            check=True,
        )  # fmt: skip
        return ctypes.CDLL(str(target))


def in_c(columns: Any, precision: str) -> Any:
    """Rows of the five functions, from s_1, s_2, s_3 and t as columns."""
    values = np.zeros((columns.shape[1], 5), columns.dtype)
    rows = [np.ascontiguousarray(column) for column in columns]
    pointers = [ctypes.c_void_p(row.ctypes.data) for row in rows]
    getattr(compiled(), f"scan_{precision}")(*pointers, ctypes.c_int(rows[0].size), ctypes.c_void_p(values.ctypes.data))
    return values


def in_numpy(columns: Any, precision: str) -> Any:
    """The same by the kernels of the NumPy package."""
    s_1, s_2, s_3, t = columns
    values = np.zeros((t.size, 5), columns.dtype)
    for held in (False, True):
        lanes = np.flatnonzero((s_3 == 0.0) == held)
        if lanes.size:
            one, two, three = s_1[lanes], s_2[lanes], s_3[lanes]
            poles = Poles(three, one, two, one, two, three) if held else factor_cubic(one, two, three)
            with np.errstate(all="ignore"):
                values[lanes] = np.stack(basis_at(poles, t[lanes]), axis=-1)
    return values


SOLVERS = {"C": in_c, "NumPy": in_numpy}


# ---- sweeps ----


def parameters(at: float, reach: float, dtype: Any, count: int) -> Any:
    """Numbers of the precision around `at`: some in succession, then `count` on each side,
    spread over the logarithm.
    """
    middle = dtype(at)
    up, down = [middle], [middle]
    for _ in range(NEIGHBOURS):
        up.append(np.nextafter(up[-1], dtype(np.inf)))
        down.append(np.nextafter(down[-1], dtype(0)))
    first = math.log10(2.0 * NEIGHBOURS * float(np.finfo(dtype).eps))
    steps = 10.0 ** np.linspace(first, math.log10(reach), count)
    far = [float(middle) * np.exp(sign * steps) for sign in (-1.0, 1.0)]
    return np.unique(np.array([*down, *up, *far[0], *far[1]], dtype=dtype))


def jump_of(at: float, values: Any, errors: Any) -> float:
    """The largest change of the signed errors between successive numbers next to the switch."""
    middle = int(np.argmin(np.abs(values - values.dtype.type(at))))
    near = errors[max(0, middle - NEIGHBOURS) : middle + NEIGHBOURS + 1]
    return float(np.abs(np.diff(near, axis=0)).max())


def distances(at: float, values: Any) -> Any:
    return (values.astype(float) - float(values.dtype.type(at))) / float(values.dtype.type(at))


def sweep_basis(switch: Switch, count: int) -> Swept:
    """The functions of the basis across a switch."""
    swept = Swept(switch)
    for precision, dtype in DTYPES.items():
        at = switch.at(dtype)
        values = parameters(at, switch.reach, dtype, count)
        if "none" in switch.name:
            values = np.concatenate([np.zeros(1, dtype), values])
        columns = np.array([switch.problem(float(value)) for value in values]).T.astype(dtype)
        shares = np.linspace(0.025, 1.0, 40)
        exact = columns.astype(float)
        tops = [np.abs(in_numpy(np.array([*exact[:3], exact[3] * share]), "f64")) for share in shares]
        scales = np.max(tops, axis=0)
        known, conditions = [], []
        for lane in range(values.size):
            s_1, s_2, s_3, t = (mpmath.mpf(float(number)) for number in columns[:, lane])
            known.append(truth((s_1, s_2, s_3), t))
            conditions.append(condition((s_1, s_2, s_3), t, known[-1], scales[lane].tolist()))
        for name in switch.libraries:
            got = SOLVERS[name](columns, precision)
            signed = np.array([
                [float(mpmath.mpf(float(v)) - exactly) for v, exactly in zip(row, is_, strict=True)]
                for row, is_ in zip(got, known, strict=True)
            ]) / scales / np.maximum(1.0, conditions)[:, np.newaxis]  # fmt: skip
            swept.curves[name, precision] = Scan(
                distances(at, values), np.abs(signed).max(axis=1), jump_of(at, values, signed)
            )
    return swept


def stance_error(switch: StanceSwitch, value: float, dtype: Any) -> float:
    """The larger error, of state and AED, of one stance; infinite where the events are others. Of a state that is read,
    the error of the state that an exact stance ends in then.
    """
    robot = switch.robot(value)
    horizon = {} if switch.reads is None else {"horizon": switch.reads}
    exact, inputs = reference_for(robot, dtype, **switch.start, **horizon)
    condition_of = cache(lambda of: max(1.0, reference.condition(rounded(robot, dtype), of=of, **inputs)))
    goes_on = {name: number for name, number in inputs.items() if name not in horizon}
    stance = hopform.solve_stance(robot, dtype=dtype, **goes_on)
    if switch.reads is None:
        same = [e.kind for e in stance.events] == [e.kind for e in exact.events] and stance.status == exact.status
        errors = plain_errors(robot, stance, exact, inputs["v2"])
    else:
        at = stance.at(inputs["horizon"])
        same = [e.kind for e in stance.events if e.time < switch.reads] == [e.kind for e in exact.events]
        errors = {"state": state_error(robot, dtype, at, exact, inputs["v2"])}
    scaled = [error if error <= TOLERANCE[dtype] else error / condition_of(of) for of, error in errors.items()]
    return max(scaled) if same else math.inf


def sweep_stances(switch: StanceSwitch, count: int) -> Swept:
    """Whole stances across a switch; the jump is that of the errors' sizes."""
    swept = Swept(switch)
    for precision, dtype in DTYPES.items():
        at = switch.at(dtype)
        values = parameters(at, switch.reach, dtype, count)
        if "none" in switch.name:
            values = np.concatenate([np.zeros(1, dtype), values])
        errors = np.array([stance_error(switch, float(value), dtype) for value in values])
        swept.curves["C", precision] = Scan(distances(at, values), errors, jump_of(at, values, errors))
    return swept


def sweep(switch: Switch | StanceSwitch, count: int) -> Swept:
    return sweep_basis(switch, count) if isinstance(switch, Switch) else sweep_stances(switch, count)


# ---- the limits ----

ULPS = 64.0
"""What a function of the basis may lose, and what may change from one number to the next: 1.4e-14 and 7.6e-6."""


def limit_of(switch: Switch | StanceSwitch, precision: str) -> float:
    """The stated accuracy: for functions ULPS units in the last place, for stances 1e-12 and 1e-5."""
    dtype = DTYPES[precision]
    return ULPS * float(np.finfo(dtype).eps) if isinstance(switch, Switch) else TOLERANCE[dtype]


def worst_of(swept: Swept, precision: str) -> tuple[float, float, float]:
    """Below, above, jump: the largest of C and NumPy."""
    scans = [scan for (_, of), scan in swept.curves.items() if of == precision]
    return max(s.below for s in scans), max(s.above for s in scans), max(s.jump for s in scans)


def beyond(swept: Swept) -> list[str]:
    """What is above the limit, in words."""
    found = []
    for precision in DTYPES:
        limit = limit_of(swept.switch, precision)
        for what, value in zip(("below", "above", "jump"), worst_of(swept, precision), strict=True):
            if not value <= limit:
                found.append(f"{swept.switch.name}, {precision}, {what}: {value:.2e} > {limit:.1e}")
    return found


# ---- picture and page ----

COLOURS = {("C", "f64"): "#1f4e79", ("NumPy", "f64"): "#6aaed6", ("C", "f32"): "#a63603", ("NumPy", "f32"): "#fdae6b"}
COLUMNS = 4
DECADES = 17.0
"""Of a distance below which all of them are drawn at the switch."""


def draw(swept: list[Swept], path: Path) -> None:
    """All curves in one picture: below the switch to the left, above it to the right, its last bits in the middle."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from tests import palette

    rows = math.ceil(len(swept) / COLUMNS)
    with rc_context({"font.size": 8, "axes.linewidth": 0.5}):
        figure = Figure(figsize=(11.0, 1.5 * rows), dpi=100, layout="constrained")
        grid = figure.subplots(rows, COLUMNS, sharey=True)
        for axes, one in zip(grid.flat, swept, strict=False):
            draw_one(axes, one)
        for axes in grid.flat[len(swept) :]:
            axes.set_axis_off()
        handles, labels = grid.flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(CURVES) + 1, frameon=False)
        figure.supxlabel("relative distance of the parameter from the switch, logarithmic on both sides", fontsize=8)
        figure.supylabel("error", fontsize=8)
        palette.save(figure, path)


def draw_one(axes: Any, one: Swept) -> None:
    for curve, scan in one.curves.items():
        place = np.sign(scan.distance) * (DECADES + np.log10(10.0**-DECADES + np.abs(scan.distance)))
        axes.semilogy(place, np.maximum(scan.error, 1e-18), color=COLOURS[curve], linewidth=0.9, label=" ".join(curve))
    axes.axvline(0.0, color="0.5", linewidth=0.6, linestyle=":")
    for precision in DTYPES:
        label = "limit" if precision == "f64" else None
        colour = COLOURS["C", precision]
        axes.axhline(limit_of(one.switch, precision), color=colour, linewidth=0.7, linestyle="--", label=label)
    low, high = axes.get_xlim()
    marked = {-17: "-1", -9: "-1e-8", 0: "0", 9: "1e-8", 17: "1"} if high < 30.0 else {0: "0", 17: "1", 47: "1e30"}
    ticks = [n for n in marked if low <= n <= high]
    axes.set_xticks(ticks, [marked[n] for n in ticks], fontsize=7)
    axes.set_ylim(1e-18, 1e-3)
    axes.set_yticks([1e-16, 1e-11, 1e-6])
    axes.set_title(f"{one.switch.name}\n{one.switch.where}", fontsize=8)


def page(swept: list[Swept], count: int) -> str:
    """The table in Markdown."""
    lines = [
        "# Across every switch-over",
        "",
        f"Written by `make scans`. A parameter is swept through each case distinction of the solver, by {count} values",
        f"on each side, from a factor of several down to the last bit, and by {NEIGHBOURS} floating point numbers in",
        "succession next to the switch. W'', W', W and its two integrals, or whole stances, are compared with 50",
        "digits, in both precisions. The error of a function is the larger one of the engine's kernels in C and of those",
        "in NumPy, `hopform_solver.kernels`. It is in units of the largest magnitude of the function up to t, divided by",
        "the condition number of the five where that is above 1. Stances are solved in C, and their error is scaled as in",
        "[accuracy](../evidence/accuracy.md). *Jump* is the largest change of the error from one number to the next at",
        f"the switch. `make test` holds limits: {ULPS:.0f} units in the last place (1.4e-14, 7.6e-6) for functions, 1e-12",
        "and 1e-5 for stances.",
        "",
        "![Error curves across each switch](switchovers.png)",
        "",
        "| switch | where | f64 below | above | jump | f32 below | above | jump |",
        "| --- | --- | --: | --: | --: | --: | --: | --: |",
    ]
    for one in swept:
        cells = [f"{value:.1e}" for precision in DTYPES for value in worst_of(one, precision)]
        name, where = (text.replace("|", "to") for text in (one.switch.name, one.switch.where))
        lines.append(f"| {name} | {where} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def swept_all(count: int, processes: int) -> Iterator[Swept]:
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(sweep_number, range(len(SWITCHES) + len(STANCES)), [count] * (len(SWITCHES) + len(STANCES)))


def sweep_number(number: int, count: int) -> Swept:
    """By number, because functions do not travel between processes; what comes back has no switch."""
    swept = sweep((*SWITCHES, *STANCES)[number], count)
    return Swept(number, swept.curves)


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    arguments.add_argument("--count", type=int, default=60, help="values on each side")
    arguments.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    arguments.add_argument("--out", type=Path, default=ROOT / "docs" / "developers")
    chosen = arguments.parse_args()
    swept, wrong = [], []
    for one in swept_all(chosen.count, chosen.processes):
        one.switch = (*SWITCHES, *STANCES)[one.switch]
        swept.append(one)
        numbers = "  ".join(f"{of} " + " ".join(f"{value:.1e}" for value in worst_of(one, of)) for of in DTYPES)
        print(f"{one.switch.name:<46} {numbers}", flush=True)
        wrong += beyond(one)
    draw(swept, chosen.out / "switchovers.png")
    (chosen.out / "switchovers.md").write_text(page(swept, chosen.count), "utf-8")
    for line in wrong:
        print(line)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
