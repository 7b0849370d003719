"""`stance.explain()` says what the engine did: the stance is the same to the bit, its event functions are the motion's,
and every moment of a phase is certified.
"""

import math
from itertools import pairwise

import numpy as np
import pytest

import hopform
from hopform import _front as cli
from hopform._explain import RULES, searches_of
from tests.conformance.random_stances import random_robot
from tests.unit.test_explanations import PAGES, figures  # noqa: F401


def stances(count, dtype="float64"):
    for seed in range(count):
        robot, how = random_robot(seed)
        try:
            yield hopform.solve_stance(robot, **how | {"max_phases": 20}, dtype=dtype)
        except hopform.HopformError:
            continue


def explained(stance):
    return searches_of(stance, stance._asked)


@pytest.fixture(scope="module")
def page():
    robot = hopform.load_robot("hopper_c")
    return hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, height=0.2), u=0.75)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_the_stance_that_is_explained_is_the_stance_to_the_bit(dtype):
    several = list(stances(120, dtype))
    assert len(several) > 100
    for stance in several:
        solved, _ = explained(stance)
        assert solved.phase_rows() == stance._solved.phase_rows()
        assert repr(solved.outcome()) == repr(stance._solved.outcome())


def test_every_moment_of_a_phase_is_certified_for_every_event_function():
    rules = set()
    for stance in stances(120):
        for search in explained(stance)[1].values():
            for function in search.functions:
                intervals = function.intervals
                rules |= {each.rule for each in intervals}
                if math.isnan(function.zero):
                    assert (intervals[0].start, intervals[-1].end) == (0.0, search.length)
                assert all(one.end == other.start for one, other in pairwise(intervals))
                assert all(one.start < one.end or search.length == 0.0 for one in intervals)
    assert {word.split(",")[0] for word in rules} >= {"rule 1", "rule 2", "rule 4", "rule 5"}


def motion(stance, phase, name, t):
    """An event function by its name, from the motion and the equations (3), (4)."""
    robot, state, y = stance.robot, stance.at(t), stance.compression(t)
    if name == "N/k":
        return stance.contact_force(t) / robot.k
    if name == "x1_max - x1":
        return robot.x1_max - state.x1
    if name == "x1 - x1_min":
        return state.x1 - robot.x1_min
    if "v" in name:
        return (-1.0 if name[0] == "-" else 1.0) * getattr(state, name.lstrip("-"))
    *friction, sign, acceleration = name.split()
    free = {
        "a1": (-robot.gamma2 * phase.u - robot.k * (y - robot.c) - robot.b1 * state.v1) / robot.m_eff,
        "a2": (robot.k * y - robot.b2 * state.v2) / robot.m_s - robot.g,
    }
    at_rest = sum(getattr(robot, each) for each in friction if each != "+")
    return at_rest + {"-": -1.0, "+": 1.0}[sign] * free[acceleration]


def test_event_functions_are_those_of_the_motion_and_positive_until_the_phase_ends():
    names = set()
    for stance in stances(120):
        _, searches = explained(stance)
        for n, phase in enumerate(stance.phases):
            search = searches.get(n)
            if search is None or phase.end - phase.start < 1e-9:
                continue
            assert search.length == pytest.approx(phase.end - phase.start, rel=1e-9)
            t = np.linspace(phase.start, phase.end, 41)[:-1]
            for function in search.functions:
                g = motion(stance, phase, function.name, t)
                size = max(abs(function.start), abs(function.end), float(np.abs(g).max()))
                names.add(function.name)
                assert g[0] == pytest.approx(function.start, abs=1e-9 * size)
                assert g.min() > -1e-9 * size
                assert not function.ends or abs(function.end) < 1e-9 * size
    assert names >= {"N/k", "v1", "-v1", "v2", "-v2", "x1 - x1_min", "x1_max - x1", "f1 + a1", "f1 - a1"}
    assert any("_excess" in name for name in names)


def test_one_function_ends_each_phase_that_an_event_ends(page):
    endings = [[each.name for each in search.functions if each.ends] for search in explained(page)[1].values()]
    assert endings == [["v1"], ["f1 + a1"], ["x1 - x1_min"], ["-v2"], ["f1 - a1"], ["N/k"]]


def test_a_minimum_above_zero_is_told_by_rule_4(figures):  # noqa: F811
    """The page on the certificate draws it: 2 mA above the last current whose minimum takes off."""
    u = figures["last_current_with_a_dip"](0.36, 0.38) + 0.002
    stance = hopform.solve_stance(figures["RINGING"], v2=figures["V2"], u=u)
    assert "N/k" in (text := stance.explain())
    assert RULES["cut_at_minimum"] in text


def test_the_poles_of_a_mode_are_the_roots_of_its_polynomial(page):
    robot = page.robot
    both = [
        1.0, robot.b1 / robot.m_eff + robot.b2 / robot.m_s,
        robot.k / robot.m_eff + robot.k / robot.m_s + robot.b1 * robot.b2 / (robot.m_eff * robot.m_s),
        robot.k * (robot.b1 + robot.b2) / (robot.m_eff * robot.m_s),
    ]  # fmt: skip
    body = [1.0, robot.b2 / robot.m_s, robot.k / robot.m_s]
    _, searches = explained(page)
    for row, polynomial in ((0, both), (1, body)):
        poles = searches[row].poles
        assert np.abs(np.polyval(polynomial, poles)).max() < 1e-9 * abs(polynomial[-1])
        assert searches[row].half_period == pytest.approx(math.pi / max(pole.imag for pole in poles))


def test_steps_of_the_current_and_a_bound_on_phases_are_explained():
    robot = hopform.load_robot("hopper_c")
    steps = hopform.solve_stance(robot, v2=-1.9, u=[(0.0, 2.0), (0.05, 3.0)])
    assert "then a step of u" in steps.explain()
    short = hopform.solve_stance(robot, v2=-1.9, u=0.75, max_phases=2)
    assert short.explain().count("Phase ") == len(short.phases)
    resting = hopform.solve_stance(robot, v2=0.0, compression=(robot.m_s * robot.g) / robot.k, horizon=0.1)
    assert resting.status == "rest"
    assert "nothing moves" in resting.explain()


def test_more_notes_than_there_is_room_for_at_first_are_all_kept(page, monkeypatch):
    whole = explained(page)[1]
    monkeypatch.setattr("hopform._explain.FIRST_ROOM", 3)
    assert explained(page)[1] == whole


def test_the_command_explains(capsys, page):
    asked = ["stance", "--height", "0.2", "--u", "0.75", "--explain"]
    assert cli.main(asked) == 0
    assert page.explain() in capsys.readouterr().out
    assert cli.main([*asked, "--json"]) == 2
    assert capsys.readouterr().err == "hopform: --json and --explain exclude each other\n"
