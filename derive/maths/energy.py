"""Energy of the body, (22)-(24), and the ledger of the whole robot.

    E = m_s v_2^2/2 + m_s g x_2 + k (x_2 - L_0 - c)^2/2          E(t) - E(0) = U_delta, the paper's AED
    AED = int k x_1 v_2 - int b_2 v_2^2 - m_s f_2 int |v_2|                                       (24), signs mended
    H = m_eff v_1^2/2 + m_s v_2^2/2 + m_s g x_2 + k (x_1 - x_2 + L_0 + c)^2/2

Without a contact there is no E, and H has the weight of each mass times its coordinate, if gravity acts along that.

Both hold the spring's own energy: where y counts from elsewhere, x_1 - x_2 + L_0 + c is y and the rest of the spring.
What further forces in the leg do is work of their own.

Every term of the ledger is the integral of a power, a quadratic form in 1, x_1 - x_1(0), y, v_1, v_2 within a phase;
the integrals of the products (`Moments`) have a closed form of their own, so each term is computed by itself.
"""

from dataclasses import dataclass, replace

import sympy as sp

from ..ir import Authored, Quantity, Record, Spelled, Step, Steps, function, scalar
from ..model import words
from ..model.equations import LETTER_OF_ENTRY, Force, Model, kinetic
from ..model.mechanism import field_name
from ..model.quantities import *
from .laplace import REST, rest_of_spring
from .time_domain import AT, v2_t, x1_t, y_t

X1_0 = scalar("x1_0", "m", "displacement of the actuator at the start of the phase")
AED = scalar("aed", "J", "analytical energy delta")
STORED = scalar("stored", "J", "k (x_2 - L_0 - c)^2/2")
MOVING = scalar("moving", "J", "m_s (v_2^2 + speed^2)/2")
SPEED = scalar("speed", "m/s", "velocity that counts beside that of the body")
GAIN = scalar("gain", "J", "E(t) - E(0)")
x1_0, aed, stored, moving, speed, gain = (quantity.symbol for quantity in (X1_0, AED, STORED, MOVING, SPEED, GAIN))
displacement, length, unloaded = sp.symbols("displacement length unloaded", real=True)

body_energy = m_s * v2**2 / 2 + m_s * g * x2 + k * (x2 - L0 - c) ** 2 / 2
PRODUCTS = dict(zip(MOMENTS.symbols, (v1, v2, v1**2, v1 * v2, v2**2, y * v1, y * v2, displacement * v2), strict=True))
"""The products whose integrals are known, by their integral."""


def total_energy(model: Model) -> sp.Expr:
    """The energy H of everything, at a state."""
    return kinetic + model.potential


def moments_record(model: Model) -> Record:
    """The integrals that the ledger of a model reads."""
    read = {symbol for step in ledger_of(model) for symbol in step.value.free_symbols}
    return replace(MOMENTS, quantities=tuple(quantity for quantity in MOMENTS.quantities if quantity.symbol in read))


def moment_axes(model: Model) -> list[list[int]]:
    """The axes whose product each of them integrates: places in (x_1 - x_1(0), v_1, v_2, y, 1); where the ledger reads
    none that of 1, because C has no empty struct.
    """
    axes = (displacement, *STATE.symbols[1:])
    places = []
    for quantity in moments_record(model).quantities:
        (powers_of_axes,) = sp.Poly(PRODUCTS[quantity.symbol], *axes).monoms()
        factors = [axis for axis, power in enumerate(powers_of_axes) for _ in range(power)]
        places.append([*factors, len(axes)][:2])
    return places or [[len(axes), len(axes)]]


def powers(model: Model) -> dict[sp.Symbol, sp.Expr]:
    """The power of each entry of the ledger, in the order of its fields."""
    entries = {
        motor_work: -gamma2 * u * v1,
        offset_work: k * c * v1,
        viscous_1: -b1 * v1**2,
        viscous_2: -b2 * v2**2,
        coulomb_1: model.friction[0] * v1,
        coulomb_2: model.friction[1] * v2,
    }
    if model.has_contact:
        entries[spring_work] = k * x1 * v2  # x_1 counts from the ground, as E does; elsewhere from any origin
    values = entries | {work.entry.symbol: work.power for work in works(model)}
    return {entry: power for entry, power in values.items() if model.has_entry(entry)}


def entries(model: Model) -> dict[sp.Symbol, Quantity]:
    """The entries that letters of the derivation stand for, by their symbols: each is named after its element, if the file
    names one, or else after what does its work.
    """
    taken = {work.entry.name for work in works(model)} | {each.name for each in (*LEDGER.quantities, STOP_LOSS)}
    named = dict[sp.Symbol, Quantity]()
    for quantity in (*LEDGER.quantities, STOP_LOSS):
        named[quantity.symbol] = words.of_quantity(model, quantity)
        if (entry := _of_element(model, quantity)) is not None and entry.name not in taken:
            named[quantity.symbol] = entry
            taken.add(entry.name)
    return named


def _of_element(model: Model, quantity: Quantity) -> Quantity | None:
    """An entry under the name of the one element whose work it is; None where the file leaves that name as it is."""
    mass, usual = OF_ELEMENT.get(quantity.symbol, (0, ""))
    letter = LETTER_OF_ENTRY.get(quantity.symbol)
    if not usual or letter is None or len(called := model.called(letter)) != 1 or called[0] == usual:
        return None
    kind, moved = model.sources[letter].split()[0], model.names[max(mass, 1) - 1]
    assert moved is not None
    name = f"{field_name(called[0])}_{mass or 'work'}"
    meaning = f"work of {kind} '{called[0]}' on the {moved.thing}"
    return Spelled(name, name, quantity.unit, meaning, letter=str(quantity.symbol))


OF_ELEMENT = {
    motor_work: (0, "motor"),
    viscous_1: (1, "viscous friction"),
    viscous_2: (2, "viscous friction"),
    coulomb_1: (1, "Coulomb friction"),
    coulomb_2: (2, "Coulomb friction"),
}
"""Of the entries of elements that a file names their mass, 0 of what the input drives, and the usual name."""


def ledger_record(model: Model) -> Record:
    """The fields of the ledger: those that letters stand for, then the work of each further force on each mass it acts on."""
    every = (*entries(model).items(), *((work.entry.symbol, work.entry) for work in works(model)))
    has = powers(model)
    return replace(LEDGER, quantities=tuple(entry for symbol, entry in every if symbol in has))


def energy_record(model: Model) -> Record:
    """The energies of a model: that of the body is one of hops."""
    return (
        ENERGY
        if model.has_contact
        else replace(ENERGY, meaning=ENERGY.quantities[1].meaning, quantities=ENERGY.quantities[1:])
    )


def with_stop_loss(model: Model, work: Record, meaning: str) -> Record:
    """The ledger that a user sees: the work of each force, and behind the losses of friction that at stops, if there are
    any.
    """
    place = sum(entry.symbol in LETTER_OF_ENTRY for entry in work.quantities)
    loss = (entries(model)[STOP_LOSS.symbol],) if model.has_stops else ()
    return Record(work.name, meaning, (*work.quantities[:place], *loss, *work.quantities[place:]))


def names_of(model: Model, symbols: tuple[sp.Symbol, ...]) -> tuple[str, ...]:
    """What a ledger calls entries."""
    record = with_stop_loss(model, ledger_record(model), "")
    names = {entry.symbol: entry.name for entry in record.quantities}
    return tuple(names[symbol] for symbol in symbols)


def whole_robot_entries(model: Model) -> tuple[sp.Symbol, ...]:
    """The entries whose sum is the change of H: all but the spring's work on the body."""
    return tuple(entry for entry in with_stop_loss(model, ledger_record(model), "").symbols if entry != spring_work)


def body_entries(model: Model) -> tuple[sp.Symbol, ...]:
    """The entries whose sum is the AED, the change of E; none of a model without a contact, which has no E."""
    if not model.has_contact:
        return ()
    entries = (spring_work, viscous_2, coulomb_2, *(work.entry.symbol for work in works(model) if work.mass == 2))
    has = powers(model)
    return tuple(entry for entry in entries if entry in has)


@function(takes=(ROBOT, MOMENTS, CURRENT, SIDE_1, SIDE_2, LIMIT_SIGN, X1_0), returns=LEDGER)
def ledger_of(model: Model) -> Steps:
    """Each entry of the ledger over a part of a phase that starts at x_1 = x1_0."""
    by_law = {} if model.law is None else {motor_work: _work_of_motor_with_law()}
    return tuple(
        Step(entry, by_law.get(entry) or work_of(model, power), "(24)" if entry in body_entries(model) else "ledger")
        for entry, power in powers(model).items()
    )


def _work_of_motor_with_law() -> sp.Expr:
    """The work of a motor whose current a law sets, or its limit."""
    follows = 1 - limit_sign**2
    of_law = K_p * int_v1 * (u - x1_0 - int_v1 / 2) - K_d * int_v1v1
    return follows * of_law - (1 - follows) * gamma2 * u * int_v1


@function(takes=(ROBOT, STATE), returns=STOP_LOSS)
def loss_at_stop() -> Steps:
    """What the actuator loses where it meets a stop."""
    yield Step(STOP_LOSS.symbol, -m_eff * v1**2 / 2, "its kinetic energy")


@function(takes=(LEDGER,), returns=AED, of_contact=True)
def aed_of_ledger(model: Model) -> Steps:
    """Change of the energy of the body by the entries of a ledger."""
    yield Step(aed, sum(body_entries(model), sp.S.Zero), "(24)")


@function(takes=(ROBOT, STATE.quantities[0], STATE.quantities[3]), returns=BODY_HEIGHT)
def second_position(model: Model) -> Steps:
    """Height of the body over the ground under the foot.

    It is x_2 of a state, solved from y; each step rounds once, in this order.
    """
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(length, model.ratio * x1 - y, "hop height of the body")
    yield Step(unloaded, L0 + c - rest, "length without load")
    yield Step(
        x2, length + unloaded, "y = x_1 - x_2 + unloaded" if model.ratio == 1 else "y = ratio x_1 - x_2 + unloaded"
    )


@function(takes=(ROBOT,), returns=REST, of_contact=True)
def compression_at_rest(model: Model) -> Steps:
    """Compression of the spring at the free length of the leg, which is L_0 + c less that."""
    yield Step(REST.symbol, model.rest, "N = 0")


@function(takes=(ROBOT, STATE), returns=STORED, of_contact=True)
def stored_energy(model: Model) -> Steps:
    """Energy of the body beside its kinetic energy and that of its height.

    Where this is large against `moving_energy`, the difference of two E has lost the digits of the AED.
    """
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(length, model.ratio * x1 - y - rest, "its height less the length without load, at the start")
    yield Step(stored, k * length**2 / 2, "(22), (23)")


@function(takes=(ROBOT, STATE, SPEED), returns=MOVING, of_contact=True)
def moving_energy() -> Steps:
    """Kinetic energy of the body, and that of a given velocity, with which stored energy is compared."""
    yield Step(moving, m_s * (speed**2 + v2**2) / 2, "(22), (23)")


@function(takes=(ROBOT, STATE), returns=ENERGY)
def energies(model: Model) -> Steps:
    """Energy of the body and of the robot.

    E and H of a state; x_2 - L_0 - c is the actuator's displacement less the compression of the spring.
    """
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(length, model.ratio * x1 - y - rest, "its height less the length without load")
    yield Step(body, m_s * v2**2 / 2 + m_s * g * (length + (L0 + c)) + k * length**2 / 2, "(22), (23)")
    first, second = model.weights
    yield Step(
        total,
        m_eff * v1**2 / 2 + m_s * v2**2 / 2 + first * x1 + second * (length + (L0 + c)) + k * (y + rest) ** 2 / 2,
        "energy of the whole robot",
    )


@function(takes=(ROBOT, STATE, AT), returns=GAIN, of_contact=True)
def body_energy_gain(model: Model) -> Steps:
    """Change of the body's energy between two states, the AED.

    Each difference of squares is factored: nothing large is subtracted.
    """
    length_t = sp.Symbol("length_t", real=True)
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(length, model.ratio * x1 - y - rest, "its height less the length without load, at the start")
    yield Step(length_t, x1_t - y_t - rest, "the same at the end")
    yield Step(
        gain,
        m_s * (v2_t - v2) * (v2_t + v2) / 2 + (length_t - length) * (m_s * g + k * (length_t + length) / 2),
        "(22)-(24) U_delta",
    )


@dataclass(frozen=True)
class Work:
    """The work of a force on one of the masses: an entry of the ledger and its power."""

    mass: int
    entry: Quantity
    power: sp.Expr


def works(model: Model) -> tuple[Work, ...]:
    """The work of each further force."""
    return tuple(work for force in model.further for work in works_of(model, force))


def works_of(model: Model, force: Force) -> tuple[Work, ...]:
    """The work of a further force on each mass of the model that it acts on, by what these are called."""
    powers_on = zip((1, 2), model.names, (force.force_1 * v1, force.force_2 * v2), strict=True)
    return tuple(
        Work(mass, _entry(f"{field_name(force.name)}_{mass}", f"work of {force.meaning} on the {own.thing}"), power)
        for mass, own, power in powers_on
        if own is not None and power != 0
    )


def _entry(name: str, meaning: str) -> Quantity:
    """An entry of the ledger that is named after an element of the file."""
    return Authored(name, name, "J", meaning)


def work_of(model: Model, power: sp.Expr) -> sp.Expr:
    """The power with every product replaced by its integral."""
    in_phase = sp.expand(power.subs(x2, model.ratio * x1 - y + model.length).subs(x1, x1_0 + displacement))
    polynomial = sp.Poly(in_phase, displacement, y, v1, v2)
    products = PRODUCTS | {int_v1**2 / 2: displacement * v1}
    integrals = {sp.Poly(product, displacement, y, v1, v2).monoms()[0]: value for value, product in products.items()}
    return sum(
        (coefficient * integrals[monomial] for monomial, coefficient in polynomial.terms() if coefficient != 0),
        sp.S.Zero,
    )
