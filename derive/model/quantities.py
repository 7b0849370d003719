"""Every symbol of the project, declared once: spelling, the paper's glyph, unit, domain, meaning.

Robot fields, C structs, input checks, docstrings and the test of units all read these tables.
"""

import sympy as sp

from ..ir import Quantity, Record

ROBOT = Record("Robot", "What the mechanism is made of.")
"""Its quantities are the parameters of a model, which its file declares."""

LETTERS = sp.symbols(
    "m_eff m_s k L0 c b1 b2 f1 f2 gamma2 g x1_min x1_max u_max impact_loss f1_excess f2_excess "
    "f1_minus f2_minus f1_excess_minus f2_excess_minus K_p K_d ratio",
    real=True,
)
(
    m_eff, m_s, k, L0, c, b1, b2, f1, f2, gamma2, g, x1_min, x1_max, u_max, impact_loss, f1_excess, f2_excess,
    f1_minus, f2_minus, f1_excess_minus, f2_excess_minus, K_p, K_d, ratio,
) = LETTERS  # fmt: skip
"""The letters of the derivation, the paper's parameters and those of friction by sign: a model says what each is.

m_eff, m_s: inertias of the two masses. k, L0, c: the spring, of compression x_1 - x_2 + L0 + c, and the offset force
k c. b1, b2: viscous friction. f_i, f_i_minus: Coulomb friction over the inertia where v_i > 0 and where v_i < 0;
f_i_excess, f_i_excess_minus: what friction at rest has more, to either side. gamma2: force per current, against x_1.
g: gravity. x1_min, x1_max: stops. u_max: limit of the current. impact_loss: fraction of the body's kinetic energy lost
at touchdown. K_p, K_d: gains of a law that sets the current, force per displacement and per velocity. ratio: of a gear
or a rope, by which the spring's compression is ratio x_1 - x_2 + L0 + c.
"""
BY_SIGN = (f1_minus, f2_minus, f1_excess_minus, f2_excess_minus)
"""The letters that no parameter of the paper's hopper has: friction backward, where it is another."""
OF_LAW = (K_p, K_d)
"""Further ones: the gains of a law."""
OF_GEAR = (ratio,)
"""That of a gear."""
TRAVEL = Quantity("travel", r"y_{max}", "m", "travel of the spring: compression at coil bind", "length", float("inf"))
"""A limit of the robot that no equation knows: compressions are compared with it."""

RATES = Record("Rates", "Coefficients of y, v_1, v_2 and 1 in (3), (4), and their characteristic polynomials.").of(
    Quantity("a1_y", r"a_{1y}", "1/s^2", "acceleration of the actuator per compression"),
    Quantity("a1_v1", r"a_{11}", "1/s", "acceleration of the actuator per v_1"),
    Quantity("a1_v2", r"a_{12}", "1/s", "acceleration of the actuator per v_2"),
    Quantity("a1_u", r"a_{1u}", "m/s^2/A", "acceleration of the actuator per current"),
    Quantity("a1_0", r"a_{10}", "m/s^2", "constant acceleration of the actuator"),
    Quantity("a2_y", r"a_{2y}", "1/s^2", "acceleration of the body per compression"),
    Quantity("a2_v1", r"a_{21}", "1/s", "acceleration of the body per v_1"),
    Quantity("a2_v2", r"a_{22}", "1/s", "acceleration of the body per v_2"),
    Quantity("a2_0", r"a_{20}", "m/s^2", "constant acceleration of the body"),
    Quantity("s_1", r"s_1", "1/s", "sum of the rates of the three poles"),
    Quantity("s_2", r"s_2", "1/s^2", "sum of their products in pairs"),
    Quantity("s_3", r"s_3", "1/s^3", "their product"),
    Quantity("p_1", r"p_1", "1/s", "actuator moving alone: s^2 + p_1 s + q_1"),
    Quantity("q_1", r"q_1", "1/s^2", "actuator moving alone"),
    Quantity("p_2", r"p_2", "1/s", "body moving alone: s^2 + p_2 s + q_2"),
    Quantity("q_2", r"q_2", "1/s^2", "body moving alone"),
    Quantity("damping", r"a_{11} a_{22} - a_{12} a_{21}", "1/s^2", "product of the rates of both without the spring"),
)
a1_y, a1_v1, a1_v2, a1_u, a1_0, a2_y, a2_v1, a2_v2, a2_0, s_1, s_2, s_3, p_1, q_1, p_2, q_2, damping = RATES.symbols
RATES_OF_GEAR = (
    Quantity("y_v1", r"\rho", "1", "rate of the compression per v_1"),
    Quantity(
        "drift_1", r"a_{11} + \rho a_{12}", "1/s", "acceleration of the actuator per v_1 at a constant compression"
    ),
    Quantity("drift_2", r"a_{21} + \rho a_{22}", "1/s", "acceleration of the body per v_1 at a constant compression"),
)
"""Further rates, where a gear or a rope makes y_v1 another number than 1: in the sums nothing cancels."""
y_v1, drift_1, drift_2 = (quantity.symbol for quantity in RATES_OF_GEAR)

POLES = Record("Poles", "The denominator of a mode, (s + a)(s^2 + p s + q); a = 0 where one mass is held.").of(
    Quantity("a", r"a", "1/s", "rate of the real pole"),
    Quantity("p", r"p", "1/s", "sum of the rates of the pair"),
    Quantity("q", r"q", "1/s^2", "product of the rates of the pair"),
    *RATES.quantities[9:12],
)
a, p, q = POLES.symbols[:3]

STATE = Record("State", "The hopper at one instant.", python_name="LegState").of(
    Quantity("x1", r"x_1", "m", "displacement of the actuator"),
    Quantity("v1", r"\dot{x}_1", "m/s", "velocity of the actuator"),
    Quantity("v2", r"\dot{x}_2", "m/s", "velocity of the body"),
    Quantity("y", r"y", "m", "spring deflection, from its free length"),
)
x1, v1, v2, y = STATE.symbols

DRIVE = Record("Drive", "Constant accelerations of a phase: current, gravity, offset and Coulomb friction.").of(
    Quantity("C_1", r"C_1", "m/s^2", "constant acceleration of the actuator"),
    Quantity("C_2", r"C_2", "m/s^2", "constant acceleration of the body"),
)
C_1, C_2 = DRIVE.symbols

MOTION = Record("Numerators", "Numerators of (11), counted from where and how fast each coordinate starts.").of(
    Quantity("H3_1", r"H_{3,1}", "m/s^2", "actuator, terms in s^2: its initial acceleration"),
    Quantity("H2_1", r"H_{2,1}", "m/s^3", "actuator, terms in s"),
    Quantity("H1_1", r"H_{1,1}", "m/s^4", "actuator, constant terms"),
    Quantity("H3_2", r"H_{3,2}", "m/s^2", "body, terms in s^2: its initial acceleration"),
    Quantity("H2_2", r"H_{2,2}", "m/s^3", "body, terms in s"),
    Quantity("H1_2", r"H_{1,2}", "m/s^4", "body, constant terms"),
    Quantity("H3_y", r"H_{3,y}", "m/s", "compression, terms in s^2: its initial rate"),
    Quantity("H2_y", r"H_{2,y}", "m/s^2", "compression, terms in s"),
    Quantity("H1_y", r"H_{1,y}", "m/s^3", "compression, constant terms"),
    Quantity("N2_1", r"N_{2,1}", "m/s^2", "actuator, terms in s^2 of its whole numerator, that begins with v_1 s^3"),
    Quantity("N1_1", r"N_{1,1}", "m/s^3", "actuator, terms in s of that"),
    Quantity("N0_1", r"N_{0,1}", "m/s^4", "actuator, constant terms of that"),
)
H3_1, H2_1, H1_1, H3_2, H2_2, H1_2, H3_y, H2_y, H1_y, N2_1, N1_1, N0_1 = MOTION.symbols

NUMERATOR = Record("Numerator", "H_3 s^2 + H_2 s + H_1 of (11): how a function of time leaves its initial value.").of(
    Quantity("H3", r"H_3", "1/s", "terms in s^2: the initial rate"),
    Quantity("H2", r"H_2", "1/s^2", "terms in s"),
    Quantity("H1", r"H_1", "1/s^3", "constant terms"),
)
H3, H2, H1 = NUMERATOR.symbols

DECAY = Record("Decay", "exp(-a t) and its integrals.").of(
    Quantity("e", r"e^{-at}", "1", "exp(-a t)"),
    Quantity("e1", r"\int e^{-at}", "s", "integral of e, t phi_1(-a t)"),
    Quantity("e2", r"\iint e^{-at}", "s^2", "integral of e1, t^2 phi_2(-a t)"),
    Quantity("e3", r"\iiint e^{-at}", "s^3", "integral of e2, t^3 phi_3(-a t)"),
)
e, e1, e2, e3 = DECAY.symbols

PAIR = Record("Pair", "The inverse transform R of 1/(s^2 + p s + q), its derivative and its integrals.").of(
    Quantity("Rd", r"\dot{R}", "1", "derivative of R"),
    Quantity("R", r"R", "s", "response of the pair of poles to an impulse"),
    Quantity("R1", r"\int R", "s^2", "integral of R"),
    Quantity("R2", r"\iint R", "s^3", "integral of R1"),
    Quantity("R3", r"\iiint R", "s^4", "integral of R2"),
)
Rd, R, R1, R2, R3 = PAIR.symbols
TURNED = Quantity("turned", r"q \int R", "1", "1 - Rd - p R = q R1, small after a full turn")
turned = TURNED.symbol

BASIS = Record("Basis", "The inverse transform W of 1/((s + a)(s^2 + p s + q)), its derivatives and its integrals.").of(
    Quantity("Wdd", r"\ddot{W}", "1", "second derivative of W"),
    Quantity("Wd", r"\dot{W}", "s", "derivative of W"),
    Quantity("W", r"W", "s^2", "response of the three poles to an impulse"),
    Quantity("W1", r"\int W", "s^3", "integral of W"),
    Quantity("W2", r"\iint W", "s^4", "integral of W1"),
)
Wdd, Wd, W, W1, W2 = BASIS.symbols

SERIES = Record("Series", "W over a short time, from its power series: the three highest integrals.").of(
    BASIS.quantities[4],
    Quantity("W3", r"\iiint W", "s^5", "third integral of W"),
    Quantity("W4", r"\iiiint W", "s^6", "fourth integral of W"),
)
W3, W4 = SERIES.symbols[1:]

PAIR_SERIES = Record(
    "PairSeries", "The highest integrals of R over a short time, from its power series.", PAIR.quantities[3:]
)

FREE = Record("Free", "Free accelerations: the right sides of (3), (4) at v_i = 0 without the friction of mass i.").of(
    Quantity("free_1", r"a_1", "m/s^2", "free acceleration of the actuator"),
    Quantity("free_2", r"a_2", "m/s^2", "free acceleration of the body"),
)
free_1, free_2 = FREE.symbols

PAIR_NUMERATOR = Record("PairNumerator", "Deflated numerator, s + a divided out: A s + B over s^2 + p s + q.").of(
    Quantity("A", r"A", "1/s^2", "terms in s"),
    Quantity("B", r"B", "1/s^3", "constant terms"),
)
A, B = PAIR_NUMERATOR.symbols

ENERGY = Record("Energy", "The energy of the body with its spring, (22), (23), and of the whole robot.").of(
    Quantity("body", r"E", "J", "kinetic + gravitational + k (x_2 - L_0 - c)^2/2; in flight without the latter"),
    Quantity("total", r"H", "J", "kinetic and potential energy of the whole robot"),
)
body, total = ENERGY.symbols

MOMENTS = Record("Moments", "Time integrals over a part of a phase; x_1 counts from where the phase starts.").of(
    Quantity("int_v1", r"\int v_1", "m", "integral of v_1"),
    Quantity("int_v2", r"\int v_2", "m", "integral of v_2"),
    Quantity("int_v1v1", r"\int v_1^2", "m^2/s", "integral of v_1^2"),
    Quantity("int_v1v2", r"\int v_1 v_2", "m^2/s", "integral of v_1 v_2"),
    Quantity("int_v2v2", r"\int v_2^2", "m^2/s", "integral of v_2^2"),
    Quantity("int_yv1", r"\int y v_1", "m^2", "integral of y v_1"),
    Quantity("int_yv2", r"\int y v_2", "m^2", "integral of y v_2"),
    Quantity("int_xv2", r"\int (x_1 - x_1(0)) v_2", "m^2", "integral of (x_1 - x_1(0)) v_2"),
)
int_v1, int_v2, int_v1v1, int_v1v2, int_v2v2, int_yv1, int_yv2, int_xv2 = MOMENTS.symbols

LEDGER = Record(
    "Ledger", "Work of each force, signed as it enters the robot; what is lost at stops is apart.", python_name="Work"
).of(
    Quantity("motor_work", r"-\int\gamma_2 u v_1", "J", "work of the motor"),
    Quantity("offset_work", r"k c \Delta x_1", "J", "work of the offset force k c"),
    Quantity("viscous_1", r"-\int b_1 v_1^2", "J", "viscous loss of the actuator"),
    Quantity("viscous_2", r"-\int b_2 v_2^2", "J", "viscous loss of the body"),
    Quantity("coulomb_1", r"-m_{eff} f_1\int|v_1|", "J", "Coulomb loss of the actuator"),
    Quantity("coulomb_2", r"-m_s f_2\int|v_2|", "J", "Coulomb loss of the body"),
    Quantity(
        "spring_work", r"\int k x_1 v_2", "J", "what the actuator's displacement does to the body through the spring"
    ),
)
STOP_LOSS = Quantity("stop_loss", "E_s", "J", "what the actuator lost at stops")
motor_work, offset_work, viscous_1, viscous_2, coulomb_1, coulomb_2, spring_work = LEDGER.symbols

TIME = Quantity("t", r"t", "s", "time since the phase began")
CURRENT = Quantity("u", r"u", "A", "current")
SIDE_1 = Quantity("side_1", r"\mathrm{sign}\,\dot{x}_1", "1", "sign of v_1 in the phase, 0 if held")
SIDE_2 = Quantity("side_2", r"\mathrm{sign}\,\dot{x}_2", "1", "sign of v_2 in the phase, 0 if held")
LIMIT_SIGN = Quantity("limit", r"\ell", "1", "sign of the limit that the input of a law is at in the phase, 0 under it")
RESIDUAL_0 = Quantity("residual_0", r"r(0)", "1", "final value of a function of time, less its initial value")
CHI = Quantity("chi", r"\chi", "1/s^2", "s^2 + p s + q at s = -a: what (18) divides by")
OMEGA = Quantity("omega_p", r"\omega", "1/s", "frequency of a pair that rings")
SHIFT = Quantity("sigma", r"\sigma", "1/s", "mean of the three rates, for nearly triple poles")
HEIGHT = Quantity("height", r"h", "m", "hop height")
BODY_HEIGHT = Quantity("x2", r"x_2", "m", "height of the body over the ground under the foot")
t, u, side_1, side_2, limit_sign, residual_0, chi, omega_p, sigma, height, x2 = (
    quantity.symbol
    for quantity in (TIME, CURRENT, SIDE_1, SIDE_2, LIMIT_SIGN, RESIDUAL_0, CHI, OMEGA, SHIFT, HEIGHT, BODY_HEIGHT)
)
