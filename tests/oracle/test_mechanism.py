"""The oracle of mechanisms stands on its own feet: the 50-digit reference, time stepping, printed figures, energy."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests import needs
from tests.conformance.random_stances import draw_stances
from tests.oracle.mechanism import builders, read, solve
from tests.oracle.mechanism.compare import EXCUSED, RIGHT, WRONG, Answer, compare, conditions
from tests.oracle.mechanism.fixtures import PROBLEMS, answer
from tests.oracle.mechanism.neighbour import neighbour
from tests.oracle.mechanism.numbers import exact, mp, ulp
from tests.oracle.reference import solve as solve_reference
from tests.oracle.reference.flight import solve_flight as solve_reference_flight

pytestmark = pytest.mark.sliced  # the judge is judged where there is time for it
FIXTURES = sorted((Path(__file__).parent / "mechanism" / "fixtures").glob("*.json"))
ROBOT = ("m_eff", "m_s", "k", "L0", "c", "b1", "b2", "f1", "f2", "gamma2", "g", "x1_min", "x1_max")
START = ("x1", "v1", "v2", "y")
TINY = mp.mpf("1e-40")
DROP = "-1.930751"  # sqrt(2 g 0.2 m) less 5 % of its energy
HOPPER = builders.HOPPER_C


def random_problem(row: Any) -> tuple[dict[str, float], dict[str, Any]]:
    start = {name: float(row[name]) for name in START}
    return {name: float(row[name]) for name in ROBOT}, {**start, "u": float(row["u"]), "max_phases": 60}


@pytest.mark.parametrize("row", needs.the_first(draw_stances(71, 100), 2), ids=range(100))
def test_random_stances_are_those_of_the_reference(row):
    robot, start = random_problem(row)
    found, wanted = solve(builders.stance(robot, **start)), solve_reference(robot, **start)
    assert found.kinds == (*(event.kind for event in wanted.events), wanted.status)
    assert abs(found.duration - wanted.duration) < TINY
    for event, other in zip(found.events, wanted.events, strict=True):
        assert abs(event.time - other.time) < TINY
    for t, state in ((found.duration / 3, wanted.at(wanted.duration / 3)), (found.duration, wanted.final)):
        here = found.at(t)
        assert all(abs(here[name] - getattr(state, name)) < TINY * (1 + abs(here[name])) for name in state._fields)
    assert abs(found.gains["body"] - wanted.aed) < TINY * (1 + abs(wanted.aed))


def random_leg(seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    draw = random.Random(seed)
    m_s, k = 10 ** draw.uniform(-1, 1), 10 ** draw.uniform(1, 5)
    m_eff = m_s * 10 ** draw.uniform(-2, 2)
    b1, b2 = (draw.choice([0.0, 2 * math.sqrt(k * m) * 10 ** draw.uniform(-3, 1)]) for m in (m_eff, m_s))
    robot = {"m_eff": m_eff, "m_s": m_s, "k": k, "L0": 0.4, "c": draw.choice([0, 0.01]), "b1": b1, "b2": b2}
    robot |= {"f1": draw.choice([0, 0.7]), "f2": draw.choice([0, 0.5]), "gamma2": -10.0, "g": 9.81}
    robot |= {"x1_min": 0, "x1_max": draw.choice([0.001, 0.08, math.inf])}
    return robot, {"v2": -draw.uniform(0.5, 2.5), "u": [(0, draw.uniform(-2, 3)), (0.05, -1)], "max_phases": 40}


@pytest.mark.parametrize("seed", needs.the_first(range(30), 2))
def test_steps_of_the_current_are_those_of_the_reference(seed):
    robot, start = random_leg(seed)
    found = solve(builders.damped_leg(robot, 0.0, **start))
    wanted = solve_reference(robot, **start)
    assert found.kinds == (*(event.kind for event in wanted.events), wanted.status)
    assert all(abs(a.time - b.time) < TINY for a, b in zip(found.events, wanted.events, strict=True))
    assert all(abs(found.final[name] - getattr(wanted.final, name)) < TINY for name in wanted.final._fields)


@pytest.mark.parametrize("seed", needs.the_first(range(20), 2))
def test_random_flights_are_those_of_the_reference(seed):
    draw = random.Random(seed)
    robot = {**HOPPER, "c": draw.choice([0.0, 0.005]), "f1": draw.choice([0.0, 0.5]), "b1": draw.choice([0.0, 150.0])}
    Kp, Kd, limit = 10 ** draw.uniform(1, 5), 10 ** draw.uniform(0, 3), 10 ** draw.uniform(-1, 1)
    x1, v1, v2, ahead = draw.uniform(0, 0.08), draw.uniform(-0.5, 0.5), draw.uniform(1, 3), draw.uniform(-0.1, 0.1)
    wanted = solve_reference_flight(
        {**robot, "b2": 0, "f2": 0, "u_max": limit}, v2=v2, x1=x1, v1=v1, y=ahead, gains=(Kp, Kd)
    )
    x2 = exact(x1) - exact(ahead) + exact(robot["L0"]) + exact(robot["c"])
    found = solve(builders.flight(robot, Kp=Kp, Kd=Kd, u_max=limit, x1=x1, v1=v1, x2=x2, v2=v2, horizon=10))
    events = [event for event in wanted.events if not event.kind.startswith("u_")]
    assert found.kinds == (*(event.kind for event in events), wanted.status) and found.status == "touchdown"
    assert all(abs(a.time - b.time) < TINY for a, b in zip(found.events, events, strict=True))
    assert all(abs(found.final[name] - q) < TINY for name, q in zip(("x1", "v1", "v2"), wanted.end, strict=False))
    works = found.ledger(found.duration)
    for name, work in (("input", "motor_work"), ("damper viscous_1", "viscous_1"), ("friction x1", "coulomb_1")):
        assert abs(works[name] - getattr(wanted.ledger, work)) < TINY


# ---- time stepping: the same physics in floats, by scipy ----

Force = Callable[[Any, Any], Any]


@dataclass(frozen=True)
class Stepper:
    """Coordinates with a mass, dry friction (plus, minus) and limits each, under forces without dry friction."""

    mass: Sequence[float]
    force: Force
    friction: Sequence[tuple[float, float]]
    limits: Sequence[tuple[float, float]]
    ends: Callable[[Any, Any], float] = lambda q, v: 1.0

    def side(self, i: int, q: Any, v: Any) -> int:
        """Where a coordinate at rest goes."""
        pull, (plus, minus) = self.force(q, v)[i], self.friction[i]
        sign = 1 if pull > plus else -1 if pull < -minus else 0
        return 0 if sign and q[i] == self.limits[i][sign > 0] else sign

    def rate(self, z: Any, signs: Sequence[int]) -> Any:
        q, v = np.split(z, 2)
        level = [(minus, 0.0, plus)[s + 1] * s for s, (plus, minus) in zip(signs, self.friction, strict=True)]
        moving = np.abs(signs)
        return np.concatenate([v * moving, moving * (self.force(q, v) - level) / self.mass])

    def watched(self, q: Any, signs: Sequence[int]) -> Iterator[tuple[str, int, int, Any]]:
        """What, which coordinate, which side, and the function that falls through zero there."""
        count = len(signs)
        yield "end", 0, 0, lambda t, z: self.ends(*np.split(z, 2))
        for i, s in enumerate(signs):
            if s:
                yield "velocity", i, s, lambda t, z, i=i, s=s: s * z[count + i]
                stop = self.limits[i][s > 0]
                if math.isfinite(stop):
                    yield "limit", i, s, lambda t, z, i=i, s=s, stop=stop: s * (stop - z[i])
                continue
            for way, level in zip((1, -1), self.friction[i], strict=True):
                if q[i] != self.limits[i][way > 0]:
                    yield "hold", i, way, lambda t, z, i=i, w=way, f=level: f - w * self.force(*np.split(z, 2))[i]

    def run(self, q: Sequence[float], v: Sequence[float], horizon: float = 2.0) -> tuple[list[Any], float, Any]:
        """Changes (word, coordinate), duration, final state."""
        t, changes, q, v = 0.0, list[Any](), np.array(q, float), np.array(v, float)
        signs = [int(np.sign(v[i])) or self.side(i, q, v) for i in range(len(q))]
        while any(signs):
            watched = list(self.watched(q, signs))
            for *_, function in watched:
                function.terminal, function.direction = True, -1
            done = solve_ivp(
                lambda t, z, signs=tuple(signs): self.rate(z, signs), (t, horizon), np.concatenate([q, v]),
                events=[function for *_, function in watched], method="DOP853", rtol=1e-12, atol=1e-14, max_step=2e-3,
            )  # fmt: skip
            t, (q, v) = done.t[-1], np.split(done.y[:, -1].copy(), 2)
            due = [entry[:3] for entry, times in zip(watched, done.t_events or (), strict=True) if len(times)]
            if not due or due[0][0] == "end":
                break
            changes.append(self.change(*due[0], q, v, signs))
        return changes, t, (q, v)

    def change(self, what: str, i: int, way: int, q: Any, v: Any, signs: list[int]) -> tuple[str, int]:
        """The word for an event; q, v and signs are changed."""
        if what == "hold":
            signs[i] = way
            return "slips", i
        q[i] = self.limits[i][way > 0] if what == "limit" else q[i]
        v[i] = 0.0
        signs[i] = self.side(i, q, v)
        return "hits_stop" if what == "limit" else "reverses" if signs[i] else "sticks", i


def agrees(text: dict[str, Any], names: Sequence[str], stepped: Any) -> None:
    changes, duration, (q, v) = stepped
    found = solve(text)
    assert [event.kind for event in found.events] == [f"{names[i]}_{what}" for what, i in changes]
    assert abs(found.duration - duration) < 1e-8
    assert max(abs(a - b) for a, b in zip(found.end.q, q, strict=True)) < 1e-8
    assert max(abs(a - b) for a, b in zip(found.end.v, v, strict=True)) < 1e-7


NONE = (-math.inf, math.inf)
JOINTS = [
    {"m": 2.0, "k": 50.0, "q_0": 0.1, "b": 1.0, "F_plus": 3.0, "F_minus": 1.0, "q": 0.5, "q_min": -0.05, "q_max": 1.0},
    {"m": 0.5, "k": 0.0, "b": 2.0, "F_plus": 0.2, "F_minus": 0.4, "v": -1.0, "u": 0.3},
    {"m": 1.0, "k": 400.0, "b": 0.4, "F_plus": 0.0, "F_minus": 2.0, "q": 0.3, "load": -1.0},
    {"m": 1.0, "k": 30.0, "b": 0.0, "F_plus": 0.5, "F_minus": 0.5, "q": 0.9, "v": -1.0, "q_min": 0.2, "q_max": 1.0},
]


@pytest.mark.parametrize("joint", needs.the_first(JOINTS, 2), ids=range(len(JOINTS)))
def test_a_joint_is_that_of_time_stepping(joint):
    p = {"k": 0.0, "q_0": 0.0, "b": 0.0, "load": 0.0, "u": 0.0, "q": 0.0, "v": 0.0, **joint}
    stepper = Stepper(
        [p["m"]],
        lambda q, v: -p["k"] * (q - p["q_0"]) - p["b"] * v + p["u"] + p["load"],
        [(p["F_plus"], p["F_minus"])],
        [(p.get("q_min", -math.inf), p.get("q_max", math.inf))],
    )
    agrees(builders.joint(**joint), ["q"], stepper.run([p["q"]], [p["v"]]))


def leg_force(b12: float, k_2: float, L_2: float, k_b: float, h_b: float, push: float, u: float) -> Any:
    """Forces on x1 and z = x2 - L0 of hopper_c, and the contact force."""

    def contact(q: Any, v: Any) -> float:
        x1, x2 = q[0], q[1] + 0.4
        return 1200.0 * (x1 - x2 + 0.4) + k_2 * (x1 - x2 + L_2) + b12 * (v[0] - v[1])

    def force(q: Any, v: Any) -> Any:
        N = contact(q, v)
        x2 = q[1] + 0.4
        return np.array([-N - 150.0 * v[0] + 65.0 * u, N - 5.0 * v[1] - 3.0 * 9.81 - k_b * (x2 - h_b) + push])

    return force, contact


LEGS = {
    "damper 5": (builders.damped_leg(HOPPER, "5", v2="-1.9", u="3"), {"b12": 5.0}),
    "damper 40": (builders.damped_leg(HOPPER, "40", v2="-1.9", u="3"), {"b12": 40.0}),
    "longer spring": (builders.second_spring(HOPPER, "300", "0.41", v2="-1.9", u="3"), {"k_2": 300.0, "L_2": 0.41}),
    "shorter spring": (builders.second_spring(HOPPER, "600", "0.37", v2="-1.9", u="3"), {"k_2": 600.0, "L_2": 0.37}),
    "world": (builders.body_spring(HOPPER, "60", "0.5", v2="-1.9", u="3"), {"k_b": 60.0, "h_b": 0.5}),
    "push": (builders.pushed_body(HOPPER, "-5", v2="-1.9", u="3"), {"push": -5.0}),
}


@pytest.mark.parametrize("name", needs.the_first([*LEGS], 2))
def test_a_leg_with_more_in_it_is_that_of_time_stepping(name):
    text, parts = LEGS[name]
    force, contact = leg_force(**{"b12": 0, "k_2": 0, "L_2": 0, "k_b": 0, "h_b": 0, "push": 0, "u": 3.0, **parts})
    touchdown = brentq(lambda z: contact([0.0, z], [0.0, 0.0]), -0.1, 0.1)  # where the leg at rest carries nothing
    stepper = Stepper([25.0, 3.0], force, [(25 * 0.78,) * 2, (3 * 0.6,) * 2], [(0.0, 0.08), NONE], contact)
    agrees(text, ["x1", "x2"], stepper.run([0.0, touchdown], [0.0, -1.9]))


GAINS = [("500", "200", "0.04", "0.39"), ("3000", "100", "0.08", "-0.5"), ("60000", "300", "0.03", "0.1")]


@pytest.mark.parametrize(("Kp", "Kd", "x1", "v1"), GAINS)
def test_a_flight_is_that_of_time_stepping(Kp, Kd, x1, v1):
    text = builders.flight(HOPPER, Kp=Kp, Kd=Kd, u_max="3", x1=x1, v1=v1, x2="0.5", v2="1.9")
    p, d = float(Kp), float(Kd)

    def force(q: Any, v: Any) -> Any:
        u = min(max((p * q[0] + d * v[0]) / -65.0, -3.0), 3.0)
        return np.array([-150.0 * v[0] + 65.0 * u, -3.0 * 9.81])

    stepper = Stepper(
        [25.0, 3.0], force, [(25 * 0.78,) * 2, (0.0, 0.0)], [(0.0, 0.08), NONE], lambda q, v: q[1] - 0.4 - q[0]
    )
    changes, duration, end = stepper.run([float(x1), 0.5], [float(v1), 1.9])
    agrees(text, ["x1"], ([c for c in changes if c[1] == 0], duration, end))


def test_a_flight_with_a_damper_in_the_leg_is_that_of_time_stepping():
    """The foot follows from N = 0, k y + b12 y' = 0, a first-order equation: a third coordinate by its solution."""
    gains = {"Kp": "500", "Kd": "200", "u_max": "3", "x1": "0.04", "v1": "0.39", "x2": "0.5", "v2": "1.9"}
    text = builders.damped_flight(HOPPER, "20", y="0.01", push="-2", **gains)

    def force(q: Any, v: Any) -> Any:
        u = min(max((500 * q[0] + 200 * v[0]) / -65.0, -3.0), 3.0)
        return np.array([-150.0 * v[0] + 65.0 * u, -3.0 * 9.81 - 2.0, -v[2]])

    stepper = Stepper(
        [25.0, 3.0, 20.0 / 1200.0], force, [(25 * 0.78,) * 2, (0.0, 0.0), (0.0, 0.0)], [(0.0, 0.08), NONE, NONE],
        lambda q, v: q[1] - 0.4 - q[0] + q[2],
    )  # fmt: skip
    changes, duration, end = stepper.run([0.04, 0.5, 0.01], [0.39, 1.9, -0.6])
    agrees(text, ["x1"], ([c for c in changes if c[1] == 0], duration, end))
    found = solve(text)
    assert abs(found.at("0.1")["y"] - mp.exp(-6) / 100) < TINY


@pytest.mark.parametrize(("m_f", "b12", "u"), [("0.15", "5", "0"), ("0.15", "20", "-2"), ("0.3", "5", "3")])
def test_a_hopper_with_a_foot_mass_is_that_of_time_stepping(m_f, b12, u):
    """Three coordinates, landing is an impact on a limit and take-off a release: stance and flight are held sets."""
    s = np.array([1.0, 1.0, -1.0])

    def force(q: Any, v: Any) -> Any:
        N = 1200.0 * (s @ q) + float(b12) * (s @ v)
        return -N * s - np.array([0.0, 150.0, 5.0]) * v + [-float(m_f) * 9.81, 65.0 * float(u), -3.0 * 9.81]

    stepper = Stepper(
        [float(m_f), 25.0, 3.0], force, [(0.0, 0.0), (25 * 0.78,) * 2, (3 * 0.6,) * 2],
        [(0.0, math.inf), (0.0, 0.08), NONE],
    )  # fmt: skip
    text = builders.footed(HOPPER, m_f, b12, height="0.2", u=u, horizon="0.6")
    agrees(text, ["foot", "x1", "x2"], stepper.run([0.2, 0.0, 0.2], [0.0, 0.0, 0.0], 0.6))


@pytest.mark.parametrize(
    ("b12", "u", "duration", "apex"),
    [
        ("5", "0", "0.184781", "7.851"),
        ("5", "3", "0.189874", "17.156"),
        ("20", "0", "0.190742", "1.368"),
        ("40", "3", "0.25562", "7.81"),
    ],
)
def test_a_damper_in_the_leg_does_what_is_printed(b12, u, duration, apex):
    stance = solve(builders.damped_leg(HOPPER, b12, v2=DROP, u=u))
    height = stance.final["x2"] + stance.final["v2"] ** 2 / (2 * mp.mpf("9.81")) - mp.mpf("0.4")
    assert stance.status == "takeoff"
    assert mp.nstr(stance.duration, len(duration) - 2) == duration
    assert abs(100 * height - mp.mpf(apex)) < mp.mpf("0.0006") * max(1, 10 ** (5 - len(apex)))


def test_extremes_are_those_of_the_closed_form():
    """y = sag (1 - cos wt) + (v/w) sin wt of a locked leg; N has a minimum where the body turns above the ground."""
    stance = solve(builders.stance(LOCKED, v2="-1"))
    assert abs(stance.compression_max - mp.mpf("0.1") - mp.sqrt(2) / 10) < TINY
    swing = solve(builders.stance(LOCKED, v2="0", y="0.15", horizon="0.5"))
    assert [mp.nstr(N, 20) for _, N in swing.force_minima] == ["5.0"]
    assert abs(swing.force_minima[0][0] - mp.pi / 10) < TINY


def test_works_over_long_steps_are_those_over_windows():
    """An overdamped mass that creeps: rates of 1 and 1e4 per second, 2 s in a few long steps."""
    creeping = solve(builders.joint(m="1", k="1e4", b="1e4", v="1", q="0.1"))
    assert creeping.run.windows < 30
    for t in ("0.3", "2"):
        works = creeping.ledger(t)
        assert abs(sum(works.values()) - creeping.kinetic(t) + creeping.given_kinetic) < mp.mpf("1e-55")


def test_a_contact_opens_where_an_impact_makes_its_force_negative():
    """At 20 N s/m and 3 A the stop takes v1, and N = k y + b12 (v1 - v2) jumps from 9.4 N to -4.2 N."""
    stance = solve(builders.damped_leg(HOPPER, "20", v2=DROP, u="3"))
    assert stance.kinds == ("x2_reverses", "x1_hits_stop", "takeoff")
    assert stance.events[-1].time == stance.duration
    assert stance.system.contact.force.at(stance.end.q, stance.end.v) < -4


@pytest.mark.parametrize("path", needs.the_first(FIXTURES, 4), ids=lambda path: path.stem)
def test_the_works_of_all_forces_are_the_gain_of_kinetic_energy(path):
    motion = solve(path)
    for t in (motion.duration / 3, motion.duration):
        works = motion.ledger(t)
        assert abs(sum(works.values()) - motion.kinetic(t) + motion.given_kinetic) < mp.mpf("1e-45")
        assert all(work <= 0 for name, work in works.items() if name.split()[0] in ("damper", "friction", "stop_loss"))


@pytest.mark.parametrize("path", FIXTURES, ids=lambda path: path.stem)
def test_a_fixture_is_its_builders_problem_with_its_answer(path):
    text = json.loads(path.read_text("utf-8"))
    wanted = text.pop("answer")
    assert text == json.loads(json.dumps(PROBLEMS[path.stem]))
    found = answer(solve(path))
    assert found["status"] == wanted["status"] and len(FIXTURES) == len(PROBLEMS)
    assert [kind for _, kind in found["events"]] == [kind for _, kind in wanted["events"]]
    pairs = [(found["duration"], wanted["duration"])]
    pairs += [(a, b) for (a, _), (b, _) in zip(found["events"], wanted["events"], strict=True)]
    pairs += [(q, wanted[part][name]) for part in ("final", "gains", "ledger") for name, q in found[part].items()]
    assert all(abs(mp.mpf(a) - mp.mpf(b)) < mp.mpf("1e-27") for a, b in pairs)


# ---- the rules, one by one ----


def in_leg_coordinates(text: dict[str, Any]) -> dict[str, Any]:
    """The same stance in (x1, y), z = x1 - y, where the masses are coupled: T^T M T, directions c T."""
    damping = {"viscous_1": [["b1", "0"], ["0", "0"]], "viscous_2": [["b2", "-b2"], ["-b2", "b2"]]}
    first, second = text["elements"]
    return {
        **text,
        "mass": [["m_eff + m_s", "-m_s"], ["-m_s", "m_s"]],
        "stiffness": {"leg": [["0", "0"], ["0", "k"]]},
        "damping": {**damping, "viscous_12": [["0", "0"], ["0", "b12"]]},
        "force": {"offset": ["k*c", "0"], "weight": ["-m_s*g", "m_s*g"]},
        "elements": [first, {**second, "direction": [1, -1]}],
        "contact": {"force": {"q": [0, "k"], "v": [0, "b12"]}, "compression": {"q": [0, 1]}, "tolerance": "0"},
        "position": ["x1", "y"],
        "velocity": ["v1", "v1 - v2"],
        "outputs": {
            "x1": {"q": [1, 0]},
            "v1": {"v": [1, 0]},
            "x2": {"q": [1, -1], "constant": "L0 + c"},
            "v2": {"v": [1, -1]},
            "y": {"q": [0, 1]},
        },
        "energies": {},
    }


@pytest.mark.parametrize("b12", ["0", "20", "40"])
@pytest.mark.parametrize("friction", [{}, {"f1": "8", "f2": "6"}])
@pytest.mark.parametrize("start", [{"v2": "-1.9", "u": "3"}, {"v2": "-2.5", "x1": "0.079", "v1": "0.5", "u": "3"}])
def test_coordinates_do_not_matter(b12, friction, start):
    """An impact is a projection along M^-1 c: the body keeps its velocity though x1 carries its coordinate along."""
    text = builders.damped_leg({**HOPPER, **friction}, b12, **start)
    one, other = solve(text), solve(in_leg_coordinates(text))
    assert one.kinds == other.kinds and abs(one.duration - other.duration) < mp.mpf("1e-55")
    assert all(abs(q - other.final[name]) < mp.mpf("1e-55") for name, q in one.final.items())
    works, others = one.ledger(one.duration), other.ledger(other.duration)
    assert abs(works["stop_loss"] - others["stop_loss"]) < mp.mpf("1e-55")


BARE = {"m_eff": 2, "m_s": 1, "k": 100, "L0": "0.5", "c": 0, "b1": 0, "b2": 0, "f1": 0, "f2": 0, "gamma2": -1, "g": 10}
LOCKED = {**BARE, "x1_min": 0, "x1_max": 0}


def test_a_force_that_touches_zero_is_no_takeoff():
    stance = solve(builders.stance(LOCKED, v2="0", y="0.2"))
    assert stance.kinds == ("x2_reverses",) * 6 + ("horizon",)
    assert stance.margin < 1e-60
    assert all(abs(event.time - n * mp.pi / 10) < TINY for n, event in enumerate(stance.events, 1))


@pytest.mark.parametrize("depth", ["1e-3", "1e-12", "1e-25"])
def test_a_force_that_dips_below_zero_is_a_takeoff_by_any_depth(depth):
    """A locked leg without friction oscillates about its sag of 0.1 m."""
    stance = solve(builders.stance(LOCKED, v2="0", y=mp.mpf("0.1") * (2 + mp.mpf(depth))))
    assert stance.kinds == ("takeoff",) and 0 < stance.margin < 2 * mp.mpf(depth)
    assert abs(stance.duration - mp.acos(-1 / (1 + mp.mpf(depth))) / 10) < TINY
    above = solve(builders.stance(LOCKED, v2="0", y=mp.mpf("0.1") * (2 - mp.mpf(depth))))
    assert above.kinds[:2] == ("x2_reverses",) * 2


@pytest.mark.parametrize(
    ("start", "b12", "kinds"),
    [
        ({"v2": "-1"}, "0", ("x2_reverses", "takeoff")),  # N = 0, compressing
        ({"v2": "1"}, "0", ("takeoff",)),  # N = 0, extending
        ({"v2": "0"}, "0", ("x2_reverses",)),  # N = N' = 0, N'' > 0: the body falls
        ({"v2": "1"}, "5", ("takeoff",)),  # y = 0, N < 0
        ({"v2": "-1"}, "0.5", ("x2_reverses", "takeoff")),  # y = 0, N > 0
        ({"v2": "-1", "y": "-1e-17"}, "0", ("takeoff",)),  # N < 0, y within the tolerance
        ({"v2": "0", "y": "-1e-17"}, "0", ("takeoff",)),
    ],
)
def test_the_contact_force_at_the_start_decides(start, b12, kinds):
    found = solve(builders.damped_leg(LOCKED, b12, **start))
    assert found.kinds[: len(kinds)] == kinds
    assert found.duration == 0 or found.kinds != ("takeoff",)


def test_a_leg_that_would_have_to_pull_while_all_is_held_takes_off():
    stance = solve(builders.stance({**LOCKED, "f2": 20}, v2="0", y="-1e-17"))
    assert stance.kinds == ("takeoff",) and stance.duration == 0


def test_a_leg_that_is_stretched_at_the_start_is_an_error():
    with pytest.raises(ValueError, match="stretched"):
        solve(builders.stance(LOCKED, v2="-1", y="-1e-15"))


def test_a_start_that_moves_into_a_stop_loses_its_velocity_without_an_event():
    motion = solve(builders.joint(m="2", k="1", q_max="0", v="3", load="1", horizon="1"))
    assert motion.kinds == ("rest",) and motion.duration == 0
    assert motion.ledger(0)["stop_loss"] == -9


def test_an_impact_releases_a_held_element_that_it_sets_in_motion():
    """Masses (2, 1; 1, 2): M^-1 c = (2, -1)/3, so 1 m/s into a's stop is 0.5 m/s of b; friction gives no impulse."""
    text = pair("0") | {"mass": [[2, 1], [1, 2]], "stiffness": [[0, 0], [0, 0]], "horizon": "0.3"}
    text |= {"elements": [
        {"name": "a", "direction": [1, 0], "limits": ["-inf", "0.25"]},
        {"name": "b", "direction": [0, 1], "friction": [50, 50]},
    ]}  # fmt: skip
    motion = solve(text)
    assert motion.kinds == ("a_hits_stop", "b_slips", "b_sticks", "rest")
    after = motion.phases[1]
    assert after.start == mp.mpf("0.25") and after.point.v == (0, mp.mpf("0.5"))
    assert abs(motion.duration - mp.mpf("0.25") - mp.mpf("0.5") * 2 / 50) < TINY
    assert motion.ledger(motion.duration)["stop_loss"] == mp.mpf("-0.75")


def test_a_position_at_a_stop_to_within_rounding_is_at_the_stop():
    low = -mp.mpf(1) / 3
    inside = solve(builders.joint(m="1", q=low * (1 + mp.mpf("1e-80")), q_min=low, v="-1", horizon="1"))
    assert inside.kinds == ("rest",) and inside.final["q"] == low
    with pytest.raises(ValueError, match="must be in"):
        solve(builders.joint(m="1", q=low * (1 + mp.mpf("1e-60")), q_min=low))


def test_a_stop_that_is_left_again_at_once_is_hit_and_nothing_else():
    motion = solve(builders.joint(m="1", k="4", q_0="0", v="1", q_max="0.25", horizon="1"))
    assert motion.kinds == ("q_hits_stop", "horizon")
    assert abs(motion.events[0].time - mp.asin("0.5") / 2) < TINY
    assert abs(motion.final["q"] - mp.cos(2 * (1 - motion.events[0].time)) / 4) < TINY


def test_a_stop_that_holds_is_left_where_the_force_exceeds_the_level():
    """Pushed onto the stop by 2 N; drawn off by 1 N, which is the level exactly, and at last by 1.5 N."""
    steps = [["0", "2"], ["1", "-1"], ["2", "-1.5"]]
    motion = solve(builders.joint(m="1", F_plus="1", F_minus="1", v="1", q_max="0.25", u=steps, horizon="2.1"))
    assert motion.kinds == ("q_hits_stop", "q_slips", "horizon") and motion.events[1].time == 2


def test_exact_ties_of_the_hold_rule_are_decided_by_the_first_derivative_that_is_not_zero():
    """The load equals the level; the spring lets go or pulls as a second body moves."""
    for speed, kinds in (("1", ()), ("-1", ("a_slips",))):
        text = pair(speed)
        text |= {"parameters": {"k": "1", "F": "1"}, "start": {"v_a": "0", "v_b": speed}, "horizon": "0.1"}
        text |= {"stiffness": [["k", "-k"], ["-k", "k"]], "force": ["-F", "0"]}
        found = solve(text)
        assert found.kinds == ("horizon",)  # what an element does at t = 0 is no event
        assert bool(found.final["v_a"]) == bool(kinds)


def test_a_frictionless_element_starts_at_once():
    motion = solve(builders.joint(m="1", k="0", u="1e-30", horizon="1"))
    assert motion.kinds == ("horizon",) and abs(motion.final["q"] / mp.mpf("5e-31") - 1) < TINY


def test_events_at_one_time_come_in_the_order_of_the_elements_and_takeoff_first():
    twins = pair("1") | {"stiffness": [["k", 0], [0, "k"]]}
    both = solve(twins)
    assert both.kinds[:2] == ("a_reverses", "b_reverses") and both.events[0].time == both.events[1].time
    turned = solve({**twins, "elements": twins["elements"][::-1]})
    assert turned.kinds[:2] == ("b_reverses", "a_reverses")
    row = {"v": [1, 0]}
    left = solve({**twins, "contact": {"force": row, "compression": row}})
    assert left.kinds == ("takeoff",) and left.duration == both.events[0].time


def test_a_step_of_the_current_lets_go_and_holds():
    motion = solve(builders.joint(m="1", F_plus="1", F_minus="2", b="0", u=[["0", "1"], ["0.5", "2"], ["1", "0"]]))
    assert [event.kind for event in motion.events] == ["q_slips", "q_sticks"] and motion.status == "rest"
    assert motion.events[0].time == mp.mpf("0.5") and abs(motion.duration - mp.mpf("1.5")) < TINY


def test_rest_begins_when_everything_is_held_though_the_current_steps_later():
    motion = solve(builders.joint(m="1", F_plus="2", F_minus="2", v="1", u=[["0", "0"], ["1", "1.9"]]))
    assert motion.kinds == ("q_sticks", "rest") and motion.duration == mp.mpf("0.5")


def test_a_step_behind_the_horizon_is_none():
    motion = solve(builders.joint(m="1", v="1", u=[["0", "0"], ["3", "5"]]))
    assert motion.kinds == ("horizon",) and motion.duration == 2 == motion.final["q"]


def test_levels_differ_by_sign():
    down = solve(builders.joint(m="1", F_plus="1", F_minus="2", v="-1"))
    up = solve(builders.joint(m="1", F_plus="1", F_minus="2", v="1"))
    assert abs(down.duration - mp.mpf("0.5")) < TINY and abs(up.duration - 1) < TINY


def test_a_chain_stops_at_its_cap():
    motion = solve(builders.joint(m="1", k="100", v="1", max_phases=5))
    assert motion.kinds == ("q_reverses",) * 5 + ("too_many_phases",)
    assert abs(motion.duration - mp.mpf(9) / 20 * mp.pi) < TINY


def test_a_velocity_that_touches_zero_goes_on():
    """Two equal masses on a spring: v_a = 1 + cos wt, v_b = 1 - cos wt, w = 2 pi/s; v_a is zero at 0.5 s."""
    text = pair("0") | {"parameters": {"k": 2 * mp.pi**2, "F": "0"}, "start": {"v_a": "2", "v_b": "0"}}
    motion = solve(text | {"stiffness": [["k", "-k"], ["-k", "k"]]})
    assert motion.kinds == ("horizon",) and motion.margin < 1e-60
    assert abs(motion.at("0.5")["v_a"]) < TINY and abs(motion.final["v_a"] - 2) < TINY


def test_a_law_that_saturates_is_a_phase_and_no_event():
    motion = solve(builders.flight(HOPPER, Kp="3000", Kd="100", u_max="1", x1="0.06", v1="-0.1", x2="0.9", v2="1"))
    assert [phase.mode.saturation for phase in motion.phases][:2] == [-1, 0]
    edge = next(phase for phase in motion.phases if not phase.mode.saturation)
    law = motion.system.law
    assert law is not None and (not edge.start or abs(abs(law.row.at(edge.point.q, edge.point.v)) - law.limit) < TINY)


def test_a_foot_that_never_gets_over_the_ground_has_tripped():
    gains = {"Kp": "500", "Kd": "200", "u_max": "3", "x1": "0", "v1": "0", "v2": "1"}
    for ground, status in (("0.1", "tripped"), ("0.02", "touchdown")):
        assert solve(builders.flight(HOPPER, **gains, x2="0.4", ground=ground)).status == status


def test_held_directions_that_depend_on_each_other_are_never_held_together():
    text = pair("1") | {"elements": [{"name": n, "direction": [1, 0], "friction": [1, 1]} for n in ("a", "b")]}
    with pytest.raises(ArithmeticError, match="no mode"):
        solve(text | {"start": {"v_a": "0", "v_b": "1"}})


# ---- neighbours ----

SWING = {"m": 1.0, "k": 30.0, "b": 0.5, "F_plus": 0.5, "F_minus": 0.5, "q": 0.2, "v": -1.0, "horizon": 1.0}
HIT, MISS = ("q_hits_stop", "horizon"), ("q_reverses", "horizon")


def lowest_turn(**changes: Any) -> float:
    motion = solve(builders.joint(**{**SWING, **changes}))
    return float(motion.at(motion.events[0].time)["q"])


@pytest.mark.parametrize("ulps", [-20, -1, 0, 1, 20])
def test_a_grazed_limit_has_neighbours_that_hit_and_that_miss(ulps):
    low = lowest_turn()
    joint = read(builders.joint(**SWING, q_min=low + ulps * math.ulp(low)))
    found = solve(joint).kinds
    assert found in (HIT, MISS) and neighbour(joint, found).attempts == ()
    other = neighbour(joint, MISS if found == HIT else HIT)
    assert other.solution is not None and other.attempts[0].label[0] == "least"
    moves = [abs(q - joint.inputs()[name]) for name, q in other.solution.problem.inputs().items() if mp.isfinite(q)]
    most = [32 * ulp(q, 53) for q in joint.inputs().values() if mp.isfinite(q)]
    assert all(p <= q for p, q in zip(moves, most, strict=True)) and any(moves)


def test_a_limit_that_is_missed_by_far_has_no_neighbour_that_hits():
    low = lowest_turn()
    joint = read(builders.joint(**SWING, q_min=low * (1 + 1e-12)))
    assert solve(joint).kinds == MISS and not neighbour(joint, HIT).found
    assert neighbour(joint, HIT, digits=24).found


@pytest.mark.parametrize(
    "kinds", [("q_sticks", "rest"), ("q_reverses", "q_reverses", "horizon"), ("horizon",), ("q_slips", "horizon")]
)
def test_a_list_that_nothing_near_has_is_refused(kinds):
    low = lowest_turn()
    assert not neighbour(read(builders.joint(**SWING, q_min=low)), kinds).found


def at_the_level(ulps: int) -> Any:
    """A joint that turns where the spring balances the friction of the way back, but for some ulp of it."""
    pull = -30.0 * lowest_turn()
    return read(builders.joint(**{**SWING, "F_plus": pull + ulps * math.ulp(pull)}))


@pytest.mark.parametrize("ulps", [-9, 0, 9])
def test_a_tie_of_the_hold_rule_has_neighbours_that_stick_and_that_turn(ulps):
    assert 0 < solve(at_the_level(ulps)).margin < 1e-14
    joint, sides = at_the_level(ulps), [solve(at_the_level(far)).kinds for far in (-100, 100)]
    assert [kinds[0] for kinds in sides] == ["q_reverses", "q_sticks"]
    other = neighbour(joint, next(kinds for kinds in sides if kinds[0] != solve(joint).kinds[0]))
    assert other.found and other.attempts[0].label[0] == "hold"


def test_an_exact_tie_is_decided_by_the_rule_and_not_excused():
    """A stop that is touched is not hit, a force that touches zero is no take-off, however near they are."""
    motion = solve(builders.joint(**SWING))
    grazed = read(builders.joint(**SWING, q_min=motion.at(motion.events[0].time)["q"]))
    assert solve(grazed).kinds == MISS and not neighbour(grazed, HIT).found
    touching = read(builders.stance(LOCKED, v2="0", y="0.2"))
    assert not neighbour(touching, ("takeoff",)).found
    nearly = read(builders.stance(LOCKED, v2="0", y=mp.mpf("0.2") * (1 - mp.mpf("1e-16"))))
    assert neighbour(nearly, ("takeoff",)).found


def test_what_is_left_of_a_motion_that_has_died_away_may_graze():
    """0.1 % below critical damping a contact force first crosses zero after 70 s, at 1e-31 of what it was."""
    text = builders.joint(m="1", k="1", b="1.998", q="1", v="-1", horizon="100")
    text |= {"contact": {"force": {"q": ["k"]}, "compression": {"q": [1]}}}
    crossing = solve(text).duration
    late = read(text | {"horizon": crossing + mp.mpf("0.3")})
    assert solve(late).kinds == ("takeoff",) and crossing > 30
    other = neighbour(late, ("horizon",))
    assert other.found and other.attempts[-1].label == ("grazing",)
    early = read({**late.equations, "parameters": {**late.equations["parameters"], "b": "1.2"}})
    assert solve(early).kinds == ("takeoff",) and not neighbour(early, ("horizon",)).found


def test_two_events_at_one_time_have_neighbours_in_both_orders():
    """Two joints on unlike springs; the second starts such that both turn at once."""
    first, second = solve(pair("1")).events[:2]
    assert {first.kind, second.kind} == {"a_reverses", "b_reverses"}
    low, high = mp.mpf("0.3"), mp.mpf("2")
    for _ in range(60):
        middle = (low + high) / 2
        ahead = solve(pair(middle)).events[0].kind == "b_reverses"
        low, high = (middle, high) if ahead else (low, middle)
    problem = read(pair(float(low)))
    kinds = solve(problem).kinds
    other = neighbour(problem, (kinds[1], kinds[0], *kinds[2:]))
    assert other.found and other.attempts[0].label[0] == "order"


def pair(speed: Any) -> dict[str, Any]:
    """Two joints that know nothing of each other; b turns later the faster it starts."""
    zero = [["0", "0"], ["0", "0"]]
    return {
        "name": "two joints",
        "coordinates": ["a", "b"],
        "parameters": {"k": 7.0, "F": 0.3},
        "start": {"v_a": 1.0, "v_b": speed},
        "position": [0, 0],
        "velocity": ["v_a", "v_b"],
        "mass": [[1, 0], [0, 1]],
        "stiffness": [["k", 0], [0, "4*k/5"]],
        "damping": zero,
        "elements": [
            {"name": "a", "direction": [1, 0], "friction": ["F", "F"]},
            {"name": "b", "direction": [0, 1], "friction": ["F", "F"]},
        ],
        "outputs": {"v_a": {"v": [1, 0]}, "v_b": {"v": [0, 1]}},
        "units": {"time": 1, "v_a": 1, "v_b": 1},
        "horizon": 1,
    }


BALANCED = {"m": 1.0, "k": 30.0, "b": 0.5, "q": 0.2, "horizon": 1.0}
"""A joint that nothing holds, at rest; its spring draws it by 6 N."""


@pytest.mark.parametrize("ulps", [-40, -3, 1, 40])
def test_what_no_friction_holds_has_a_neighbour_that_rests_where_its_forces_may_cancel(ulps):
    """Both sides of the balance move: it is met by moving all inputs by less than 32 ulp. Farther away nothing rests."""
    load = mp.mpf(30.0) * mp.mpf(0.2) + ulps * mp.mpf(math.ulp(6.0))
    joint = read(builders.joint(**BALANCED, load=load))
    assert solve(joint).kinds == ("q_reverses", "horizon")
    other = neighbour(joint, ("rest",))
    assert other.solution is not None and other.attempts[-1].label[:2] == ("on", "hold")
    moves = [abs(q - joint.inputs()[name]) for name, q in other.solution.problem.inputs().items() if mp.isfinite(q)]
    most = [32 * ulp(q, 53) for q in joint.inputs().values() if mp.isfinite(q)]
    assert all(p <= q for p, q in zip(moves, most, strict=True)) and any(moves)
    assert not neighbour(read(builders.joint(**BALANCED, load=load + 400 * ulps * math.ulp(6.0))), ("rest",)).found


def test_two_that_nothing_holds_have_a_neighbour_in_which_both_rest():
    def balances(off: float) -> Any:
        text = pair("0") | {"start": {"q_a": 0.1, "q_b": 0.3}, "position": ["q_a", "q_b"], "velocity": [0, 0]}
        loads = {"of_a": 7.0 * 0.1 * (1 + off), "of_b": 4.0 * 7.0 / 5.0 * 0.3 * (1 - off)}
        outputs, units = {"q_a": {"q": [1, 0]}, "q_b": {"q": [0, 1]}}, {"time": 1, "q_a": 1, "q_b": 1}
        text |= {"force": list(loads), "parameters": {"k": 7.0, "F": 0.0} | loads, "outputs": outputs, "units": units}
        return read(text)

    assert solve(balances(1e-15)).kinds == ("horizon",)
    assert neighbour(balances(1e-15), ("rest",)).found and not neighbour(balances(1e-13), ("rest",)).found


def test_a_neighbour_may_have_started_otherwise_without_an_event():
    """Held at its friction, or let go there: that is no event, but afterwards the lists differ."""
    start = {"m": 1.0, "k": 30.0, "F_plus": 6.0, "F_minus": 6.0, "q": -0.2}
    held, let_go = (
        read(builders.joint(**start, load=off, u=[[0, 0.0], [0.5, 1.0]], horizon=3.0)) for off in (-1e-15, 1e-15)
    )
    lists = [solve(held).kinds, solve(let_go).kinds]
    assert lists[0] != lists[1] and lists[0][0] == "q_slips"
    further = read(builders.joint(**start, load=1e-12, u=[[0, 0.0], [0.5, 1.0]], horizon=3.0))
    for problem, kinds in ((held, lists[1]), (let_go, lists[0])):
        assert neighbour(problem, kinds).found, kinds
    assert solve(further).kinds == lists[1] and not neighbour(further, lists[0]).found


# ---- the judge ----


def answer_of(motion: Any, **changes: Any) -> Answer:
    events = [(float(event.time), event.kind) for event in motion.events]
    final = {name: float(q) for name, q in motion.final.items()}
    gains = {name: float(q) for name, q in motion.gains.items() if name in motion.system.units}
    return replace(Answer(motion.status, float(motion.duration), events, final, gains), **changes)


@pytest.mark.parametrize("path", needs.the_first(FIXTURES, 2), ids=lambda path: path.stem)
def test_the_exact_answer_is_right_and_one_that_is_off_is_not(path):
    motion = solve(path)
    verdict = compare(motion.problem, answer_of(motion))
    assert verdict.outcome == RIGHT and verdict.ratio < 1e-15 and not verdict.condition
    name, value = next((name, q) for name, q in motion.final.items() if name in motion.system.units)
    off = answer_of(motion, final={name: value + mp.mpf("1e-7") * motion.system.units[name]})
    wrong = compare(motion.problem, off)
    assert wrong.outcome == WRONG and abs(wrong.errors["state"] - 1e-7) < 1e-12
    assert compare(motion.problem, off, digits=24).outcome == RIGHT
    late = compare(motion.problem, answer_of(motion, duration=motion.duration * (1 + mp.mpf("1e-7"))), digits=24)
    share = motion.duration / max(motion.duration, motion.system.units["time"])
    assert abs(late.errors["state"] - 1e-7 * share) < 1e-12


def test_an_answer_without_an_event_is_wrong():
    motion = solve(builders.stance(HOPPER, v2=DROP, u="3"))
    assert compare(motion.problem, answer_of(motion, events=[])).outcome == WRONG


def test_an_answer_that_was_given_up_is_judged_up_to_there():
    ringing = builders.joint(m="1", k="100", v="1")
    short = answer_of(solve(ringing | {"max_phases": 4}))
    assert short.kinds == ("q_reverses",) * 4 + ("too_many_phases",) and compare(ringing, short).outcome == RIGHT
    assert compare(ringing, replace(short, events=short.events[:3])).outcome == WRONG


def test_the_answer_of_a_neighbour_is_excused():
    low = lowest_turn()
    joint = read(builders.joint(**SWING, q_min=low))
    other = neighbour(joint, MISS if solve(joint).kinds == HIT else HIT).solution
    assert other is not None
    assert compare(joint, answer_of(other)).outcome == EXCUSED


def test_the_condition_of_a_free_mass_is_that_of_its_formula():
    """q = v_0 t + gamma u t^2/(2 m) = 1 + 1 at t = 1: v_0, gamma, u and m each count 1 m in 0.1 m."""
    free = solve(builders.joint(m="1", k="0", v="1", u="2", horizon="1"))
    assert abs(conditions(free)["state"] - 40) < 1e-20


def test_the_condition_counts_the_start_of_each_later_phase():
    """q = v_0 t, and from 1 s on q_1 + v_1 (t - 1): v_0 counts 2 m in 0.1 m, q_1 and v_1 1 m each."""
    free = solve(builders.joint(m="1", v="1", u=[["0", "0"], ["1", "0"]], horizon="2"))
    assert abs(conditions(free)["state"] - 40) < 1e-20


def test_a_grazing_answer_is_judged_by_its_condition():
    """A slow reversal: its time has a condition far above 1, which its error is divided by."""
    joint = read(builders.joint(m=1.0, k=0.0, load=-1e-9, v=1e-9, horizon=2.0))
    verdict = compare(joint, answer_of(solve(joint)), condition=True)
    assert verdict.outcome == RIGHT and verdict.condition["state"] >= 1
