"""The figures of the explanations show what the pages say of them."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import hopform
from tests import needs

PAGES = Path(__file__).resolve().parents[2] / "docs" / "explanation"


@pytest.fixture(scope="module")
def figures():
    return runpy.run_path(str(PAGES / "figures.py"))


def test_every_figure_stands_on_one_page(figures):
    """But for the stance, which the README shows from docs/images."""
    marks = re.findall(r"^<!-- figure (\w+) -->$", "\n".join(p.read_text("utf-8") for p in PAGES.glob("*.md")), re.M)
    assert sorted([*marks, "stance"]) == sorted(figure.__name__ for figure in figures["FIGURES"])


@pytest.mark.sliced
@needs.library
def test_the_figures_are_drawn(figures, tmp_path):
    figures["draw"](tmp_path / "drawn")
    assert {path.stem for path in (tmp_path / "drawn").iterdir()} == {each.__name__ for each in figures["FIGURES"]}


def test_near_equal_poles_cost_partial_fractions_their_digits_and_hopform_none(figures):
    times = np.linspace(0.02, 0.5, 25)
    for distance in (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 0.5):
        exact, computed, ours = figures["errors_of_w"](10.0 * np.array([1, 1, 1]) + [-10 * distance, 0, 20 * distance],
                                                       times)  # fmt: skip
        assert ours < 4e-15
        assert 1e-18 < exact * distance**2 < 1e-14
        assert computed < 1e-3
        if distance < 1e-6:
            assert computed > 1e-7


def test_a_dip_lies_between_samples_and_the_signs_count_its_zeros(figures):
    edge = figures["last_current_with_a_dip"](0.36, 0.38)
    for u, zeros in ((edge - 0.002, 2), (edge + 0.002, 0)):
        t, g, rate, d = figures["in_one_interval"](u)
        assert np.count_nonzero(np.diff(np.sign(g))) == zeros
        assert np.interp(0.005 * np.arange(28, 31), t, g).min() > 0.0
        assert d.min() > 0.0
        assert np.count_nonzero(np.diff(np.sign(rate))) == 1
        stance = hopform.solve_stance(figures["RINGING"], v2=figures["V2"], u=u)
        assert (stance.duration < t[-1]) == (zeros == 2)
        inside = t[t < stance.duration]
        y = np.array(stance.at(inside).x1) - stance.at(inside).x2 + figures["RINGING"].L0 + figures["RINGING"].c
        assert np.abs(y - g[: inside.size]).max() < 1e-12
        assert np.abs(np.gradient(g, t) - rate)[1:-1].max() < 1e-4


@needs.library
def test_the_search_that_is_drawn_is_that_of_the_controller(figures):
    body, v2 = figures["BODY"], hopform.touchdown_velocity(figures["BODY"], height=0.05)
    tried, apexes, waiting = figures["search"](v2, 0.03)
    command = hopform.choose_current(body, v2=v2, h_des=0.03)
    assert (tried[7], apexes[7], len(tried)) == (command.u, command.apex, command.solved) and len(tried) == 9
    assert [round(1e3 * bound, 1) for _, _, bound in waiting[3] if bound > 0.0] == [2.1]
    holds = [any(start <= command.u <= end for start, end, _ in row) for row in waiting]
    assert holds == [False, *[True] * 6, False, False]
