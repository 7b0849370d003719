"""The mode logic of a stance: equations (3), (4) in one mode, what ends it, and what follows.

The integrator and the peers of the benchmarks know nothing of hoppers: between two events they integrate y' = A y + b,
and find the first zero of six event functions that are positive within a mode. Plain Python on floats and tuples of
floats, so that numba compiles the very same lines. tests/bench/peers/rules.h is the same in C, for compiled peers.
"""

from typing import NamedTuple

TAKEOFF, REST, HORIZON, TOO_MANY_PHASES = 1.0, 2.0, 3.0, 4.0
LONGEST, MAX_PHASES, HEAD = 2.0, 64, 8
FAR = 1e300
NONE, LIFTS, STOPS, FIRST_UP, FIRST_DOWN, SECOND_UP, SECOND_DOWN = -1, 0, 1, 2, 3, 4, 5
X1_REVERSES, X1_STICKS, X1_SLIPS, X1_HITS_STOP, X2_REVERSES, X2_STICKS, X2_SLIPS = 1, 2, 3, 4, 5, 6, 7


class Leg(NamedTuple):
    """Accelerations as coefficients of compression, velocity and 1; friction; stroke; a bound of the rates."""

    a1_y: float
    a1_v: float
    a1_0: float
    f1: float
    a2_y: float
    a2_v: float
    a2_0: float
    f2: float
    x1_min: float
    x1_max: float
    rate: float


class Point(NamedTuple):
    """The state, or a derivative of it: displacement, both velocities, compression."""

    x1: float
    v1: float
    v2: float
    y: float


def leg_of(job):
    """The coefficients of a job, which is a tuple of 19 floats."""
    m_eff, m_s, k, _, c, b1, b2, f1, f2, gamma2, g, low, high, _, _, _, _, _, u = job
    rate = (k / m_eff + k / m_s) ** 0.5 + b1 / m_eff + b2 / m_s
    a1_0 = (k * c - gamma2 * u) / m_eff
    return Leg(-k / m_eff, -b1 / m_eff, a1_0, f1, k / m_s, -b2 / m_s, -g, f2, max(low, -FAR), min(high, FAR), rate)


def rates(leg, side_1, side_2, z):
    """The time derivative of the state: a mass that is held stays."""
    first = leg.a1_y * z.y + leg.a1_v * z.v1 + leg.a1_0 - side_1 * leg.f1 if side_1 != 0.0 else 0.0
    second = leg.a2_y * z.y + leg.a2_v * z.v2 + leg.a2_0 - side_2 * leg.f2 if side_2 != 0.0 else 0.0
    return Point(z.v1, first, second, z.v1 - z.v2)


def next_rates(leg, side_1, side_2, d):
    """The time derivative of a derivative of the state."""
    first = leg.a1_y * d.y + leg.a1_v * d.v1 if side_1 != 0.0 else 0.0
    second = leg.a2_y * d.y + leg.a2_v * d.v2 if side_2 != 0.0 else 0.0
    return Point(d.v1, first, second, d.v1 - d.v2)


def sign(value):
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


def blocked(leg, x1, side):
    """Whether a stop, or a locked stroke, keeps the actuator from going to a side."""
    return leg.x1_min >= leg.x1_max or (side < 0.0 and x1 <= leg.x1_min) or (side > 0.0 and x1 >= leg.x1_max)


def departure(free, friction, drift):
    """Where a mass at rest goes: held while |free| <= friction; on the threshold its drift decides."""
    if abs(free) == friction:
        return sign(drift) if free * drift >= 0.0 else 0.0
    return 1.0 if free > friction else (-1.0 if free < -friction else 0.0)


def departure_1(leg, side_2, z):
    d = rates(leg, 0.0, side_2, z)
    drift = leg.a1_y * (d.y if d.y != 0.0 else next_rates(leg, 0.0, side_2, d).y)
    side = departure(leg.a1_y * z.y + leg.a1_0, leg.f1, drift)
    return 0.0 if blocked(leg, z.x1, side) else side


def departure_2(leg, side_1, z):
    d = rates(leg, side_1, 0.0, z)
    drift = leg.a2_y * (d.y if d.y != 0.0 else next_rates(leg, side_1, 0.0, d).y)
    return departure(leg.a2_y * z.y + leg.a2_0, leg.f2, drift)


def event_functions(leg, side_1, side_2, z):
    """Six functions, positive within a mode: compression, way to the stop, and two per mass.

    A mass that slips has its speed, one that is held what is left of its friction on either side.
    """
    stop = FAR
    if side_1 != 0.0:
        stop = leg.x1_max - z.x1 if side_1 > 0.0 else z.x1 - leg.x1_min
        first_up, first_down = side_1 * z.v1, 1.0
    else:
        free = leg.a1_y * z.y + leg.a1_0
        first_up = 1.0 if blocked(leg, z.x1, 1.0) else leg.f1 - free
        first_down = 1.0 if blocked(leg, z.x1, -1.0) else leg.f1 + free
    if side_2 != 0.0:
        second_up, second_down = side_2 * z.v2, 1.0
    else:
        free = leg.a2_y * z.y + leg.a2_0
        second_up, second_down = leg.f2 - free, leg.f2 + free
    return (z.y, stop, first_up, first_down, second_up, second_down)


def slopes(leg, side_1, side_2, d):
    """The change of the event functions with the derivative d of the state."""
    first_up = side_1 * d.v1 if side_1 != 0.0 else -leg.a1_y * d.y
    second_up = side_2 * d.v2 if side_2 != 0.0 else -leg.a2_y * d.y
    first_down = 0.0 if side_1 != 0.0 else leg.a1_y * d.y
    second_down = 0.0 if side_2 != 0.0 else leg.a2_y * d.y
    return (d.y, -side_1 * d.x1, first_up, first_down, second_up, second_down)


def first_step(leg, side_1, side_2, z):
    """A first step within which no function that starts at zero has returned to zero,
    as far as its Taylor series says.
    """
    d1 = rates(leg, side_1, side_2, z)
    d2 = next_rates(leg, side_1, side_2, d1)
    d3 = next_rates(leg, side_1, side_2, d2)
    g0, g1 = event_functions(leg, side_1, side_2, z), slopes(leg, side_1, side_2, d1)
    g2, g3 = slopes(leg, side_1, side_2, d2), slopes(leg, side_1, side_2, d3)
    h = 0.05 / leg.rate
    for n in range(6):
        if g0[n] == 0.0:
            if abs(g1[n]) * leg.rate > 1e-7 * abs(g2[n]):
                if g2[n] != 0.0:
                    h = min(h, 0.5 * abs(g1[n] / g2[n]))
            elif g3[n] != 0.0:
                h = min(h, 0.5 * abs(g2[n] / g3[n]))
    return max(h, 1e-9 / leg.rate)


def begin(job, leg):
    """State and modes right after touchdown."""
    z = Point(job[15], job[16], job[17], 0.0)
    side_1, side_2 = sign(z.v1), sign(z.v2)
    if side_1 != 0.0 and blocked(leg, z.x1, side_1):
        z, side_1 = Point(z.x1, 0.0, z.v2, z.y), 0.0
    rests_1, rests_2 = side_1 == 0.0, side_2 == 0.0
    for _ in range(2):
        side_1 = departure_1(leg, side_2, z) if rests_1 else side_1
        side_2 = departure_2(leg, side_1, z) if rests_2 else side_2
    return z, side_1, side_2


def pass_event(leg, side_1, side_2, z, which):
    """State, modes and kind of the event (0: a touch) after one of the event functions has come to zero."""
    if which in (STOPS, FIRST_UP) and side_1 != 0.0:
        stop = leg.x1_max if side_1 > 0.0 else leg.x1_min
        hits = which == STOPS or abs(z.x1 - stop) <= 1e-13
        z = Point(stop if hits else z.x1, 0.0, z.v2, z.y)
        side = departure_1(leg, side_2, z)
        kind = X1_HITS_STOP if hits else (X1_STICKS if side == 0.0 else (X1_REVERSES if side != side_1 else 0))
        return z, side, side_2, kind
    if which in (FIRST_UP, FIRST_DOWN):
        return z, 1.0 if which == FIRST_UP else -1.0, side_2, X1_SLIPS
    if which == SECOND_UP and side_2 != 0.0:
        z = Point(z.x1, z.v1, 0.0, z.y)
        side = departure_2(leg, side_1, z)
        kind = X2_STICKS if side == 0.0 else (X2_REVERSES if side != side_2 else 0)
        return z, side_1, side, kind
    return z, side_1, 1.0 if which == SECOND_UP else -1.0, X2_SLIPS


def gained(job, z):
    """The analytical energy delta: change of the body's energy between touchdown and state z."""
    m_s, k, g = job[1], job[2], job[10]
    w0, w = job[15], z.x1 - z.y
    return 0.5 * m_s * (z.v2 - job[17]) * (z.v2 + job[17]) + m_s * g * (w - w0) + 0.5 * k * (w - w0) * (w + w0)


def chain(job, search, tolerance, answer):
    """One stance into a row of `answer`; search(leg, side_1, side_2, z, limit, tolerance) is the peer.

    It returns the time until the first event function comes to zero, or limit, then which one (NONE), and the state
    there.
    """
    leg = leg_of(job)
    z, side_1, side_2 = begin(job, leg)
    t, phases, count, ending = 0.0, 1, 0, TOO_MANY_PHASES
    while phases <= MAX_PHASES:
        if side_1 == 0.0 and side_2 == 0.0:
            ending = REST
            break
        took, which, z = search(leg, side_1, side_2, z, LONGEST - t, tolerance)
        t += took
        if which in (NONE, LIFTS):
            ending = HORIZON if which == NONE else TAKEOFF
            break
        z, side_1, side_2, kind = pass_event(leg, side_1, side_2, z, which)
        phases += 1
        if kind != 0 and phases <= MAX_PHASES:
            answer[HEAD + 2 * count], answer[HEAD + 2 * count + 1] = t, kind
            count += 1
    y = 0.0 if ending == TAKEOFF else z.y
    answer[0], answer[1], answer[2], answer[3], answer[4], answer[5] = ending, t, z.x1, z.v1, z.v2, y
    answer[6], answer[7] = gained(job, z), count
