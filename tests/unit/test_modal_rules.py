"""The rules of a node in modal coordinates: what a rule says of an interval is so, judged in double precision.

modal_rules.c asks each rule, in single precision, about functions that come near zero inside a node. The least value of
the function is found here, in double precision, from the poles and the row as they are rounded. A rule that is weakened
stays sound, so the share of intervals of which it says yes is held from below, too.
"""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.objects import shared_library
from tests.oracle.checker import ROBOT

EPS = 2.0**-23
LEAST = -0.25
"""[rounding bound] How far below zero a minimum may be in an interval that a rule calls free of zeros."""
QUESTION = np.dtype(
    [("robot", "f8", len(ROBOT)), *((n, "f8") for n in ("f", "c", "s", "start", "span", "sign")), ("row", "i4"),
     ("spare", "i4")]
)  # fmt: skip
VERDICT = np.dtype(
    [*((n, "f8") for n in ("value", "end", "rate_end", "a", "mean", "omega", "fade", "cosine", "sine", "length",
                           "rounding")),
     *((n, "i4") for n in ("refused", "signs", "amplitude", "bernstein"))]
)  # fmt: skip
COUNT = 6000
GRID = np.linspace(0.0, 1.0, 401)


SOURCES = (Path(__file__).with_name("modal_rules.c"),)


def drawn(seed: int, stiff: bool) -> Any:
    draw = np.random.default_rng(seed)
    q = np.zeros(COUNT, QUESTION)
    over = lambda low, high: 10.0 ** draw.uniform(np.log10(low), np.log10(high), COUNT)  # noqa: E731
    spring, mass = over(1e2, 1e5), over(0.01, 100.0)
    robot = dict.fromkeys(ROBOT, np.zeros(COUNT)) | {
        "m_eff": mass, "m_s": np.ones(COUNT), "k": spring, "u_max": np.ones(COUNT), "gamma2": np.ones(COUNT),
        "x1_min": np.full(COUNT, -np.inf), "x1_max": np.full(COUNT, np.inf), "g": np.full(COUNT, 9.81),
        "b1": 2.0 * np.sqrt(spring * mass) * (over(5.0, 500.0) if stiff else over(1e-4, 0.8)),
        "b2": 2.0 * np.sqrt(spring) * over(1e-4, 0.3),
    }  # fmt: skip
    q["robot"] = np.stack([robot[name] for name in ROBOT], axis=1)
    angle = draw.uniform(0.0, 2.0 * np.pi, COUNT)
    q["c"], q["s"] = np.cos(angle), np.sin(angle)
    q["f"] = draw.choice([-1.0, 1.0], COUNT) * over(1e-3, 1e3)
    q["span"] = np.where(draw.random(COUNT) < 0.5, 1.0, over(0.02, 1.0))
    q["sign"], q["row"] = draw.choice([-1.0, 1.0], COUNT), draw.integers(0, 3, COUNT)
    for name in ("f", "c", "s", "span"):
        q[name] = q[name].astype("f4")
    return q


def asked(library: Any, q: Any) -> Any:
    v = np.zeros(len(q), VERDICT)
    library.ask(ctypes.c_void_p(q.ctypes.data), ctypes.c_int64(len(q)), ctypes.c_void_p(v.ctypes.data))
    return v


def gains(q: Any, v: Any, share: Any) -> Any:
    """What each function has gained after shares of its interval, in double precision."""
    t = v["length"][:, None] * share
    pole = -v["mean"][:, None] + 1j * v["omega"][:, None]
    pair = (q["c"] + 1j * q["s"])[:, None] * np.expm1(pole * t) / pole
    a = v["a"][:, None]
    fade = q["f"][:, None] * -np.expm1(-a * t) / a
    return v["fade"][:, None] * fade + v["cosine"][:, None] * pair.real + v["sine"][:, None] * pair.imag


def least(q: Any, v: Any) -> Any:
    """The least gain of each function inside its interval: the grid's, and then a finer one about that."""
    coarse = gains(q, v, GRID[None, :])
    middle = GRID[coarse.argmin(axis=1)][:, None]
    fine = np.clip(middle + np.linspace(-1.0, 1.0, 201)[None, :] / 400.0, 0.0, 1.0)
    return np.minimum(coarse.min(axis=1), gains(q, v, fine).min(axis=1))


def aim(q: Any, v: Any) -> None:
    """Half of the functions hardly move at first, and half of those then fall as fast as their amplitude allows."""
    draw = np.random.default_rng(6).random(COUNT)
    above = v["a"] - v["mean"]
    cosine, sine = above * v["cosine"] + v["omega"] * v["sine"], above * v["sine"] - v["omega"] * v["cosine"]
    size, known = np.hypot(cosine, sine), (v["refused"] == 0) & (np.abs(v["fade"]) > 0.0)
    for name, row in (("c", cosine), ("s", sine)):
        q[name] = np.where(known & (draw < 0.25), -row / np.where(known, size, 1.0), q[name]).astype("f4")
    pair = v["cosine"] * q["c"] + v["sine"] * q["s"]
    q["f"] = np.where(known & (draw < 0.5), -pair / np.where(known, v["fade"], 1.0), q["f"]).astype("f4")


@pytest.mark.parametrize("stiff", [False, True])
def test_what_a_rule_of_a_node_says_is_so(store, stiff):
    library = ctypes.CDLL(str(shared_library(store, "modal_rules", SOURCES, "-DHOPFORM_MODAL=1")))
    q = drawn(11, stiff)
    first = asked(library, q)
    aim(q, first)
    lowest = least(q, first)
    draw = np.random.default_rng(5)
    scale = np.abs(gains(q, first, GRID[None, :])).max(axis=1)
    beside = draw.choice([-1.0, 1.0], COUNT) * 10.0 ** draw.uniform(np.log10(EPS), 0.0, COUNT) * scale
    q["start"] = np.maximum(-lowest + beside, 0.0).astype("f4")
    v = asked(library, q)
    of_pair = (v["refused"] == 0) & (v["end"] >= 0.0)
    depth = (v["value"] + lowest) / v["rounding"]
    for rule, share in (("signs", 0.3), ("amplitude", 0.03), ("bernstein", 0.03)):
        says = of_pair & (v[rule] != 0)
        inside = np.minimum(depth[says], np.minimum(v["value"], v["end"])[says] / v["rounding"][says])
        assert says.sum() > (share if not stiff or rule == "signs" else 0.0) * of_pair.sum(), (rule, says.sum())
        assert inside.min() > LEAST, f"{rule} says so of {says.sum()}: a minimum {inside.min():.2f} bounds below zero"
    falls = (v["refused"] == 0) & (v["end"] < -v["rounding"]) & (v["signs"] != 0)
    values = v["value"][falls, None] + gains(q[falls], v[falls], GRID[None, :])
    once = (np.diff(np.sign(values + v["rounding"][falls, None]), axis=1) != 0).sum(axis=1)
    assert falls.sum() > 100 and (once <= 1 + (v["value"][falls] == 0.0)).all(), "what ends below zero has one root"
