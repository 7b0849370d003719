"""One mass that slips alone, by its displacement: where it rests, and where a guard is met, judged in double precision.

alone.c asks the search, in single precision, about pairs of poles that ring, are two real ones, nearly equal, or none.
"""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import needs
from tests.objects import shared_library

EPS = 2.0**-23
QUESTION = np.dtype(
    [*((n, "f8") for n in ("p", "q", "velocity", "draw", "until", "rounding")), ("guard", "f8", 2),
     *((n, "f8") for n in ("value", "rate", "bend"))]
)  # fmt: skip
VERDICT = np.dtype([*((n, "f8") for n in ("t", "s", "v", "draw", "rest_time")), ("owner", "i4"), ("evaluations", "i4")])
SOURCES = (Path(__file__).with_name("alone.c"),)
CONTACT, REST, HELD, LIMIT = 0, 1, 2, 3
NONE = -1
COUNT = 4000
FUNCTIONS = 1000
PAIRS = ("rings", "real", "near", "free")


@pytest.fixture
def library(store):
    return ctypes.CDLL(str(shared_library(store, "alone", SOURCES)))


def asked(library: Any, q: Any) -> Any:
    v = np.zeros(len(q), VERDICT)
    library.ask(ctypes.c_void_p(q.ctypes.data), ctypes.c_int64(len(q)), ctypes.c_void_p(v.ctypes.data))
    return v


def drawn(seed: int, kind: str) -> Any:
    """Motions of a pair, without guards, for as long as they go on."""
    draw = np.random.default_rng(seed)
    over = lambda low, high: 10.0 ** draw.uniform(np.log10(low), np.log10(high), COUNT)  # noqa: E731
    q = np.zeros(COUNT, QUESTION)
    root = over(0.1, 1e3)
    share = {"rings": over(1e-4, 0.95), "near": 1.0 + draw.choice([-1.0, 1.0], COUNT) * over(1e-5, 1e-2)}
    q["q"] = np.where(kind == "free", 0.0, root**2)
    q["p"] = 2.0 * root * share.get(kind, over(1.01, 1e3))
    q["velocity"] = over(0.1, 10.0) * (draw.random(COUNT) < 0.8)
    size = np.where(q["velocity"] > 0.0, q["velocity"], over(0.1, 10.0)) * np.maximum(root, q["p"])
    q["draw"] = size * over(1e-3, 1e3) * np.where(q["velocity"] > 0.0, draw.choice([-1.0, 1.0], COUNT), 1.0)
    q["until"], q["guard"], q["value"] = (1e3 / root).astype("f4"), NONE, NONE
    for name in ("p", "q", "velocity", "draw"):
        q[name] = q[name].astype("f4")
    return q


def motion(q: Any, t: Any) -> tuple[Any, Any, Any]:
    """Displacement, velocity and draw at a time, in double precision; the series of exp(M t) where that is short."""
    p, square = q["p"], 0.25 * q["p"] ** 2 - q["q"]
    half = np.sqrt(np.abs(square))
    fade = np.exp(-0.5 * p * t)
    rings = square < 0.0
    grows = np.where(rings, 0.0, half * t)
    slow = np.where(rings, fade, np.exp(grows - 0.5 * p * t))  # exp(-p t/2) cosh and sinh, without what overflows
    even = np.where(rings, np.cos(half * t) * fade, 0.5 * slow * (1.0 + np.exp(-2.0 * grows)))
    odd = np.where(rings, np.sin(half * t) * fade, 0.5 * slow * -np.expm1(-2.0 * grows)) / half
    Rd, R = even - 0.5 * p * odd, odd
    fast = 0.5 * p + np.where(rings, 0.0, half)
    slow_pole = q["q"] / fast
    gone = lambda pole: np.where(pole > 0.0, -np.expm1(-pole * t) / np.where(pole > 0.0, pole, 1.0), t)  # noqa: E731
    apart = ~rings & (half > 0.1 * fast)
    by_quotient = (1.0 - Rd - p * R) / np.where(apart, 1.0, q["q"])
    R1 = np.where(apart, (gone(slow_pole) - gone(fast)) / np.where(apart, 2.0 * half, 1.0), by_quotient)
    short = np.maximum(p, np.sqrt(q["q"])) * t < 1e-3
    R1 = np.where(short, t**2 * (0.5 - p * t / 6.0 + (p**2 - q["q"]) * t**2 / 24.0), R1)
    return (
        R * q["velocity"] + R1 * q["draw"],
        Rd * q["velocity"] + R * q["draw"],
        q["draw"] - q["q"] * (R * q["velocity"] + R1 * q["draw"]),
    )


@pytest.mark.parametrize("kind", PAIRS)
def test_a_lone_mass_rests_where_its_motion_says(library, kind):
    q = drawn(3, kind)
    v = asked(library, q)
    rests = v["owner"] == REST
    assert rests.mean() > 0.2
    q, v = q[rests], v[rests]
    s, velocity, draw = motion(q, v["t"])
    within = 32.0 * EPS * (1.0 + v["t"] * np.sqrt(q["q"] + q["p"] ** 2))
    scale = np.abs(q["velocity"]) + np.abs(q["draw"]) * v["t"]
    assert (np.abs(velocity) <= within * scale).all() and (v["v"] == 0.0).all()
    assert (np.abs(v["s"] - s) <= within * np.maximum(np.abs(s), v["t"] * np.abs(velocity))).all()
    assert (v["draw"] <= 0.0).all()
    if kind == "free":
        assert (v["draw"] == q["draw"]).all(), "nothing but friction has drawn it, all the time"


def test_what_settles_does_not_rest_or_turn_by_rounding(library):
    """Two real poles, or nearly: where no more than rounding is left of draw and velocity nothing happens any more. A draw
    that is known counts, and of a pair that rings one of rounding, too.
    """
    draw = np.random.default_rng(8)
    q = np.concatenate([drawn(6, "real"), drawn(7, "near")])
    q = q[0.25 * q["p"] ** 2 > 0.9985 * q["q"]]
    q["velocity"] = 10.0 ** draw.uniform(-30.0, 0.0, len(q))
    q = settled_by(q, 1.0)
    q["draw"] = 0.5 * q["rounding"] * draw.uniform(-1.0, 1.0, len(q)) * (draw.random(len(q)) < 0.9)
    q["until"] = (10.0 ** draw.uniform(-3.0, 1.0, len(q)) / q["p"]).astype("f4")
    settles = asked(library, q)
    assert (settles["owner"] == NONE).all() and (settles["v"] > 0.0).all()
    known = asked(library, np.concatenate([settled_by(q, 0.0), settled_by(q, 0.1)]))
    assert (known["owner"] == REST).sum() > 0.2 * len(q), "a draw that is known stops it"
    assert (known[: len(q)] == known[len(q) :]).all(), "nor a draw that is more than rounding is lost"
    rings = drawn(3, "rings")
    rings = rings[0.25 * rings["p"] ** 2 < 0.99 * rings["q"]]
    assert len(rings) > COUNT // 2 and (asked(library, settled_by(rings, 10.0)) == asked(library, rings)).all()


def settled_by(q: Any, share: float) -> Any:
    """The same with a draw that is rounded by a share of 4 p v."""
    q = q.copy()
    q["rounding"] = 4.0 * share * q["p"] * q["velocity"]
    return q


@pytest.mark.parametrize("kind", PAIRS)
def test_a_guard_is_met_where_the_motion_is_there(library, kind):
    """A root next to the start, or to the rest, has its digits; nearly all take one or two evaluations."""
    draw = np.random.default_rng(5)
    q = drawn(4, kind)
    first = asked(library, q)
    rests = first["owner"] == REST
    reach = np.where(rests, first["s"], q["velocity"] / np.maximum(q["p"], np.sqrt(q["q"])))
    share = np.where(draw.random(COUNT) < 0.5, 10.0 ** draw.uniform(-9.0, 0.0, COUNT), draw.uniform(0.0, 1.0, COUNT))
    q["guard"][:, 1] = (reach * share).astype("f4")
    q = q[(reach > 0.0) & (share < 0.999)]
    v = asked(library, q)
    met = v["owner"] == HELD
    assert met.mean() > 0.95
    q, v = q[met], v[met]
    s, velocity, _ = motion(q, v["t"])
    goal = q["guard"][:, 1]
    off = np.abs(s - goal) / (goal + v["t"] * np.abs(velocity))
    assert off.max() < 8.0 * EPS, f"{off.max() / EPS:.0f} eps of it"
    assert np.mean(v["evaluations"]) < 3.0


def test_two_guards_are_met_in_the_order_of_their_displacements_and_a_tie_goes_to_the_first_owner(library):
    q = np.zeros(4, QUESTION)
    q["value"] = NONE
    q["p"], q["q"], q["velocity"], q["draw"], q["until"] = 0.1, 4.0, 1.0, 0.5, 10.0
    q["guard"] = [(0.2, 0.1), (0.1, 0.2), (0.1 * (1.0 + 4.0 * EPS), 0.1), (0.1 * (1.0 + 1e4 * EPS), 0.1)]
    assert asked(library, q)["owner"].tolist() == [HELD, CONTACT, CONTACT, HELD]


def test_a_guard_behind_the_rest_or_the_end_of_the_step_is_not_met(library):
    q = np.zeros(4, QUESTION)
    q["value"] = NONE
    q["p"], q["q"], q["velocity"], q["draw"], q["until"] = 0.1, 4.0, 1.0, 0.5, 10.0
    q["guard"] = NONE
    rest = asked(library, q)[0]
    q["until"] = [10.0, 10.0, 0.5 * rest["t"], 0.5 * rest["t"]]
    s, *_ = motion(q, q["until"])
    q["guard"][:, 1] = [rest["s"] * (1.0 + 1e-5), rest["s"] * (1.0 - 1e-4), s[2] * (1.0 + 1e-5), s[3] * (1.0 - 1e-5)]
    v = asked(library, q)
    assert v["owner"].tolist() == [REST, HELD, NONE, HELD]
    assert v["t"][2] == np.float32(q["until"][2])


def test_a_guard_that_is_passed_while_the_mass_is_drawn_to_it_asks_for_no_time_to_rest(library):
    q = np.zeros(3, QUESTION)
    q["value"] = NONE
    q["p"], q["q"], q["velocity"], q["draw"], q["until"] = 0.1, 4.0, 1.0, 0.5, [10.0, 0.05, 10.0]
    q["guard"] = [(NONE, 0.1), (NONE, 0.1), (NONE, 0.2)]
    v = asked(library, q)
    assert v["owner"].tolist() == [HELD, NONE, HELD] and v["t"][1] == np.float32(0.05)
    assert (v["rest_time"] > 1e37).tolist() == [True, False, False]


def fallen(q: Any, t: Any) -> tuple[Any, Any]:
    """What the functions are after some times, a row of them each, and how much of that may be rounding: their terms."""
    f = np.zeros((*t.shape,), QUESTION)
    for name, of in (("p", "p"), ("q", "q"), ("velocity", "rate"), ("draw", "bend")):
        f[name] = q[of][:, None]
    gained, rate, _ = motion(f, t)
    by_rate, by_bend = f.copy(), f.copy()
    by_rate["draw"], by_bend["velocity"] = 0.0, 0.0
    terms = np.abs(motion(by_rate, t)[0]) + np.abs(motion(by_bend, t)[0]) + np.abs(rate) * t
    return gained, terms


@pytest.mark.parametrize("kind", needs.the_first(PAIRS, 2))
def test_a_function_of_displacement_and_velocity_is_met_at_its_first_zero(library, kind):
    """Functions that fall and rise, or rise and fall, most of them to near zero: the first zero of each is found."""
    draw = np.random.default_rng(8)
    q = drawn(6, kind)[:FUNCTIONS]
    count = len(q)
    first = asked(library, q)
    ends = np.where(first["owner"] == REST, first["t"], q["until"])
    ends = np.minimum(ends, 40.0 / np.maximum(np.sqrt(q["q"]), q["p"]))  # behind that all has faded
    q["until"] = ends.astype("f4")
    fast = np.maximum(np.sqrt(q["q"]), q["p"])
    q["rate"] = (draw.choice([-1.0, 1.0], count) * 10.0 ** draw.uniform(-3.0, 0.0, count)).astype("f4")
    q["bend"] = (draw.choice([-1.0, 1.0], count) * fast * 10.0 ** draw.uniform(-2.0, 1.0, count)).astype("f4")
    grid = q["until"][:, None] * np.linspace(0.0, 1.0, 300)[None, :] ** 2
    gained, terms = fallen(q, grid)
    lowest = np.minimum(gained.min(axis=1), 0.0)
    beside = np.where(draw.random(count) < 0.5, 10.0 ** draw.uniform(-7.0, 0.0, count), 0.5)
    share = 1.0 + draw.choice([-1.0, 1.0], count) * beside
    q["value"] = np.where(lowest < 0.0, -lowest * np.maximum(share, 0.0), terms.max(axis=1)).astype("f4")
    v = asked(library, q)
    bound = 32.0 * EPS * (q["value"] + terms.max(axis=1))
    met = v["owner"] == LIMIT
    assert 0.2 < met.mean() < 0.9
    there = np.where(met, v["t"], q["until"])[:, None]
    value, _ = fallen(q, there)
    assert (np.abs(q["value"] + value[:, 0])[met] <= bound[met]).all(), "it is zero where it is met"
    before = q["value"][:, None] + gained
    early = (before < -bound[:, None]) & (grid < there * (1.0 - 1e-4))
    assert not early.any(), f"{early.any(axis=1).sum()} of {count} are below zero before"
