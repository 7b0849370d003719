# SPDX-License-Identifier: MIT-0
"""A phase: its poles and numerators by mode, and its state over time. All lanes at once.

Arrays of two axes have a row for each element, or for each axis of the state, in the order of `elements`.
"""

from typing import NamedTuple

import numpy as np

from . import formulas
from .elements import FOLLOWS, MODES
from .kernels import basis_at, factor_cubic
from .lanes import Array, choose, lanes_in, put, take
from .records import Basis, Drive, LegState, Motion, Poles, Rates, Robot
from .stability import conditions

MOVES_WITH = np.array(FOLLOWS)[..., np.newaxis] != 0
"""(axes, elements, 1): which elements move an axis of the state."""


class Plan(NamedTuple):
    """What is computed once per robot: coefficients of the equations of motion and poles, (modes, 6, lanes)."""

    robot: Robot
    rates: Rates
    poles: Array


class Phase(NamedTuple):
    """Phases: of which robot, from which state, under which current, and in which mode.

    side (elements, lanes): the sign of each velocity, 0 where the element is held.
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
    """The plan of robots whose fields are arrays of one length; ValueError if one of them is unstable.

    Of a model with a law it is that at a limit of the current, which is then the u of a phase and side[1] its sign.
    """
    return _plan(robot, stable_rates_of(robot))


def plan_under_law(robot: Robot) -> Plan:
    """The plan of robots of a model with a law between the limits: the u of a phase is the target, side[1] 0."""
    stable_rates_of(robot)
    return _plan(robot, formulas.rates_under_law(robot))


def _plan(robot: Robot, of_robot: Rates) -> Plan:
    zero = np.zeros_like(robot[0])
    rates = Rates(*(zero + value for value in of_robot))
    polynomials = [[rates[n] for n in mode.polynomial] for mode in MODES]
    return Plan(robot, rates, np.array([pair_alone(*s) if len(s) == 2 else factor_cubic(*s) for s in polynomials]))


def pair_alone(p: Array, q: Array) -> Poles:
    """The poles of an element that slips while the others are held."""
    zero = np.zeros_like(p)
    return Poles(zero, p, q, p, q, zero)


def poles_of(plan: Plan, side: Array) -> Poles:
    """The poles of each lane's mode; any where all is held."""
    *others, poles = plan.poles
    for mode, own in zip(MODES, others, strict=False):
        poles = choose(lanes_in(mode.slips, side), own, poles)
    return Poles(*poles)


def motion_under(rates: Rates, drive: Drive, state: LegState, side: Array) -> Motion:
    """The numerators of each lane's mode from the state in which the phase starts, under constant accelerations."""
    motion = Motion(*np.zeros((len(Motion._fields), side.shape[1]), side.dtype))
    for mode in MODES:
        if (lanes := lanes_in(mode.slips, side)).any():
            put(motion, lanes, mode.motion(*take((rates, drive, state), lanes)))
    return motion


def drive_of(phase: Phase) -> Drive:
    """The constant accelerations of phases."""
    drive = formulas.drive_of(phase.plan.robot, phase.plan.rates, phase.u, *phase.side)
    return Drive(*(np.zeros_like(phase.u) + value for value in drive))


def motion_of(phase: Phase) -> Motion:
    """The numerators of phases."""
    return motion_under(phase.plan.rates, drive_of(phase), phase.start, phase.side)


def arrive(state: LegState, motion: Motion, basis: Basis, side: Array) -> LegState:
    """The state of a phase where the response of the poles is `basis`; what is held stays exactly where it is."""
    moves = (MOVES_WITH & (side != 0.0)).any(axis=1)
    return LegState(*map(choose, moves, formulas.state_at(state, motion, basis), state))


def state_in_phase(phase: Phase, t: Array) -> LegState:
    """The state at time t since a phase began."""
    basis = basis_at(poles_of(phase.plan, phase.side), t)
    return arrive(phase.start, motion_of(phase), basis, phase.side)
