r"""The register of the paper's equations (1)-(27): as printed, as derived, verdict, reason, steps. Errata are data.

It is one of the paper as long as the hopper that ships is the paper's: `PAPER` has what the verdicts rest on, (3), (4)
and what the paper says of touchdown and flight, and `differences` what the file of a hopper has beyond that.

`printed` and `derived` are LaTeX in the paper's glyphs. tests/algebra.py has the same as algebra, where algebra can
decide: there a verdict is a statement about their difference.

Figures are those of the robot `hopper_c` after a drop from 20 cm unless said otherwise; the tests compute each of them.
"""

import pprint
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from ..ir import Own
from ..maths.energy import body_energy
from ..maths.laplace import s
from ..model.equations import Model
from ..model.quantities import *
from ..shipped import HOPPER

PAPER = {
    "(3)": (k * (x2 - x1 - L0) - b1 * v1 - gamma2 * u) / m_eff - f1 * side_1,
    "(4)": (k * (x1 - x2 + L0 + c) - b2 * v2 - m_s * g) / m_s - f2 * side_2,
    "(3) at rest": f1 + f1_excess,
    "(4) at rest": f2 + f2_excess,
    "(3) in flight": (k * c - b1 * v1 - gamma2 * u) / m_eff - f1 * side_1,
    "(4) in flight": -g,
    "(22)": m_s * v2**2 / 2 + m_s * g * x2 + k * (x2 - L0 - c) ** 2 / 2,
    "(25)": m_s * (1 - impact_loss) * v2**2 / 2,
}
"""What the verdicts rest on, in the parameters: accelerations in stance, the largest that friction at rest takes up,
accelerations in flight, where the contact force is 0, energies of the body and at touchdown. It comes from the paper,
with (22), (25) as they are mended; nothing of it comes from a model's file.
"""


def differences(hopper: Model) -> dict[str, sp.Expr]:
    """What a hopper has beyond `PAPER`, in the parameters of its file, by the equation; nothing where they agree."""
    at_rest = (
        level + (up + down) / 2 + side * (up - down) / 2
        for level, (up, down), side in zip(hopper.levels, hopper.excesses, (side_1, side_2), strict=True)
    )
    at_touchdown = m_s * (1 - impact_loss) * v2**2 / 2
    stated = (*hopper.accelerations, *at_rest, *hopper.in_flight, body_energy, at_touchdown)
    found = {}
    for (name, papers), letters in zip(PAPER.items(), stated, strict=True):
        own = hopper.value(letters)
        own = own.xreplace({symbol: sp.Symbol(symbol.name, real=True) for symbol in own.atoms(Own)})
        found[name] = sp.factor(own - papers)
    return {name: value for name, value in found.items() if value != 0}


def in_words(found: Mapping[str, sp.Expr]) -> str:
    """Differences from the paper in one line, of each equation the first; empty where there are none."""
    signs = {side: sp.Symbol(f"sign({velocity})") for side, velocity in ((side_1, v1), (side_2, v2))}
    first: dict[str, tuple[str, str]] = {}
    for name, value in found.items():
        text = str(value.xreplace(signs)).replace("**", "^").replace("*", " ")
        first.setdefault(name.split()[0], (name, text))
    if not first:
        return ""
    (name, text), *others = first.values()
    more = "".join(f", {other} by {value}" for other, value in others)
    return f"{name} of {FILE} differs from the paper's by {text}{more}: what follows is no register of the paper"


FILE = "derive/models/hopper.py"
DIFFERENCE = in_words(differences(HOPPER))
"""How the hopper that ships differs from the paper's; empty as long as it does not."""

_VERDICTS = {
    "agrees": "follows from (3), (4) as it is printed",
    "clash of symbols": "right, but one letter stands for two things",
    "typographical slip": "one letter or dot differs from what the neighbouring equations say",
    "incomplete": "true as far as it goes; leaves out a case, a condition or a term",
    "wrong": "gives other numbers than (3), (4)",
}
VERDICTS = {"not claimed": DIFFERENCE} if DIFFERENCE else _VERDICTS
"""The verdicts that there are, with what each means: none is claimed of another mechanism than the paper's."""


@dataclass(frozen=True)
class Equation:
    """One equation of the paper: what is printed, what follows from (3), (4), which generated steps compute it, and a
    verdict, one of VERDICTS.
    """

    verdict: str
    title: str
    printed: str
    derived: str
    reason: str
    computed_by: tuple[str, ...]

    number: int = 0

    @property
    def lines(self) -> list[str]:
        """The entry as lines of Python, texts in pieces that fit the line."""
        return f"{pprint.pformat(self, width=112)},".splitlines()


agrees, clash, slip, incomplete, wrong = (partial(Equation, verdict) for verdict in _VERDICTS)


def as_printed(title: str, printed: str, reason: str, steps: tuple[str, ...]) -> Equation:
    """An equation that agrees: what follows from (3), (4) is what is printed."""
    return agrees(title, printed, printed, reason, steps)


# The polynomials as printed: below (11), and behind s in the denominators of (6), (7).
cubic = (
    s**3
    + s**2 * (b2 / m_s + b1 / m_eff)
    + s * (k / m_s + k / m_eff + b1 * b2 / (m_eff * m_s))
    + k * (b1 + b2) / (m_eff * m_s)
)
quadratic_1 = s**2 + s * b1 / m_eff + k / m_eff
quadratic_2 = s**2 + s * b2 / m_s + k / m_s


_ENTRIES = {
    1: incomplete(
        "Motion of the actuator, first model",
        r"\ddot{x}_1 = \frac{1}{m_{eff}}(k(x_2 - x_1 - L_0) - b_1\dot{x}_1 - \gamma_2 u)",
        r"\ddot{x}_1 = \frac{1}{m_{eff}}(k(x_2 - x_1 - L_0 - c) - b_1\dot{x}_1 - \gamma_2 u)",
        "A Lagrangian with one spring gives L_0 + c here as in (2). Printed with L_0 alone, (1) contains a further "
        "constant force k c on the actuator that has no partner on the body; it is kept, and its work is an entry of "
        "the ledger. With c = 0 both are the same. The force is not small: from c = 16 mm on it alone overcomes the "
        "actuator's friction. Gravity does not act on x_1: m_eff is an inertia, not a weight.",
        ("rates_of: a1_y, a1_v1, a1_u, a1_0", "ledger_of: offset_work"),
    ),
    2: as_printed(
        "Motion of the body, first model",
        r"\ddot{x}_2 = \frac{1}{m_s}(k(x_1 - x_2 + L_0 + c) - b_2\dot{x}_2 - m_s g)",
        "(4) with f_2 = 0, and what the Lagrangian gives.",
        ("rates_of: a2_y, a2_v2, a2_0",),
    ),
    3: incomplete(
        "Motion of the actuator",
        r"\ddot{x}_1 = \frac{1}{m_{eff}}(k(x_2 - x_1 - L_0) - b_1\dot{x}_1 - \gamma_2 u) - f_1 \text{sign}(\dot{x}_1)",
        r"\ddot{x}_1 = \frac{1}{m_{eff}}(k(x_2 - x_1 - L_0 - c) - b_1\dot{x}_1 - \gamma_2 u) - f_1 "
        r"\text{sign}(\dot{x}_1)",
        "L_0 against L_0 + c as in (1). And sign(0) is any number of [-1, 1]: the actuator sticks wherever the other "
        "terms stay within f_1, which the paper's count of N pieces leaves out. At 0.75 A it sticks, slips and meets "
        "its stop within one stance; without current it stands on its stop from touchdown to take-off.",
        ("rates_of: a1_y, a1_v1, a1_u, a1_0", "drive_of: C_1", "free_accelerations: free_1"),
    ),
    4: as_printed(
        "Motion of the body",
        r"\ddot{x}_2 = \frac{1}{m_s}(k(x_1 - x_2 + L_0 + c) - b_2\dot{x}_2 - m_s g) - f_2 \text{sign}(\dot{x}_2)",
        "What the Lagrangian gives. f_2 stands outside the bracket over m_s, so it is an acceleration, here, in (5) "
        "and in (10); sign(0) as in (3).",
        ("rates_of: a2_y, a2_v2, a2_0", "drive_of: C_2", "free_accelerations: free_2"),
    ),
    5: incomplete(
        "Friction of the actuator from the current that moves it",
        r"f_1 = u_* \frac{\gamma_2}{m_{eff}}",
        r"f_1 + f_{1,e} = \frac{|k(x_2 - x_1 - L_0) - \gamma_2 u_*|}{m_{eff}}",
        "The current that moves an actuator measures its friction at rest; what that exceeds the friction in motion by, "
        "f_{1,e}, is nothing that (3) knows. (5) holds for magnitudes (gamma_2 may be negative) and where the spring "
        "carries no load. A robot that stands on "
        "its leg starts to move upwards at 0.75 A, not at 0.30 A, and below 0.15 A it sinks, because its weight is "
        "more than the friction of its actuator; half the distance of the two thresholds is 0.30 A.",
        ("threshold_current: u_threshold", "free_accelerations: free_1"),
    ),
    6: as_printed(
        "Laplace transform of (3)",
        r"X_1(s) = \frac{s^2 x_1(0) + s(\dot{x}_1(0) + \frac{x_1(0)b_1}{m_{eff}}) + \lambda_2 + sX_2(s) "
        r"\frac{k}{m_{eff}}}{s(s^2 + s \frac{b_1}{m_{eff}} + \frac{k}{m_{eff}})}",
        "The current is a step, u/s, so that u stands in lambda_2 without a factor of s.",
        ("rates_of: p_1, q_1", "motion_of_mass_1: H3_1, H2_1"),
    ),
    7: slip(
        "Laplace transform of (4)",
        r"X_2(s) = \frac{s^2 x_2(0) + s\beta - \gamma + s \frac{k}{m_2} X_1(s)}{s(s^2 + s \frac{b_2}{m_s} + "
        r"\frac{k}{m_s})}",
        r"X_2(s) = \frac{s^2 x_2(0) + s\beta - \gamma + s \frac{k}{m_s} X_1(s)}{s(s^2 + s \frac{b_2}{m_s} + "
        r"\frac{k}{m_s})}",
        "m_2 is m_s.",
        ("rates_of: p_2, q_2", "motion_of_mass_2: H3_2, H2_2"),
    ),
    8: wrong(
        "Constant acceleration of the body",
        r"\gamma = -\frac{f_2}{m_s} + g - \frac{k(L_0 + c)}{m_s}",
        r"\gamma = f_2 \text{sign}(\dot{x}_2) + g - \frac{k(L_0 + c)}{m_s}",
        "f_2 is an acceleration in (4), f_2/m_s is none: the body comes 1.1 mm lower at 3 A. The sign printed is "
        "that of compression alone; kept until take-off, with f_2 mended, it lifts the body by 4.3 mm.",
        ("drive_of: C_2",),
    ),
    9: as_printed(
        "Initial velocity of the body in the transform",
        r"\beta = \dot{x}_2(0) + x_2(0) \frac{b_2}{m_s}",
        "The code counts from x_2(0), where the second term is absent.",
        ("rates_of: a2_v2", "state_at: v2_t"),
    ),
    10: incomplete(
        "Constant acceleration of the actuator",
        r"\lambda_2 = -\frac{\gamma_2 u}{m_{eff}} - \frac{kL_0}{m_{eff}} - f_1",
        r"\lambda_2 = -\frac{\gamma_2 u}{m_{eff}} - \frac{kL_0}{m_{eff}} - f_1 \text{sign}(\dot{x}_1)",
        "Holds while the actuator moves up. A free actuator without current goes down instead: with the printed sign "
        "it is 4.9 mm too low where the body turns, because friction pushes along.",
        ("drive_of: C_1",),
    ),
    11: clash(
        "Transform of the body's height, and its poles",
        r"X_2(s) = \frac{x_2(0)s^4 + H_4 s^3 + H_3 s^2 + H_2 s + H_1}{s^2(s+a)(s+b)(s+c)}",
        r"X_2(s) = \frac{x_2(0)s^4 + H_4 s^3 + H_3 s^2 + H_2 s + H_1}{s^2(s+a)(s+b)(s+c)}",
        "Transform and polynomial hold. c is the offset of (2), (4) already. And a, b, c are not roots of the "
        "polynomial, as the text below says, but their negatives: the roots have no positive real part, and with "
        "them (18) would grow.",
        ("rates_of: s_1, s_2, s_3",),
    ),
    12: as_printed(
        "Numerator of (11), terms in s^3",
        r"H_4 = x_2(0) \frac{b_1}{m_{eff}} + \beta",
        "Counted from x_2(0) it is the initial velocity, which the code adds by itself.",
        ("state_at: x1_t, v2_t",),
    ),
    13: as_printed(
        "Numerator of (11), terms in s^2",
        r"H_3 = x_2(0) \frac{k}{m_{eff}} + \frac{b_1 \beta}{m_{eff}} - \gamma + \frac{kx_1(0)}{m_s}",
        "With gamma of (8) mended. Counted from x_2(0), x_2'(0) it is the initial acceleration of the body.",
        ("motion_of_both: H3_2",),
    ),
    14: wrong(
        "Numerator of (11), terms in s",
        r"H_2 = (\dot{x}_1(0) + \frac{x_1(0)b_1}{b_{eff}}) \frac{k}{m_s} + \frac{k\beta}{m_{eff}} + \frac{b_1 "
        r"\gamma}{m_1}",
        r"H_2 = (\dot{x}_1(0) + \frac{x_1(0)b_1}{m_{eff}}) \frac{k}{m_s} + \frac{k\beta}{m_{eff}} - \frac{b_1 "
        r"\gamma}{m_{eff}}",
        "b_eff and m_1 are m_eff, and gamma enters with a minus sign, as in (7): with the plus sign the body is 13 "
        "cm off at the end of one compression at 3 A.",
        ("motion_of_both: H2_2",),
    ),
    15: incomplete(
        "Numerator of (11), constant terms",
        r"H_1 = \frac{-\gamma k}{m_{eff}} - \frac{uk\gamma_2}{m_s m_{eff}} - \left( \frac{L_0 k}{m_{eff}} + f_1 "
        r"\right) \frac{k}{m_s}",
        r"H_1 = \frac{-\gamma k}{m_{eff}} - \frac{uk\gamma_2}{m_s m_{eff}} - \left( \frac{L_0 k}{m_{eff}} + f_1 "
        r"\text{sign}(\dot{x}_1) \right) \frac{k}{m_s}",
        "Holds while the actuator moves up. L_0 cancels against (8), c does not, because (3) lacks it: k c stays as "
        "a force that drives both masses for ever, and the code never forms the terms that cancel.",
        ("motion_of_both: H1_2",),
    ),
    16: incomplete(
        "Transform of the actuator's displacement",
        r"X_1(s) = \frac{s^2 x_1(0) + s(\dot{x}_1(0) + \frac{x_1(0)b_1}{m_{eff}}) + \lambda_2}{s(s+d)(s+e)} + Z(s)",
        r"X_1(s) = \frac{(s^2 + s \frac{b_2}{m_s} + \frac{k}{m_s})(s^2 x_1(0) + s(\dot{x}_1(0) + "
        r"\frac{x_1(0)b_1}{m_{eff}}) + \lambda_2) + \frac{k}{m_{eff}}(s^2 x_2(0) + s\beta - "
        r"\gamma)}{s^2(s+a)(s+b)(s+c)}",
        "True, but d and e are no poles of X_1: their residues here and in (17) cancel identically, so x_1 has the "
        "poles of x_2. The denominator of (6) has three roots, one of them 0; d and e are the negatives of the other "
        "two.",
        ("motion_of_both: H3_1, H2_1, H1_1",),
    ),
    17: incomplete(
        "What the body adds to (16)",
        r"Z(s) = \frac{\frac{k}{m_{eff}}(x_2(0)s^4 + H_4 s^3 + H_3 s^2 + H_2 s + H_1)}{s^2(s+a)(s+b)(s+c)(s+d)(s+e)}",
        r"\mathop{\text{Res}}_{s=-d,-e} Z(s) = -\mathop{\text{Res}}_{s=-d,-e} \frac{s^2 x_1(0) + s(\dot{x}_1(0) + "
        r"\frac{x_1(0)b_1}{m_{eff}}) + \lambda_2}{s(s+d)(s+e)}",
        "True, but the poles d and e cancel in (16); split by themselves they divide by zero where b_1^2 = 4 k "
        "m_eff, a robot that moves as smoothly as any other. The letter e is the base of the exponentials of (18) as "
        "well.",
        ("motion_of_both: H3_1, H2_1, H1_1",),
    ),
    18: incomplete(
        "Height of the body over time",
        r"x_2(t) = A + Bt + Ce^{-at} + De^{-bt} + Ee^{-ct}",
        r"x_2(t) = x_2(0) + \dot{x}_2(0) t + \ddot{x}_2(0) W + \tilde{H}_2 \int W + \tilde{H}_1 \iint W, \quad "
        r"W = \mathcal{L}^{-1} \frac{1}{(s+a)(s+b)(s+c)}",
        "Needs distinct poles and b_1 + b_2 > 0. Without viscous friction a third pole lies at 0 and a term in t^2 "
        "is missing; near it A and B grow without bound and cancel: at b_1 = b_2 = 1e-6 N s/m the sum in double "
        "precision is more than 1 cm off although every coefficient is right to the last bit. Mostly two poles are "
        "complex, and so are two coefficients. B = (k c - gamma_2 u - m_s g - m_eff f_1 sign(x_1') - m_s f_2 "
        "sign(x_2'))/(b_1 + b_2) is a terminal velocity: while both masses slip there is no resting height. E is an "
        "energy in (25)-(27). The tilde counts H_2, H_1 from x_2(0), x_2'(0).",
        ("residue: chi", "split: W, W1, W2", "state_at: x1_t, y_t"),
    ),
    19: agrees(
        "Velocity of the body over time",
        r"\dot{x}_2(t) = B - aCe^{-at} - bDe^{-bt} - cEe^{-ct}",
        r"\dot{x}_2(t) = \dot{x}_2(0) + \ddot{x}_2(0) \dot{W} + \tilde{H}_2 W + \tilde{H}_1 \int W",
        "The time derivative of (18), with the limits of (18).",
        ("split: Wd, W, W1", "state_at: v2_t"),
    ),
    20: incomplete(
        "Displacement of the actuator over time",
        r"x_1(t) = \hat{A} + \hat{B}t + \hat{C}e^{-at} + \hat{D}e^{-bt} + \hat{E}e^{-ct} + \hat{F}e^{-dt} + "
        r"\hat{G}e^{-et}",
        r"x_1(t) = \hat{A} + \hat{B}t + \hat{C}e^{-at} + \hat{D}e^{-bt} + \hat{E}e^{-ct}",
        "The coefficients F and G are zero for every robot and every start, because the poles d and e cancel; "
        "otherwise the limits of (18). B is the same in both: the masses end with one velocity.",
        ("split: W, W1, W2", "state_at: x1_t"),
    ),
    21: incomplete(
        "Velocity of the actuator over time",
        r"\dot{x}_1(t) = \hat{B} - a\hat{C}e^{-at} - b\hat{D}e^{-bt} - c\hat{E}e^{-ct} - d\hat{F}e^{-dt} - "
        r"e\hat{G}e^{-et}",
        r"\dot{x}_1(t) = \hat{B} - a\hat{C}e^{-at} - b\hat{D}e^{-bt} - c\hat{E}e^{-ct}",
        "The time derivative of (20), whose last two terms are zero.",
        ("split: Wd, W, W1", "state_at: v1_t"),
    ),
    22: incomplete(
        "Energy of the body",
        r"U_{x_2} = \int m_s \ddot{x}_2 dx_2",
        r"E = \frac{1}{2} m_s \dot{x}_2^2 + m_s g x_2 + \frac{1}{2} k (x_2 - L_0 - c)^2",
        "The integral is the change of the kinetic energy alone. What the paper plots, and what U_delta changes, is "
        "E: it adds gravity and the spring without the actuator's share.",
        ("energies: body", "body_energy_gain: gain"),
    ),
    23: slip(
        "Energy of the body, conservative part",
        r"U_{x_2} = \int (k(-x_2 + L_0 + c) - m_s g) \ddot{x}_2 dt + U_{delta}",
        r"U_{x_2} = \int (k(-x_2 + L_0 + c) - m_s g) \dot{x}_2 dt + U_{delta}",
        "A force times an acceleration is no power: x_2'' dt is x_2' dt, which is dx_2. The sign of m_s g is right.",
        ("body_energy_gain: gain",),
    ),
    24: wrong(
        "What the body's energy gains in stance (AED)",
        r"U_{delta} = f_2(L_0 - x_2) + \int b_2 \dot{x}_2^2 dt + \int kx_1 \dot{x}_2 dt",
        r"U_{delta} = \int kx_1 \dot{x}_2 dt - \int b_2 \dot{x}_2^2 dt - m_s f_2 \int |\dot{x}_2| dt",
        "The losses enter with minus signs: with plus signs the apex at 3 A is overpredicted by 18 cm. f_2 is an "
        "acceleration, so m_s is missing, and L_0 - x_2 comes back to where it was while friction takes from the "
        "whole path. The last term is what reaches the body through the spring, 4.6 J at 3 A, not what the actuator "
        "adds: the motor does 7.7 J. The integrals have a closed form, sums over pairs of modes. The library's C computes "
        "them by quadrature: Gauss's rule over a time of at most 4/(s_1 + sqrt(s_2)), whose remainder is at most 5e-17 "
        "(single precision: 5e-9) of the products of two modes, and doubling of that time.",
        ("squares_of: int_WdWd, int_WW, int_W1W1", "moments_of: int_v2, int_v2v2, int_xv2")
        + ("ledger_of: viscous_2, coulomb_2, spring_work", "body_energy_gain: gain"),
    ),
    25: incomplete(
        "Energy at touchdown",
        r"E_{td} = \frac{1}{2} m_s v_{td}^2",
        r"E_{td} = \frac{1}{2} m_s (1 - \eta) v_{td}^2",
        "v_td has to be taken after the impact, which costs the fraction eta of the energy: taken before it, a drop "
        "from 20 cm predicts 1.0 cm too much. Height and spring at touchdown, m_s g x_1(0) + k x_1(0)^2/2, are left "
        "to (27). The 5 % of the paper stand for half of what a foot costs: one of 5 % of the body's mass takes 4.8 % "
        "of the kinetic energy as it stops at touchdown, and as much again as the body picks it up at lift-off, so that "
        "an apex reaches 0.907 of what the springs gave back. The model has a foot without mass, and the first alone.",
        ("touchdown_velocity: v_after", "apex_from_energy: E_td"),
    ),
    26: wrong(
        "Energy of a step in the ground",
        r"E_{dist} = \frac{1}{2} m_s g |x_{2ground} - x_2|",
        r"E_{dist} = m_s g (x_{2ground} - x_2)",
        "The energy of a height has no 1/2, and a step down is not a step up: a step down by 5 cm misplaces the apex "
        "by 7.5 cm, a step up by 2.5 cm. x_2 has to be read as the level from which h_des counts; as the height of "
        "the body the difference is the length of the leg on any ground.",
        ("apex_from_energy: E_dist", "printed_objective: E_dist"),
    ),
    27: incomplete(
        "What the controller minimises",
        r"J = |E_{delta}(u) - (m_s g h_{des} - E_{td} - E_{dist})|",
        r"J = |E_{delta}(u) + \frac{1}{2} k x_1(0)^2 - \frac{1}{2} k x_1(T)^2 + m_s g x_1(0) - (m_s g h_{des} - "
        r"E_{td} - E_{dist})|",
        "Leaves out the spring coordinate: E counts k x_1^2/2 that leaves with the foot at take-off, 3.2 cm of apex "
        "at 3 A. h_des counts from L_0 + c. E_delta needs a take-off; where there is none J is undefined, and as a "
        "function of u it has jumps and several minima, so the code solves apex(u) = h_des instead.",
        ("apex_from_energy: apex", "apex_of_takeoff: apex", "printed_objective: J"),
    ),
}
REGISTER = tuple(
    Equation("not claimed", entry.title, entry.printed, "", DIFFERENCE, (), number)
    if DIFFERENCE
    else replace(entry, number=number)
    for number, entry in _ENTRIES.items()
)


def tallies() -> Iterator[tuple[str, str, int, str]]:
    """A row per verdict: what it means, how many equations have it, and links to them."""
    for verdict, meaning in VERDICTS.items():
        numbers = [entry.number for entry in REGISTER if entry.verdict == verdict]
        yield verdict, meaning, len(numbers), ", ".join(f"[({number})](#{number})" for number in numbers)


CERTIFICATE = {
    "tests/unit/test_derivation.py": {
        "test_velocities_obey_3_and_4": "The closed form obeys (3), (4) in every combination of slipping and held "
        "masses, further terms or none.",
        "test_a_phase_starts_where_the_last_one_ended": "Each phase starts where the last one ended.",
        "test_both_masses_end_with_the_terminal_velocity_that_balances_all_forces": "For ever after, both masses move "
        "with the terminal velocity that balances all forces.",
        "test_the_numerators_are_those_of_11_to_17_counted_from_the_start": "The numerators are those of (11) to "
        "(17), with the corrections of this page.",
        "test_18_comes_back_for_distinct_poles": "Away from multiple poles the solution is (18), coefficient by "
        "coefficient.",
        "test_the_split_off_pole_and_the_pair_are_w": "Real pole and pair, split, are the inverse transform of (11) "
        "for any poles.",
        "test_integrals_and_derivatives_by_recursion_are_what_they_are_called": "So are the power series, the "
        "recursions and the series around a triple pole.",
        "test_the_whole_robot_gains_what_the_ledger_says": "The change of the robot's energy is the sum of the ledger.",
        "test_the_body_gains_the_aed": "The change of the body's energy is the AED.",
        "test_the_apex_from_energies_is_the_apex_of_the_takeoff": "The apex from energies is the apex of the take-off.",
        "test_a_variation_is_the_derivative_of_the_motion": "A variation is the derivative of the motion, for the "
        "current and every parameter.",
    },
    "tests/unit/test_formulas.py": {
        "test_units_balance_in_every_step": "Units balance in every generated step.",
        "test_the_generated_formula_has_the_value_of_its_derivation_at_forty_digits": "Every generated formula has "
        "the value of its derivation at 40 digits, within 16 eps of the sum of its terms.",
        "test_w_is_exact_in_double_precision_for_any_poles_and_times": "W, its derivatives and its integral are right "
        "within 128 eps for distinct, complex, double, triple, nearly triple and slow poles, the second integral "
        "within 192 eps.",
        "test_the_factors_of_the_cubic_multiply_to_its_coefficients": "The factors of the cubic multiply to its "
        "coefficients, within 4 eps each, 12 eps near a triple pole.",
    },
    "tests/unit/test_paper_claims.py": {
        "test_a_claim_has_the_numbers_that_hopform_computes": "Every number of a claim.",
    },
    "tests/unit/test_equations.py": {
        "test_what_agrees_differs_by_nothing_from_what_follows": "Every verdict on an equation, and every "
        "figure in its reason.",
        "test_what_is_printed_reads_as_the_expression_that_is_proven": "The formulas on this page are the expressions "
        "that are proven.",
    },
}
"""Claims about the derivation and the generated code, by the test that proves each, by its file."""


def proofs() -> Iterator[tuple[str, str]]:
    """A row per claim: it and its test."""
    return ((claim, f"`{file}::{test}`") for file, claims in CERTIFICATE.items() for test, claim in claims.items())
