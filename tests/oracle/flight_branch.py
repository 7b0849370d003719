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
STEP = mp.mpf("1e-18")
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
    if abs(q) * t * t > mp.mpf("1e-12"):
        return Rd, R, (1 - Rd - p * R) / q
    total, high, low = mp.zero, t * t / 2, mp.zero  # by its Taylor series: v'' = -p v' - q v
    for n in range(2, 400):
        total += high
        low, high = high, (-p * high * t / (n + 1)) - q * low * t * t / ((n + 1) * n)
        if abs(high) + abs(low) < mp.mpf(10) ** -(mp.dps + 5) * abs(total):
            break
    return Rd, R, total


def solve(robot: Mapping[str, Any], start: Mapping[str, Any], phases: Sequence[Phase], status: str) -> list[Any]:
    """ROWS, from x1, v1, x2, v2, Kp, Kd of a start; x2 over the ground ahead. Gains None: those of `designed`."""
    r = {name: mp.mpf(value) for name, value in robot.items()}
    s = {name: mp.mpf(value) for name, value in start.items() if value is not None}
    x0, v0, x2, v2, g = s["x1"], s["v1"], s["x2"], s["v2"], r["g"]
    largest = abs(r["gamma2"]) * r["u_max"] if r["gamma2"] else mp.zero
    Kp, Kd = (s["Kp"], s["Kd"]) if largest else (mp.zero, mp.zero)
    above = x2 - r["L0"] - r["c"]
    x, v, t, acc = x0, v0, mp.zero, mp.zero

    for n, phase in enumerate(phases):
        law = not phase.limit
        p = (r["b1"] + Kd) / r["m_eff"] if law else r["b1"] / r["m_eff"]
        q = Kp / r["m_eff"] if law else mp.zero
        a = r["k"] * r["c"] / r["m_eff"] - r["f1"] * phase.side
        if not law:
            a -= phase.limit * largest / r["m_eff"]
        if phase.held:
            p, q, a = mp.zero, mp.zero, mp.zero
        if phase.held or phase.lost:
            v = mp.zero
        begin = x, v

        def at(h: Any, begin: Any = begin, p: Any = p, q: Any = q, a: Any = a) -> tuple[Any, Any, Any]:
            Rd, R, R1 = response(p, q, h)
            draw = a - q * begin[0]
            x, v = begin[0] + R * begin[1] + R1 * draw, Rd * begin[1] + R * draw
            return x, v, a - p * v - q * x

        def residual(
            h: Any, event: str = phase.event, t: Any = t, at: Any = at, phase: Phase = phase
        ) -> tuple[Any, Any]:
            """What vanishes at the end, and its rate."""
            x, v, acc = at(h)
            fallen, speed = v2 * (t + h) - g * (t + h) ** 2 / 2, v2 - g * (t + h)
            if event == "rest":
                return v, acc
            if event == "stop":
                return x - (r["x1_max"] if phase.side > 0 else r["x1_min"]), v
            if event == "pull":
                pull = Kp * x + Kd * v
                return abs(pull) - largest, mp.sign(pull) * (Kp * v + Kd * acc)
            if event == "ground":
                return above + fallen - x, speed - v
            return speed - v, -g - acc

        h = mp.mpf(phase.end) - t
        if phase.event != "fixed":
            for _ in range(60):
                value, rate = residual(h)
                step = value / rate
                h -= step
                if abs(step) <= mp.mpf(10) ** -45 * abs(h):
                    break
            else:
                raise ArithmeticError(f"Newton's steps do not end: {phase}")
        x, v, acc = at(h)
        t += h
        if phase.event == "stop" and n < len(phases) - 1:
            x, v = r["x1_max"] if phase.side > 0 else r["x1_min"], mp.zero
        if phase.event == "rest":
            v = mp.zero
    T, end_v2 = t, v2 - g * t
    height = x + r["L0"] + r["c"] if status == "touchdown" else x2 + v2 * T - g * T * T / 2
    after = end_v2 * mp.sqrt(1 - r["impact_loss"]) if status == "touchdown" else end_v2
    top = min(max(v2, mp.zero) / g, T)
    return [T, x, v, height, end_v2, after, above + v2 * top - g * top * top / 2]


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
        if design and name not in ("Kp", "Kd"):
            s["Kp"], s["Kd"] = designed(r, s["x1"], s["v2"])
        elif name in ("Kp", "Kd"):
            s[name] += by
        return solve(r, s, phases, status)

    columns = []
    for name, size in sizes.items():
        h = STEP * mp.mpf(size)
        columns.append([(b - a) / (2 * h) for a, b in zip(moved(name, -h), moved(name, h), strict=True)])
    return columns
