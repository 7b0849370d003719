"""A flight that goes through the phases of another one, to as many digits as asked for, and its derivatives.

    x'' = a - p x' - q x,    p = (b1 + Kd)/m_eff, q = Kp/m_eff, a = k c/m_eff - f1 side      under the law
                             p = b1/m_eff, q = 0, a = (k c - limit |gamma2| u_max)/m_eff - f1 side   at its limit
    foot = x2 - L0 - c - x1,  x2'' = -g

Which phases there are is given; when each ends is found by Newton's steps: where the velocity vanishes, the actuator
meets a stop, the pull |Kp x + Kd v| is the limit's, the foot meets the ground or is highest. So a small change of an
input leaves the phases alone, and differences of it are derivatives, also where an event is about to appear.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mpmath.ctx_mp import MPContext

mp = MPContext()
mp.dps = 80
STEP = mp.mpf("1e-24")
"""Of a difference to one side: good to 20 digits."""
ROWS = ("T", "x1", "v1", "x2", "v2", "v2_after", "apex")


class Phase(NamedTuple):
    """Side and limit, where about it ends, and the event there: "rest", "stop", "pull", "ground", "top", or "fixed" at a
    time that stays. held: it stays where it is. lost: a stop has taken the velocity as it began.
    """

    side: int
    limit: int
    end: float
    event: str
    held: bool = False
    lost: bool = False


def response(p: Any, q: Any, t: Any) -> tuple[Any, Any, Any]:
    """R', R and the integral R1 of R'' + p R' + q R = 0, R(0) = 0, R'(0) = 1."""
    mean, square = p / 2, p * p / 4 - q
    z = square * t * t
    if abs(z) < mp.mpf("1e-6"):
        even, odd, term = mp.one, mp.one, mp.one
        for n in range(1, 16):
            term *= z / ((2 * n - 1) * (2 * n))
            even, odd = even + term, odd + term / (2 * n + 1)
        sine, cosine = t * odd, even
    else:
        root = mp.sqrt(abs(square))
        sine = (mp.sinh(root * t) if square > 0 else mp.sin(root * t)) / root
        cosine = mp.cosh(root * t) if square > 0 else mp.cos(root * t)
    fade = mp.exp(-mean * t)
    R, Rd = fade * sine, fade * (cosine - mean * sine)
    if abs(q) * t * t > mp.mpf("1e-33"):
        return Rd, R, (1 - Rd - p * R) / q
    if not q and abs(p * t) > 1:
        return Rd, R, (t - R) / p
    total, high, low = mp.zero, t * t / 2, mp.zero  # by its Taylor series: v'' = -p v' - q v
    for n in range(2, 400):
        total += high
        low, high = high, (-p * high * t / (n + 1)) - q * low * t * t / ((n + 1) * n)
        if abs(high) + abs(low) < mp.mpf(10) ** -(mp.dps + 5) * abs(total):
            break
    return Rd, R, total


class Motion(NamedTuple):
    """The actuator in a phase, which starts at time t at x, v: x'' = a - p x' - q x."""

    t: Any
    x: Any
    v: Any
    p: Any
    q: Any
    a: Any

    def at(self, h: Any) -> tuple[Any, Any, Any]:
        """Place, velocity and acceleration after a time."""
        Rd, R, R1 = response(self.p, self.q, h)
        draw = self.a - self.q * self.x
        x, v = self.x + R * self.v + R1 * draw, Rd * self.v + R * draw
        return x, v, self.a - self.p * v - self.q * x


class _Flight:
    """A robot, its start and its law."""

    def __init__(self, robot: Mapping[str, Any], start: Mapping[str, Any]) -> None:
        self.r = r = {name: mp.mpf(value) for name, value in robot.items()}
        self.s = s = {name: mp.mpf(value) for name, value in start.items()}
        self.largest = abs(r["gamma2"]) * r["u_max"] if r["gamma2"] else mp.zero
        self.Kp, self.Kd = (s["Kp"], s["Kd"]) if self.largest else (mp.zero, mp.zero)
        self.above = s["x2"] - r["L0"] - r["c"]

    def begun(self, phase: Phase, t: Any, x: Any, v: Any) -> Motion:
        r = self.r
        if phase.held:
            return Motion(t, x, *[mp.zero] * 4)
        v = mp.zero if phase.lost else v
        a = r["k"] * r["c"] / r["m_eff"] - r["f1"] * phase.side
        if phase.limit:
            return Motion(t, x, v, r["b1"] / r["m_eff"], mp.zero, a - phase.limit * self.largest / r["m_eff"])
        return Motion(t, x, v, (r["b1"] + self.Kd) / r["m_eff"], self.Kp / r["m_eff"], a)

    def stop(self, phase: Phase) -> Any:
        return self.r["x1_max"] if phase.side > 0 else self.r["x1_min"]

    def residual(self, phase: Phase, motion: Motion, h: Any) -> tuple[Any, Any]:
        """What vanishes where the phase ends, and its rate."""
        x, v, acc = motion.at(h)
        t, g, v2 = motion.t + h, self.r["g"], self.s["v2"]
        if phase.event == "rest":
            return v, acc
        if phase.event == "stop":
            return x - self.stop(phase), v
        if phase.event == "pull":
            pull = self.Kp * x + self.Kd * v
            return abs(pull) - self.largest, mp.sign(pull) * (self.Kp * v + self.Kd * acc)
        if phase.event == "ground":
            return self.above + (v2 - g * t / 2) * t - x, v2 - g * t - v
        return v2 - g * t - v, -g - acc

    def length(self, phase: Phase, motion: Motion) -> Any:
        """How long the phase lasts: from what is given, by Newton's steps."""
        h = mp.mpf(phase.end) - motion.t
        for _ in range(60 if phase.event != "fixed" else 0):
            value, rate = self.residual(phase, motion, h)
            step = value / rate if rate else h
            if abs(step) > abs(h) / 2 + mp.mpf("1e-6") * motion.t:  # a graze: there is no root near
                break
            h -= step
            if abs(step) <= mp.mpf(10) ** -40 * abs(h):
                return h
        if phase.event == "fixed":
            return h
        raise ArithmeticError(f"Newton's steps do not end: {phase}")


def solve(robot: Mapping[str, Any], start: Mapping[str, Any], phases: Sequence[Phase], status: str) -> list[Any]:
    """ROWS, from x1, v1, x2, v2, Kp, Kd of a start; x2 over the ground ahead."""
    flight = _Flight(robot, start)
    r, v2, g = flight.r, flight.s["v2"], flight.r["g"]
    t, x, v = mp.zero, flight.s["x1"], flight.s["v1"]
    for n, phase in enumerate(phases):
        motion = flight.begun(phase, t, x, v)
        h = flight.length(phase, motion)
        t, (x, v, _) = t + h, motion.at(h)
        if phase.event == "stop" and n < len(phases) - 1:
            x, v = flight.stop(phase), mp.zero
        v = mp.zero if phase.event == "rest" else v
    lands, end_v2 = status == "touchdown", v2 - g * t
    height = x + r["L0"] + r["c"] if lands else flight.s["x2"] + (v2 - g * t / 2) * t
    after = end_v2 * mp.sqrt(1 - r["impact_loss"]) if lands else end_v2
    top = min(max(v2, mp.zero) / g, t)
    return [t, x, v, height, end_v2, after, flight.above + (v2 - g * top / 2) * top]


def designed(robot: Mapping[str, Any], x1: Any, v2: Any) -> tuple[Any, Any]:
    """Gains of a critically damped return, settled 50 ms before the body is down again at x1 = 0, in 20 ms at least."""
    r = {name: mp.mpf(value) for name, value in robot.items()}
    square = mp.mpf(v2) ** 2 + 2 * r["g"] * mp.mpf(x1)
    time = (mp.mpf(v2) + mp.sqrt(square)) / r["g"] - mp.mpf(0.05) if square >= 0 else mp.zero
    rate = mp.mpf(20) / 3 / max(time, mp.mpf(0.02))
    Kd = max(2 * r["m_eff"] * rate - r["b1"], mp.zero)
    return rate * (r["b1"] + Kd - r["m_eff"] * rate), Kd


def derivatives(
    robot: Mapping[str, Any], start: Mapping[str, Any], phases: Sequence[Phase], status: str,
    sizes: Mapping[str, float], *, design: bool,
) -> list[list[Any]]:  # fmt: skip
    """By each input of `sizes`, which has the change of it that matters: a column of ROWS. With `design` the gains follow."""

    def moved(name: str, by: Any) -> list[Any]:
        r, s = dict(robot), {key: mp.mpf(value) for key, value in start.items()}
        if name in r:
            r[name] = mp.mpf(r[name]) + by
        elif name == "ground":
            s["x2"] -= by
        elif name not in ("Kp", "Kd"):
            s[name] += by
        if design:
            s["Kp"], s["Kd"] = designed(r, s["x1"], s["v2"])
        if name in ("Kp", "Kd"):
            s[name] += by
        return solve(r, s, phases, status)

    here, columns = moved("x1", mp.zero), list[list[Any]]()
    for name, size in sizes.items():
        h = STEP * mp.mpf(size)
        columns.append([(b - a) / h for a, b in zip(here, moved(name, h), strict=True)])
    return columns
