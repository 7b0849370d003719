"""What a formula that is pasted as NumPy calls where its own letters would lose digits: near poles that are equal, and
near those at 0. `pasted.c` has the same in C. Each function takes arrays that are broadcast, and computes all cases.

The solver in NumPy has kernels of its own, runtime/engine/python/kernels.py: they choose lanes, and read records and
formulas of the package, which a text that stands by itself does not have.
"""

import numpy as np


def _factor_cubic(s_1, s_2, s_3):
    """What s^3 + s_1 s^2 + s_2 s + s_3 = (s + a)(s^2 + p s + q) has for a, p, q: -a is its most isolated real root."""
    drifts = ~(s_3 > 0.0)
    scale = np.maximum(s_1, np.maximum(np.sqrt(s_2), np.cbrt(s_3)))
    c_1, c_2, c_3 = s_1 / scale, s_2 / scale**2, s_3 / scale / scale**2
    mean = c_1 / 3  # around the mean root, z^3 + P z = T: Newton from above, where the cubic is convex
    P, T = c_2 - 3 * mean**2, c_3 - mean * (c_2 - 2 * mean**2)
    z = np.sqrt(abs(P)) + np.cbrt(abs(T))
    for _ in range(60):
        z = np.fmin(z, z - ((z * z + P) * z - abs(T)) / (3 * z * z + P))
    offset = np.where(abs(T) > 0, z, np.sqrt(np.maximum(-P, 0)))
    a = mean + np.where(T > 0, offset, -offset)
    p = c_1 - a
    q = np.where(a > mean, c_3 / a, c_2 - a * p)
    for _ in range(3):  # the factors are polished: the residual of the coefficients is what the motion sees
        r_1, r_2, r_3 = c_1 - (a + p), c_2 - (q + a * p), c_3 - a * q
        chi = q - a * (p - a)
        da = (r_3 - a * (r_2 - a * r_1)) / chi
        small = (abs(chi) > 0) & (da * da < 2.0**-52)
        q = np.where(small, q + (r_2 - a * (r_1 - da) - p * da), q)
        p = np.where(small, p + (r_1 - da), p)
        a = np.where(small, a + da, a)
    return np.where(drifts, 0.0, a * scale), np.where(drifts, s_1, p * scale), np.where(drifts, s_2, q * scale**2)


def _decay_at(a, t):
    """The decay exp(-a t), and its integrals: once, twice, three times."""
    z = a * t
    tail = np.ones_like(z)
    for n in range(20, 0, -1):
        tail = 1 - z * tail / (n + 3)
    e3 = t**3 * tail / 6
    e2 = t**2 / 2 - a * e3
    e1 = t - a * e2
    e = np.exp(-z)
    far_e1 = (1 - e) / a
    far_e2 = (t - far_e1) / a
    short, far = (1 - a * e1, e1, e2, e3), (e, far_e1, far_e2, (t**2 / 2 - far_e2) / a)
    return tuple(np.where(abs(z) < 1, *each) for each in zip(short, far, strict=True))


def _pair_at(p, q, t):
    """R', R, int R, iint R, iiint R: R is the inverse transform of 1/(s^2 + p s + q)."""
    mean = p / 2
    discriminant = mean**2 - q
    half = np.where(q > 0, np.sqrt(abs(discriminant)), mean)  # the square may underflow
    rings, fast = discriminant < 0, mean + half
    is_short = np.where(rings, q * t**2 < 1, ~(fast * t >= 2))
    # Shortly: the power series of the two highest integrals, from which the others follow.
    pt, qtt = -p * t, -q * t**2
    before, term = np.zeros_like(pt + qtt), np.full_like(pt + qtt, 1 / 6)
    R2, R3 = term, np.full_like(term, 1 / 24)
    for n in range(1, 60):
        before, term = term, (pt * term + qtt * before / (n + 2)) / (n + 3)
        R2, R3 = R2 + term, R3 + term / (n + 4)
        if not np.any(is_short & (abs(term) + abs(before) > 1e-20)):
            break
    R2, R3 = R2 * t**3, R3 * t**4
    R1 = t**2 / 2 - p * R2 - q * R3
    R = t - p * R1 - q * R2
    short = 1 - p * R - q * R1, R, R1, R2, R3
    # Two real poles apart: no quotient by q.
    slow, apart = q / fast, fast - q / fast
    of_slow, of_fast = _decay_at(slow, t), _decay_at(fast, t)
    R, *integrals = ((one - other) / apart for one, other in zip(of_slow, of_fast, strict=True))
    distinct = of_fast[0] - slow * R, R, *integrals
    # A pair that rings; and two real poles, nearly equal.
    fade, sine, cosine = np.exp(-mean * t), np.sin(half * t / 2), np.cos(half * t / 2)
    versine = 2 * sine**2
    ringing = fade * 2 * sine * cosine / half
    close = np.exp(-fast * t) * _decay_at(-2 * half, t)[1]
    R = np.where(rings, ringing, close)
    Rd = np.where(rings, fade * (1 - versine) - mean * ringing, np.exp(-fast * t) - slow * close)
    R1 = np.where(rings, fade * versine - np.expm1(-mean * t) - mean * ringing, 1 - Rd - p * R) / q
    R2 = (t - R - p * R1) / q
    others = Rd, R, R1, R2, (t**2 / 2 - R1 - p * R2) / q
    are_apart = ~rings & (half * t >= 0.5)
    return tuple(
        np.where(is_short, one, np.where(are_apart, two, three))
        for one, two, three in zip(short, distinct, others, strict=True)
    )


def _short_response(s_1, s_2, s_3, t, of_interest):
    """What `_response_at` returns, by the power series of the three highest integrals, from which the others follow."""
    h, hh, hhh = -s_1 * t, -s_2 * t**2, -s_3 * t**3
    zero = np.zeros_like(h + hh + hhh)
    earlier, before, term = zero, zero, zero + 1 / 24
    W2, W3, W4 = term, zero + 1 / 120, zero + 1 / 720
    for n in range(1, 60):
        new = (h * term + (hh * before + hhh * earlier / (n + 2)) / (n + 3)) / (n + 4)
        earlier, before, term = before, term, new
        W2, W3, W4 = W2 + term, W3 + term / (n + 5), W4 + term / ((n + 5) * (n + 6))
        if not np.any(of_interest & (abs(term) + abs(before) + abs(earlier) > 1e-22)):
            break
    W2, W3, W4 = W2 * t**4, W3 * t**5, W4 * t**6
    W1 = t**3 / 6 - s_1 * W2 - s_2 * W3 - s_3 * W4
    W = t**2 / 2 - s_1 * W1 - s_2 * W2 - s_3 * W3
    Wd = t - s_1 * W - s_2 * W1 - s_3 * W2
    return 1 - s_1 * Wd - s_2 * W - s_3 * W1, Wd, W, W1, W2


def _response_at(a, p, q, s_1, s_2, s_3, t):
    """W'', W', W, int W, iint W: W is the inverse transform of 1/(s^3 + s_1 s^2 + s_2 s + s_3)."""
    chi, rest = q - a * (p - a), p - a
    drifts = ~(abs(a) > 0)
    is_apart = ~drifts & (chi * t**2 >= 1)
    is_short = ~(drifts | is_apart) & (s_1 * t < 4)
    short = _short_response(s_1, s_2, s_3, t, is_short)
    # The real pole is apart from the pair.
    Rd, R, R1, R2, R3 = _pair_at(p, q, t)
    e, e1, e2, _ = _decay_at(a, t)
    W = np.where(a * t < 0.5, q * R1 - a * (e1 - R), e - Rd - rest * R) / chi
    apart = (a**2 * e - (a * p - q) * Rd - a * q * R) / chi, (a * (Rd - e) + q * R) / chi, W
    # Three poles that are nearly equal, around their mean.
    mean, of_three, discriminant = s_1 / 3, (2 * a - p) / 6, (p / 2) ** 2 - q
    Q_s, T_s = -3 * of_three**2 - discriminant, 2 * of_three * (of_three**2 - discriminant)
    Vdd, Vd, V, *_ = _short_response(0 * s_1, Q_s, T_s, t, ~(drifts | is_apart | is_short))
    fade = np.exp(-mean * t)
    close = fade * (Vdd - 2 * mean * Vd + mean**2 * V), fade * (Vd - mean * V), fade * V
    Wdd, Wd, W = (np.where(is_apart, one, other) for one, other in zip(apart, close, strict=True))
    W1 = (1 - Wdd - s_1 * Wd - s_2 * W) / s_3
    of_split = is_apart & (chi >= 0.05 * q)
    W1 = np.where(of_split, (e1 - R - rest * R1) / chi, W1)
    W2 = np.where(of_split, (e2 - R1 - rest * R2) / chi, (t - Wd - s_1 * W - s_2 * W1) / s_3)
    cases = zip((Rd, R, R1, R2, R3), short, (Wdd, Wd, W, W1, W2), strict=True)
    return tuple(np.where(drifts, one, np.where(is_short, two, three)) for one, two, three in cases)


def _overlap(rate, f_0, f_3, f_2, f_1, g_0, g_3, g_2, g_1, a, p, q, s_1, s_2, s_3, t):
    """The integral from 0 to t of exp(-rate t) times f_0 + f_3 W' + f_2 W + f_1 int W times the same of g.

    By Gauss's rule of 12 nodes, over parts of at most 4 times the shortest time constant at first. What decays without
    ringing is gone before a part that is as long as the time before it is too long; what rings limits the parts to 4
    times its own time constant.
    """
    numbers = (rate, f_0, f_3, f_2, f_1, g_0, g_3, g_2, g_1, a, p, q, s_1, s_2, s_3, t)
    rate, f_0, f_3, f_2, f_1, g_0, g_3, g_2, g_1, a, p, q, s_1, s_2, s_3, t = np.broadcast_arrays(*numbers)
    places, weights = (each.reshape(-1, *[1] * t.ndim) / 2 for each in np.polynomial.legendre.leggauss(12))
    shortest = 4 / (s_1 + np.sqrt(abs(s_2)))
    swing = np.where(p**2 / 4 < q, 4 / (p + np.sqrt(abs(q))), t)
    total = start = np.zeros(t.shape)
    for _ in range(1000000):
        if not np.any(start < t):
            break
        longest = np.where(p * start > 80, start, np.fmin(start, swing))
        part = np.where(start < t, np.fmin(t - start, np.fmax(shortest, longest)), 0)
        at = start + part * (places + 0.5)
        _, Wd, W, W1, _ = _response_at(a, p, q, s_1, s_2, s_3, at)
        f = f_0 + f_3 * Wd + f_2 * W + f_1 * W1
        g = g_0 + g_3 * Wd + g_2 * W + g_1 * W1
        total = total + np.sum(part * weights * np.exp(-rate * at) * f * g, axis=0)
        start = start + part
    return total
