"""How a stance depends on its inputs, to first order: a change d_p of each input changes the state by d_x1, d_v1, d_v2,
d_y.

Within a phase z obeys z' = M z, `linear.py`, so its change obeys d_z' = M d_z + d_M z. Only the rows of (3), (4) in M
depend on anything, and over a gear that of y on its ratio; their changes are `Slopes`. The change of a formula of several steps is formed step by step.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import sympy as sp

from ..ir import Own, OwnChange, Parameter, ParameterChange, Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from . import control, elements, energy, laplace, law, modes


def change_of_quantity(quantity: Quantity) -> Quantity:
    """The change of a quantity, as one."""
    kind = ParameterChange if isinstance(quantity, Parameter) else Quantity
    return kind(f"d_{quantity.name}", rf"\delta {quantity.glyph}", quantity.unit, f"change of the {quantity.meaning}")


def changes(record: Record) -> Record:
    """A change of each quantity of a record."""
    return Record(
        f"{record.name}Change", f"Changes: {record.meaning}", tuple(map(change_of_quantity, record.quantities))
    )


RIGHT_SIDES = {quantity.symbol: quantity for quantity in (*RATES.quantities, *DRIVE.quantities)}
SLOPES = Record("Slopes", "Change of the right sides of (3), (4), by what its shares go with: v_1, v_2, y, 1.").of(
    *(change_of_quantity(RIGHT_SIDES[entry]) for entry in (a1_v1, a1_v2, a1_y, C_1, a2_v1, a2_v2, a2_y, C_2))
)
ROBOT_CHANGE = changes(ROBOT)
STATE_CHANGE = changes(STATE)
CURRENT_CHANGE = change_of_quantity(CURRENT)
APEX_CHANGE = scalar("d_apex", "m", "change of the hop height of the apex")
HEIGHT_CHANGE = change_of_quantity(BODY_HEIGHT)


def change_of(symbol: sp.Symbol) -> sp.Symbol:
    return (OwnChange if isinstance(symbol, Own) else type(symbol))(f"d_{symbol}", real=True)


def changed(value: sp.Expr, inputs: Iterable[sp.Symbol]) -> sp.Expr:
    """The change of an expression where the inputs change, to first order."""
    return sp.expand(sum((value.diff(symbol) * change_of(symbol) for symbol in inputs), sp.S.Zero))


def changed_steps(steps: Sequence[Step], inputs: Sequence[sp.Symbol], asked: Sequence[sp.Symbol]) -> tuple[Step, ...]:
    """The changes `asked`, step by step, with those of the steps themselves that they read."""
    moving, all_steps = list(inputs), list[Step]()
    for step in steps:
        all_steps += [step, Step(change_of(step.symbol), changed(step.value, moving), f"change of {step.source}")]
        moving.append(step.symbol)
    needed, kept = set(asked), list[Step]()
    for step in reversed(all_steps):
        if step.symbol in needed:
            kept.append(step)
            needed |= step.value.free_symbols
    return tuple(reversed(kept))


@function(takes=(ROBOT, CURRENT, SIDE_1, SIDE_2, LIMIT_SIGN, ROBOT_CHANGE, CURRENT_CHANGE), returns=SLOPES)
def slopes_of(model: Model) -> Steps:
    """Change of the right sides of (3), (4) with the robot and the current."""
    rates = [step for step in laplace.rates_by_limit(model) if step.symbol in RATES.symbols[:9]]
    steps = model.in_parameters((*rates, *laplace.drive_of(model)))
    if not model.is_geared:
        return changed_steps(steps, (*model.robot.symbols, u), SLOPES.symbols)
    steps = model.in_parameters(
        (*rates, *(step for step in laplace.rates_of(model) if step.symbol == y_v1), *laplace.drive_of(model))
    )
    asked = slopes_record(model).symbols
    of_stretch = (Step(symbol, sp.S.Zero, "no force") for symbol in asked[len(SLOPES.quantities) + 1 :])
    return (*changed_steps(steps, (*model.robot.symbols, u), asked[: len(SLOPES.quantities) + 1]), *of_stretch)


def slopes_record(model: Model) -> Record:
    """Those of a model: with a gear the rate of the compression changes, too."""
    if not model.is_geared:
        return SLOPES
    rest = (scalar(f"d_y_{of}", "1/s", "0: change of the rate of the compression") for of in ("v2", "y", "0"))
    return SLOPES.of(*SLOPES.quantities, change_of_quantity(RATES_OF_GEAR[0]), *rest)


LOWEST_CHANGE, HIGHEST_CHANGE = change_of_quantity(elements.LOWEST), change_of_quantity(elements.HIGHEST)


@function(takes=(ROBOT, ROBOT_CHANGE), returns=LOWEST_CHANGE)
def lower_stop_change(model: Model) -> Steps:
    """Change of the lower end of the stroke with the robot."""
    steps = model.in_parameters(elements.lower_stop())
    return changed_steps(steps, model.robot.symbols, LOWEST_CHANGE.symbols)


@function(takes=(ROBOT, ROBOT_CHANGE), returns=HIGHEST_CHANGE)
def upper_stop_change(model: Model) -> Steps:
    """Change of the upper end of the stroke with the robot."""
    steps = model.in_parameters(elements.upper_stop())
    return changed_steps(steps, model.robot.symbols, HIGHEST_CHANGE.symbols)


LIMIT_CHANGE = change_of_quantity(elements.LIMIT)


@function(takes=(ROBOT, ROBOT_CHANGE), returns=LIMIT_CHANGE, of_contact=True)
def current_limit_change(model: Model) -> Steps:
    """Change of the largest size of the current with the robot."""
    steps = model.in_parameters(elements.current_limit())
    return changed_steps(steps, model.robot.symbols, LIMIT_CHANGE.symbols)


REACHED_CHANGE = change_of_quantity(law.REACHED)


@function(takes=(ROBOT, LIMIT_SIGN, ROBOT_CHANGE, CURRENT_CHANGE), returns=REACHED_CHANGE)
def input_at_limit_change(model: Model) -> Steps:
    """Change of the input at a limit with the robot and the input."""
    steps = model.in_parameters(law.input_at_limit(model))
    return changed_steps(steps, (*model.robot.symbols, u), REACHED_CHANGE.symbols)


@function(takes=(RATES, STATE_CHANGE), returns=FREE)
def free_slopes() -> Steps:
    """Change of the free accelerations with the state."""
    for step in modes.free_accelerations():
        yield replace(step, value=changed(step.value, (v1, v2, y)))


@function(takes=(ROBOT, ROBOT_CHANGE), returns=modes.EXCESS)
def excess_change(model: Model) -> Steps:
    """Change of the friction at rest, less that of the friction in motion, with the robot."""
    steps = model.in_parameters(modes.excess_of(model))
    symbols = {change_of(symbol): symbol for symbol in modes.EXCESS.symbols}
    for step in changed_steps(steps, model.robot.symbols, tuple(symbols)):
        yield replace(step, symbol=symbols.get(step.symbol, step.symbol))


@function(
    takes=(ROBOT, STATE, ROBOT_CHANGE, STATE_CHANGE),
    returns=scalar("d_body", "J", "change of the energy"),
    of_contact=True,
)
def body_energy_change(model: Model) -> Steps:
    """Change of the energy of the body with the robot and the state, x_2 counted from the leg without load.

    That at the end less that at the start is the change of the AED.
    """
    length, kinetic, weight, spring = sp.symbols("length kinetic weight spring", real=True)
    steps, rest = laplace.rest_of_spring(model)
    steps = (
        *steps,
        Step(length, x1 - y, "hop height of the body"),
        Step(kinetic, m_s * v2**2 / 2, "(22) kinetic"),
        Step(weight, m_s * g * length, "(22), (23) weight"),
        Step(spring, k * (length - rest) ** 2 / 2, "(22), (23) spring"),
        Step(body, kinetic + weight + spring, "(22), (23)"),
    )
    return changed_steps(model.in_parameters(steps), (*model.robot.symbols, x1, v2, y), (change_of(body),))


@function(takes=(ROBOT, STATE, ROBOT_CHANGE, STATE_CHANGE), returns=APEX_CHANGE, of_contact=True)
def apex_change(model: Model) -> Steps:
    """Change of the apex with the robot and the state at take-off; a body that falls does not rise."""
    up, change = control.v_up, change_of(v2)
    steps = model.in_parameters(control.apex_of_takeoff(model))
    steps = changed_steps(steps, (*model.robot.symbols, x1, up, y), (change_of(control.apex),))
    yield Step(up, (v2 + sp.Abs(v2)) / 2, "max(v_2, 0)")
    yield from (replace(step, value=step.value.subs(change_of(up), change)) for step in steps)


@function(takes=(ROBOT, STATE, STATE_CHANGE), returns=APEX_CHANGE, of_contact=True)
def apex_slope(model: Model) -> Steps:
    """Change of the apex with the state at take-off alone."""
    unchanged = dict.fromkeys(map(change_of, model.robot.symbols), 0)
    yield from (replace(step, value=step.value.subs(unchanged)) for step in apex_change(model))


@function(takes=(ROBOT, STATE, ROBOT_CHANGE, STATE_CHANGE), returns=HEIGHT_CHANGE)
def height_change(model: Model) -> Steps:
    """Change of the body's height with the robot and the state."""
    steps = model.in_parameters(energy.second_position(model))
    return changed_steps(steps, (*model.robot.symbols, x1, y), (change_of(x2),))
