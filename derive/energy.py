"""Energy of the body, (22)-(24), and the ledger of the whole robot.

    E = m_s v_2^2/2 + m_s g x_2 + k (x_2 - L_0 - c)^2/2          E(t) - E(0) = U_delta, the paper's AED
    AED = int k x_1 v_2 - int b_2 v_2^2 - m_s f_2 int |v_2|                                       (24), signs mended
    H = m_eff v_1^2/2 + m_s v_2^2/2 + m_s g x_2 + k (x_1 - x_2 + L_0 + c)^2/2

Every term of the ledger is the integral of a power, a quadratic form in 1, x_1 - x_1(0), y, v_1, v_2 within a phase; the
integrals of the products (`Moments`) have a closed form of their own, so each term is computed by itself.
"""

from dataclasses import dataclass

import sympy as sp

from derive import model as equations
from derive.ir import Quantity, Record, Step
from derive.model import Model, Term
from derive.quantities import (
    L0,
    LEDGER,
    b1,
    b2,
    body,
    c,
    coulomb_1,
    coulomb_2,
    f1,
    f2,
    g,
    gamma2,
    int_v1,
    int_v1v1,
    int_v1v2,
    int_v2,
    int_v2v2,
    int_xv2,
    int_yv1,
    int_yv2,
    k,
    m_eff,
    m_s,
    motor_work,
    offset_work,
    side_1,
    side_2,
    spring_work,
    total,
    u,
    v1,
    v2,
    viscous_1,
    viscous_2,
    x1,
    x2,
    y,
)

x1_0 = sp.Symbol("x1_0", real=True)
displacement = sp.Symbol("displacement", real=True)
length = sp.Symbol("length", real=True)
aed = sp.Symbol("aed", real=True)
stored = sp.Symbol("stored", real=True)
unloaded = sp.Symbol("unloaded", real=True)

body_energy = m_s * v2**2 / 2 + m_s * g * x2 + k * (x2 - L0 - c) ** 2 / 2
total_energy = equations.kinetic + equations.potential

# The products whose integrals are known, by their integral.
PRODUCTS = {
    int_v1: v1,
    int_v2: v2,
    int_v1v1: v1**2,
    int_v1v2: v1 * v2,
    int_v2v2: v2**2,
    int_yv1: y * v1,
    int_yv2: y * v2,
    int_xv2: displacement * v2,
}


def powers(model: Model) -> dict[sp.Symbol, sp.Expr]:
    """The power of each entry of the ledger, in the order of its fields."""
    entries = {
        motor_work: -gamma2 * u * v1,
        offset_work: k * c * v1,
        viscous_1: -b1 * v1**2,
        viscous_2: -b2 * v2**2,
        coulomb_1: -m_eff * f1 * side_1 * v1,
        coulomb_2: -m_s * f2 * side_2 * v2,
        spring_work: k * x1 * v2,
    }
    return entries | {work.entry: work.power for work in works(model)}


def ledger_record(model: Model) -> Record:
    """The fields of the ledger: those of the hopper, then the work of each further term on each mass that it acts on."""
    further = tuple(
        Quantity(
            str(work.entry), str(work.entry), "J", f"work of the term '{work.term.name}' on the {_MASSES[work.mass]}"
        )
        for work in works(model)
    )
    return Record(LEDGER.name, LEDGER.meaning, LEDGER.quantities + further)


def whole_robot_entries(model: Model) -> tuple[sp.Symbol, ...]:
    """The entries whose sum, with the loss at stops, is the change of H: all but the spring's work on the body."""
    return tuple(entry for entry in powers(model) if entry != spring_work)


def body_entries(model: Model) -> tuple[sp.Symbol, ...]:
    """The entries whose sum is the AED, the change of E."""
    return (spring_work, viscous_2, coulomb_2, *(work.entry for work in works(model) if work.mass == 2))


def ledger(model: Model) -> tuple[Step, ...]:
    """Each entry of the ledger over a part of a phase, from the integrals of products."""
    return tuple(
        Step(entry, _integrate(power), "(24)" if entry in body_entries(model) else "ledger")
        for entry, power in powers(model).items()
    )


def aed_of_ledger(model: Model) -> tuple[Step, ...]:
    """The AED as the sum of what adds to the body's energy."""
    return (Step(aed, sum(body_entries(model), sp.S.Zero), "(24)"),)


def body_height() -> tuple[Step, ...]:
    """x_2 of a state, solved from y = x_1 - x_2 + L_0 + c; each step rounds once, in this order."""
    return (
        Step(length, x1 - y, "x_2 - L_0 - c"),
        Step(unloaded, L0 + c, "length of the leg without load"),
        Step(x2, length + unloaded, "y = x_1 - x_2 + L_0 + c"),
    )


def stored_energy() -> tuple[Step, ...]:
    """Where this is large against m_s max(v_2^2, 1)/2, the difference of two E has lost the digits of the AED."""
    return (
        Step(length, x1 - y, "x_2 - L_0 - c at the start"),
        Step(stored, k * length**2 / 2, "(22), (23)"),
    )


def energies() -> tuple[Step, ...]:
    """E and H of a state; x_2 - L_0 - c is the actuator's displacement less the compression."""
    return (
        Step(length, x1 - y, "x_2 - L_0 - c"),
        Step(body, m_s * v2**2 / 2 + m_s * g * (length + (L0 + c)) + k * length**2 / 2, "(22), (23)"),
        Step(
            total,
            m_eff * v1**2 / 2 + m_s * v2**2 / 2 + m_s * g * (length + (L0 + c)) + k * y**2 / 2,
            "energy of the whole robot",
        ),
    )


def body_energy_gain() -> tuple[Step, ...]:
    """E(t) - E(0), with each difference of squares factored: nothing large is subtracted."""
    x1_t, v2_t, y_t = sp.symbols("x1_t v2_t y_t", real=True)
    length_t, gain = sp.symbols("length_t gain", real=True)
    return (
        Step(length, x1 - y, "x_2 - L_0 - c at the start"),
        Step(length_t, x1_t - y_t, "x_2 - L_0 - c at the end"),
        Step(
            gain,
            m_s * (v2_t - v2) * (v2_t + v2) / 2 + (length_t - length) * (m_s * g + k * (length_t + length) / 2),
            "(22)-(24) U_delta",
        ),
    )


@dataclass(frozen=True)
class Work:
    """What a term does to one of the masses: an entry of the ledger and its power."""

    term: Term
    mass: int
    entry: sp.Symbol
    power: sp.Expr


_MASSES = {1: "actuator", 2: "body"}


def works(model: Model) -> tuple[Work, ...]:
    """The work of each further term on each mass that it acts on."""
    return tuple(
        Work(term, mass, sp.Symbol(f"{field_name(term.name)}_{mass}", real=True), force * velocity)
        for term in model.terms
        for mass, force, velocity in ((1, term.force_1, v1), (2, term.force_2, v2))
        if force != 0
    )


def field_name(name: str) -> str:
    """A term's name as part of the name of a field."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def _integrate(power: sp.Expr) -> sp.Expr:
    """The power with every product replaced by its integral."""
    in_phase = sp.expand(power.subs(x1 - x2, y - L0 - c).subs(x2, x1 + L0 + c - y).subs(x1, x1_0 + displacement))
    polynomial = sp.Poly(in_phase, displacement, y, v1, v2)
    integrals = {sp.Poly(product, displacement, y, v1, v2).monoms()[0]: name for name, product in PRODUCTS.items()}
    return sum(
        (coefficient * integrals[monomial] for monomial, coefficient in polynomial.terms() if coefficient != 0),
        sp.S.Zero,
    )
