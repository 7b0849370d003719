# SPDX-License-Identifier: MIT-0
"""A phase: its poles and numerators by mode, and its state over time. All lanes at once."""

from typing import NamedTuple

import numpy as np

from hopform_solver import formulas
from hopform_solver.kernels import basis_at, factor_cubic
from hopform_solver.lanes import Array, Lanes, blank, choose, put, take
from hopform_solver.records import Basis, Drive, LegState, Motion, Numerator, Poles, Rates, Robot
from hopform_solver.stability import conditions


class Plan(NamedTuple):
    """What is computed once per robot: coefficients of the equations of motion and poles of each mode."""

    robot: Robot
    rates: Rates
    both: Poles
    actuator: Poles
    body: Poles


class Side(NamedTuple):
    """The mode: the sign of each velocity, 0 where the mass is held."""

    first: Array
    second: Array


def refuse_negative(value: Array, name: str, who: str) -> None:
    """ValueError if one of the values that a condition of stability is about is negative."""
    negative = np.asarray(value)[np.asarray(value) < 0.0]
    if negative.size:
        raise ValueError(
            f"the robot is unstable, {who}: Routh's condition {name} >= 0 is violated, {name} = {float(negative[0])!r}"
        )


def stable_rates_of(robot: Robot) -> Rates:
    """Coefficients of the equations of motion; ValueError names the condition that lets a motion grow."""
    rates = formulas.rates_of(robot)
    for name, value, who in conditions(rates):
        refuse_negative(value, name, who)
    return rates


def plan_of(robot: Robot) -> Plan:
    """The plan of robots whose fields are arrays of one length; ValueError if one of them is unstable."""
    zero = np.zeros_like(robot.m_eff)
    rates = Rates(*(zero + value for value in stable_rates_of(robot)))
    return Plan(
        robot,
        rates,
        factor_cubic(*np.array([rates.s_1, rates.s_2, rates.s_3])),
        Poles(zero, rates.p_1, rates.q_1, rates.p_1, rates.q_1, zero),
        Poles(zero, rates.p_2, rates.q_2, rates.p_2, rates.q_2, zero),
    )


def plan_lanes(plan: Plan, lanes: Lanes) -> Plan:
    robot, rates, both, actuator, body = plan
    return Plan(take(robot, lanes), take(rates, lanes), take(both, lanes), take(actuator, lanes), take(body, lanes))


def poles_of(plan: Plan, side: Side) -> Poles:
    """The poles of each lane's mode."""
    holds_1, holds_2 = side.first == 0.0, side.second == 0.0
    return Poles(
        *(
            choose(holds_1, body, choose(holds_2, actuator, both))
            for both, actuator, body in zip(plan.both, plan.actuator, plan.body, strict=True)
        )
    )


def motion_under(rates: Rates, drive: Drive, state: LegState, side: Side) -> Motion:
    """The numerators of each lane's mode from the state in which the phase starts, under constant accelerations."""
    motion = blank(Motion, side.first)
    moves_1, moves_2 = side.first != 0.0, side.second != 0.0
    for lanes, formula in (
        (moves_1 & moves_2, formulas.motion_of_both),
        (moves_1 & ~moves_2, formulas.motion_of_actuator),
        (~moves_1 & moves_2, formulas.motion_of_body),
    ):
        if lanes.any():
            put(motion, lanes, formula(take(rates, lanes), take(drive, lanes), take(state, lanes)))
    return motion


def motion_of(plan: Plan, state: LegState, u: Array, side: Side) -> Motion:
    """The same under a current."""
    return motion_under(plan.rates, formulas.drive_of(plan.robot, plan.rates, u, *side), state, side)


def contact_numerator(robot: Robot, motion: Motion) -> Numerator:
    """The numerator of the contact force over k."""
    none = np.zeros_like(motion.H3_y)
    of_state = ((motion[n], motion[n + 3], motion[n + 6]) for n in range(3))
    return Numerator(
        *(formulas.contact_slope(robot, LegState(none, of_1, of_2, of_y)) for of_1, of_2, of_y in of_state)
    )


def arrive(state: LegState, motion: Motion, basis: Basis, side: Side) -> LegState:
    """The state of a phase where the response of the poles is `basis`; what is held stays exactly where it is."""
    at = formulas.state_at(state, motion, basis)
    holds_1, holds_2 = side.first == 0.0, side.second == 0.0
    return LegState(
        np.where(holds_1, state.x1, at.x1_t),
        np.where(holds_1, 0.0, at.v1_t).astype(at.v1_t.dtype),
        np.where(holds_2, 0.0, at.v2_t).astype(at.v2_t.dtype),
        np.where(holds_1 & holds_2, state.y, at.y_t),
    )


def state_in_phase(plan: Plan, start: LegState, u: Array, side: Side, t: Array) -> LegState:
    """The state at time t since a phase began."""
    return arrive(start, motion_of(plan, start, u, side), basis_at(poles_of(plan, side), t), side)
