"""What a search promises, over a table of recordings: to know less never fits worse, a start is never left for a worse
end, a cause that is named brings what it says where its option is taken, and a verdict's advice changes it.
"""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pytest

import hopform
import hopform.identify
from hopform.identify import _estimation as estimation
from hopform.identify._fits import Fit
from hopform.identify._joint import fit_robot
from hopform.identify._report import verdict
from tests import needs
from tests.conformance.test_nuisances import step
from tests.derived import solver_of
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate
from tests.unit.test_model_fits import RATE, Pendulum, driven, table

PRECISION = 1e-6
"""Share of a rms by which one that is no higher may be higher."""
WHOLE: dict[str, Any] = {"compare": False, "holdout": False}


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, "joint")


class Case(NamedTuple):
    """A recording, what is known of its joint, and whether gravity is its spring; what is fitted beside friction and
    J is known as the file of a joint has it.
    """

    recording: Any
    known: Mapping[str, float | str]
    sine: bool

    def fit(self, joint: Any, freed: tuple[str, ...] = (), **how: Any) -> Fit:
        """The fit of J, viscous and Coulomb friction, alike either way, and of what is freed."""
        known = {name: value for name, value in self.known.items() if name not in freed}
        fitted = [*(name for name in ("J", "b", "F_plus") if name not in known), *freed]
        return hopform.identify.fit(joint, self.recording, fitted=fitted, known=known, sine=self.sine, **(ALONE | how))


def swinging(of: Pendulum, start: float, count: int, seed: int, slack: float = 0.0, quantum: float = 0.0) -> Case:
    """A pendulum that is let go; quantum: of the encoder, else with noise of 1 mrad."""
    phi = slack + of.swings(start, count)
    if quantum:
        phi = quantum * np.round(phi / quantum)
    else:
        phi = phi + 1e-3 * np.random.default_rng(seed).standard_normal(count)
    return Case(table("time_s,phi_rad", phi), {"k": of.K, "k_t": 1.0, "phi_0": 0.0, "F_minus": "F_plus"}, True)


def sprung(rig: Rig, count: int, quantum: float) -> Case:
    """A joint on a spring that is let go, by an encoder."""
    phi = quantum * np.round(simulate(rig, np.zeros(count), RATE) / quantum)
    return Case(table("time_s,phi_rad", phi), {"k": rig.k, "k_t": 1.0, "phi_0": 0.0, "F_minus": "F_plus"}, False)


def under_a_current(seed: int) -> Case:
    rig, recording = driven(seed)
    return Case(recording, {"J": rig.mass, "k": rig.k, "k_t": rig.gamma, "F_minus": "F_plus", "phi_0": 0.0}, False)


QUANTUM = 2.0 * math.pi / 4096.0
CASES: Mapping[str, Callable[[], Case]] = {
    "a pendulum from 80 degrees": lambda: swinging(Pendulum(), 1.4, 800, 1),
    "one that hangs aside": lambda: swinging(Pendulum(), 1.4, 800, 2, slack=0.05),
    "friction by direction, by an encoder": lambda: swinging(Pendulum(F=0.008, more=0.01), 2.2, 1000, 3, 0.0, QUANTUM),
    "light, for 8 s": lambda: swinging(Pendulum(b=5e-4, F=0.003, more=0.003), 1.4, 3200, 4),
    "from 160 degrees": lambda: swinging(Pendulum(), 2.8, 1600, 5),
    "on a spring": lambda: sprung(Rig(0.0071, 0.4807, 0.002, 1.7, start=0.4), 1200, QUANTUM),
    "under a current": lambda: under_a_current(3),
}
FREED = [("phi_0",), ("F_minus",), ("phi_0", "F_minus"), ("k_t",)]
PAIRS = [(name, freed) for name in CASES for freed in FREED if (freed == ("k_t",)) == (name == "under a current")]


@pytest.mark.parametrize(("name", "freed"), needs.sliced(*PAIRS))
def test_freeing_a_value_never_raises_the_rms(joint, name, freed):
    """Nor does freeing one of the two of a pair, nor the stiffness beside them, near which it was known."""
    case = CASES[name]()
    held, free = case.fit(joint), case.fit(joint, freed)
    assert free.rms <= held.rms * (1.0 + PRECISION)
    near = {"start": {"k": case.known["k"]}} if "J" in case.known else {}
    if near:
        assert case.fit(joint, (*freed, "k"), **near).rms <= free.rms * (1.0 + PRECISION)
    for one in freed if len(freed) > 1 else ():
        assert free.rms <= case.fit(joint, (one,)).rms * (1.0 + PRECISION)


@pytest.mark.parametrize("name", needs.sliced(*((name,) for name in CASES)))
def test_a_start_is_never_left_for_a_worse_end(joint, name):
    """Near what was known, and what was fitted beside it, a fit ends no higher than with this known."""
    case = CASES[name]()
    found, fitted = case.fit(joint), [name for name in ("J", "F_plus") if name not in case.known]
    for share in (1.0, 1.02):
        values = {name: share * found[name].value for name in fitted}
        held = hopform.identify.fit(
            joint, case.recording, fitted=["b"], known=replace_known(case, values), sine=case.sine, **ALONE
        )
        assert case.fit(joint, start={**values, "b": held["b"].value}).rms <= held.rms * (1.0 + PRECISION)


def replace_known(case: Case, values: Mapping[str, float]) -> dict[str, float | str]:
    """What is known, with what was fitted; what was alike is so by its value."""
    return {**{n: values.get(v, v) if isinstance(v, str) else v for n, v in case.known.items()}, **values}


# ---- causes ----


def lagging(_: Any, **how: Any) -> Fit:
    return fit_robot(steps=step(1, lag=0.006), known={"m_eff": 25.0}, **(WHOLE | how))


def off_its_slack(joint: Any, **how: Any) -> Fit:
    return _of(joint, swinging(Pendulum(), 1.4, 800, 6, slack=0.02), **how)


def by_direction(joint: Any, **how: Any) -> Fit:
    return _of(joint, swinging(Pendulum(F=0.008, more=0.01), 1.4, 800, 7), **how)


def by_a_coarse_encoder(joint: Any, **how: Any) -> Fit:
    rig = Rig(0.0071, 0.4807, 0.002, 0.012 / 0.0071, start=0.3)
    turned = Pendulum(F=0.012, more=0.002, K=rig.k)
    phi = 4.0 * QUANTUM * np.round(turned.swings(0.3, 3200) / QUANTUM / 4.0)
    return _of(joint, Case(table("time_s,phi_rad", phi), sprung(rig, 100, QUANTUM).known, True), **how)


def _of(joint: Any, case: Case, freed: Mapping[str, float] | None = None, **how: Any) -> Fit:
    freed = freed or {}
    return case.fit(joint, tuple(freed), **(WHOLE | {"diagnose": True, "start": dict(freed)} | how))


MAKERS: Mapping[str, Callable[..., Fit]] = {
    each.__name__: each for each in (off_its_slack, by_direction, by_a_coarse_encoder, lagging)
}


@pytest.mark.parametrize("name", needs.sliced(*((name,) for name in MAKERS)))
def test_the_rms_of_a_named_cause_is_reached_by_its_option(joint, name):
    make = MAKERS[name]
    fit = make(joint)
    assert fit.diagnoses and verdict(fit).startswith("The model does not explain")
    for each in fit.diagnoses:
        if each.name == "known value":
            starts = dict(re.findall(r"--near (\w+)=(\S+)", each.option))
            added = re.findall(r"add (\w+) to --fitted", each.option)
            assert sorted([*starts, *added]) == sorted(each.values)
            other = make(joint, freed=each.values, start={n: float(v) for n, v in starts.items()})
        elif each.name in ("lag", "gain", "clock"):
            other = make(joint, nuisances=(each.name,))
            assert f"--{each.name}" in each.option
        else:
            continue
        assert other.rms <= each.after * (1.0 + PRECISION), each
    assert any(each.option for each in fit.diagnoses)


# ---- verdicts ----


def test_too_few_samples_are_enough_when_recorded_for_longer(joint):
    rig, rng = Rig(0.0071, 0.4807, 0.002, 1.0, start=0.4), np.random.default_rng(2)
    phi = simulate(rig, np.zeros(120), 40.0) + 1e-3 * rng.standard_normal(120)
    known = {"k": rig.k, "k_t": 1.0, "phi_0": 0.0, "F_minus": "F_plus"}
    few, more = (Case(table("time_s,phi_rad", phi[:count], rate=40.0), known, False) for count in (50, 120))
    assert "record for longer" in verdict(few.fit(joint))
    assert verdict(more.fit(joint)).startswith("The model explains")


@pytest.mark.sliced
def test_friction_known_to_be_alike_that_is_not_is_no_lack_of_samples(joint):
    """8 s by a coarse encoder: residuals below its count with a memory. What is named is what explains them."""
    fit = by_a_coarse_encoder(joint)
    assert "record for longer" not in verdict(fit)
    named = next(each for each in fit.diagnoses if "F_minus" in each.values)
    assert verdict(by_a_coarse_encoder(joint, freed=named.values)).startswith("The model explains")


@pytest.mark.sliced
def test_a_value_that_fits_as_well_is_inside_the_interval(joint):
    """A joint falls once and sticks: of friction and a load their sum is fixed, and that the friction holds the load."""
    rig = Rig(0.0071, 0.4807, 0.05, 0.1 / 0.0071, start=0.6)
    known: dict[str, float | str] = {"k": rig.k, "k_t": 1.0, "phi_0": 0.0, "F_minus": "F_plus"}
    fell, asked = simulate(rig, np.zeros(600), RATE), 0
    for seed in range(1, 5):
        phi = QUANTUM * np.round((fell + 3e-4 * np.random.default_rng(seed).standard_normal(600)) / QUANTUM)
        case = Case(table("time_s,phi_rad", phi), known, False)
        fit = case.fit(joint, ("load",))
        count, each = fit.solution.count, fit["F_plus"]
        for friction in (0.05, 0.1, 0.3, 1.0):
            held = {**known, "F_plus": friction, "F_minus": friction}
            other = hopform.identify.fit(joint, case.recording, fitted=["J", "b", "load"], known=held, **ALONE)
            if count * ((other.rms / fit.rms) ** 2 - 1.0) < 3.0:
                asked += 1
                assert each.low <= friction <= each.high, (seed, friction, each)
    assert asked > 8


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_profile_that_does_not_close_has_no_end(side):
    """A sum of squares that grows up to a level below the quantile, against one that grows beyond it late."""

    def end(level: float) -> float:
        return estimation._cross(lambda x: min((x - 1.0) ** 2, level), 1.0, side, 4.0, -math.inf)

    assert end(3.0) == side * math.inf
    assert end(math.inf) == pytest.approx(1.0 + 2.0 * side, rel=0.05)
    late = estimation._cross(lambda x: 0.01 * (x - 1.0) ** 2, 1.0, side, 4.0, -math.inf)
    assert late == pytest.approx(1.0 + 20.0 * side, rel=0.05)


def test_a_fit_shows_its_rms_in_the_unit_of_its_recording(joint):
    fit = sprung(Rig(0.0071, 0.4807, 0.002, 1.7, start=0.4), 400, QUANTUM).fit(joint)
    assert f"rms = {fit.rms:.5g} rad" in repr(fit)
    metres = fit_robot(steps=step(), known={"m_eff": 25.0}, **ALONE)
    assert f"rms = {metres.rms:.5g} m," in repr(metres)
