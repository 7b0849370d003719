"""What the project claims of the paper, falsified: with the printed equation in the model, or in a step of the
derivation, the proof named beside it fails.
"""

import dataclasses
from collections.abc import Callable
from types import ModuleType

import pytest
import sympy as sp

from derive.ir import Step
from derive.maths import control, energy, flight, laplace, partial_fractions
from derive.model import quantities as Q
from derive.model.equations import Model
from tests.unit import test_derivation as derivation
from tests.unit import test_equations as equations

Proof = Callable[[], None]


def fails(proof: Proof) -> bool:
    """Whether a proof fails, which keeps nothing of what it derives."""
    kept = (derivation.parameters, derivation.trajectory)
    for cached in kept:
        cached.cache_clear()
    try:
        proof()
    except (AssertionError, equations.Unbalanced):
        return True
    finally:
        for cached in kept:
            cached.cache_clear()
    return False


def with_step(
    patch: pytest.MonkeyPatch, module: ModuleType, function: str, symbol: sp.Symbol, value: Callable[..., sp.Expr]
) -> None:
    """Change the value of one step of a function of the derivation."""
    made = getattr(module, function)

    def changed(*given: object) -> tuple[Step, ...]:
        steps = made(*given)
        assert symbol in {step.symbol for step in steps}
        return tuple(
            dataclasses.replace(step, value=value(step.value)) if step.symbol == symbol else step for step in steps
        )

    patch.setattr(module, function, changed)


# ---- (1)-(4): the model itself ----


class FrictionPerMass(Model):
    """(8) as printed: f_2/m_s."""

    @property
    def forces(self) -> tuple[sp.Expr, sp.Expr]:
        actuator, body = super().forces
        return actuator, body + Q.m_s * Q.f2 * Q.side_2 - Q.f2 * Q.side_2


class WithoutOffsetForce(Model):
    """(1), (3) without the constant k c that they have beside the Lagrangian."""

    @property
    def forces(self) -> tuple[sp.Expr, sp.Expr]:
        actuator, body = super().forces
        return actuator - Q.k * Q.c, body


def like_the_hopper(kind: type[Model]) -> Model:
    return kind(**{each.name: getattr(derivation.HOPPER, each.name) for each in dataclasses.fields(Model)})


@pytest.mark.parametrize(
    ("module", "model", "proof"),
    [
        (derivation, like_the_hopper(FrictionPerMass), derivation.test_rates_and_drive_give_back_the_accelerations),
        (derivation, like_the_hopper(FrictionPerMass), derivation.test_the_body_gains_the_aed),
        (
            equations,
            like_the_hopper(WithoutOffsetForce),
            equations.test_1_and_3_pull_the_actuator_with_a_constant_force_that_the_lagrangian_does_not_have,
        ),
    ],
    ids=["(8)_breaks_the_drive", "(8)_breaks_the_ledger", "(3)_without_k_c"],
)
def test_a_model_with_another_force_is_noticed(monkeypatch, module, model, proof):
    assert not fails(proof)
    monkeypatch.setattr(module, "HOPPER", model)
    assert fails(proof)


# ---- (5)-(27): one step as printed ----

with_both = (derivation.HOPPER, (1, 2))
AS_PRINTED: dict[str, tuple[ModuleType, str, sp.Symbol, Callable[..., sp.Expr], Proof]] = {
    "(8) f_2/m_s": (
        laplace, "drive_of", Q.C_2, lambda value: value.subs(Q.f2, Q.f2 / Q.m_s),
        derivation.test_rates_and_drive_give_back_the_accelerations,
    ),
    "(10), (15) friction of an actuator that moves up, always": (
        laplace, "drive_of", Q.C_1, lambda value: value.subs(Q.side_1, 1),
        derivation.test_rates_and_drive_give_back_the_accelerations,
    ),
    "(14) plus b_1 gamma/m_eff": (
        laplace, "numerators", Q.H2_2, lambda value: value + 2 * Q.a1_v1 * Q.C_2,
        lambda: derivation.test_velocities_obey_3_and_4(*with_both),
    ),
    "(14) against the transforms": (
        laplace, "numerators", Q.H2_2, lambda value: value + 2 * Q.a1_v1 * Q.C_2,
        lambda: derivation.test_the_numerators_are_those_of_11_to_17_counted_from_the_start(derivation.HOPPER),
    ),
    "(18) another sign in what it divides by": (
        partial_fractions, "residue", Q.chi, lambda value: 2 * Q.q - value,
        derivation.test_chi_is_what_the_pair_is_at_the_pole,
    ),
    "(25) before the impact": (
        control, "touchdown_velocity", control.v_after, lambda value: value.subs(Q.impact_loss, 0),
        derivation.test_a_drop_arrives_with_the_energy_of_its_height_less_the_impact,
    ),
    "(25) before the impact of any later touchdown": (
        flight, "velocity_after_impact", flight.v2_after, lambda value: value.subs(Q.impact_loss, 0),
        derivation.test_a_touchdown_keeps_the_share_of_the_kinetic_energy_that_the_impact_leaves,
    ),
    "(26) half of the step, of either sign": (
        control, "apex_from_energy", control.E_dist, lambda _: Q.m_s * Q.g * sp.Abs(control.step) / 2,
        derivation.test_a_lower_ground_adds_its_depth_to_the_apex_that_must_be_reached,
    ),
    "(27) without the spring coordinate": (
        control, "apex_from_energy", control.apex, lambda value: value.subs({Q.k: 0}) - Q.x1,
        derivation.test_the_apex_from_energies_is_the_apex_of_the_takeoff,
    ),
    "(5) of the mass of the body": (
        control, "threshold_current", control.u_threshold, lambda value: value.subs(Q.m_eff, Q.m_s),
        derivation.test_the_threshold_moves_an_unloaded_actuator,
    ),
}  # fmt: skip


@pytest.mark.parametrize("claim", AS_PRINTED)
def test_a_step_as_printed_is_noticed(monkeypatch, claim):
    module, function, symbol, value, proof = AS_PRINTED[claim]
    assert not fails(proof)
    with_step(monkeypatch, module, function, symbol, value)
    assert fails(proof)


# ---- (24): the powers of the ledger ----


@pytest.mark.parametrize(
    ("entry", "power", "proof"),
    [
        (Q.viscous_2, Q.b2 * Q.v2**2, derivation.test_the_body_gains_the_aed),
        (Q.viscous_2, Q.b2 * Q.v2**2, derivation.test_friction_only_takes),
        (Q.coulomb_2, -Q.f2 * Q.side_2 * Q.v2, derivation.test_the_body_gains_the_aed),
        (Q.motor_work, Q.gamma2 * Q.u * Q.v1, derivation.test_the_whole_robot_gains_what_the_ledger_says),
        (Q.spring_work, -Q.k * Q.x1 * Q.v2, derivation.test_the_body_gains_the_aed),
    ],
    ids=["plus_b_2", "plus_b_2_takes", "f_2_without_m_s", "motor_work_swapped", "spring_work_swapped"],
)
def test_24_with_another_term_is_noticed(monkeypatch, entry, power, proof):
    assert not fails(proof)
    powers = energy.powers
    monkeypatch.setattr(energy, "powers", lambda model: powers(model) | {entry: power})
    assert fails(proof)


# ---- units, orders, shares ----


def test_a_friction_of_the_body_in_newtons_is_noticed(monkeypatch):
    def proof() -> None:
        equations.test_derived_terms_balance(4)

    assert not fails(proof)
    quantities = tuple(
        dataclasses.replace(each, unit="N") if each.name == "f2" else each for each in derivation.HOPPER.parameters
    )
    monkeypatch.setattr(equations, "HOPPER", dataclasses.replace(derivation.HOPPER, parameters=quantities))
    assert fails(proof)


def test_a_variation_without_the_currents_own_share_is_noticed(monkeypatch):
    variations = derivation.variations
    assert not fails(derivation.test_a_variation_is_driven_by_the_derivatives_of_the_right_sides)
    monkeypatch.setattr(derivation, "variations", lambda model: variations(model) | {Q.u: (sp.S.Zero, sp.S.Zero)})
    assert fails(derivation.test_a_variation_is_driven_by_the_derivatives_of_the_right_sides)
