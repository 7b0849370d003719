"""A case in MJCF and in URDF, of its family and its numbers.

Each input is an actuator of its name; the start is the keyframe. Coordinates are joints of their names.
"""

from collections.abc import Mapping
from math import inf

Numbers = Mapping[str, float]
TIMESTEP = 0.002
"""[s] of the file; a user chooses another, and an integrator."""
LICENCE = "CC0-1.0"


def mjcf(name: str, family: str, p: Numbers, start: Numbers) -> str:
    """A model of MuJoCo; without a contact: a leg without a mass is a tendon that pushes."""
    body, drive = {"sea": _sea, "stance": _stance}.get(family, _joint)(family, p)
    places, rates = list(start.values())[::2], list(start.values())[1::2]
    g = p.get("g", 0.0)
    return f"""<mujoco model="{name}">
  <!-- {name} of the reference set of hopform, {LICENCE}. -->
  <compiler angle="radian"/>
  <option timestep="{TIMESTEP!r}" gravity="0 0 {-g!r}"/>
  <worldbody>
{body}  </worldbody>
{drive}  <keyframe>
    <key name="start" qpos="{_row(places)}" qvel="{_row(rates)}"/>
  </keyframe>
</mujoco>
"""


def _row(numbers: list[float]) -> str:
    return " ".join(map(repr, numbers))


def _hinge(name: str, inertia: float, damping: float, friction: float, more: str = "") -> str:
    return f"""    <body name="{name}">
      <inertial pos="0 0 0" mass="1" diaginertia="{_row([inertia] * 3)}"/>
      <joint name="{name}" type="hinge" axis="0 0 1" damping="{damping!r}" frictionloss="{friction!r}"{more}/>
    </body>
"""


def _slide(name: str, mass: float, damping: float, friction: float, more: str = "", weight: str = "") -> str:
    return f"""    <body name="{name}"{weight}>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
      <joint name="{name}" type="slide" axis="0 0 1" damping="{damping!r}" frictionloss="{friction!r}"{more}/>
    </body>
"""


def _range(low: float, high: float) -> str:
    return f' limited="true" range="{low!r} {high!r}"'


def _actuator(line: str) -> str:
    return f"  <actuator>\n    {line}\n  </actuator>\n"


def _joint(family: str, p: Numbers) -> tuple[str, str]:
    """One joint under a torque, behind a spring or under a law."""
    more = _range(p["q_min"], p["q_max"]) if "q_min" in p else ""
    drive = '<motor name="tau" joint="q"/>'
    if family == "driven joint":
        drive = f'<position name="phi" joint="q" kp="{p["k"]!r}"/>'
    elif family == "servo":
        limit = f'forcelimited="true" forcerange="{-p["tau_max"]!r} {p["tau_max"]!r}"'
        drive = f'<position name="target" joint="q" kp="{p["K_p"]!r}" kv="{p["K_d"]!r}" {limit}/>'
    elif "k" in p:
        more += f' stiffness="{p["k"]!r}"'
    return _hinge("q", p["J"], p["b"], p["F"], more), _actuator(drive)


def _sea(_: str, p: Numbers) -> tuple[str, str]:
    """Motor and load, the spring between them as a tendon."""
    bodies = _hinge("theta", p["J_m"], p["b_m"], p["F_m"]) + _hinge("q", p["J_l"], p["b_l"], p["F_l"])
    spring = f'stiffness="{p["k"]!r}" damping="{p["d"]!r}" springlength="0"'
    return bodies, _tendon(spring, ("theta", 1), ("q", -1)) + _actuator('<motor name="tau" joint="theta"/>')


def _stance(_: str, p: Numbers) -> tuple[str, str]:
    """Actuator and body, the leg as a tendon of length x2 - x1 that is slack from L on."""
    actuator = _slide("x1", p["m_1"], p["b_1"], p["F_1"], _range(p["x1_min"], p["x1_max"]), ' gravcomp="1"')
    body = _slide("x2", p["m_2"], p["b_2"], p["F_2"])
    leg = f'stiffness="{p["k"]!r}" springlength="{p["L"]!r} 1000"'
    return actuator + body, _tendon(leg, ("x2", 1), ("x1", -1)) + _actuator('<motor name="u" joint="x1"/>')


def _tendon(spring: str, *joints: tuple[str, int]) -> str:
    lines = "\n".join(f'      <joint joint="{joint}" coef="{factor}"/>' for joint, factor in joints)
    return f'  <tendon>\n    <fixed name="spring" {spring}>\n{lines}\n    </fixed>\n  </tendon>\n'


def urdf(name: str, family: str, p: Numbers, start: Numbers) -> str:
    """A robot of one joint, without its start and its torque, which URDF does not have."""
    low, high = p.get("q_min", -inf), p.get("q_max", inf)
    limits, kind = ("", "continuous") if low == -inf else (f' lower="{low!r}" upper="{high!r}"', "revolute")
    inertia = " ".join(
        f'{axis}="{p["J"] if axis[1] == axis[2] else 0.0!r}"' for axis in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    return f"""<?xml version="1.0"?>
<!-- {name} of the reference set of hopform, {LICENCE}. Start: {", ".join(f"{key} = {value!r}" for key, value in start.items())}. -->
<robot name="{name}">
  <link name="world"/>
  <link name="q">
    <inertial>
      <origin xyz="0 0 0" rpy="0 0 0"/>
      <mass value="1"/>
      <inertia {inertia}/>
    </inertial>
  </link>
  <joint name="q" type="{kind}">
    <parent link="world"/>
    <child link="q"/>
    <axis xyz="0 0 1"/>
    <limit{limits} effort="1000" velocity="1000"/>
    <dynamics damping="{p["b"]!r}" friction="{p["F"]!r}"/>
  </joint>
</robot>
"""
