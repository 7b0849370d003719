"""How a stance depends on its inputs, to first order: a change d_p of each input changes the state by d_x1, d_v1, d_v2,
d_y.

Within a phase z = (1, x_1, y, v_1, v_2) obeys z' = M z, so its change obeys d_z' = M d_z + d_M z. Only the rows of (3),
(4) in M depend on anything; their changes are `Slopes`. The change of a formula of several steps is formed step by
step.
"""

from collections.abc import Iterable, Sequence

import sympy as sp

from ..emit.ir import Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from . import control, laplace

SLOPES = Record("Slopes", "Change of the right sides of (3), (4), by what each share of it goes with.").of(
    Quantity("d_C_1", r"\delta C_1", "m/s^2", "change of the acceleration of the actuator, constant in a phase"),
    Quantity("d_a1_y", r"\delta a_{1y}", "1/s^2", "the same per y"),
    Quantity("d_a1_v1", r"\delta a_{11}", "1/s", "the same per v_1"),
    Quantity("d_a1_v2", r"\delta a_{12}", "1/s", "the same per v_2"),
    Quantity("d_C_2", r"\delta C_2", "m/s^2", "change of the acceleration of the body, constant in a phase"),
    Quantity("d_a2_y", r"\delta a_{2y}", "1/s^2", "the same per y"),
    Quantity("d_a2_v1", r"\delta a_{21}", "1/s", "the same per v_1"),
    Quantity("d_a2_v2", r"\delta a_{22}", "1/s", "the same per v_2"),
)


def _changed(quantity: Quantity) -> Quantity:
    return Quantity(
        f"d_{quantity.name}", rf"\delta {quantity.glyph}", quantity.unit, f"change of the {quantity.meaning}"
    )


def changes(record: Record) -> Record:
    """A change of each quantity of a record."""
    return Record(f"{record.name}Change", f"Changes: {record.meaning}", tuple(map(_changed, record.quantities)))


ROBOT_CHANGE = changes(ROBOT)
STATE_CHANGE = changes(STATE)
CURRENT_CHANGE = _changed(CURRENT)


def change_of(symbol: sp.Symbol) -> sp.Symbol:
    return sp.Symbol(f"d_{symbol}", real=True)


def _change_of(symbol: sp.Symbol, unit: str, meaning: str) -> Quantity:
    return scalar(str(change_of(symbol)), unit, meaning)


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


@function(takes=(ROBOT, STATE, ROBOT_CHANGE, STATE_CHANGE), returns=_change_of(body, "J", "change of the energy"))
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
    takes=(
        ROBOT,
        control.V_UP,
        ROBOT_CHANGE,
        _change_of(x1, "m", "change of the actuator's displacement at take-off"),
        _change_of(y, "m", "change of the compression at take-off"),
        _change_of(control.v_up, "m/s", "change of v_up"),
    ),
    returns=_change_of(control.apex, "m", "change of the hop height of the apex"),
)
def apex_change(model: Model) -> Steps:
    """Change of the apex with the robot and the state at take-off."""
    inputs = (*model.robot.symbols, x1, y, control.v_up)
    return changed_steps(control.apex_of_takeoff(model), inputs, (change_of(control.apex),))
