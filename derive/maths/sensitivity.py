"""How a stance depends on its inputs, to first order: a change d_p of each input changes the state by d_x1, d_v1, d_v2,
d_y.

Within a phase z = (1, x_1, y, v_1, v_2) obeys z' = M z, so its change obeys d_z' = M d_z + d_M z. Only the rows of (3),
(4) in M depend on anything; their changes are `Slopes`. The change of a formula of several steps is formed step by
step.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import sympy as sp

from ..emit.ir import Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from . import control, laplace


def _changed(quantity: Quantity) -> Quantity:
    return Quantity(
        f"d_{quantity.name}", rf"\delta {quantity.glyph}", quantity.unit, f"change of the {quantity.meaning}"
    )


def changes(record: Record) -> Record:
    """A change of each quantity of a record."""
    return Record(f"{record.name}Change", f"Changes: {record.meaning}", tuple(map(_changed, record.quantities)))


SLOPES = Record("Slopes", "Change of the right sides of (3), (4), by what its shares go with: 1, y, v_1, v_2.").of(
    *map(_changed, (DRIVE.quantities[0], *RATES.quantities[:3], DRIVE.quantities[1], *RATES.quantities[5:8]))
)
ROBOT_CHANGE = changes(ROBOT)
STATE_CHANGE = changes(STATE)
CURRENT_CHANGE = _changed(CURRENT)


def change_of(symbol: sp.Symbol) -> sp.Symbol:
    return sp.Symbol(f"d_{symbol}", real=True)


def changed(value: sp.Expr, inputs: Iterable[sp.Symbol]) -> sp.Expr:
    """The change of an expression where the inputs change, to first order."""
    return sp.expand(sum((value.diff(symbol) * change_of(symbol) for symbol in inputs), sp.S.Zero))


def changed_steps(steps: Sequence[Step], inputs: Sequence[sp.Symbol], wanted: Sequence[sp.Symbol]) -> tuple[Step, ...]:
    """The changes `wanted`, step by step, with those of the steps themselves that they read."""
    moving, made = list(inputs), list[Step]()
    for step in steps:
        made += [step, Step(change_of(step.symbol), changed(step.value, moving), f"change of {step.source}")]
        moving.append(step.symbol)
    needed, kept = set(wanted), list[Step]()
    for step in reversed(made):
        if step.symbol in needed:
            kept.append(step)
            needed |= step.value.free_symbols
    return tuple(reversed(kept))


@function(takes=(ROBOT, CURRENT, SIDE_1, SIDE_2, ROBOT_CHANGE, CURRENT_CHANGE), returns=SLOPES)
def slopes_of(model: Model) -> Steps:
    """Change of the right sides of (3), (4) with the robot and the current."""
    rates = [step for step in laplace.rates_of(model) if step.symbol in RATES.symbols[:9]]
    return changed_steps((*rates, *laplace.drive_of(model)), (*model.robot.symbols, u), SLOPES.symbols)


@function(takes=(ROBOT, STATE, ROBOT_CHANGE, STATE_CHANGE), returns=scalar("d_body", "J", "change of the energy"))
def body_energy_change(model: Model) -> Steps:
    """Change of the energy of the body with the robot and the state, x_2 counted from L_0 + c.

    That at the end less that at the start is the change of the AED.
    """
    length, kinetic, weight, spring = sp.symbols("length kinetic weight spring", real=True)
    steps = (
        Step(length, x1 - y, "x_2 - L_0 - c"),
        Step(kinetic, m_s * v2**2 / 2, "(22) kinetic"),
        Step(weight, m_s * g * length, "(22), (23) weight"),
        Step(spring, k * length**2 / 2, "(22), (23) spring"),
        Step(body, kinetic + weight + spring, "(22), (23)"),
    )
    return changed_steps(steps, (*model.robot.symbols, x1, v2, y), (change_of(body),))


@function(
    takes=(ROBOT, STATE.quantities[2], ROBOT_CHANGE, STATE_CHANGE),
    returns=scalar("d_apex", "m", "change of the hop height of the apex"),
)
def apex_change(model: Model) -> Steps:
    """Change of the apex with the robot and the state at take-off, v_2 being max(v_2, 0)."""
    steps = [replace(step, value=step.value.subs(control.v_up, v2)) for step in control.apex_of_takeoff(model)]
    return changed_steps(steps, (*model.robot.symbols, x1, v2, y), (change_of(control.apex),))
