"""How a stance depends on its inputs, to first order: a change d_p of each input changes the state by d_x1, d_v1, d_v2, d_y.

Within a phase z = (1, x_1, y, v_1, v_2) obeys z' = M z, so its change obeys d_z' = M d_z + d_M z. Only the rows of (3), (4) in M
depend on anything; their changes are `Slopes`. The change of a formula of several steps is formed step by step.
"""

from collections.abc import Iterable, Sequence

import sympy as sp

from derive import control, laplace
from derive.ir import Quantity, Record, Step
from derive.model import Model
from derive.quantities import CURRENT, RATES, STATE, g, k, m_s, u, v2, x1, y

SLOPES = Record(
    "Slopes",
    "Change of the right sides of (3), (4), by what each share of it goes with.",
    (
        Quantity("d_C_1", r"\delta C_1", "m/s^2", "change of the acceleration of the actuator, constant in a phase"),
        Quantity("d_a1_y", r"\delta a_{1y}", "1/s^2", "the same per y"),
        Quantity("d_a1_v1", r"\delta a_{11}", "1/s", "the same per v_1"),
        Quantity("d_a1_v2", r"\delta a_{12}", "1/s", "the same per v_2"),
        Quantity("d_C_2", r"\delta C_2", "m/s^2", "change of the acceleration of the body, constant in a phase"),
        Quantity("d_a2_y", r"\delta a_{2y}", "1/s^2", "the same per y"),
        Quantity("d_a2_v1", r"\delta a_{21}", "1/s", "the same per v_1"),
        Quantity("d_a2_v2", r"\delta a_{22}", "1/s", "the same per v_2"),
    ),
)


def _changed(quantity: Quantity) -> Quantity:
    return Quantity(
        f"d_{quantity.name}", rf"\delta {quantity.glyph}", quantity.unit, f"change of the {quantity.meaning}"
    )


def changes(record: Record) -> Record:
    """A change of each quantity of a record."""
    return Record(f"{record.name}Change", f"Changes: {record.meaning}", tuple(map(_changed, record.quantities)))


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


def slopes(model: Model) -> tuple[Step, ...]:
    """The changes of the coefficients of (3), (4) and of the constant accelerations, from those of robot and current."""
    rates = [step for step in laplace.rates(model) if step.symbol in RATES.symbols[:9]]
    return changed_steps((*rates, *laplace.drive()), (*model.robot.symbols, u), SLOPES.symbols)


def body_energy_change(model: Model) -> tuple[Step, ...]:
    """Change of the body's energy with x_2 from L_0 + c; that at the end less that at the start is the change of the AED."""
    length, kinetic, weight, spring, body = sp.symbols("length kinetic weight spring body", real=True)
    steps = (
        Step(length, x1 - y, "x_2 - L_0 - c"),
        Step(kinetic, m_s * v2**2 / 2, "(22) kinetic"),
        Step(weight, m_s * g * length, "(22), (23) weight"),
        Step(spring, k * length**2 / 2, "(22), (23) spring"),
        Step(body, kinetic + weight + spring, "(22), (23)"),
    )
    return changed_steps(steps, (*model.robot.symbols, x1, v2, y), (change_of(body),))


def apex_change() -> tuple[Step, ...]:
    """Change of the apex from those of gravity and of the state at take-off; v_up = max(v_2, 0)."""
    return changed_steps(control.apex_of_takeoff(), (g, x1, control.v_up), (change_of(control.apex),))
