"""The cases of the reference set: what each is in words, its numbers, and its equations as problems of the oracle.

A number of a case is a float64, taken exactly. Nothing here is of hopform.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

Numbers = Mapping[str, Any]
Steps = list[tuple[float, Any]]
Text = dict[str, Any]


class Quantity(NamedTuple):
    """A number of a case: its value, unit and meaning."""

    value: float
    unit: str
    meaning: str


class Input(NamedTuple):
    """What drives a case: constant from each step to the next."""

    name: str
    unit: str
    meaning: str
    steps: Steps


class Gradient(NamedTuple):
    """A derivative of a value of the answer by a parameter, a start or the input (all its steps alike), and the step
    of the differences by which a simulator is asked for it.
    """

    of: str
    by: str
    step: float


@dataclass(frozen=True)
class Case:
    """A case before it is solved. `every`: time between the instants of the answer; `values`: the state at the last
    instant by its name, or `time_to_rest`, `takeoff`, `apex`, `touchdown`; `mjcf`, `urdf`: why that format cannot say
    it, empty where it can.
    """

    name: str
    title: str
    description: str
    family: str
    equations: tuple[str, ...]
    coordinates: dict[str, tuple[str, str]]  # unit, velocity
    parameters: dict[str, Quantity]
    start: dict[str, Quantity]
    input: Input
    horizon: float
    every: float
    values: tuple[str, ...]
    gradients: tuple[Gradient, ...]
    problem: Callable[[Numbers, Numbers, Steps, float], Text]
    mjcf: str = ""
    urdf: str = ""


# ---- one joint ----

J = Quantity(0.031, "kg m^2", "inertia")
DAMPING = Quantity(0.0085, "N m s/rad", "viscous friction")


def joint_values(F: float, **more: Quantity) -> dict[str, Quantity]:
    return {"J": J, "b": DAMPING, "F": Quantity(F, "N m", "Coulomb friction"), **more}


def joint_start(q: float = 0.0, v: float = 0.0) -> dict[str, Quantity]:
    return {"q": Quantity(q, "rad", "angle at t = 0"), "v": Quantity(v, "rad/s", "velocity at t = 0")}


def constant(value: float) -> Steps:
    return [(0.0, value)]


def torque(steps: Steps) -> Input:
    return Input("tau", "N m", "torque on the joint", steps)


def one_joint(p: Numbers, start: Numbers, steps: Steps, horizon: float, **other: Any) -> Text:
    """J q'' = tau - k q - b q' - F(q'), between stops; `other` replaces what is another for a drive or a law."""
    level = "F + F_s" if "F_s" in p else "F"
    element = {"name": "q", "direction": [1], "friction": ["F", "F"], "at_rest": [level, level]}
    if "q_min" in p:
        element["limits"] = ["q_min", "q_max"]
    return {
        "name": "joint",
        "coordinates": ["q"],
        "mass": [["J"]],
        "stiffness": {"spring": [["k" if "k" in p else "0"]]},
        "damping": {"viscous": [["b"]]},
        "input": ["1"],
        "elements": [element],
        "position": ["q"],
        "velocity": ["v"],
        "outputs": {"q": {"q": [1]}, "v": {"v": [1]}},
        **as_given(p, start, steps, horizon),
        **other,
    }


def as_given(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    return {"parameters": dict(p), "start": dict(start), "u": steps, "horizon": horizon}


def driven_joint(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    """The far end of the spring is the input: J q'' = k (phi - q) - b q' - F(q')."""
    return one_joint(p, start, steps, horizon, input=["k"])


def servo(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    """J q'' = tau - b q' - F(q') under tau = sat(K_p (target - q) - K_d q')."""
    law = {"q": ["-K_p"], "v": ["-K_d"], "target": "K_p", "limit": "tau_max"}
    return one_joint(p, start, steps, horizon, law=law)


SLIDING = "F(v) = F sign(v); at v = 0 the joint is held while the other torques are within F"
RATE = "q' = v"
JOINT = {"q": ("rad", "v")}
NO_SPRING = "URDF has no spring at a joint"

SPIN_DOWN = Case(
    "spin-down",
    "A joint spins down to rest",
    "A joint that turns freely is braked by viscous and Coulomb friction. It comes to rest at the time "
    "t = (J/b) ln(1 + b v(0)/F), and stays.",
    "joint",
    (RATE, "J v' = tau - b v - F(v)", SLIDING),
    JOINT,
    joint_values(0.042),
    joint_start(v=11.5),
    torque(constant(0.0)),
    6.0,
    0.05,
    ("q_end", "time_to_rest"),
    (
        Gradient("q_end", "F", 1e-4),
        Gradient("q_end", "b", 1e-5),
        Gradient("q_end", "J", 1e-4),
        Gradient("q_end", "v", 1e-2),
        Gradient("time_to_rest", "F", 1e-4),
    ),
    one_joint,
)

HOLD = Case(
    "hold",
    "A joint is held below its friction",
    "A constant torque of 0.3 of the Coulomb friction acts on a joint at rest. Nothing moves: any velocity is creep.",
    "joint",
    (RATE, "J v' = tau - b v - F(v)", SLIDING),
    JOINT,
    joint_values(1.0),
    joint_start(),
    torque(constant(0.3)),
    2.0,
    0.02,
    ("q_end",),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "tau", 1e-4), Gradient("q_end", "q", 1e-4)),
    one_joint,
)

SINE = Case(
    "slow-sine",
    "A joint follows a slow sine of torque, sticks and slips",
    "The torque is 0.6 sin(2 pi 0.25 t) N m, rounded to 1e-6 and held from tick to tick, 50 ticks a second, so that the "
    "answer is exact. The joint slips while the torque is above its friction, and is held around each reversal.",
    "joint",
    (RATE, "J v' = tau - b v - F(v)", SLIDING),
    JOINT,
    joint_values(0.35),
    joint_start(),
    torque([(k * 1.0 / 50, round(0.6 * math.sin(2.0 * math.pi * 0.25 * k / 50), 6)) for k in range(250)]),
    5.0,
    0.04,
    ("q_end", "v_end"),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "b", 1e-5), Gradient("q_end", "J", 1e-5)),
    one_joint,
)

STAIRS = Case(
    "stick-slip",
    "Stick-slip of a mass that a spring pulls over stairs",
    "The far end of a spring moves by a stair each 0.25 s. The mass follows in jumps: each breaks away with the stair, "
    "and ends where the spring is left within the friction.",
    "driven joint",
    (RATE, "J v' = k (phi - q) - b v - F(v)", SLIDING),
    JOINT,
    joint_values(0.5, k=Quantity(8.0, "N m/rad", "stiffness of the spring")),
    joint_start(),
    Input(
        "phi",
        "rad",
        "angle of the spring's far end",
        [(0.25 * n, a) for n, a in enumerate((0.0, 0.15, 0.3, 0.45, 0.6, 0.4, 0.2, 0.0))],
    ),
    2.5,
    0.02,
    ("q_end",),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "k", 1e-3), Gradient("q_end", "J", 1e-4)),
    driven_joint,
    urdf=NO_SPRING,
)

STOPS = Case(
    "stops",
    "A joint on a spring hits its stops",
    "A spring pulls a joint from 0.2 rad; a torque pushes it against the upper stop and lets go. A stop is inelastic: the "
    "joint loses its velocity there.",
    "joint",
    (RATE, "J v' = tau - k q - b v - F(v)", SLIDING, "v = 0 after q has reached q_min or q_max"),
    JOINT,
    joint_values(
        0.042,
        k=Quantity(1.5, "N m/rad", "stiffness of a spring to q = 0"),
        q_min=Quantity(-0.1, "rad", "lower stop"),
        q_max=Quantity(0.3, "rad", "upper stop"),
    ),
    joint_start(0.2),
    torque([(0.0, 0.0), (0.4, 0.4), (0.8, 0.0)]),
    2.0,
    0.02,
    ("q_end", "v_end"),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "k", 1e-4), Gradient("q_end", "q_min", 1e-4)),
    one_joint,
    urdf=NO_SPRING,
)

SERVO = Case(
    "servo",
    "A servo at the limit of its torque",
    "A PD law follows steps of a target; its torque is limited, and at the limit for most of each step. The friction "
    "leaves an error at rest.",
    "servo",
    (RATE, "J v' = tau - b v - F(v)", "tau = K_p (target - q) - K_d v, between -tau_max and tau_max", SLIDING),
    JOINT,
    joint_values(
        0.1,
        K_p=Quantity(8.0, "N m/rad", "torque per difference of target and angle"),
        K_d=Quantity(0.5, "N m s/rad", "torque per velocity, against it"),
        tau_max=Quantity(0.5, "N m", "limit of the torque"),
    ),
    joint_start(),
    Input("target", "rad", "angle that the law follows", [(0.0, 1.0), (1.2, -0.5)]),
    3.0,
    0.04,
    ("q_end",),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "K_p", 1e-3), Gradient("q_end", "tau_max", 1e-4)),
    servo,
    urdf="URDF has no control law",
)

BREAKAWAY = Case(
    "breakaway",
    "Friction at rest is above sliding friction",
    "A spring pulls a mass at 0.4 rad/s, held from tick to tick, 50 ticks a second. The mass sticks until the spring "
    "pulls with F + F_s, then slides under F, overshoots, and sticks again.",
    "driven joint",
    (
        RATE,
        "J v' = k (phi - q) - b v - F(v)",
        "F(v) = F sign(v); at v = 0 the joint is held while the other torques are within F + F_s",
    ),
    JOINT,
    joint_values(
        0.3,
        F_s=Quantity(0.21, "N m", "friction at rest, less F"),
        k=Quantity(2.0, "N m/rad", "stiffness of the spring"),
    ),
    joint_start(),
    Input("phi", "rad", "angle of the spring's far end", [(k * 1.0 / 50, round(0.4 * k / 50, 6)) for k in range(150)]),
    3.0,
    0.04,
    ("q_end", "v_end"),
    (Gradient("q_end", "F", 1e-4), Gradient("q_end", "k", 1e-4), Gradient("q_end", "J", 1e-5)),
    driven_joint,
    mjcf="frictionloss of MJCF is one level, at rest as in motion",
    urdf=f"{NO_SPRING}, and its friction is one level, at rest as in motion",
)


# ---- two masses ----


def sea(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    """J_m, J_l with the spring k and the damper d between them, friction on both."""
    between = [[1, -1], [-1, 1]]

    def scaled(name: str) -> list[list[str]]:
        return [[name if entry > 0 else f"-{name}" for entry in row] for row in between]

    return {
        "name": "series-elastic actuator",
        "coordinates": ["theta", "q"],
        "mass": [["J_m", "0"], ["0", "J_l"]],
        "stiffness": {"spring": scaled("k")},
        "damping": {"spring": scaled("d"), "motor": [["b_m", "0"], ["0", "0"]], "load": [["0", "0"], ["0", "b_l"]]},
        "input": ["1", "0"],
        "elements": [
            {"name": "theta", "direction": [1, 0], "friction": ["F_m", "F_m"]},
            {"name": "q", "direction": [0, 1], "friction": ["F_l", "F_l"]},
        ],
        "position": ["theta", "q"],
        "velocity": ["omega", "v"],
        "outputs": {"theta": {"q": [1, 0]}, "omega": {"v": [1, 0]}, "q": {"q": [0, 1]}, "v": {"v": [0, 1]}},
        **as_given(p, start, steps, horizon),
    }


SEA = Case(
    "sea",
    "A series-elastic actuator: two masses with friction and a spring between them",
    "A torque in steps on the motor turns the load through a spring. Motor and load stick and slip each by itself.",
    "sea",
    (
        "theta' = omega",
        "q' = v",
        "J_m omega' = tau - k (theta - q) - d (omega - v) - b_m omega - F_m(omega)",
        "J_l v' = k (theta - q) + d (omega - v) - b_l v - F_l(v)",
        "F_m(omega) = F_m sign(omega), F_l(v) = F_l sign(v); each is held at velocity 0 while the other torques on it "
        "are within its friction",
    ),
    {"theta": ("rad", "omega"), "q": ("rad", "v")},
    {
        "J_m": Quantity(0.075, "kg m^2", "inertia of the motor behind its gear"),
        "J_l": Quantity(0.1, "kg m^2", "inertia of the load"),
        "k": Quantity(150.0, "N m/rad", "stiffness of the spring"),
        "d": Quantity(0.05, "N m s/rad", "damping of the spring"),
        "b_m": Quantity(0.025, "N m s/rad", "viscous friction of the motor"),
        "b_l": Quantity(0.02, "N m s/rad", "viscous friction of the load"),
        "F_m": Quantity(0.5, "N m", "Coulomb friction of motor and gear"),
        "F_l": Quantity(0.3, "N m", "Coulomb friction of the load"),
    },
    {
        "theta": Quantity(0.0, "rad", "angle of the motor at t = 0"),
        "omega": Quantity(0.0, "rad/s", "its velocity"),
        "q": Quantity(0.0, "rad", "angle of the load at t = 0"),
        "v": Quantity(0.0, "rad/s", "its velocity"),
    },
    Input("tau", "N m", "torque of the motor behind its gear", [(0.0, 2.0), (0.2, -1.0), (0.6, 0.3)]),
    1.0,
    0.01,
    ("theta_end", "q_end"),
    (
        Gradient("q_end", "F_m", 1e-4),
        Gradient("q_end", "F_l", 1e-4),
        Gradient("q_end", "k", 1e-2),
        Gradient("theta_end", "F_l", 1e-4),
    ),
    sea,
    urdf=NO_SPRING,
)


# ---- a hopper ----

LEG = {
    "m_1": Quantity(25.0, "kg", "effective mass of the actuator, on which no weight acts"),
    "m_2": Quantity(3.0, "kg", "mass of the body"),
    "k": Quantity(1200.0, "N/m", "stiffness of the spring of the leg"),
    "L": Quantity(0.4, "m", "height of the body where the spring is slack and x1 = 0"),
    "b_1": Quantity(150.0, "N s/m", "viscous friction of the actuator"),
    "b_2": Quantity(5.0, "N s/m", "viscous friction of the body, in stance"),
    "F_1": Quantity(19.5, "N", "Coulomb friction of the actuator"),
    "F_2": Quantity(1.8, "N", "Coulomb friction of the body, in stance"),
    "g": Quantity(9.81, "m/s^2", "gravity, on the body"),
    "x1_min": Quantity(0.0, "m", "lower stop of the actuator"),
    "x1_max": Quantity(0.08, "m", "upper stop of the actuator"),
}
STANCE = (
    "x1' = v1",
    "x2' = v2",
    "m_1 v1' = u - N - b_1 v1 - F_1(v1)",
    "m_2 v2' = N - b_2 v2 - m_2 g - F_2(v2)",
    "N = k (x1 - x2 + L) >= 0; take-off is where it falls to 0",
    "F_i(v) = F_i sign(v); each mass is held at velocity 0 while the other forces on it are within F_i",
    "v1 = 0 after x1 has reached x1_min or x1_max",
)
BODY = {"x1": ("m", "v1"), "x2": ("m", "v2")}
NO_CONTACT = "URDF has no spring, and no leg without a mass"


def leg_start(x2: float, v2: float) -> dict[str, Quantity]:
    return {
        "x1": Quantity(0.0, "m", "displacement of the actuator at t = 0"),
        "v1": Quantity(0.0, "m/s", "its velocity"),
        "x2": Quantity(x2, "m", "height of the body at t = 0"),
        "v2": Quantity(v2, "m/s", "its velocity"),
    }


def stance(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    """Both masses on the ground; z = x2 - L, so that the compression is x1 - z. The contact ends the motion."""
    leg = [["k", "-k"], ["-k", "k"]]
    return {
        "name": "hopper in stance",
        "coordinates": ["x1", "z"],
        "mass": [["m_1", "0"], ["0", "m_2"]],
        "stiffness": {"leg": leg},
        "damping": {"actuator": [["b_1", "0"], ["0", "0"]], "body": [["0", "0"], ["0", "b_2"]]},
        "force": ["0", "-m_2*g"],
        "input": ["1", "0"],
        "elements": [
            {"name": "x1", "direction": [1, 0], "friction": ["F_1", "F_1"], "limits": ["x1_min", "x1_max"]},
            {"name": "x2", "direction": [0, 1], "friction": ["F_2", "F_2"]},
        ],
        "contact": {"force": {"q": ["k", "-k"]}, "compression": {"q": [1, -1]}},
        "position": ["x1", "x2 - L"],
        "velocity": ["v1", "v2"],
        "outputs": {
            "x1": {"q": [1, 0]},
            "v1": {"v": [1, 0]},
            "x2": {"q": [0, 1], "constant": "L"},
            "v2": {"v": [0, 1]},
        },
        **as_given(p, start, steps, horizon),
    }


def flight(p: Numbers, start: Numbers, steps: Steps, horizon: float) -> Text:
    """The spring carries nothing; a law returns the actuator; it ends where the foot, x2 - L - x1, meets the ground."""
    return {
        "name": "hopper in flight",
        "coordinates": ["x1", "x2"],
        "mass": [["m_1", "0"], ["0", "m_2"]],
        "damping": {"actuator": [["b_1", "0"], ["0", "0"]]},
        "force": ["0", "-m_2*g"],
        "input": ["1", "0"],
        "law": {"q": ["-K_p", "0"], "v": ["-K_d", "0"], "limit": "u_max"},
        "elements": [
            {"name": "x1", "direction": [1, 0], "friction": ["F_1", "F_1"], "limits": ["x1_min", "x1_max"]},
        ],
        "clearance": {"q": ["-1", "1"], "constant": "-L"},
        "position": ["x1", "x2"],
        "velocity": ["v1", "v2"],
        "outputs": {"x1": {"q": [1, 0]}, "v1": {"v": [1, 0]}, "x2": {"q": [0, 1]}, "v2": {"v": [0, 1]}},
        **as_given(p, start, steps, horizon),
    }


def force(steps: Steps) -> Input:
    return Input("u", "N", "force of the motor on the actuator, up", steps)


DROP = Case(
    "drop",
    "The stance of a hopper after a drop",
    "A hopper lands with 1.93 m/s and no current in its motor: its body sinks onto the spring, turns, and takes off. "
    "The leg has no mass, and may not pull.",
    "stance",
    STANCE,
    BODY,
    LEG,
    leg_start(0.4, -1.93),
    force(constant(0.0)),
    0.184,
    0.004,
    ("x2_end", "v2_end"),
    (
        Gradient("x2_end", "F_2", 1e-3),
        Gradient("x2_end", "k", 1e-1),
        Gradient("v2_end", "v2", 1e-4),
        Gradient("v2_end", "m_2", 1e-3),
    ),
    stance,
    urdf=NO_CONTACT,
)

TAKE_OFF = Case(
    "take-off",
    "Take-off of a hopper that pushes: its time and the apex that follows",
    "A hopper lands with 1.5 m/s, waits for 0.05 s, and pushes. Its actuator leaves its stop and extends; the leg takes "
    "off where its contact force falls to zero. apex is the height of the body over x2 = L in the flight that follows.",
    "stance",
    STANCE,
    BODY,
    LEG,
    leg_start(0.4, -1.5),
    force([(0.0, 0.0), (0.05, 260.0)]),
    0.208,
    0.004,
    ("takeoff", "apex"),
    (
        Gradient("takeoff", "F_1", 1e-2),
        Gradient("apex", "F_1", 1e-2),
        Gradient("apex", "F_2", 1e-3),
        Gradient("apex", "k", 1e-1),
        Gradient("apex", "v2", 1e-4),
    ),
    stance,
    urdf=NO_CONTACT,
)

HOP = Case(
    "hop",
    "A hop: flight, stance, flight",
    "A hopper falls from rest, foot 0.2 m over the ground, meets it, loses a share of its body's kinetic energy, pushes "
    "in stance, takes off, and flies to the next touchdown while its actuator returns under a law with a limit.",
    "hop",
    (
        *STANCE,
        "in flight: N = 0, b_2 = 0, F_2 = 0, and u = -K_p x1 - K_d v1, between -u_max and u_max",
        "touchdown is where x2 - L - x1 falls to 0; v2 becomes sqrt(1 - loss) v2 there",
    ),
    BODY,
    {
        **LEG,
        "K_p": Quantity(2000.0, "N/m", "force of the return in flight per displacement, against it"),
        "K_d": Quantity(300.0, "N s/m", "force of the return in flight per velocity, against it"),
        "u_max": Quantity(650.0, "N", "limit of the return's force"),
        "loss": Quantity(0.05, "1", "share of the body's kinetic energy that a touchdown takes"),
    },
    leg_start(0.6, 0.0),
    Input("u", "N", "force of the motor in stance, up", constant(195.0)),
    0.78,
    0.01,
    ("takeoff", "apex", "touchdown"),
    (
        Gradient("takeoff", "k", 1e-1),
        Gradient("apex", "F_1", 1e-2),
        Gradient("apex", "u", 1e-1),
        Gradient("touchdown", "x2", 1e-4),
    ),
    stance,
    mjcf="MJCF has no friction that acts in stance alone, and no loss at a touchdown of a leg without a mass",
    urdf=NO_CONTACT,
)

CASES = (SPIN_DOWN, HOLD, SINE, STAIRS, STOPS, SERVO, BREAKAWAY, SEA, DROP, TAKE_OFF, HOP)
