"""The derivation as a program: named steps, ordered into the functions that both languages get.

Straight-line formulas only. What loops or branches (roots of the cubic, choice of a regime, isolation of
events, the chain of phases) stands once per language in runtime/engine and calls these.
"""

import sympy as sp

from derive import control, energy, flight, laplace, modes, partial_fractions, sensitivity, time_domain
from derive import quantities as Q
from derive.ir import Function, Program, Quantity, Record
from derive.model import HOPPER, Model


def _scalar(symbol: sp.Symbol, unit: str, meaning: str) -> Quantity:
    return Quantity(str(symbol), str(symbol), unit, meaning)


RISE = Record(
    "Rise",
    "How far a function of time has left its initial value, and its first three derivatives.",
    (
        _scalar(time_domain.rise, "1", "the function less its initial value"),
        _scalar(time_domain.rise_rate, "1/s", "its rate"),
        _scalar(time_domain.rise_curvature, "1/s^2", "the derivative of its rate"),
        _scalar(time_domain.rise_third, "1/s^3", "the derivative of that"),
    ),
)
SHIFTED = Record(
    "Shifted",
    "Three nearly equal roots: their mean rate and s^3 + Q_s s + T_s around it.",
    (
        Q.SHIFT,
        _scalar(partial_fractions.Q_s, "1/s^2", "coefficient of s"),
        _scalar(partial_fractions.T_s, "1/s^3", "constant coefficient"),
    ),
)
SHIFTED_SERIES = Record(
    "ShiftedSeries",
    "V, the inverse transform of 1/(s^3 + Q_s s + T_s), and its derivatives.",
    (
        _scalar(partial_fractions.Vdd, "1", "second derivative"),
        _scalar(partial_fractions.Vd, "s", "first derivative"),
        _scalar(partial_fractions.V, "s^2", "the function"),
        _scalar(partial_fractions.decay, "1", "exp(-sigma t)"),
    ),
)
RESPONSE = Record("Response", "W and its first two derivatives.", Q.BASIS.quantities[:3])
INTEGRALS = Record("Integrals", "The two integrals of W.", Q.BASIS.quantities[3:])
CARRIED = Record(
    "Carried",
    "W, its derivatives and integrals a short time later.",
    (
        _scalar(time_domain.Wdd_t, "1", "W''"),
        _scalar(time_domain.Wd_t, "s", "W'"),
        _scalar(time_domain.W_t, "s^2", "W"),
        _scalar(time_domain.W1_t, "s^3", "integral of W"),
        _scalar(time_domain.W2_t, "s^4", "integral of that"),
    ),
)
AT = Record(
    "At",
    "The state at time t of a phase.",
    (
        _scalar(time_domain.x1_t, "m", "displacement of the actuator"),
        _scalar(time_domain.v1_t, "m/s", "velocity of the actuator"),
        _scalar(time_domain.v2_t, "m/s", "velocity of the body"),
        _scalar(time_domain.y_t, "m", "compression of the spring"),
    ),
)
DECAY_PAIR = Record(
    "PairCore", "R, its derivative and what is left of the initial 1.", (*Q.PAIR.quantities[:2], Q.TURNED)
)
PAIR_INTEGRALS = Record("PairIntegrals", "The integrals of R.", Q.PAIR.quantities[2:])
UNSHIFTED = Record("KnownPair", "R, its derivative and its first integral.", Q.PAIR.quantities[:3])
SHORT = Record("KnownBasis", "W, its derivatives and its first integral.", Q.BASIS.quantities[:4])
V_UP = _scalar(control.v_up, "m/s", "max(v_2, 0) at take-off")


def program(model: Model = HOPPER) -> Program:
    """The functions and records of a model."""
    robot = model.robot
    ledger = energy.ledger_record(model)
    robot_change = sensitivity.changes(robot)
    functions = (
        Function(
            "rates_of",
            "Coefficients of the equations of motion and of their characteristic polynomials.",
            (robot,),
            laplace.rates(model),
            Q.RATES,
        ),
        Function(
            "drive_of",
            "Constant accelerations of a phase.",
            (robot, Q.RATES, Q.CURRENT, Q.SIDE_1, Q.SIDE_2),
            laplace.drive(),
            Q.DRIVE,
        ),
        *(
            Function(
                f"motion_of_{who}",
                f"Numerators of the motion with {who} slipping.",
                (Q.RATES, Q.DRIVE, Q.STATE),
                laplace.numerators(moving),
                Q.MOTION,
            )
            for who, moving in modes.MOVING.items()
        ),
        Function(
            "free_accelerations",
            "Free accelerations of both masses.",
            (Q.RATES, Q.STATE, Q.CURRENT),
            modes.free(),
            Q.FREE,
        ),
        *(
            Function(
                f"free_numerator_{number}",
                f"How the free acceleration of mass {number}, held, leaves its initial value.",
                (Q.RATES, Q.MOTION),
                modes.free_numerator(number),
                Q.NUMERATOR,
            )
            for number in (1, 2)
        ),
        Function("residue", "What (18) divides by.", (Q.POLES,), (partial_fractions.split_off_pole,), Q.CHI),
        Function(
            "split",
            "W from exp(-a t) and R.",
            (Q.POLES, Q.CHI, Q.DECAY, Q.PAIR),
            partial_fractions.split(),
            Q.BASIS,
        ),
        Function(
            "split_soon",
            "W while exp(-a t) is near 1.",
            (Q.POLES, Q.CHI, Q.DECAY, Q.PAIR),
            partial_fractions.split_soon(),
            _scalar(Q.W, "s^2", "response of the three poles to an impulse"),
        ),
        Function(
            "pair_by_quotient",
            "Integrals of R where q t^2 is not small.",
            (Q.POLES, DECAY_PAIR, Q.TIME),
            partial_fractions.pair_by_quotient(),
            PAIR_INTEGRALS,
        ),
        Function(
            "pair_from_series",
            "R, its derivative and first integral from its two highest integrals.",
            (Q.POLES, Q.PAIR_SERIES, Q.TIME),
            partial_fractions.pair_from_series(),
            UNSHIFTED,
        ),
        Function(
            "all_from_series",
            "W, its derivatives and first integral from its three highest integrals.",
            (Q.POLES, Q.SERIES, Q.TIME),
            partial_fractions.all_from_series(),
            SHORT,
        ),
        Function(
            "shift", "Three nearly equal roots, seen from their mean.", (Q.POLES,), partial_fractions.shift(), SHIFTED
        ),
        Function(
            "unshift",
            "W from the series around the mean root.",
            (Q.SHIFT, SHIFTED_SERIES),
            partial_fractions.unshift(),
            RESPONSE,
        ),
        Function(
            "integrals_by_recursion",
            "The integrals of W where the poles are close together and none is slow.",
            (Q.POLES, RESPONSE, Q.TIME),
            partial_fractions.integrals_by_recursion(),
            INTEGRALS,
        ),
        Function(
            "behind_the_pole",
            "What is left of a numerator behind the factor s + a.",
            (Q.POLES, Q.NUMERATOR),
            partial_fractions.behind_the_pole(),
            Q.PAIR_NUMERATOR,
        ),
        Function(
            "turning",
            "How fast a function of time turns, but for the real pole: a motion of the pair alone.",
            (Q.POLES, Q.PAIR_NUMERATOR, Q.BASIS),
            partial_fractions.turning(),
            _scalar(partial_fractions.m, "1/s^2", "A R' + B R"),
        ),
        Function(
            "ringing_at",
            "A function of time as a slow part and an oscillation.",
            (Q.POLES, Q.CHI, Q.NUMERATOR, Q.DECAY),
            partial_fractions.ringing(),
            Q.RINGING,
        ),
        Function(
            "rises",
            "How far a function of time has left its initial value.",
            (Q.POLES, Q.NUMERATOR, Q.BASIS),
            time_domain.rises(),
            RISE,
        ),
        Function(
            "left_to_go",
            "What is left of the way to the value to which a function of time tends.",
            (Q.POLES, Q.NUMERATOR, Q.BASIS, Q.WAY),
            time_domain.left_to_go(),
            _scalar(time_domain.left, "1", "the final value less the function"),
        ),
        Function(
            "carry",
            "W a short time t later.",
            (Q.POLES, Q.BASIS, Q.TIME),
            time_domain.carried(),
            CARRIED,
        ),
        Function("state_at", "The state at time t of a phase.", (Q.STATE, Q.MOTION, Q.BASIS), time_domain.state(), AT),
        Function("energies", "Energy of the body and of the robot.", (robot, Q.STATE), energy.energies(), Q.ENERGY),
        Function(
            "body_energy_gain",
            "Change of the body's energy between two states, the AED.",
            (robot, Q.STATE, AT),
            energy.body_energy_gain(),
            _scalar(sp.Symbol("gain", real=True), "J", "E(t) - E(0)"),
        ),
        Function(
            "ledger_of",
            "Each entry of the ledger over a part of a phase that starts at x_1 = x1_0.",
            (
                robot,
                Q.MOMENTS,
                Q.CURRENT,
                Q.SIDE_1,
                Q.SIDE_2,
                _scalar(energy.x1_0, "m", "displacement of the actuator at the start of the phase"),
            ),
            energy.ledger(model),
            ledger,
        ),
        Function(
            "aed_of_ledger",
            "What the entries of a ledger add to the energy of the body.",
            (ledger,),
            energy.aed_of_ledger(model),
            _scalar(control.aed, "J", "analytical energy delta"),
        ),
        Function(
            "body_height",
            "Height of the body over the ground under the foot.",
            (robot, Q.STATE.quantities[0], Q.STATE.quantities[3]),
            energy.body_height(),
            _scalar(Q.x2, "m", "height of the body"),
        ),
        Function(
            "stored_energy",
            "What the energy of the body has beside its motion and its height.",
            (robot, Q.STATE),
            energy.stored_energy(),
            _scalar(energy.stored, "J", "k (x_2 - L_0 - c)^2/2"),
        ),
        Function(
            "touchdown_velocity",
            "Velocity of the body after the impact of a drop from a hop height.",
            (robot, Q.HEIGHT),
            control.touchdown_velocity(),
            _scalar(control.v_after, "m/s", "velocity after the impact"),
        ),
        Function(
            "apex_of_takeoff",
            "Hop height of the apex after a take-off.",
            (robot, Q.STATE.quantities[0], V_UP),
            control.apex_of_takeoff(),
            _scalar(control.apex, "m", "hop height of the apex"),
        ),
        Function(
            "apex_from_energy",
            "Hop height of the apex over the ground at take-off, from the energies at touchdown and the AED.",
            (
                robot,
                Q.STATE,
                _scalar(control.aed, "J", "analytical energy delta of the stance"),
                _scalar(control.x1_T, "m", "displacement of the actuator at take-off"),
                _scalar(control.step, "m", "reference level less the ground under the foot"),
            ),
            control.apex_from_energy(),
            _scalar(control.apex, "m", "hop height of the apex"),
        ),
        Function(
            "printed_objective",
            "The objective of the controller as the paper prints it.",
            (
                robot,
                Q.STATE,
                _scalar(control.aed, "J", "analytical energy delta of the stance"),
                _scalar(control.h_des, "m", "desired apex"),
                _scalar(control.step, "m", "reference level less the ground under the foot"),
            ),
            control.printed_objective(),
            _scalar(control.J, "J", "what the printed controller minimises"),
        ),
        Function(
            "objective",
            "The same objective with another share of the step, and with the spring coordinate.",
            (
                robot,
                Q.STATE,
                _scalar(control.aed, "J", "analytical energy delta of the stance"),
                _scalar(control.x1_T, "m", "displacement of the actuator at take-off"),
                _scalar(control.h_des, "m", "desired apex"),
                _scalar(control.lift, "m", "what (26) counts of the step, printed half its size"),
                _scalar(control.spring, "1", "0: without the spring coordinate as printed, 1: with it"),
            ),
            control.objective(),
            _scalar(control.J, "J", "what the controller minimises"),
        ),
        Function(
            "threshold_current",
            "Current at which the unloaded actuator starts to move.",
            (robot,),
            control.threshold(),
            _scalar(control.u_threshold, "A", "threshold of the current"),
        ),
        Function(
            "slopes_of",
            "How the right sides of (3), (4) change with the robot and the current.",
            (robot, Q.CURRENT, Q.SIDE_1, Q.SIDE_2, robot_change, sensitivity.CURRENT_CHANGE),
            sensitivity.slopes(model),
            sensitivity.SLOPES,
        ),
        Function(
            "body_energy_change",
            "How the energy of the body changes with the robot and the state, x_2 counted from L_0 + c.",
            (robot, Q.STATE, robot_change, sensitivity.STATE_CHANGE),
            sensitivity.body_energy_change(model),
            _scalar(sensitivity.change_of(Q.body), "J", "change of the energy"),
        ),
        Function(
            "apex_change",
            "How the apex changes with gravity and the state at take-off.",
            (
                robot,
                V_UP,
                robot_change,
                _scalar(sensitivity.change_of(Q.x1), "m", "change of the actuator's displacement at take-off"),
                _scalar(sensitivity.change_of(control.v_up), "m/s", "change of v_up"),
            ),
            sensitivity.apex_change(),
            _scalar(sensitivity.change_of(control.apex), "m", "change of the hop height of the apex"),
        ),
        *_of_flight(model),
    )
    records = (
        robot,
        Q.RATES,
        Q.POLES,
        Q.STATE,
        Q.DRIVE,
        Q.MOTION,
        Q.NUMERATOR,
        Q.DECAY,
        Q.PAIR,
        DECAY_PAIR,
        PAIR_INTEGRALS,
        Q.PAIR_SERIES,
        UNSHIFTED,
        Q.BASIS,
        Q.SERIES,
        SHORT,
        SHIFTED,
        SHIFTED_SERIES,
        RESPONSE,
        INTEGRALS,
        Q.PAIR_NUMERATOR,
        Q.RINGING,
        Q.FREE,
        RISE,
        CARRIED,
        AT,
        Q.ENERGY,
        Q.MOMENTS,
        ledger,
        robot_change,
        sensitivity.STATE_CHANGE,
        sensitivity.SLOPES,
        flight.GAINS,
        flight.FLIGHT_RATES,
        flight.ACTUATOR,
        flight.ACTUATOR_AT,
        flight.PULL,
        flight.BALLISTIC,
        flight.FOOT_AT,
        flight.WAY,
        flight.FLIGHT_LEDGER,
    )
    return Program(
        "Closed-form stance of a series-elastic hopper with viscous and Coulomb friction.", records, functions
    )


def _of_flight(model: Model) -> tuple[Function, ...]:
    """The functions of the flight."""
    robot, gains, rates, actuator = model.robot, flight.GAINS, flight.FLIGHT_RATES, flight.ACTUATOR
    start = actuator.quantities[2]
    return (
        Function(
            "flight_rates_of",
            "Poles and accelerations of the actuator in flight.",
            (robot, gains, flight.LIMIT_FORCE),
            flight.rates(model),
            rates,
        ),
        Function(
            "acceleration_under_law",
            "Acceleration with which a phase of the flight under the law begins.",
            (robot, rates, *actuator.quantities[:2], Q.SIDE_1),
            flight.start_under_law(),
            start,
        ),
        Function(
            "acceleration_at_limit",
            "Acceleration with which a phase of the flight at the limit of the current begins.",
            (robot, rates, actuator.quantities[1], Q.SIDE_1, flight.LIMIT),
            flight.start_at_limit(),
            start,
        ),
        Function(
            "actuator_in_flight",
            "The actuator at time t of a phase of the flight.",
            (actuator, Q.POLES, Q.PAIR),
            flight.motion(),
            flight.ACTUATOR_AT,
        ),
        Function(
            "pull_of_law",
            "What the law asks of the motor at time t of a phase of the flight.",
            (gains, actuator, flight.ACTUATOR_AT),
            flight.pulls(),
            flight.PULL,
        ),
        Function(
            "foot_in_flight",
            "The foot at time t of a phase of the flight.",
            (robot, flight.BALLISTIC, flight.ACTUATOR_AT, Q.TIME),
            flight.feet(),
            flight.FOOT_AT,
        ),
        Function(
            "critical_gains",
            "Gains that bring the actuator back in a given time, critically damped.",
            (robot, flight.SETTLING),
            flight.design(model),
            gains,
        ),
        Function(
            "time_of_fall",
            "Time after which the body has come down from a height.",
            (robot, Q.STATE.quantities[2], flight.DROP),
            flight.fall(),
            _scalar(flight.touchdown_time, "s", "time of the touchdown"),
        ),
        Function(
            "velocity_after_impact",
            "Velocity of the body after the impact.",
            (robot, Q.STATE.quantities[2]),
            flight.impact(),
            _scalar(flight.v2_after, "m/s", "velocity of the body after the impact"),
        ),
        Function(
            "flight_energies",
            "Energy of the body and of the robot in flight.",
            (robot, *Q.STATE.quantities[1:3], flight.BODY_HEIGHT),
            flight.energies(),
            Q.ENERGY,
        ),
        Function(
            "flight_ledger_of",
            "Each entry of the flight's ledger over a part of a phase.",
            (
                robot,
                gains,
                flight.LIMIT_FORCE,
                *actuator.quantities[:1],
                Q.SIDE_1,
                flight.LIMIT,
                flight.WAY,
            ),
            flight.ledger(model),
            flight.FLIGHT_LEDGER,
        ),
    )
