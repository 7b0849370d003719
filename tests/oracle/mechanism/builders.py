"""Problems of known mechanisms, their physics written out by hand; numbers go in as decimals or exact floats.

(1), (2) are (3), (4) without dry friction:

    m_eff x1'' = k (x2 - x1 - L0) - b1 x1' - gamma2 u - m_eff f1 sign(x1')             (1), (3)
    m_s x2'' = k (x1 - x2 + L0 + c) - b2 x2' - m_s g - m_s f2 sign(x2')                (2), (4)

With z = x2 - L0 - c the spring's compression is y = x1 - z, and k (x2 - x1 - L0) = -k y + k c.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .numbers import Number, Real, exact, mp, ulp

Text = dict[str, Any]

HOPPER_C: dict[str, Number] = {
    "m_eff": "25",
    "m_s": "3",
    "k": "1200",
    "L0": "0.40",
    "c": "0",
    "b1": "150",
    "b2": "5",
    "f1": "0.78",
    "f2": "0.60",
    "gamma2": "-65",
    "g": "9.81",
    "x1_min": "0",
    "x1_max": "0.08",
}
LEG = [["1", "-1"], ["-1", "1"]]  # of a force between the masses along y = x1 - z
HEIGHTS = {
    "x1": {"q": [1, 0]},
    "v1": {"v": [1, 0]},
    "x2": {"q": [0, 1], "constant": "L0 + c"},
    "v2": {"v": [0, 1]},
    "y": {"q": [1, -1]},
}
TOLERANCE = "4*ulp(max(abs(x1), abs(x1 - y + L0 + c), abs(L0), abs(c)))"
STROKE = [["x1", "x1_min", "x1_max"]]  # equal ones are moved together
UNITS = {
    "time": "sqrt(m_s/k)",
    "x1": "0.1",
    "x2": "0.1",
    "y": "0.1",
    "v1": "1",
    "v2": "1",
    "body": "m_s*max(abs(v2), 1)**2/2",
}


def scaled(matrix: list[list[str]], name: str) -> list[list[str]]:
    """A matrix of 1, -1 and 0 times a named coefficient."""
    return [[name if entry == "1" else f"-{name}" if entry == "-1" else "0" for entry in row] for row in matrix]


def given(parameters: Mapping[str, Number], start: Mapping[str, Number], u: Any, horizon: Number, most: int) -> Text:
    return {"parameters": dict(parameters), "start": dict(start), "u": u, "horizon": horizon, "max_phases": most}


def stance(
    robot: Mapping[str, Number],
    *,
    v2: Number,
    x1: Number = "0",
    v1: Number = "0",
    y: Number = "0",
    u: Any = "0",
    horizon: Number = "2",
    max_phases: int = 4096,
) -> Text:
    """The hopper on the ground, (3), (4); y is the compression at the start. N = k y.

    >>> from tests.oracle.mechanism import solve
    >>> [event.kind for event in solve(stance(HOPPER_C, v2="-1.930829")).events]
    ['x2_reverses']
    """
    body = {
        "mass": [["0", "0"], ["0", "m_s"]],
        "stiffness": [["0", "0"], ["0", "k"]],
        "force": ["0", "-m_s*g"],
    }  # m_s v2^2/2 + m_s g x2 + k (x2 - L0 - c)^2/2, less a constant
    return {
        "name": "hopper in stance",
        "coordinates": ["x1", "z"],
        "mass": [["m_eff", "0"], ["0", "m_s"]],
        "stiffness": {"leg": scaled(LEG, "k")},
        "damping": {"viscous_1": [["b1", "0"], ["0", "0"]], "viscous_2": [["0", "0"], ["0", "b2"]]},
        "force": {"offset": ["k*c", "0"], "weight": ["0", "-m_s*g"]},
        "input": ["-gamma2", "0"],
        "elements": [
            {
                "name": "x1",
                "direction": [1, 0],
                "friction": ["m_eff*f1", "m_eff*f1"],
                "limits": ["x1_min", "x1_max"],
            },
            {"name": "x2", "direction": [0, 1], "friction": ["m_s*f2", "m_s*f2"]},
        ],
        "contact": {"force": {"q": ["k", "-k"]}, "compression": {"q": [1, -1]}, "tolerance": TOLERANCE},
        "position": ["x1", "x1 - y"],
        "velocity": ["v1", "v2"],
        "outputs": HEIGHTS,
        "energies": {"body": body},
        "units": UNITS,
        "tied": STROKE,
        **given(robot, {"x1": x1, "v1": v1, "v2": v2, "y": y}, u, horizon, max_phases),
    }


def compression(robot: Mapping[str, Number], x1: Number, x2: Number) -> Real:
    """y = x1 - x2 + L0 + c, taken as 0 within 4 ulp (float64) of the largest of its terms."""
    terms = [exact(x1), -exact(x2), exact(robot["L0"]), exact(robot["c"])]
    y = mp.fsum(terms)
    return mp.zero if abs(y) <= 4 * ulp(max(abs(q) for q in terms), 53) else y


def damped_leg(robot: Mapping[str, Number], b12: Number, **start: Any) -> Text:
    """(3), (4) and a damper in the leg: m_eff x1'' = ... - b12 (v1 - v2), N = k y + b12 (v1 - v2)."""
    text = stance({**robot, "b12": b12}, **start)
    damping = {**text["damping"], "viscous_12": scaled(LEG, "b12")}
    force = {"q": ["k", "-k"], "v": ["b12", "-b12"]}
    return {
        **text,
        "name": "hopper with a damper in the leg",
        "damping": damping,
        "contact": {**text["contact"], "force": force},
    }


def second_spring(robot: Mapping[str, Number], k_2: Number, L_2: Number, **start: Any) -> Text:
    """(3), (4) and a spring k_2 (x1 - x2 + L_2) beside the leg's: N = k (x1 - z) + k_2 (x1 - z + L_2 - L0 - c).

    It vanishes where the one pulls as the other pushes, at x1 - z = k_2 (L0 + c - L_2)/(k + k_2); y counts from there.
    """
    text = stance({**robot, "k_2": k_2, "L_2": L_2}, **start)
    slack, rest = "k_2*(L_2 - L0 - c)", "k_2*(L0 + c - L_2)/(k + k_2)"
    y = {"q": [1, -1], "constant": f"-{rest}"}
    force = {"q": ["k + k_2", "-(k + k_2)"], "constant": slack}
    tolerance = f"4*ulp(max(abs(x1), abs(x1 - y - {rest} + L0 + c), abs(L0), abs(c)))"
    return {
        **text,
        "name": "hopper with a second spring in the leg",
        "stiffness": {**text["stiffness"], "second": scaled(LEG, "k_2")},
        "force": {**text["force"], "second": [f"-{slack}", slack]},
        "contact": {"force": force, "compression": y, "tolerance": tolerance},
        "position": ["x1", f"x1 - y - {rest}"],
        "outputs": {**text["outputs"], "y": y},
    }


def body_spring(robot: Mapping[str, Number], k_b: Number, h_b: Number, **start: Any) -> Text:
    """(3), (4) and a spring from the body to the world, -k_b (x2 - h_b): a linear force on the body. N = k y."""
    text = stance({**robot, "k_b": k_b, "h_b": h_b}, **start)
    return {
        **text,
        "name": "hopper with a spring from the body to the world",
        "stiffness": {**text["stiffness"], "world": [["0", "0"], ["0", "k_b"]]},
        "force": {**text["force"], "world": ["0", "k_b*(h_b - L0 - c)"]},
    }


def pushed_body(robot: Mapping[str, Number], push: Number, **start: Any) -> Text:
    """(3), (4) and a constant force on the body, upwards: m_s x2'' = ... + push."""
    text = stance({**robot, "push": push}, **start)
    return {
        **text,
        "name": "hopper with a constant force on the body",
        "force": {**text["force"], "push": ["0", "push"]},
    }


def flight(
    robot: Mapping[str, Number],
    *,
    Kp: Number,
    Kd: Number,
    u_max: Number,
    x1: Number,
    v1: Number,
    x2: Number,
    v2: Number,
    ground: Number = "0",
    horizon: Number = "2",
    max_phases: int = 4096,
) -> Text:
    """The hopper in the air: the spring carries nothing, F = 0, so the foot moves with the actuator.

    m_eff x1'' = k c - b1 x1' - gamma2 u - m_eff f1 sign(x1')     u = sat((Kp x1 + Kd v1)/gamma2)     x2'' = -g
    foot over the ground = x2 - (L0 + c) - x1 - ground
    """
    parameters = {**robot, "Kp": Kp, "Kd": Kd, "u_max": u_max, "ground": ground}
    actuator = {
        "name": "x1",
        "direction": [1, 0],
        "friction": ["m_eff*f1", "m_eff*f1"],
        "limits": ["x1_min", "x1_max"],
    }
    return {
        "name": "hopper in flight",
        "coordinates": ["x1", "x2"],
        "mass": [["m_eff", "0"], ["0", "m_s"]],
        "damping": {"viscous_1": [["b1", "0"], ["0", "0"]]},
        "force": {"offset": ["k*c", "0"], "weight": ["0", "-m_s*g"]},
        "input": ["-gamma2", "0"],
        "law": {"q": ["Kp/gamma2", "0"], "v": ["Kd/gamma2", "0"], "limit": "u_max"},
        "elements": [actuator],
        "clearance": {"q": ["-1", "1"], "constant": "-(L0 + c) - ground"},
        "position": ["x1", "x2"],
        "velocity": ["v1", "v2"],
        "outputs": {"x1": {"q": [1, 0]}, "v1": {"v": [1, 0]}, "x2": {"q": [0, 1]}, "v2": {"v": [0, 1]}},
        "units": {name: UNITS[name] for name in ("time", "x1", "x2", "v1", "v2")},
        "tied": STROKE,
        **given(parameters, {"x1": x1, "v1": v1, "x2": x2, "v2": v2}, "0", horizon, max_phases),
    }


def damped_flight(robot: Mapping[str, Number], b12: Number, *, y: Number, push: Number = "0", **given: Any) -> Text:
    """The hopper in the air with a damper in the leg and a constant force on the body, m_s x2'' = -m_s g + push.

    The foot has no mass, so k y + b12 y' = 0: y'' = -(k/b12) y' from y' = -(k/b12) y, a coordinate of its own.
    foot over the ground = x2 - (L0 + c) - x1 + y - ground
    """
    text = flight({**robot, "b12": b12, "push": push}, **given)
    none = ["0", "0", "0"]
    return {
        **text,
        "name": "hopper in flight with a damper in the leg",
        "coordinates": ["x1", "x2", "y"],
        "mass": [["m_eff", "0", "0"], ["0", "m_s", "0"], ["0", "0", "b12/k"]],
        "damping": {"viscous_1": [["b1", "0", "0"], none, none], "leg": [none, none, ["0", "0", "1"]]},
        "force": {"offset": ["k*c", "0", "0"], "weight": ["0", "-m_s*g", "0"], "push": ["0", "push", "0"]},
        "input": ["-gamma2", "0", "0"],
        "law": {"q": ["Kp/gamma2", "0", "0"], "v": ["Kd/gamma2", "0", "0"], "limit": "u_max"},
        "elements": [{**element, "direction": [1, 0, 0]} for element in text["elements"]],
        "clearance": {"q": ["-1", "1", "1"], "constant": "-(L0 + c) - ground"},
        "start": {**text["start"], "y": y},
        "position": ["x1", "x2", "y"],
        "velocity": ["v1", "v2", "-k/b12*y"],
        "outputs": {
            "x1": {"q": [1, 0, 0]},
            "v1": {"v": [1, 0, 0]},
            "x2": {"q": [0, 1, 0]},
            "v2": {"v": [0, 1, 0]},
            "y": {"q": [0, 0, 1]},
        },
        "units": {name: UNITS[name] for name in ("time", "x1", "x2", "y", "v1", "v2")},
    }


def footed(robot: Mapping[str, Number], m_f: Number, b12: Number, *, height: Number, u: Any, horizon: Number) -> Text:
    """A hopper whose foot has a mass: ground is a limit of the foot, and flight is one more held set.

    y = x_f + x1 - z and N = k y + b12 y': -N on foot and actuator, +N on the body.
    Dropped from rest with the foot `height` over the ground.
    """
    legs = [["1", "1", "-1"], ["1", "1", "-1"], ["-1", "-1", "1"]]
    unit = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    start = {"x_f": height, "x1": "0", "z": height, "v_f": "0", "v1": "0", "v2": "0"}
    body = {"name": "x2", "direction": [0, 0, 1], "friction": ["m_s*f2", "m_s*f2"]}
    return {
        "name": "hopper with a foot mass",
        "coordinates": ["x_f", "x1", "z"],
        "mass": [["m_f", "0", "0"], ["0", "m_eff", "0"], ["0", "0", "m_s"]],
        "stiffness": {"leg": scaled(legs, "k")},
        "damping": {
            "viscous_12": scaled(legs, "b12"),
            "viscous_1": scaled([["0", "0", "0"], ["0", "1", "0"], ["0", "0", "0"]], "b1"),
            "viscous_2": scaled([["0", "0", "0"], ["0", "0", "0"], ["0", "0", "1"]], "b2"),
        },
        "force": {"offset": ["0", "k*c", "0"], "weight": ["-m_f*g", "0", "-m_s*g"]},
        "input": ["0", "-gamma2", "0"],
        "elements": [
            {"name": "foot", "direction": [1, 0, 0], "friction": ["0", "0"], "limits": ["0", "inf"]},
            {"name": "x1", "direction": [0, 1, 0], "friction": ["m_eff*f1"] * 2, "limits": ["x1_min", "x1_max"]},
            body,
        ],
        "position": ["x_f", "x1", "z"],
        "velocity": ["v_f", "v1", "v2"],
        "outputs": {name: {"q": row} for name, row in zip(("x_f", "x1", "z"), unit, strict=True)}
        | {name: {"v": row} for name, row in zip(("v_f", "v1", "v2"), unit, strict=True)},
        "units": {"time": "sqrt(m_s/k)", "x_f": "0.1", "x1": "0.1", "z": "0.1", "v_f": "1", "v1": "1", "v2": "1"},
        **given({**robot, "m_f": m_f, "b12": b12}, start, u, horizon, 4096),
    }


def joint(
    *,
    m: Number,
    k: Number = "0",
    q_0: Number = "0",
    b: Number = "0",
    gamma: Number = "1",
    load: Number = "0",
    F_plus: Number = "0",
    F_minus: Number = "0",
    q_min: Number = "-inf",
    q_max: Number = "inf",
    q: Number = "0",
    v: Number = "0",
    u: Any = "0",
    horizon: Number = "2",
    max_phases: int = 4096,
) -> Text:
    """One mass on a spring to ground: m q'' = -k (q - q_0) - b q' + gamma u + load - F_plus or + F_minus, by sign(q').

    Lengths, or angles with m an inertia: kg or kg m^2, N/m or N m/rad, m or rad; k = 0 is allowed.
    """
    parameters = {"m": m, "k": k, "q_0": q_0, "b": b, "gamma": gamma, "load": load}
    friction = {"F_plus": F_plus, "F_minus": F_minus, "q_min": q_min, "q_max": q_max}
    return {
        "name": "joint",
        "coordinates": ["q"],
        "mass": [["m"]],
        "stiffness": {"spring": [["k"]]},
        "damping": {"viscous": [["b"]]},
        "force": {"rest": ["k*q_0"], "load": ["load"]},
        "input": ["gamma"],
        "elements": [{"name": "q", "direction": [1], "friction": ["F_plus", "F_minus"], "limits": ["q_min", "q_max"]}],
        "position": ["q"],
        "velocity": ["v"],
        "outputs": {"q": {"q": [1]}, "v": {"v": [1]}},
        "units": {"time": "sqrt(m/max(k, m))", "q": "0.1", "v": "1"},
        "tied": [["q", "q_min", "q_max"]],
        **given({**parameters, **friction}, {"q": q, "v": v}, u, horizon, max_phases),
    }
