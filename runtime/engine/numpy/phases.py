# SPDX-License-Identifier: MIT-0
"""A phase: its poles and numerators by mode, and its state over time. All lanes at once."""

from typing import NamedTuple

import numpy as np

from hopform_solver import formulas
from hopform_solver.kernels import basis_at, factor_cubic
from hopform_solver.lanes import Array, choose, put, take
from hopform_solver.records import Basis, Drive, LegState, Motion, Numerator, Poles, Rates, Robot
from hopform_solver.stability import conditions


class Plan(NamedTuple):
    """What is computed once per robot: coefficients of the equations of motion and poles of each mode."""

    robot: Robot
    rates: Rates
    both: Poles
    actuator: Poles
    body: Poles


class Phase(NamedTuple):
    """Phases: of which robot, from which state, under which current, and in which mode.

    side (2, lanes): the sign of each velocity, 0 where the mass is held.
    """

    plan: Plan
    start: LegState
    u: Array
    side: Array


def stable_rates_of(robot: Robot) -> Rates:
    """Coefficients of the equations of motion; ValueError names the condition that lets a motion grow."""
    rates = formulas.rates_of(robot)
    for name, value, who in conditions(rates):
        if (negative := np.asarray(value)[np.asarray(value) < 0.0]).size:
            raise ValueError(
                f"the robot is unstable, {who}: Routh's condition {name} >= 0 is violated, "
                f"{name} = {float(negative[0])!r}"
            )
    return rates


def plan_of(robot: Robot) -> Plan:
    """The plan of robots whose fields are arrays of one length; ValueError if one of them is unstable."""
    zero = np.zeros_like(robot.m_eff)
    rates = Rates(*(zero + value for value in stable_rates_of(robot)))
    return Plan(
        robot,
        rates,
        factor_cubic(rates.s_1, rates.s_2, rates.s_3),
        pair_alone(rates.p_1, rates.q_1),
        pair_alone(rates.p_2, rates.q_2),
    )


def pair_alone(p: Array, q: Array) -> Poles:
    """The poles of one mass while the other one is held."""
    zero = np.zeros_like(p)
    return Poles(zero, p, q, p, q, zero)


def poles_of(plan: Plan, side: Array) -> Poles:
    """The poles of each lane's mode."""
    modes = zip(plan.both, plan.actuator, plan.body, strict=True)
    held_1, held_2 = side == 0.0
    return Poles(*(choose(held_1, body, choose(held_2, actuator, both)) for both, actuator, body in modes))


def motion_under(rates: Rates, drive: Drive, state: LegState, side: Array) -> Motion:
    """The numerators of each lane's mode from the state in which the phase starts, under constant accelerations."""
    motion = Motion(*np.zeros((len(Motion._fields), side.shape[1]), side.dtype))
    moves_1, moves_2 = side != 0.0
    for lanes, formula in (
        (moves_1 & moves_2, formulas.motion_of_both),
        (moves_1 & ~moves_2, formulas.motion_of_actuator),
        (~moves_1 & moves_2, formulas.motion_of_body),
    ):
        if lanes.any():
            put(motion, lanes, formula(*take((rates, drive, state), lanes)))
    return motion


def drive_of(phase: Phase) -> Drive:
    """The constant accelerations of phases."""
    return formulas.drive_of(phase.plan.robot, phase.plan.rates, phase.u, *phase.side)


def motion_of(phase: Phase) -> Motion:
    """The numerators of phases."""
    return motion_under(phase.plan.rates, drive_of(phase), phase.start, phase.side)


def contact_numerator(robot: Robot, motion: Motion) -> Numerator:
    """The numerator of the contact force over k."""
    none = np.zeros_like(motion.H3_y)
    return Numerator(*(formulas.contact_slope(robot, LegState(none, *motion[n:9:3])) for n in range(3)))


def arrive(state: LegState, motion: Motion, basis: Basis, side: Array) -> LegState:
    """The state of a phase where the response of the poles is `basis`; what is held stays exactly where it is."""
    at = formulas.state_at(state, motion, basis)
    held_1, held_2 = side == 0.0
    return LegState(
        choose(held_1, state.x1, at.x1_t),
        choose(held_1, 0.0, at.v1_t),
        choose(held_2, 0.0, at.v2_t),
        choose(held_1 & held_2, state.y, at.y_t),
    )


def state_in_phase(phase: Phase, t: Array) -> LegState:
    """The state at time t since a phase began."""
    basis = basis_at(poles_of(phase.plan, phase.side), t)
    return arrive(phase.start, motion_of(phase), basis, phase.side)
