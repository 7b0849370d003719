"""The rules of the certificate as the theorems that they state: what a rule says of an interval is so, in 113 bits.

docs/explanation/certificate.md has the rules and what is claimed. rules.c asks each of them about event functions that
come near zero inside an interval as the solver takes it, and judges the answers: the propagator and the proof that a
function stays above a value are none of the engine's. A rule that is weakened stays sound, so the share of intervals of
which it says yes is held from below, too.
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
"""[eps of its terms] What the page claims: a minimum that is less below zero may pass for a touch."""
STIFFEST = 1.0
"""[1/sqrt(eps)] The page's limit of a/w, the real pole over the frequency of the pair: 2.9e3 (float32), 6.7e7."""
REST = 16.0
"""[eps] How far the numbers of a mass may be off whose time to rest is the computed one exactly."""

EPS = {"SINGLE": 2.0**-23, "DOUBLE": 2.0**-52}
DRAWN = np.dtype(
    [(name, "f8") for name in ("a", "p", "q", "H3", "H2", "low", "length", "place", "depth", "reach", "from_zero")]
)
SAID = np.dtype([(name, "i4") for name in ("asked", "says", "wrong")])
RULES = ("signs", "slope", "bernstein", "quiet", "still", "minimum", "search")
"""In the page's numbers: 2, and where d is not negative; 1; 5, and of all functions; 4; all of them, in their order."""
VERDICT = np.dtype([("asked", "i4"), ("intervals", "i4"), ("of", SAID, len(RULES))])
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
    a, p, q = cases["a"], cases["p"], cases["q"] = KINDS[kind](draw, eps)
    w = np.sqrt(q)
    cases["H3"] = draw.sign() * draw.over(1e-3, 1.0) * w * ~draw.some(0.2)
    cases["H2"] = draw.sign() * draw.over(1e-3, 1e3) * w**2
    cases["low"] = draw.over(0.1, 30.0) * late
    cases["length"] = np.where(draw.some(0.4), 1.0, draw.over(0.02, 1.0))
    behind = draw.some(0.3)  # the interval
    cases["place"] = np.where(behind, draw.rng.uniform(1.05, 4.0, COUNT), draw.rng.uniform(0.02, 0.98, COUNT))
    grazes, above, below = draw.sign() * draw.over(1.0, 1e4), draw.over(1e-3, 10.0), -draw.over(1e-4, 0.1)
    cases["depth"] = np.where(draw.some(0.4), grazes, np.where(draw.some(0.6), above, below) / eps)
    cases["reach"] = np.where(draw.some(0.1), 20.0, 4.0)
    cases["from_zero"] = draw.some(0.15) & (a > 0.0) & (not late)
    return cases


@pytest.fixture(scope="module", params=needs.the_first([*EPS], 0))
def precision(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def rules(store: Path, precision: str) -> Any:
    return ctypes.CDLL(str(shared_library(store, "rules", SOURCES, f"-D{precision}", "-Wall", "-Wextra", "-Werror")))


Verdicts = dict[tuple[str, bool], Column]


def judged(rules: Any, precision: str, rounding: float = ROUNDING) -> Verdicts:
    """Verdicts on the intervals of each kind, at the start of a phase and late in it."""
    claim, found = (ctypes.c_double * 1)(rounding), {}
    for kind in KINDS:
        for late in (False, True):
            cases, answers = intervals(kind, EPS[precision], late), np.zeros(COUNT, VERDICT)
            rules.judge(
                ctypes.c_void_p(cases.ctypes.data), ctypes.c_int32(COUNT), claim, ctypes.c_void_p(answers.ctypes.data)
            )
            found[kind, late] = answers[answers["asked"] == 1]
    return found


@pytest.fixture(scope="module")
def verdicts(rules: Any, precision: str) -> Verdicts:
    return judged(rules, precision)


@pytest.mark.parametrize("rule", RULES)
def test_a_function_of_which_a_rule_says_that_it_has_no_zero_has_none(rule: str, verdicts: Verdicts) -> None:
    """Of rule 4: where it locates the minimum, the function is least."""
    wrong = {which: int(answers["of"][:, RULES.index(rule)]["wrong"].sum()) for which, answers in verdicts.items()}
    assert not any(wrong.values()), wrong


LEAST = {
    "signs": (0.265, 0.272),
    "slope": (0.288, 0.269),
    "bernstein": (0.324, 0.294),
    "quiet": (0.321, 0.300),
    "still": (0.325, 0.303),
}
"""Shares of the intervals about which a rule is asked, of which it says yes, in single and double precision: 0.002 less
than measured, which is room for the last digit of a draw."""
MOST = (1.404, 1.426)
"""Intervals that the search takes where it is asked for one: 0.002 more than measured."""


@pytest.mark.parametrize("rule", LEAST)
def test_a_rule_is_as_strong_as_it_was(rule: str, precision: str, verdicts: Verdicts) -> None:
    said = np.concatenate([answers["of"][:, RULES.index(rule)] for answers in verdicts.values()])
    assert said["says"].sum() >= LEAST[rule][precision == "DOUBLE"] * said["asked"].sum()


def test_a_search_is_as_short_as_it_was(precision: str, verdicts: Verdicts) -> None:
    taken = np.concatenate([answers["intervals"] for answers in verdicts.values()])
    assert taken.sum() <= MOST[precision == "DOUBLE"] * taken.size


def test_few_functions_are_left_out(verdicts: Verdicts) -> None:
    """Those that end below zero."""
    assert sum(answers.size for answers in verdicts.values()) >= 0.75 * 2 * COUNT * len(KINDS)


@pytest.mark.nightly
def test_the_judge_sees_a_minimum_below_zero_by_rounding(rules: Any, precision: str) -> None:
    """It can fail: without a rounding bound the touches that the rules let pass are zeros."""
    said = np.concatenate([answers["of"] for answers in judged(rules, precision, rounding=0.0).values()])
    wrong = dict(zip(RULES, said["wrong"].sum(axis=0), strict=True))
    assert wrong["search"] > 0 and wrong["signs"] > 0


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
