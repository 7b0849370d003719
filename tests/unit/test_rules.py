"""Rules 3 and 4 of the certificate, and how often a rate vanishes between two times: what they say is so, in 113 bits.

docs/explanation/certificate.md has the rules and what is claimed. rules.c asks them about motions of drawn poles, and
judges the answers: the propagator and the proof that a function stays above a value are none of the engine's. A rule
that is weakened stays sound, so what it costs and how often it says yes is held, too. The rules of a node are asked by
test_node_rules.py.
"""

import ctypes
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from tests import needs
from tests.conformance.firmware.targets import ROOT
from tests.objects import shared_library

ROUNDING = 21.0
"""[eps of its terms] A function may be less by so much than where its minimum is located."""
STIFFEST = 1.0
"""[1/sqrt(eps)] The page's limit of a/w, the real pole over the frequency of the pair: 2.9e3 (float32), 6.7e7."""
REST = 16.0
"""[eps] How far the numbers of a mass may be off whose time to rest is the computed one exactly."""

EPS = {"SINGLE": 2.0**-23, "DOUBLE": 2.0**-52}
DRAWN = np.dtype([(name, "f8") for name in ("a", "p", "q", "H3", "H2", "low", "length", "place")])
SAID = np.dtype([(name, "i4") for name in ("asked", "says", "wrong")])
TURNING = np.dtype([("a", "f8"), ("p", "f8"), ("q", "f8"), ("zeros", "f8", 2), ("length", "f8")])
SLIPPING = np.dtype([(name, "f8") for name in ("p", "q", "v", "acceleration")])
SOURCES = (
    Path(__file__).with_name("rules.c"),
    *(ROOT / "tests/oracle/checker" / f"{n}.c" for n in ("poles", "bounds")),
)

Column = np.ndarray[Any, Any]
Poles = tuple[Column, Column, Column]
COUNT = 250


class Draw:
    """Columns of random numbers."""

    def __init__(self, seed: int, count: int) -> None:
        self.rng, self.count = np.random.default_rng(seed), count

    def over(self, low: float, high: float) -> Column:
        """Spread evenly over the decades between two numbers."""
        return np.asarray(10.0 ** self.rng.uniform(math.log10(low), math.log10(high), self.count))

    def sign(self) -> Column:
        return self.rng.choice([-1.0, 1.0], self.count)

    def some(self, share: float) -> Column:
        return np.asarray(self.rng.random(self.count) < share)

    def near_one(self, closest: float) -> Column:
        return 1.0 + self.sign() * self.over(closest, 0.3)


def pair(mu: Column, w: Column) -> tuple[Column, Column]:
    """p and q of a pair of the decay mu and the frequency w."""
    return 2.0 * mu, mu**2 + w**2


def ringing(draw: Draw, eps: float, most: float = 1.0, least: float = 1e-3) -> Poles:
    w = draw.over(1.0, 100.0)
    return w * draw.over(least, most), *pair(w * draw.over(1e-4, 10.0), w)


def stiff(draw: Draw, eps: float) -> Poles:
    return ringing(draw, eps, STIFFEST / math.sqrt(eps), 1.0)


def three_real(draw: Draw, eps: float) -> Poles:
    one = draw.over(1.0, 100.0)
    two, three = one * draw.over(1e-3, 1e3), one * draw.over(1e-3, 1e3)
    return one, two + three, two * three


def stiff_and_real(draw: Draw, eps: float) -> Poles:
    one = draw.over(1.0, 100.0)
    two, three = one * draw.over(1e2, 1.0 / math.sqrt(eps)), one * draw.over(1.0, 10.0)
    return one, two + three, two * three


def near_equal(draw: Draw, eps: float) -> Poles:
    """Double, triple, and nearly so, the distances down to the last digit."""
    one = draw.over(1.0, 100.0)
    alone = np.where(draw.some(0.4), 1.0, draw.over(1e-2, 1e2))
    return one * alone * draw.near_one(eps), 2.0 * one * draw.near_one(eps), one**2 * draw.near_one(eps)


def one_held(draw: Draw, eps: float) -> Poles:
    w = draw.over(1.0, 100.0)
    return 0.0 * w, 2.0 * w * draw.over(1e-4, 100.0), w**2


KINDS: dict[str, Callable[[Draw, float], Poles]] = {
    each.__name__: each for each in (ringing, stiff, three_real, stiff_and_real, near_equal, one_held)
}


def intervals(kind: str, eps: float, late: bool) -> Column:
    """Intervals from the start of a phase or, late, from 0.1 to 30 nodes on, when much has faded."""
    draw = Draw(1 + sorted(KINDS).index(kind), COUNT)
    cases = np.zeros(COUNT, DRAWN)
    _, _, q = cases["a"], cases["p"], cases["q"] = KINDS[kind](draw, eps)
    w = np.sqrt(q)
    cases["H3"] = draw.sign() * draw.over(1e-3, 1.0) * w * ~draw.some(0.2)
    cases["H2"] = draw.sign() * draw.over(1e-3, 1e3) * w**2
    cases["low"] = draw.over(0.1, 30.0) * late
    cases["length"] = np.where(draw.some(0.4), 1.0, draw.over(0.02, 1.0))
    cases["place"] = draw.rng.uniform(0.02, 0.98, COUNT)
    return cases


@pytest.fixture(scope="module", params=needs.the_first([*EPS], 0))
def precision(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def rules(store: Path, precision: str) -> Any:
    return ctypes.CDLL(str(shared_library(store, "rules", SOURCES, f"-D{precision}", "-Wall", "-Wextra", "-Werror")))


MOST = {"SINGLE": 1.760, "DOUBLE": 2.945}
"""Evaluations that a minimum takes: 0.003 more than measured, which is room for the last digit of a draw."""


def judged(rules: Any, precision: str, kind: str, rounding: float = ROUNDING) -> Column:
    """Verdicts on the minima that are there, of poles of a kind, at the start of a phase and late in it."""
    cases = np.concatenate([intervals(kind, EPS[precision], late) for late in (False, True)])
    said = np.zeros(cases.size, SAID)
    rules.judge_minimum(
        ctypes.c_void_p(cases.ctypes.data), ctypes.c_int32(cases.size), ctypes.c_double(rounding),
        ctypes.c_void_p(said.ctypes.data),
    )  # fmt: skip
    return np.asarray(said[said["asked"] == 1])


def test_a_function_is_least_where_rule_4_locates_its_minimum(rules: Any, precision: str) -> None:
    """In no more evaluations than measured; three in five of the functions have one."""
    verdicts = {kind: judged(rules, precision, kind) for kind in KINDS}
    wrong = {kind: int(said["wrong"].sum()) for kind, said in verdicts.items()}
    assert not any(wrong.values()), wrong
    taken = np.concatenate([said["says"] for said in verdicts.values()])
    assert taken.size > 0.6 * 2 * COUNT * len(KINDS)
    assert taken.mean() <= MOST[precision], taken.mean()


def test_the_judge_sees_a_minimum_that_is_off_by_rounding(rules: Any, precision: str) -> None:
    """It can fail: without a rounding bound there are functions that are less elsewhere."""
    assert judged(rules, precision, "ringing", rounding=0.0)["wrong"].any()


def test_the_propagator_of_the_judge_is_that_of_the_matrix_exponential(rules: Any) -> None:
    """To 1e-26 of its largest value so far, at 60 digits; W is the last column of the companion matrix's."""
    for a, p, q, t in ((0.0, 0.2, 4.0, 3.0), (1e7, 0.3, 2.0, 1.5), (2.0, 4.0, 4.0, 2.5), (1e-3, 50.0, 90.0, 4.0)):
        parts = ((ctypes.c_double * 2) * 4)()
        rules.propagator(*(ctypes.c_double(number) for number in (a, p, q, t)), parts)
        with mpmath.workdps(60):
            a_, p_, q_ = map(mpmath.mpf, (a, p, q))
            m = mpmath.matrix([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, -a_ * q_, -q_ - a_ * p_, -a_ - p_]])
            column = mpmath.expm(m * mpmath.mpf(t))[:, 3]
            for (high, low), exact in zip(parts, reversed(column), strict=True):
                assert abs(mpmath.mpf(high) + mpmath.mpf(low) - exact) <= mpmath.mpf("1e-26") * abs(exact)


def test_a_mass_that_slips_alone_rests_when_rule_3_says_so(rules: Any, precision: str) -> None:
    """And never where it says that. A hundredth below critical damping and less nothing is left of the velocity when
    it comes to zero, for a judge in 113 bits."""
    draw = Draw(11, 4 * COUNT)
    w = draw.over(1.0, 100.0)
    beside = 1.0 + np.where(draw.some(0.5), -draw.over(1e-2, 0.3), draw.over(1e-6, 0.3))
    cases, said = np.zeros(draw.count, SLIPPING), np.zeros(draw.count, SAID)
    cases["p"], cases["q"] = 2.0 * w * np.where(draw.some(0.3), beside, draw.over(1e-4, 0.9)), w**2
    cases["p"] = np.where(draw.some(0.3), 2.0 * w * draw.over(1.1, 100.0), cases["p"])
    cases["v"] = draw.over(1e-3, 10.0) * ~draw.some(0.2)
    cases["acceleration"] = draw.sign() * draw.over(1e-3, 1e3) * cases["v"] * w + (cases["v"] == 0.0)
    rules.judge_rest(
        ctypes.c_void_p(cases.ctypes.data), ctypes.c_int32(draw.count), ctypes.c_double(REST),
        ctypes.c_void_p(said.ctypes.data),
    )  # fmt: skip
    assert not said["wrong"].any()
    assert 0.5 * draw.count < said["says"].sum() < 0.95 * draw.count


def test_a_rate_turns_as_its_jets_show_where_the_rule_says_so(rules: Any, precision: str) -> None:
    """Rates with two zeros, of which none, one or both are inside, of pairs that ring and of three real poles; 64 places
    of each in 113 bits."""
    draw = Draw(12, 8 * COUNT)
    w, rings = draw.over(1.0, 100.0), draw.some(0.6)
    mu = w * np.where(rings, draw.over(1e-3, 0.9), draw.over(1.1, 10.0))
    cases, said = np.zeros(draw.count, TURNING), np.zeros(draw.count, SAID)
    cases["a"] = w * draw.over(1e-2, 30.0)
    cases["p"], cases["q"] = 2.0 * mu, w**2
    half = math.pi / np.sqrt(np.abs(w**2 - mu**2))
    cases["length"] = np.where(rings, half * draw.rng.uniform(0.1, 1.3, draw.count), draw.over(0.3, 10.0) / w)
    cases["zeros"] = cases["length"][:, np.newaxis] * draw.rng.uniform(0.05, 1.6, (draw.count, 2))
    rules.judge_turns(ctypes.c_void_p(cases.ctypes.data), ctypes.c_int32(draw.count), ctypes.c_void_p(said.ctypes.data))
    assert not said["wrong"].any()
    assert (said["asked"] == 2).sum() > 0.15 * draw.count, "that turn twice"
    few = said["says"][said["asked"] < 2]
    assert few.mean() > {"SINGLE": 0.54, "DOUBLE": 0.735}[precision], few.mean()
