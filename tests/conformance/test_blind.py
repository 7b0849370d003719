"""What a fit says of rigs that do what no element of the model says, on a few of `tests.conformance.blind`."""

import dataclasses
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from scipy.linalg import expm

from hopform.identify import Fit
from hopform.identify import _alternatives as alternatives
from hopform.identify import _causes as causes
from hopform.identify import _current_noise as current_noise
from hopform.identify import _estimation as estimation
from hopform.identify import _rivals as rivals
from tests import needs
from tests.conformance import blind
from tests.conformance.blind import CELLS, EFFECTS, Cell, drawn, fitted, measure, recorded
from tests.derived import SHIPPED, solver_of
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate


@pytest.fixture(scope="module", autouse=True)
def joint(store: Path) -> Iterator[None]:
    """The solver of the joint that ships, built once per run of the tests."""
    solver = solver_of(store, SHIPPED / "joint.py")
    with patch.object(blind, "_joint", lambda: solver):
        yield


QUICK: dict[str, Any] = {"compare": False, "holdout": False}


@cache
def fit_of(kind: str, effect: str, number: int) -> tuple[Fit, dict[str, float]]:
    of, rng = drawn(kind, effect, number)
    return fitted(of, [recorded(of, rng)], **QUICK)


def names(fit: Fit) -> list[str]:
    """The causes that are named."""
    return [each.name for each in fit.diagnoses if not each.possible]


def intervals(fit: Fit, truth: dict[str, float]) -> list[bool]:
    """Whether the intervals that are given hold the truth."""
    given = [each for each in fit.estimates if each.name in truth and math.isfinite(each.high - each.low)]
    return [each.low <= truth[each.name] <= each.high for each in given]


def test_a_spring_that_hardens_is_possible_and_not_gravity():
    """Its cube whitens the residuals as the sine does, of the wrong sign and size; no element has it, so no name."""
    fit, truth = fit_of("decay", "hardening", 1)
    assert not names(fit) and fit.diagnoses[0].name == "hardening"
    assert not intervals(fit, truth)
    assert "possible causes of rms" in fit.warnings[-1] and "none of which stands out" in fit.warnings[-1]


def test_a_drift_of_the_sensor_is_in_position_and_no_load():
    fit, truth = fit_of("decay", "drift", 1)
    assert names(fit) == ["sensor drift"] and not intervals(fit, truth)
    of, _ = drawn("decay", "drift", 1)
    assert next(iter(fit.diagnoses[0].values.values())) == pytest.approx(of.drifts, rel=0.3)


@pytest.mark.sliced
def test_noise_of_the_current_is_known_by_itself_and_gives_intervals():
    """They hold the truth, under residuals that are not white."""
    fits = [fit_of("joint", "current noise", n) for n in range(3)]
    held = [each for fit, truth in fits for each in intervals(fit, truth)]
    assert len(held) == 9 and sum(held) >= 8
    assert not any(fit.diagnoses for fit, _ in fits)
    assert all(current_noise.SAID in fit.statements for fit, _ in fits)
    assert not all(fit.traces[0].tests.white for fit, _ in fits)


@pytest.mark.sliced
def test_the_level_of_a_currents_noise_is_that_of_the_draw():
    of, rng = drawn("joint", "current noise", 1)
    fit, _ = fitted(of, [recorded(of, rng)], **ALONE)
    assert current_noise.level(fit.solution.experiments[0]) == pytest.approx(of.noise_of_current, rel=0.15)
    rippling = dataclasses.replace(fit.solution.experiments[0], steps=tuple(
        (t, u + 0.3 * math.cos(2.0 * math.pi * n / 3.0)) for n, (t, u) in enumerate(fit.solution.experiments[0].steps)
    ))  # fmt: skip
    assert current_noise.level(rippling) == 0.0, "a ripple of the driver moves the mass"
    clean, rng = drawn("joint", "sound", 1)
    fit, _ = fitted(clean, [recorded(clean, rng)], **ALONE)
    assert current_noise.level(fit.solution.experiments[0]) == 0.0


def test_causes_are_looked_for_only_where_residuals_are_no_noise(monkeypatch):
    asked = list[bool]()
    monkeypatch.setattr(causes, "diagnose", lambda *_: asked.append(True) or ())
    of, rng = drawn("decay", "sound", 0)
    made = recorded(of, rng)
    fitted(of, [made], **QUICK)
    assert not asked
    fitted(of, [made], diagnose=True, **QUICK)
    assert asked


def test_a_jump_of_the_data_is_a_warning_with_its_times():
    of, rng = drawn("drop", "gap", 1)
    fit, _ = fitted(of, [recorded(of, rng)], **ALONE)
    jump = (of.gap or (0, 0))[0] / of.rate
    assert any("are samples lost there" in each for each in fit.warnings)
    found = rivals.jumps_of(fit.solution.experiments[0].time, fit.solution.experiments[0].measured)[0]
    assert found.before + fit.solution.experiments[0].begin == pytest.approx(jump, abs=1.5 / of.rate)
    for kind in ("held", "drop"):
        sound, _ = fit_of(kind, "sound", 0)
        assert not any("samples lost" in each for each in sound.warnings)


@pytest.mark.parametrize("middle, lost", [(300, 100), (400, 160)])
def test_lost_samples_show_as_a_jump_of_the_place_or_of_the_velocity(middle, lost):
    """About the bottom of a sine only the velocity is another one; where it passes 0 the place is. The sine alone has no
    jump."""
    time, rng = np.arange(800) / 400.0, np.random.default_rng(2)
    x = np.sin(2.0 * np.pi * time) + 1e-4 * rng.standard_normal(time.size)
    assert not rivals.jumps_of(time, x)
    first = middle - lost // 2
    cut = np.delete(x, np.s_[first : first + lost])
    jump = rivals.jumps_of(time[: cut.size], cut)[0]
    assert abs(jump.sample - first) <= 2 and (jump.speed != 0.0) == (middle == 300)


@pytest.mark.sliced
def test_a_load_that_is_neither_fitted_nor_given_is_a_known_value_that_is_off():
    """The joint has a constant load of a twentieth of its largest torque: as one that a motor lifts."""
    of, rng = drawn("joint", "sound", 0)
    more = 0.05 * float(np.abs(of.u).max())
    made = recorded(dataclasses.replace(of, u=of.u + more), rng)
    logged = {n: c._replace(values=c.values - more) if c.title == "i_A" else c for n, c in made.columns.items()}
    fit, _ = fitted(of, [dataclasses.replace(made, columns=logged)], **QUICK)
    first = fit.diagnoses[0]
    assert first.name == "known value" and first.option == "add load to --fitted"
    assert first.values["load"] == pytest.approx(of.rig.gamma * more, rel=0.02)


@pytest.mark.sliced
def test_a_drive_that_pushes_one_way_cannot_tell_friction_by_load():
    of, rng = drawn("joint", "sound", 0)
    words = "cannot be distinguished from a smaller force constant"
    for u, said in ((of.u, False), (np.abs(of.u), True)):
        pushed = blind.replace(of, u=u)
        fit, _ = fitted(pushed, [recorded(pushed, rng)], **ALONE)
        assert any(words in each for each in fit.statements) == said


@pytest.mark.parametrize("number", needs.the_first([3, 1]))
def test_the_response_to_a_force_is_that_of_the_motion(number):
    """Of the linear equation between turns, against the difference of two exact motions, through rests and turns."""
    fit, _ = fit_of("held", "sound", number)
    (experiment,) = fit.solution.experiments
    at = rivals.along_of(experiment, fit.solution.values)
    assert ((at.v[:-1] == 0.0) & (at.v[1:] == 0.0)).any() and (at.v[:-1] * at.v[1:] < 0.0).any()
    wave = np.sin(7.0 * at.t)
    exact = experiment.response_to(fit.solution.values, lambda _: -wave, 1e-3)
    linear = rivals.seen_at(experiment, at, rivals._carried(at, wave[:, np.newaxis]))[:, 0]  # noqa: SLF001
    assert np.abs(linear - exact).max() < 0.02 * np.abs(exact).max()


def test_an_interval_of_a_decay_allows_for_a_link_that_bends():
    """It makes the inertia seem larger and leaves nothing: that of the model without it is off by 34 half widths."""
    of, rng = drawn("decay", "link", 523)
    fit, truth = fitted(of, [recorded(of, rng)], diagnose=False, **QUICK)
    plain = next(each for each in estimation.estimates(fit.solution)[0] if each.name == "J")
    off = 0.5 * (plain.low + plain.high) - truth["J"]
    assert off > 10.0 * (plain.high - plain.low)
    assert 0.5 * (fit["J"].low + fit["J"].high) - truth["J"] < 2.0 * (fit["J"].high - fit["J"].low)
    assert any("J" in each and "a link that bends" in each for each in fit.statements)


def test_an_interval_allows_for_friction_by_load_that_a_drive_of_one_sign_does_not_show():
    """It is a smaller force constant, exactly: so is the direction that the fit takes for it."""
    of, rng = drawn("joint", "loaded", 510)
    fit, truth = fitted(of, [recorded(of, rng)], diagnose=False, **QUICK)
    assert intervals(fit, truth) == [True, True, True]
    loaded = next(each for each in alternatives.missed(fit.solution) if each.of.name == "loaded")
    assert math.isinf(loaded.error)


@pytest.mark.parametrize("at_link", [0.0, 1.0])
def test_a_rig_with_a_link_moves_as_two_masses_on_springs(at_link):
    """By the exponential of their matrix: what is fitted to its recordings is off by the link and not by time steps."""
    rig = Rig(0.02, 4.5, 0.003, 0.0, start=0.4, link=0.005, link_k=79.0, link_b=0.025, at_link=at_link)
    rate, count = 200.0, 300
    rows = np.array([
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
        np.array([-rig.k - rig.link_k, rig.link_k, -rig.b - rig.link_b, rig.link_b]) / rig.mass,
        np.array([rig.link_k, -rig.link_k, rig.link_b, -rig.link_b]) / rig.link,
    ])  # fmt: skip
    step, state, exact = expm(rows / rate), np.array([rig.start, rig.start, 0.0, 0.0]), list[float]()
    for _ in range(count):
        exact.append(float(state[int(at_link)]))
        state = step @ state
    assert np.abs(simulate(rig, np.zeros(count), rate) - exact).max() < 1e-6


def test_every_cell_is_of_an_effect_that_is_drawn():
    assert {effect for effects in CELLS.values() for effect in effects} == EFFECTS.keys()
    of, rng = drawn("joint", "gap", 0)
    assert recorded(of, rng).time.size == of.u.size - of.gap[1]


def test_a_cell_counts_names_that_are_there_and_that_are_not():
    fit, truth = fit_of("decay", "drift", 1)
    cell = Cell()
    cell.score(fit, truth, 0)
    assert (cell.right("drift"), cell.wrong("drift"), cell.right("lag"), cell.wrong("lag")) == (1, 0, 0, 1)


@pytest.mark.nightly
def test_of_blind_fits_names_are_right_and_intervals_hold():
    """Three rigs of each cell: of 20 names at most one is wrong, 90 % of the intervals hold, 3 % of the fits are gross
    and silent."""
    cells = {(k, e): measure(k, e, range(3), **QUICK) for k, effects in CELLS.items() for e in effects}
    right, wrong = (sum(of(e) for (_, e), of in ((key, getattr(c, way)) for key, c in cells.items()))
                    for way in ("right", "wrong"))  # fmt: skip
    assert right >= 12 and wrong <= (right + wrong) / 20.0
    assert sum(c.inside for c in cells.values()) >= 0.9 * sum(c.total for c in cells.values())
    assert sum(len(c.gross) for c in cells.values()) <= 0.03 * sum(c.fits for c in cells.values())
