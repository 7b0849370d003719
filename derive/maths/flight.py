"""Flight: the body is ballistic, and the actuator returns under a PD law, up to the limit of its current.

The foot has no mass, so the leg carries nothing: y = 0 without a damper in it, and the body moves with the actuator as
seen from the foot.
From (3)

    x_1'' = (k c - b_1 v_1 - gamma_2 u)/m_eff - f_1 sign(v_1),      gamma_2 u = K_p x_1 + K_d v_1, within +-|gamma_2|
    u_max

which is linear in each of its modes: s^2 + p s + q with p = (b_1 + K_d)/m_eff, q = K_p/m_eff under the law, and with
p = b_1/m_eff, q = 0 at the limit. With W, the response of s (s^2 + p s + q) to an impulse, from x_1, v_1 and the
acceleration a

    x_1(t) - x_1 = v_1 W' + (a + p v_1) W        1 = W'' + p W' + q W
    v_1''' + p v_1'' + q v_1' = 0

nothing is divided by p or q. The foot is above the ground by foot + v_2 t - g t^2/2 - (x_1(t) - x_1).

A further force acts in flight unless it is declared for stance alone or acts in the leg. In flight it may be one on the
actuator, constant or linear in v_1, and a constant one on the body: for g stands then what that leaves of it.
"""

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from .laplace import rest_of_spring

GAINS = Record(
    "Gains", "The law of the actuator in flight, gamma_2 u = K_p x_1 + K_d v_1 within the limit of the current."
).of(
    Quantity("Kp", r"K_p", "N/m", "force per displacement", "nonnegative"),
    Quantity("Kd", r"K_d", "N s/m", "force per velocity", "nonnegative"),
)
Kp, Kd = GAINS.symbols

LIMIT_FORCE = Quantity("largest", r"|\gamma_2| u_{max}", "N", "largest force of the motor", "nonnegative")
LIMIT = Quantity("limit", r"\mathrm{sat}", "1", "sign of the motor's pull at its limit, 0 under the law")
SETTLING = Quantity("time", r"T", "s", "time to settle", "positive")
largest, limit, time = LIMIT_FORCE.symbol, LIMIT.symbol, SETTLING.symbol

FLIGHT_RATES = Record(
    "FlightRates", "The actuator in flight: accelerations, and poles under the law and at its limit."
).of(
    Quantity("p_law", r"p", "1/s", "sum of the rates under the law"),
    Quantity("q_law", r"q", "1/s^2", "product of the rates under the law"),
    Quantity("p_free", r"p_0", "1/s", "rate of the actuator under a constant force"),
    Quantity("a_free", r"a_0", "m/s^2", "constant acceleration without the motor"),
    Quantity("a_largest", r"a_{max}", "m/s^2", "largest acceleration by the motor"),
)
p_law, q_law, p_free, a_free, a_largest = FLIGHT_RATES.symbols

ACTUATOR = Record("Actuator", "The actuator at one instant of the flight.").of(
    Quantity("x1", r"x_1", "m", "displacement"),
    Quantity("v1", r"\dot{x}_1", "m/s", "velocity"),
    Quantity("acc1", r"\ddot{x}_1", "m/s^2", "acceleration"),
)
acc1 = ACTUATOR.symbols[2]

MOVED = Quantity("moved", r"x_1(t) - x_1", "m", "how far the actuator has moved since the phase began")
moved = MOVED.symbol

FLIGHT_LEDGER = Record(
    "FlightLedger",
    "Work of each force on the actuator in flight, signed as it enters; what is lost at stops is apart.",
    python_name="FlightWork",
).of(*(each for each in LEDGER.quantities if each.symbol in (motor_work, offset_work, viscous_1, coulomb_1)))
"""That of the hopper; `flight_ledger_record` has that of a model."""
HOP_HEIGHT = Quantity("hop_height", r"x_2 - L_0 - c", "m", "height of the body less the length without load")
DROP = Quantity("drop", r"h", "m", "height of the body over where it comes back to", "nonnegative")
FLIGHT_INTEGRALS = Record(
    "FlightIntegrals",
    "Integrals over a part of a phase of the flight.",
    (MOVED, MOMENTS.quantities[2], Quantity("rise", r"\Delta x_2", "m", "of the body")),
)
FALL = scalar("fall", "m/s^2", "acceleration with which the body falls in flight")
TOUCHDOWN_TIME = scalar("touchdown_time", "s", "time of the touchdown")
LOSS_AT_IMPACT = scalar("loss_at_impact", "J", "what the body loses at the impact, negative")
V2_AFTER = scalar("v2_after", "m/s", "velocity of the body after the impact")
rise = FLIGHT_INTEGRALS.symbols[2]
hop_height, drop, touchdown_time, v2_after = (
    quantity.symbol for quantity in (HOP_HEIGHT, DROP, TOUCHDOWN_TIME, V2_AFTER)
)
settled_rate, damping, shortfall = sp.symbols("settled_rate damping shortfall", real=True)

# A critically damped return from rest is at 1/100 of its displacement after 20/3 of its time constant: (1 + 20/3) exp(-20/3) <
# 1/100.
SETTLED = sp.Rational(20, 3)


def acceleration(model: Model) -> sp.Expr:
    """(3) without contact force."""
    return model.in_flight[0]


def under_law(model: Model) -> sp.Expr:
    """The acceleration with the current of the law."""
    return sp.expand(acceleration(model).subs(u, (Kp * x1 + Kd * v1) / gamma2))


def at_limit(model: Model) -> sp.Expr:
    """The acceleration with the motor at its limit."""
    return sp.expand(acceleration(model).subs(u, limit * largest / gamma2))


@function(takes=(ROBOT, GAINS, LIMIT_FORCE), returns=FLIGHT_RATES)
def flight_rates_of(model: Model) -> Steps:
    """Poles and accelerations of the actuator in flight."""
    law, limited = under_law(model), at_limit(model)
    free = {x1: 0, v1: 0, side_1: 0, limit: 0}
    yield Step(p_law, -law.diff(v1), "(3) under the law, per v_1")
    yield Step(q_law, -law.diff(x1), "(3) under the law, per x_1")
    yield Step(p_free, -limited.diff(v1), "(3) in flight, per v_1")
    yield Step(a_free, limited.subs(free), "(3) in flight, constant")
    yield Step(a_largest, -limited.diff(limit), "(3) per u, at the limit")


@function(takes=(ROBOT, FLIGHT_RATES, *ACTUATOR.quantities[:2], SIDE_1), returns=ACTUATOR.quantities[2])
def acceleration_under_law(model: Model) -> Steps:
    """Acceleration with which a phase of the flight under the law begins."""
    yield Step(acc1, a_free - q_law * x1 - p_law * v1 - model.levels[0] * side_1, "(3) under the law")


@function(takes=(ROBOT, FLIGHT_RATES, ACTUATOR.quantities[1], SIDE_1, LIMIT), returns=ACTUATOR.quantities[2])
def acceleration_at_limit(model: Model) -> Steps:
    """Acceleration with which a phase of the flight at the limit of the current begins."""
    yield Step(acc1, a_free - a_largest * limit - p_free * v1 - model.levels[0] * side_1, "(3) at the limit")


@function(takes=(*ACTUATOR.quantities[1:], POLES), returns=NUMERATOR)
def displacement_numerator() -> Steps:
    """Numerator of how far the actuator has moved since a phase of the flight began."""
    yield Step(H3, v1, "(3) in flight")
    yield Step(H2, acc1 + p * v1, "(3) in flight")
    yield Step(H1, sp.S.Zero, "no force grows with time")


@function(takes=(GAINS, *ACTUATOR.quantities[1:], POLES), returns=NUMERATOR)
def pull_numerator() -> Steps:
    """Numerator of the pull of the law in a phase of the flight."""
    yield Step(H3, Kp * v1 + Kd * acc1, "rate of the law's pull")
    yield Step(H2, Kp * (acc1 + p * v1) - Kd * q * v1, "v_1 = v_1(0) (1 - q W) + a W'")
    yield Step(H1, sp.S.Zero, "no force grows with time")


@function(takes=(ROBOT, SETTLING), returns=GAINS)
def critical_gains(model: Model) -> Steps:
    """Gains that bring the actuator back in a given time, critically damped.

    Back is within 1/100 of its displacement. The friction b_1 is part of the damping. Where it is more than critical K_d is 0,
    and K_p puts the slower pole where both would be.
    """
    force = sp.expand(-acceleration(model).diff(v1) * m_eff)
    critical = 2 * m_eff * settled_rate
    yield Step(settled_rate, SETTLED / time, "(1 + 20/3) exp(-20/3) < 1/100")
    yield Step(shortfall, critical - force, "critical damping less b_1")
    yield Step(Kd, (shortfall + sp.Abs(shortfall)) / 2, "what the motor adds to b_1")
    yield Step(damping, force + Kd, "b_1 + K_d")
    yield Step(Kp, settled_rate * (damping - m_eff * settled_rate), "the slower pole at the settling rate")


@function(takes=(ROBOT,), returns=FALL)
def fall_of(model: Model) -> Steps:
    """Acceleration with which the body falls in flight."""
    yield Step(FALL.symbol, model.fall, "(4) in flight")


@function(takes=(ROBOT, STATE.quantities[2], DROP), returns=TOUCHDOWN_TIME)
def time_of_fall(model: Model) -> Steps:
    """Time after which the body has come down from a height."""
    yield Step(touchdown_time, (v2 + sp.sqrt(v2**2 + 2 * model.fall * drop)) / model.fall, "ballistic")


@function(takes=(ROBOT, STATE.quantities[2]), returns=V2_AFTER)
def velocity_after_impact() -> Steps:
    """Velocity of the body after the impact."""
    yield Step(v2_after, v2 * sp.sqrt(1 - impact_loss), "impact loss")


@function(takes=(ROBOT, STATE.quantities[2]), returns=LOSS_AT_IMPACT)
def loss_at_impact() -> Steps:
    """What the body loses at the impact."""
    yield Step(LOSS_AT_IMPACT.symbol, -impact_loss * m_s * v2**2 / 2, "a share of its kinetic energy")


@function(takes=(ROBOT, *STATE.quantities[1:3], HOP_HEIGHT), returns=ENERGY)
def flight_energies(model: Model) -> Steps:
    """Energy of the body and of the robot in flight.

    The leg is unloaded: its spring holds what others hold against it.
    """
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(body, m_s * v2**2 / 2 + m_s * g * (hop_height + (L0 + c - rest)), "energy of the body in flight")
    yield Step(total, body + m_eff * v1**2 / 2 + k * rest**2 / 2, "energy of the whole robot in flight")


@function(
    takes=(ROBOT, GAINS, LIMIT_FORCE, ACTUATOR.quantities[0], SIDE_1, LIMIT, FLIGHT_INTEGRALS), returns=FLIGHT_LEDGER
)
def flight_ledger_of(model: Model) -> Steps:
    """Each entry of the flight's ledger over a part of a phase.

    From the displacement and the integral of v_1^2.
    """
    has = flight_ledger_record(model).symbols
    return tuple(step for step in _works_in_flight(model) if step.symbol in has)


def _works_in_flight(model: Model) -> Steps:
    follows = 1 - limit**2
    force = sp.expand(acceleration(model).subs(u, 0) * m_eff - model.friction[0])
    on_body = sp.expand((g - model.fall) * m_s)
    of_law = Kp * moved * (x1 + moved / 2) + Kd * int_v1v1
    return (
        Step(motor_work, -follows * of_law - limit * largest * moved, "law, or limit"),
        Step(offset_work, sp.expand(force.subs(v1, 0)) * moved + on_body * rise, "constant forces"),
        Step(viscous_1, force.diff(v1) * int_v1v1, "ledger"),
        Step(coulomb_1, model.friction[0] * moved, "ledger"),
    )


def flight_ledger_record(model: Model) -> Record:
    """The fields of the ledger of a flight: what the file declares, forces without a letter among them."""
    by_further = {step.symbol for step in _works_in_flight(model) if model.value(step.value) != 0}
    kept = (each for each in FLIGHT_LEDGER.quantities if model.has_entry(each.symbol) or each.symbol in by_further)
    return FLIGHT_LEDGER.of(*kept)
