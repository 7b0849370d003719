"""The rules of a node: what a rule says of an interval is so, judged in double precision.

node_rules.c asks each rule, in single precision, about functions that come near zero inside a node. The least value of
the function is found here, in double precision, from the rates as they are rounded. A rule that is weakened stays sound,
so the share of intervals of which it says yes is held from below, too, and the intervals of a search from above.
"""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import needs
from tests.derived import derived
from tests.objects import shared_library
from tests.oracle.checker import ROBOT

EPS = 2.0**-23
LEAST = {"f32": -0.25, "f64": -100.0}
"""[rounding bound] How far below zero a minimum may be in an interval that a rule calls free of zeros; in double
precision it is known to so many bounds itself."""
OF_QUESTION = [("w", "f8", 3), *((n, "f8") for n in ("start", "span", "sign")), ("row", "i4"), ("spare", "i4")]
ENTRIES = ("a1_y", "a1_v1", "a1_v2", "a2_y", "a2_v1", "a2_v2")
VERDICT = np.dtype(
    [*((n, "f8") for n in ("value", "end", "rate_end", "deflated_end", "pole", *ENTRIES)), ("contact", "f8", 3),
     *((n, "f8") for n in ("length", "rounding", "remainder", "root", "quiet", "least", "until")),
     *((n, "i4") for n in ("refused", "signs", "amplitude", "bernstein", "intervals", "found"))]
)  # fmt: skip
COUNT = 6000
GRID = np.linspace(0.0, 1.0, 401)
SOURCES = (Path(__file__).with_name("node_rules.c"),)
DAMPED = {
    "rings": ((1e-4, 0.8), (1e-4, 0.3)), "stiff": ((5.0, 500.0), (1e-4, 0.3)), "real": ((1.5, 30.0), (1.5, 30.0)),
    "leg": ((1e-4, 0.8), (1e-4, 0.3)),
}  # fmt: skip
"""Of both masses, in critical damping: a pair that rings, one beside a fast real pole, three real poles; a pair that
rings with a damper in the leg, too, which is in the contact force."""
SHARES = {
    "rings": {"signs": 0.8, "amplitude": 0.2, "bernstein": 0.6, "quiet": 0.05},
    "stiff": {"signs": 0.7, "amplitude": 0.15, "quiet": 0.06},
    "real": {"signs": 0.7, "amplitude": 0.15},
    "leg": {"signs": 0.8, "amplitude": 0.2, "bernstein": 0.5},
}  # fmt: skip
"""Of how many intervals a rule says yes at least."""
TOUCH = -1.0
"""[rounding bound] How far below zero a minimum may be that a search passes for a touch."""
INTERVALS = {
    ("rings", "f32"): 1.165, ("stiff", "f32"): 1.309, ("real", "f32"): 1.288, ("leg", "f32"): 1.125,
    ("rings", "f64"): 1.159,
}  # fmt: skip
"""That a search takes where it is asked for one: 0.005 more than measured, 30 of 6000."""
AHEAD = 6.0
"""[interval] So far a quiet time is followed."""


def drawn(seed: int, kind: str) -> Any:
    draw = np.random.default_rng(seed)
    fields = [*ROBOT, "b12"] if kind == "leg" else [*ROBOT]
    q = np.zeros(COUNT, np.dtype([("robot", "f8", len(fields)), *OF_QUESTION]))
    over = lambda low, high: 10.0 ** draw.uniform(np.log10(low), np.log10(high), COUNT)  # noqa: E731
    spring, mass = over(1e2, 1e5), over(0.01, 100.0)
    robot = dict.fromkeys(fields, np.zeros(COUNT)) | {
        "m_eff": mass, "m_s": np.ones(COUNT), "k": spring, "u_max": np.ones(COUNT), "gamma2": np.ones(COUNT),
        "x1_min": np.full(COUNT, -np.inf), "x1_max": np.full(COUNT, np.inf), "g": np.full(COUNT, 9.81),
        "b1": 2.0 * np.sqrt(spring * mass) * over(*DAMPED[kind][0]),
        "b2": 2.0 * np.sqrt(spring) * over(*DAMPED[kind][1]),
    }  # fmt: skip
    if kind == "leg":
        robot["b12"] = 2.0 * np.sqrt(spring * mass / (1.0 + mass)) * over(0.1, 0.9)
    q["robot"] = np.stack([robot[name] for name in fields], axis=1)
    fast = np.sqrt(spring * (1.0 + 1.0 / mass))
    q["w"] = draw.normal(size=(COUNT, 3)) * np.stack([np.ones(COUNT), fast, fast], axis=1)
    q["w"][:, 1] *= over(1e-3, 1e3) if kind == "stiff" else 1.0
    q["span"] = np.where(draw.random(COUNT) < 0.5, 1.0, over(0.02, 1.0))
    q["sign"], q["row"] = draw.choice([-1.0, 1.0], COUNT), draw.integers(0, 3, COUNT)
    some = draw.random(COUNT) < 0.5  # hardly move at first
    q["w"][some, q["row"][some]] *= over(1e-6, 1e-1)[some]
    for name in ("w", "span"):
        q[name] = q[name].astype("f4")
    return q


def asked(library: Any, q: Any) -> Any:
    v = np.zeros(len(q), VERDICT)
    library.ask(ctypes.c_void_p(q.ctypes.data), ctypes.c_int64(len(q)), ctypes.c_void_p(v.ctypes.data))
    return v


class Gains:
    """What each function has gained after shares of its interval, in double precision."""

    def __init__(self, q: Any, v: Any) -> None:
        self.matrix = matrix = np.zeros((len(q), 3, 3))
        known = v["refused"] == 0
        matrix[:, 0, 1], matrix[:, 0, 2] = 1.0, -1.0
        for n, name in enumerate(ENTRIES):
            matrix[:, 1 + n // 3, n % 3] = np.where(known, v[name], -(n + 1.0) * (n not in (2, 4)))
        self.rates, vectors = np.linalg.eig(matrix)
        shares = np.linalg.solve(vectors, q["w"][:, :, None].astype(complex))[:, :, 0]
        sign = np.where(q["row"] == 0, 1.0, q["sign"])
        self.row = np.eye(3)[q["row"]]
        contact = (q["row"] == 0) & known
        self.row[contact] = v["contact"][contact]
        self.parts = sign[:, None] * np.einsum("ni,nij->nj", self.row, vectors) * shares / self.rates
        self.length = v["length"]

    def __call__(self, share: Any) -> Any:
        t = self.length[:, None] * share
        return sum((self.parts[:, n, None] * np.expm1(self.rates[:, n, None] * t)).real for n in range(3))

    def derivative(self, order: int, share: float) -> Any:
        """A derivative, in units of the interval."""
        rates = self.rates * self.length[:, None]
        return (self.parts * rates**order * np.exp(rates * share)).sum(axis=1).real

    def at_the_end(self, pole: Any) -> Any:
        """Rates and d there, and the magnitudes that they are sums of at the start."""
        start = self.parts * self.rates
        parts = start * np.exp(self.rates * self.length[:, None])
        deflated = parts * (self.rates + pole[:, None])
        sizes = np.abs(start).sum(axis=1), (np.abs(start) * (np.abs(self.rates) + pole[:, None])).sum(axis=1)
        return (parts.sum(axis=1).real, deflated.sum(axis=1).real), sizes


def aim(q: Any, gains: Gains) -> None:
    """A quarter of the functions begin with no rate and fall as fast as the amplitude of d allows: d is about the least
    it can be, and turns where the interval is half over."""
    matrix, row = gains.matrix, gains.row
    rates = np.linalg.eigvals(matrix)
    lanes = np.arange(len(q))
    real = -rates[lanes, np.abs(rates.imag).argmin(axis=1)].real
    deflated = matrix + real[:, None, None] * np.eye(3)
    d, d_rate = (np.einsum("ni,nij->nj", row, each) for each in (deflated, matrix @ deflated))
    sign = np.where(q["row"] == 0, 1.0, q["sign"])
    stiffness = -(np.linalg.det(matrix) / np.where(real > 0.0, real, 1.0))  # q
    half = 0.39 * q["span"] * np.sqrt(np.abs(stiffness))
    w = np.cross(row, d_rate - half[:, None] * d)  # d grows until then
    w *= (-sign * np.sign((w * d).sum(axis=1)) / np.linalg.norm(w, axis=1))[:, None]
    some = (np.random.default_rng(6).random(len(q)) < 0.25) & np.isfinite(w).all(axis=1)
    q["w"][some] = w[some].astype("f4")


def least(gains: Gains) -> Any:
    """The least gain of each function inside its interval: the grid's, and then a finer one about that."""
    coarse = gains(GRID[None, :])
    middle = GRID[coarse.argmin(axis=1)][:, None]
    fine = np.clip(middle + np.linspace(-1.0, 1.0, 201)[None, :] / 400.0, 0.0, 1.0)
    return np.minimum(coarse.min(axis=1), gains(fine).min(axis=1))


@pytest.mark.parametrize(
    ("kind", "precision"),
    [("rings", "f32"), *needs.sliced(("stiff", "f32"), ("leg", "f32"), ("real", "f32"), ("rings", "f64"))],
)
def test_what_a_rule_of_a_node_says_is_so(store, kind, precision):
    double = ("-DDOUBLE",) if precision == "f64" else ()
    own = derived(store, "leg_damper", "leg_damper").folder / "c" if kind == "leg" else None
    include = [] if own is None else ["-I", str(own / "include"), "-I", str(own / "src")]
    library = ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES, *double, *include)))
    q = drawn(11, kind)
    aim(q, Gains(q, asked(library, q)))
    gains = Gains(q, asked(library, q))
    lowest = least(gains)
    draw = np.random.default_rng(5)
    scale = np.abs(gains(GRID[None, :])).max(axis=1)
    beside = draw.choice([-1.0, 1.0], COUNT) * 10.0 ** draw.uniform(np.log10(EPS), 0.0, COUNT) * scale
    q["start"] = np.maximum(-lowest + beside, 0.0).astype("f4")
    v = asked(library, q)
    known = v["refused"] == 0
    if kind in ("rings", "leg") and precision == "f32":
        off = np.abs(v["end"] - v["value"] - gains(np.ones((1, 1)))[:, 0]) / v["rounding"]
        assert off[known].max() < 0.5, "a function gains what its row says"
        for name, exact, size in zip(("rate_end", "deflated_end"), *gains.at_the_end(v["pole"]), strict=True):
            far = (np.abs(v[name] - exact) / size)[known]
            usual = float(np.quantile(far, 0.9))  # of some, parts of two masses cancel
            assert usual < 16.0 * EPS, (name, usual / EPS)
    asked_of = known & (v["end"] >= 0.0)
    assert known.all() and asked_of.mean() > 0.69, "few end below zero, and none is left out"
    depth = (v["value"] + lowest) / v["rounding"]
    for rule in ("signs", "amplitude", "bernstein"):
        says = (asked_of if rule == "signs" else v["refused"] == 0) & (v[rule] != 0)  # signs alone need the end
        inside = np.minimum(depth[says], np.minimum(v["value"], v["end"])[says] / v["rounding"][says])
        assert says.sum() > SHARES[kind].get(rule, -1.0) * asked_of.sum(), (rule, says.sum(), asked_of.sum())
        assert not says.any() or inside.min() > LEAST[precision], (
            f"{rule} says so of {says.sum()}: a minimum {inside.min():.2f} bounds below zero"
        )
    quiet = asked_of & (v["quiet"] > 0.0)
    length = np.where(v["length"] > 0.0, v["length"], 1.0)
    until = np.where(quiet, np.minimum(v["quiet"] / length, AHEAD), 0.0)
    inside = (v["value"] + gains(GRID[None, :] * until[:, None]).min(axis=1))[quiet] / v["rounding"][quiet]
    assert quiet.sum() >= SHARES[kind].get("quiet", 0.0) * asked_of.sum(), (quiet.sum(), asked_of.sum())
    assert not quiet.any() or inside.min() > LEAST[precision], f"a root {inside.min():.2f} bounds below zero is quiet"
    turns = asked_of & (v["least"] >= 0.0)
    there = gains((np.maximum(v["least"], 0.0) / length)[:, None])[:, 0]
    assert turns.sum() > 0.1 * asked_of.sum(), turns.sum()
    assert ((there - lowest)[turns] / v["rounding"][turns]).max() < -LEAST[precision], (
        "a minimum is located where g is least"
    )
    share = (v["until"] / v["length"])[:, None]
    inside = (v["value"] + gains(GRID[None, ::4] * share).min(axis=1)) / v["rounding"]
    assert inside.min() > min(LEAST[precision], TOUCH), f"a search passes a root {inside.min():.2f} bounds below zero"
    assert v["found"][v["end"] < -2.0 * v["rounding"]].all(), "what ends below zero has a root"
    assert v["intervals"].mean() <= INTERVALS[kind, precision], f"{v['intervals'].mean():.4f} intervals a search"
    falls = (v["refused"] == 0) & (v["end"] < -v["rounding"]) & (v["signs"] != 0)
    values = v["value"][falls, None] + gains(GRID[None, :])[falls]
    once = (np.diff(np.sign(values + v["rounding"][falls, None]), axis=1) != 0).sum(axis=1)
    assert falls.sum() > 100 and (once <= 1 + (v["value"][falls] == 0.0)).all(), "what ends below zero has one root"


def test_a_function_is_as_near_to_its_quintic_as_the_remainder_says(store):
    library = ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES)))
    q = drawn(12, "rings")
    v = asked(library, q)
    gains, t = Gains(q, v), GRID[None, :]
    ends = np.stack([np.zeros(COUNT), gains(np.array([[1.0]]))[:, 0],
                     *(gains.derivative(order, end) for order in (1, 2) for end in (0.0, 1.0))], axis=1)  # fmt: skip
    s = 1.0 - t
    start = [lambda t, s: s**3 * (1.0 + 3.0 * t + 6.0 * t**2), lambda t, s: s**3 * t * (1.0 + 3.0 * t),
             lambda t, s: 0.5 * s**3 * t**2]  # fmt: skip
    at_ends = [f(*by) * side for f in start for by, side in (((t, s), 1.0), ((s, t), 1.0))]
    at_ends[3] = -at_ends[3]
    quintic = sum(ends[:, n, None] * at_ends[n] for n in range(6))
    far = np.abs(gains(t) - quintic).max(axis=1)
    known = (v["refused"] == 0) & (far > 1e-12 * np.abs(ends).max(axis=1))
    share = far[known] / v["remainder"][known]
    assert known.sum() > COUNT // 2 and 0.9 < share.max() <= 1.0, f"{share.max():.4f} of the remainder"


def test_a_root_just_behind_the_start_has_its_digits_and_no_bound_outgrows_a_short_time(store):
    """The function begins at zero, with no rate, and turns: c t^2/2 - t^3/6 leads far beyond its root at first."""
    library = ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES)))
    q = drawn(13, "rings")
    q["span"] = 1.0
    matrix, v = Gains(q, asked(library, q)).matrix, asked(library, q)
    lanes, sign = np.arange(COUNT), np.where(q["row"] == 0, 1.0, q["sign"])
    rows = np.stack([np.eye(3)[q["row"]], matrix[lanes, q["row"]], (matrix @ matrix)[lanes, q["row"]]], axis=1)
    soon = v["length"] * 10.0 ** np.random.default_rng(3).uniform(-2.0, -0.5, COUNT)
    goes = sign[:, None] * np.stack([np.zeros(COUNT), soon / 3.0, -np.ones(COUNT)], axis=1)
    known = (v["refused"] == 0) & (np.abs(np.linalg.det(rows)) > 0.0)
    q["w"][known] = np.linalg.solve(rows[known], goes[known, :, None])[:, :, 0]
    q["w"][lanes, q["row"]] = 0.0
    q["w"], q["start"] = q["w"].astype("f4"), 0.0
    v = asked(library, q)
    found = known & (v["root"] >= 0.0)
    assert found.sum() > COUNT // 2
    gains = Gains(q, v)
    share = np.clip(v["root"] / np.where(v["length"] > 0.0, v["length"], 1.0), 0.0, 1.0)[:, None]
    reach = np.abs(gains(share * np.linspace(0.0, 1.0, 21)[None, :])).max(axis=1)
    off = np.abs(gains(share)[:, 0])[found] / np.maximum(reach, 1e-30)[found]
    assert np.quantile(off, 0.99) < 1e-3, f"{np.quantile(off, 0.99):.2g} of what it has risen to"
    q["span"], q["start"] = 0.01, 0.0
    v, short = asked(library, q), 0.01 * v["length"]
    by_others = np.abs(rows[:, 1] * q["w"]).sum(axis=1) + v["length"] / 0.01 * np.abs(rows[:, 2] * q["w"]).sum(axis=1)
    terms = by_others * short**2 + short * np.abs(v["rate_end"])
    more = v["rounding"][found] / (16.0 * EPS * terms[found])
    assert more.max() < 4.0, f"{more.max():.3g} of its terms"


PASSIVE = {
    "m_eff": 1.46, "m_s": 0.194, "k": 348_000.0, "b2": 358.5, "f2": 0.594, "gamma2": -6.14, "g": 9.81, "u_max": 3.0,
    "x1_min": -np.inf, "x1_max": np.inf,
}  # fmt: skip
"""An actuator without friction: without a current both masses settle to one velocity, and the leg to no stretch."""
HORIZON = 3


def spent(library: Any, horizon: float, again: tuple[float, float] = (1e6, 2e6)) -> list[int]:
    """Intervals, evaluations and ending of a stance without a current, which is set again at two times."""
    fields, found = np.array([float(PASSIVE.get(name, 0.0)) for name in ROBOT]), np.zeros(3, "i8")
    number = [ctypes.c_double(each) for each in (0.6376, -0.324, horizon)]
    times = np.array(again)
    library.spend(
        *(ctypes.c_void_p(fields.ctypes.data), *number), *(ctypes.c_void_p(each.ctypes.data) for each in (times, found))
    )
    return found.tolist()


@pytest.mark.parametrize("flags", [(), ("-DDOUBLE",)])
def test_an_interval_costs_an_evaluation(store, flags):
    """So a cap on evaluations bounds the time of a stance."""
    intervals, evaluations, ending = spent(ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES, *flags))), 2.0)
    assert ending == HORIZON and 20 < intervals <= evaluations


@pytest.mark.parametrize("flags", [(), ("-DDOUBLE",)])
def test_what_fades_to_zero_slower_than_it_rings_needs_no_intervals(store, flags):
    """However long the stance is, the leg stays pressed: the stretch fades to zero from above."""
    library = ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES, *flags)))
    found = [spent(library, horizon) for horizon in (0.2, 2.0, 2000.0)]
    assert all(ending == HORIZON for _, _, ending in found)
    assert found[0][0] < 60 and found[2][0] == found[1][0] == found[0][0], found


@pytest.mark.parametrize("flags", [(), ("-DDOUBLE",)])
def test_a_step_that_changes_no_force_leaves_the_rates_of_what_has_faded(store, flags):
    """By then v_1 - v_2 has no digits in the state: by it the leg would take off."""
    library = ctypes.CDLL(str(shared_library(store, "node_rules", SOURCES, *flags)))
    for first in (0.08, 0.1, 0.1149, 0.13):
        assert spent(library, 2.0, (first, first + 0.06))[2] == HORIZON, first
