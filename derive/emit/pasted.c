/* SPDX-License-Identifier: MIT-0
 *
 * What a formula that is pasted as C calls where its own letters would lose digits: near poles that are equal, and near
 * those at 0. Written in `real`; each function is shown behind those that it calls. The engine has kernels of its own,
 * kernels_real.h: without libm, of a plan's poles, with bounds for its certificate.
 */

/* s^3 + s_1 s^2 + s_2 s + s_3 = (s + a)(s^2 + p s + q), -a the most isolated of the real roots. */
typedef struct {
    real a, p, q;
} factors_real;

static inline factors_real factor_cubic_real(real s_1, real s_2, real s_3) {
    factors_real factors = {0.0, s_1, s_2};
    const real scale = fmax_real(s_1, fmax_real(sqrt_real(s_2), cbrt_real(s_3)));
    if (!(s_3 > 0.0) || !(scale * scale * scale > 0.0)) { return factors; }
    const real c_1 = s_1 / scale, c_2 = s_2 / (scale * scale), c_3 = s_3 / scale / (scale * scale);
    /* Around the mean root, z^3 + P z = T: Newton from above, where the cubic is convex. */
    const real mean = c_1 / 3.0, P = c_2 - 3.0 * mean * mean, T = c_3 - mean * (c_2 - 2.0 * mean * mean);
    real z = sqrt_real(fabs_real(P)) + cbrt_real(fabs_real(T));
    for (int n = 0; n < 60; n++) {
        const real next = z - ((z * z + P) * z - fabs_real(T)) / (3.0 * z * z + P);
        if (!(next < z)) { break; }
        z = next;
    }
    const real offset = fabs_real(T) > 0.0 ? z : P < 0.0 ? sqrt_real(-P) : 0.0;
    real a = T > 0.0 ? mean + offset : mean - offset;
    real p = c_1 - a;
    real q = a > mean ? c_3 / a : c_2 - a * p;
    /* The factors are polished: the residual of the coefficients is what the motion sees. */
    for (int n = 0; n < 3; n++) {
        const real r_1 = c_1 - (a + p), r_2 = c_2 - (q + a * p), r_3 = c_3 - a * q;
        const real chi = q - a * (p - a);
        const real da = (r_3 - a * (r_2 - a * r_1)) / (fabs_real(chi) > 0.0 ? chi : 1.0);
        if (!(fabs_real(chi) > 0.0) || !(da * da < EPSILON_real)) { break; }
        q = q + (r_2 - a * (r_1 - da) - p * da);
        p = p + (r_1 - da);
        a = a + da;
    }
    factors.a = a * scale;
    factors.p = p * scale;
    factors.q = q * scale * scale;
    return factors;
}

/* exp(-a t), and its integrals. */
typedef struct {
    real e, e1, e2, e3;
} decay_real;

static inline decay_real decay_at_real(real a, real t) {
    const real z = a * t;
    decay_real decay;
    if (fabs_real(z) < 1.0) {
        real tail = 1.0;
        for (int n = 20; n > 0; n--) {
            tail = 1.0 - z * tail / (real)(n + 3);
        }
        decay.e3 = t * t * t * tail / 6.0;
        decay.e2 = t * t / 2.0 - a * decay.e3;
        decay.e1 = t - a * decay.e2;
        decay.e = 1.0 - a * decay.e1;
    } else {
        decay.e = exp_real(-z);
        decay.e1 = (1.0 - decay.e) / a;
        decay.e2 = (t - decay.e1) / a;
        decay.e3 = (t * t / 2.0 - decay.e2) / a;
    }
    return decay;
}

/* The inverse transform R of 1/(s^2 + p s + q), its derivative and its integrals. */
typedef struct {
    real Rd, R, R1, R2, R3;
} pair_real;

static inline pair_real pair_at_real(real p, real q, real t) {
    const real mean = p / 2.0, discriminant = mean * mean - q;
    const real half = q > 0.0 ? sqrt_real(fabs_real(discriminant)) : mean; /* the square may underflow */
    const real fast = discriminant < 0.0 ? 0.0 : mean + half;
    pair_real pair;
    real turned; /* q R1 */
    if (discriminant < 0.0 ? q * t * t < 1.0 : !(fast * t >= 2.0)) {
        /* Shortly: the power series of the two highest integrals, from which the others follow. */
        const real pt = -p * t, qtt = -q * t * t;
        real before = 0.0, term = 1.0 / 6.0;
        pair.R2 = 1.0 / 6.0;
        pair.R3 = 1.0 / 24.0;
        for (int n = 1; n < 60 && fabs_real(term) + fabs_real(before) > 1e-20; n++) {
            const real next = (pt * term + qtt * before / (real)(n + 2)) / (real)(n + 3);
            before = term;
            term = next;
            pair.R2 += next;
            pair.R3 += next / (real)(n + 4);
        }
        pair.R2 *= t * t * t;
        pair.R3 *= t * t * (t * t);
        pair.R1 = t * t / 2.0 - p * pair.R2 - q * pair.R3;
        pair.R = t - p * pair.R1 - q * pair.R2;
        pair.Rd = 1.0 - p * pair.R - q * pair.R1;
        return pair;
    }
    if (discriminant >= 0.0 && half * t >= 0.5) { /* Two real poles apart: no quotient by q. */
        const decay_real of_slow = decay_at_real(q / fast, t), of_fast = decay_at_real(fast, t);
        const real apart = fast - q / fast;
        pair.R = (of_slow.e - of_fast.e) / apart;
        pair.R1 = (of_slow.e1 - of_fast.e1) / apart;
        pair.R2 = (of_slow.e2 - of_fast.e2) / apart;
        pair.R3 = (of_slow.e3 - of_fast.e3) / apart;
        pair.Rd = of_fast.e - q / fast * pair.R;
        return pair;
    }
    if (discriminant < 0.0) { /* A pair that rings. */
        const real fade = exp_real(-mean * t), sine = sin_real(half * t / 2.0), cosine = cos_real(half * t / 2.0);
        const real versine = 2.0 * sine * sine;
        pair.R = fade * (2.0 * sine * cosine / half);
        pair.Rd = fade * (1.0 - versine) - mean * pair.R;
        turned = fade * versine - expm1_real(-mean * t) - mean * pair.R;
    } else { /* Two real poles, nearly equal. */
        const real fade = exp_real(-fast * t);
        pair.R = fade * decay_at_real(-2.0 * half, t).e1;
        pair.Rd = fade - q / fast * pair.R;
        turned = 1.0 - pair.Rd - p * pair.R;
    }
    pair.R1 = turned / q;
    pair.R2 = (t - pair.R - p * pair.R1) / q;
    pair.R3 = (t * t / 2.0 - pair.R1 - p * pair.R2) / q;
    return pair;
}

/* The inverse transform W of 1/(s^3 + s_1 s^2 + s_2 s + s_3), its derivatives and its integrals. */
typedef struct {
    real Wdd, Wd, W, W1, W2;
} response_real;

/* Shortly: the power series of the three highest integrals, from which the others follow. */
static inline response_real short_response_real(real s_1, real s_2, real s_3, real t) {
    const real h = -s_1 * t, hh = -s_2 * t * t, hhh = -s_3 * t * t * t, tt = t * t;
    real earlier = 0.0, before = 0.0, term = 1.0 / 24.0;
    real W2 = 1.0 / 24.0, W3 = 1.0 / 120.0, W4 = 1.0 / 720.0;
    for (int n = 1; n < 60 && fabs_real(term) + fabs_real(before) + fabs_real(earlier) > 1e-22; n++) {
        const real next = (h * term + (hh * before + hhh * earlier / (real)(n + 2)) / (real)(n + 3)) / (real)(n + 4);
        earlier = before;
        before = term;
        term = next;
        W2 += next;
        W3 += next / (real)(n + 5);
        W4 += next / (real)(n + 5) / (real)(n + 6);
    }
    W3 *= tt * tt * t;
    W4 *= tt * tt * tt;
    response_real response;
    response.W2 = W2 * (tt * tt);
    response.W1 = tt * t / 6.0 - s_1 * response.W2 - s_2 * W3 - s_3 * W4;
    response.W = tt / 2.0 - s_1 * response.W1 - s_2 * response.W2 - s_3 * W3;
    response.Wd = t - s_1 * response.W - s_2 * response.W1 - s_3 * response.W2;
    response.Wdd = 1.0 - s_1 * response.Wd - s_2 * response.W - s_3 * response.W1;
    return response;
}

static inline response_real response_at_real(real a, real p, real q, real s_1, real s_2, real s_3, real t) {
    const real chi = q - a * (p - a), rest = p - a;
    response_real response;
    int by_recursion = 1;
    if (!(fabs_real(a) > 0.0)) {
        const pair_real pair = pair_at_real(p, q, t);
        response.Wdd = pair.Rd;
        response.Wd = pair.R;
        response.W = pair.R1;
        response.W1 = pair.R2;
        response.W2 = pair.R3;
        by_recursion = 0;
    } else if (chi * t * t >= 1.0) { /* The real pole is apart from the pair. */
        const decay_real decay = decay_at_real(a, t);
        const pair_real pair = pair_at_real(p, q, t);
        response.Wdd = (a * a * decay.e - (a * p - q) * pair.Rd - a * q * pair.R) / chi;
        response.Wd = (a * (pair.Rd - decay.e) + q * pair.R) / chi;
        response.W = (decay.e - pair.Rd - rest * pair.R) / chi;
        if (a * t < 0.5) { response.W = (q * pair.R1 - a * (decay.e1 - pair.R)) / chi; }
        response.W1 = (decay.e1 - pair.R - rest * pair.R1) / chi;
        response.W2 = (decay.e2 - pair.R1 - rest * pair.R2) / chi;
        by_recursion = chi < 0.05 * q;
    } else if (s_1 * t < 4.0) {
        response = short_response_real(s_1, s_2, s_3, t);
        by_recursion = 0;
    } else { /* Three poles that are nearly equal, around their mean. */
        const real mean = s_1 / 3.0, fade = exp_real(-mean * t);
        const real apart = (2.0 * a - p) / 6.0, discriminant = p / 2.0 * (p / 2.0) - q;
        const real Q_s = -3.0 * apart * apart - discriminant, T_s = 2.0 * apart * (apart * apart - discriminant);
        const response_real near = short_response_real(0.0, Q_s, T_s, t);
        response.W = fade * near.W;
        response.Wd = fade * (near.Wd - mean * near.W);
        response.Wdd = fade * (near.Wdd - 2.0 * mean * near.Wd + mean * mean * near.W);
    }
    if (by_recursion) { /* s^3 + s_1 s^2 + s_2 s + s_3 on the integrals of W. */
        response.W1 = (1.0 - response.Wdd - s_1 * response.Wd - s_2 * response.W) / s_3;
        response.W2 = (t - response.Wd - s_1 * response.W - s_2 * response.W1) / s_3;
    }
    return response;
}

/* The integral from 0 to t of exp(-rate t) times f_0 + f_3 W' + f_2 W + f_1 int W times the same of g.
 *
 * By Gauss's rule of 12 nodes, over parts of at most 4 times the shortest time constant at first. What decays without
 * ringing is gone before a part that is as long as the time before it is too long; what rings limits the parts to 4
 * times its own time constant. */
static inline real overlap_real(real rate, real f_0, real f_3, real f_2, real f_1, real g_0, real g_3, real g_2,
                                real g_1, real a, real p, real q, real s_1, real s_2, real s_3, real t) {
    static const real places[] = {GAUSS_PLACES_real};
    static const real weights[] = {GAUSS_WEIGHTS_real};
    const real shortest = 4.0 / (s_1 + sqrt_real(fabs_real(s_2)));
    const real swing = p * p / 4.0 < q ? 4.0 / (p + sqrt_real(q)) : t;
    real sum = 0.0, from = 0.0;
    for (long parts = 0; from < t && parts < 1000000; parts++) {
        const real longest = p * from > 80.0 ? from : fmin_real(from, swing);
        const real part = fmin_real(t - from, fmax_real(shortest, longest));
        for (int n = 0; n < 12; n++) {
            const real at = from + part * places[n];
            const response_real W = response_at_real(a, p, q, s_1, s_2, s_3, at);
            const real f = f_0 + f_3 * W.Wd + f_2 * W.W + f_1 * W.W1;
            const real g = g_0 + g_3 * W.Wd + g_2 * W.W + g_1 * W.W1;
            sum += part * weights[n] * exp_real(-rate * at) * f * g;
        }
        from += part;
    }
    return sum;
}
