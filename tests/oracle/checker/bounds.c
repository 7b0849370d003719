/* No zero between two events.
 *
 * Behind its value at 0, a watched function is a sum of motions of groups of poles:
 *
 *     g(t) = g(0) + sum of S (1 - e^{-a t})/a + (r(t) - r(0)),      r'' + p r' + q r = 0
 *
 * The first are concave (S > 0: above their chord) or convex (above their tangent, and above their end); r'^2 + q r^2
 * never grows, which bounds r and, with r in place of r', r''. So on any window g is above a function that is linear or
 * concave, which is positive if it is so at both ends. Three nearly equal rates: the largest of |g'|,
 * 2 |(D + sigma) g'|/sigma and 4 |(D + sigma)^2 g'|/sigma^2 never grows (their matrix has a negative logarithmic norm).
 */
#include "checker.h"

enum { LONGEST = 400000, MOST_OF_A_MOTION = 20000 };

/* g at the time t that has been reached. */
typedef struct {
    quad value;
    quad slope[3]; /* of each real pole that stands alone: S e^{-a t} */
    quad r, rate;  /* the pair */
    quad d1, d2, d3; /* the three: g', g'', g''' */
} place;

static int split(const spectrum *s, const watched *g, place *at)
{
    quad first = g->d[1], second = g->d[2];
    at->value = g->d[0];
    at->r = at->rate = 0;
    at->d1 = g->d[1];
    at->d2 = g->d[2];
    at->d3 = g->d[3];
    if (s->tripled) {
        return 1;
    }
    int next = 0;
    if (s->alone == 3 || (s->alone == 1 && s->paired)) {
        const quad a = s->a[0];
        at->slope[0] = (g->d[3] + s->p * g->d[2] + s->q * g->d[1]) / (a * a - s->p * a + s->q);
        first -= at->slope[0];
        second += a * at->slope[0];
        next = 1;
    }
    if (s->paired) {
        at->rate = first;
        at->r = -(second + s->p * first) / s->q;
    } else {
        const quad fast = s->a[next], slow = s->a[next + 1];
        at->slope[next] = (second + slow * first) / (slow - fast);
        at->slope[next + 1] = (second + fast * first) / (fast - slow);
    }
    return 1;
}

/* The integral of e^{-a t} over h. */
static quad faded(quad a, quad h)
{
    return a > 0 ? -checker_expm1(-a * h) / a : h;
}

/* r and r' after h, by the series of the pair's propagator and its squares. */
static void turn(const spectrum *s, quad h, quad *r, quad *rate)
{
    int doublings = 0;
    for (quad reach = 2 * h * (checker_sqrt(s->q) + s->p); reach > 1; reach /= 2) {
        doublings++;
        h /= 2;
    }
    quad column[2][2] = {{1, 0}, {0, 1}};
    for (int j = 0; j < 2; j++) {
        quad z = column[j][0], w = column[j][1];
        for (int n = 1; n <= 27; n++) {
            const quad next = w * h / n;
            w = (-s->q * z - s->p * w) * h / n;
            z = next;
            column[j][0] += z;
            column[j][1] += w;
        }
    }
    for (; doublings > 0; doublings--) {
        const quad a = column[0][0], c = column[0][1], b = column[1][0], d = column[1][1];
        column[0][0] = a * a + b * c;
        column[0][1] = c * a + d * c;
        column[1][0] = a * b + b * d;
        column[1][1] = c * b + d * d;
    }
    const quad z = column[0][0] * *r + column[1][0] * *rate;
    *rate = column[0][1] * *r + column[1][1] * *rate;
    *r = z;
}

/* g and its derivatives after h, by the series, for three nearly equal rates; returns the change of g. */
static quad follow(const spectrum *s, quad h, place *at)
{
    const quad reach = 4 * h * s->sigma;
    if (reach > 1200) { /* gone: each rate is above sigma/2 */
        const quad rest = (at->d3 + s->s1 * at->d2 + s->s2 * at->d1) / s->s3;
        at->d1 = at->d2 = at->d3 = 0;
        return rest;
    }
    const int steps = (int)(double)reach + 1;
    quad change = 0;
    for (int i = 0; i < steps; i++) {
        const quad dt = h / steps;
        quad c[34] = {at->d1, at->d2, at->d3 / 2};
        for (int n = 0; n < 31; n++) {
            c[n + 3] = -(s->s1 * (n + 2) * (n + 1) * c[n + 2] + s->s2 * (n + 1) * c[n + 1] + s->s3 * c[n])
                     / ((quad)(n + 3) * (n + 2) * (n + 1));
        }
        quad d1 = 0, d2 = 0, d3 = 0, sum = 0;
        for (int n = 33; n >= 0; n--) {
            sum = sum * dt + c[n] / (n + 1);
            d1 = d1 * dt + c[n];
            d2 = n > 0 ? d2 * dt + n * c[n] : d2;
            d3 = n > 1 ? d3 * dt + n * (n - 1) * c[n] : d3;
        }
        change += sum * dt;
        at->d1 = d1;
        at->d2 = d2;
        at->d3 = d3;
    }
    return change;
}

/* What the largest of the three scaled derivatives of the n-th derivative of g' is; it never grows. */
static quad ceiling(const spectrum *s, quad first, quad second, quad third)
{
    const quad sigma = s->sigma;
    const quad one = absolute(first), two = 2 * absolute(second + sigma * first) / sigma;
    const quad three = 4 * absolute(third + 2 * sigma * second + sigma * sigma * first) / (sigma * sigma);
    const quad larger = one > two ? one : two;
    return larger > three ? larger : three;
}

/* A bound from now on of the derivative of order n = 1..4. */
static quad bound(const spectrum *s, const place *at, int order)
{
    quad sum = 0;
    if (s->tripled) {
        quad first = at->d1, second = at->d2, third = at->d3;
        for (int n = 1; n < order; n++) {
            const quad next = -s->s1 * third - s->s2 * second - s->s3 * first;
            first = second;
            second = third;
            third = next;
        }
        return ceiling(s, first, second, third);
    }
    for (int j = 0; j < s->alone; j++) {
        quad term = absolute(at->slope[j]);
        for (int n = 1; n < order; n++) {
            term *= s->a[j];
        }
        sum += term;
    }
    if (s->paired) {
        quad z = at->r, w = at->rate;
        for (int n = 0; n < order; n++) {
            const quad next = -s->q * z - s->p * w;
            z = w;
            w = next;
        }
        sum += checker_sqrt(z * z + w * w / s->q);
    }
    return sum;
}

/* What is the same in every window that starts at a place. */
typedef struct {
    quad bend;  /* a bound of the second derivative of the group that is bounded by a parabola */
    quad depth; /* how far that group can still fall */
} outlook;

static outlook ahead(const spectrum *s, const place *at)
{
    outlook o = {0, 0};
    if (s->tripled) {
        const quad most = ceiling(s, at->d1, at->d2, at->d3);
        const quad still = (at->d3 + s->s1 * at->d2 + s->s2 * at->d1) / s->s3; /* g(infinity) - g */
        o.bend = bound(s, at, 2);
        o.depth = 2 * most / s->sigma - still;
    } else if (s->paired) {
        const quad next = -s->q * at->r - s->p * at->rate, jerk = -s->q * at->rate - s->p * next;
        o.bend = checker_sqrt(next * next + jerk * jerk / s->q);
        o.depth = checker_sqrt(at->r * at->r + at->rate * at->rate / s->q) + at->r;
    }
    return o;
}

/* Whether g stays above `floor` over h: what holds g down at the left end and how much more at the right one. */
static int is_clear(const spectrum *s, const place *at, const outlook *o, quad h, quad floor)
{
    quad left = 0, right = 0;
    for (int j = 0; j < s->alone; j++) {
        if (at->slope[j] >= 0) {
            right += at->slope[j] * faded(s->a[j], h);
        } else if (s->a[j] * h > 1) {
            left += at->slope[j] * faded(s->a[j], h);
        } else {
            right += at->slope[j] * h;
        }
    }
    if (s->paired || s->tripled) {
        const quad parabola = (s->tripled ? at->d1 : at->rate) * h - o->bend * h * h / 2;
        if (parabola > -o->depth) {
            right += parabola;
        } else {
            left -= o->depth;
        }
    }
    return at->value + left > floor && at->value + left + right > floor;
}

/* A bound of how far g can still move in h. */
static quad still_to_come(const spectrum *s, const place *at, const outlook *o, quad h)
{
    quad sum =
        s->tripled ? 4 * ceiling(s, at->d1, at->d2, at->d3) / s->sigma : 2 * absolute(at->r) + absolute(o->depth);
    for (int j = 0; j < s->alone; j++) {
        sum += absolute(at->slope[j]) * faded(s->a[j], h);
    }
    return sum;
}

static void advance(const spectrum *s, place *at, quad h)
{
    if (s->tripled) {
        at->value += follow(s, h, at);
        return;
    }
    for (int j = 0; j < s->alone; j++) {
        const quad gone = faded(s->a[j], h);
        at->value += at->slope[j] * gone;
        at->slope[j] -= at->slope[j] * gone * s->a[j];
    }
    if (s->paired) {
        const quad before = at->r;
        turn(s, h, &at->r, &at->rate);
        at->value += at->r - before;
    }
}

int checker_stays_positive(const spectrum *s, const watched *g, quad T, int32_t *windows)
{
    const quad nothing = (quad)1e-26;
    int order = 0;
    while (order < 4 && absolute(g->d[order]) <= nothing * g->scale[order]) {
        order++;
    }
    if (order == 4) {
        return UNSETTLED;
    }
    if (g->d[order] < 0) {
        return g->d[order] < (quad)-1e-13 * g->scale[order] ? WRONG : UNSETTLED;
    }
    place at;
    split(s, g, &at);
    quad t = 0, h = T;
    if (order > 0) {
        const quad most = bound(s, &at, order + 1);
        const quad free = most > 0 ? g->d[order] * (order + 1) / most / 2 : T;
        if (free >= T) {
            return CERTIFIED;
        }
        t = free;
        advance(s, &at, t);
        h = t;
    }
    const int ends = absolute(g->end[0]) <= (quad)1e-20 * g->end_scale;
    const quad floor = nothing * (g->scale[0] > g->end_scale ? g->scale[0] : g->end_scale);
    for (; *windows < LONGEST; ++*windows) {
        if (ends && -g->end[1] > bound(s, &at, 2) * (T - t) / 2) {
            return CERTIFIED; /* it falls all the way to its zero */
        }
        const outlook o = ahead(s, &at);
        h = 4 * h < T - t ? 4 * h : T - t;
        while (h > (quad)1e-15 * T && !is_clear(s, &at, &o, h, floor)) {
            h /= 2;
        }
        if (!(h > (quad)1e-15 * T)) {
            if (absolute(at.value) + still_to_come(s, &at, &o, T - t) < 100 * floor) {
                return CERTIFIED; /* it has faded away */
            }
            return at.value < (quad)-1e-13 * g->scale[0] ? WRONG : UNSETTLED;
        }
        if (h >= T - t) {
            return CERTIFIED;
        }
        t += h;
        advance(s, &at, h);
    }
    return UNSETTLED;
}

static quad slope_of(const spectrum *s, const place *at)
{
    quad sum = s->tripled ? at->d1 : s->paired ? at->rate : 0;
    for (int j = 0; j < s->alone; j++) {
        sum += at->slope[j];
    }
    return sum;
}

/* The zero to which g falls from a place without rising, to 14 digits; 0 if Newton's steps do not prove one. */
static int falls_to_zero(const spectrum *s, const place *at, quad within, quad *h)
{
    const quad bend = bound(s, at, 2), slope = slope_of(s, at);
    *h = slope < 0 ? -at->value / slope : within;
    if (!(*h < within) || bend * *h > -2 * slope) {
        return 0;
    }
    for (int n = 0; n < 12; n++) {
        place there = *at;
        advance(s, &there, *h);
        const quad rate = slope_of(s, &there), step = rate < 0 ? -there.value / rate : -*h;
        *h += step;
        if (!(*h > 0 && *h < within)) {
            return 0;
        }
        if (absolute(step) <= (quad)1e-14 * *h) {
            return -rate > bend * *h / 2; /* g > (-rate) x - bend x^2/2 at x before its zero */
        }
    }
    return 0;
}

/* g = d[0] + d[1] t + d[2] t^2/2: both rates are 0. */
static int zero_of_parabola(const watched *g, quad T, quad *zero)
{
    const quad c = g->d[0], b = g->d[1], a = g->d[2] / 2, inside = b * b - 4 * a * c;
    if (inside < 0 || (a == 0 && b >= 0)) {
        return NO_ZERO;
    }
    const quad root = checker_sqrt(inside);
    *zero = b < 0 ? 2 * c / (root - b) : a < 0 ? -(b + root) / (2 * a) : T;
    return *zero < T ? A_ZERO : NO_ZERO;
}

int checker_first_zero(const spectrum *s, const watched *g, quad T, quad *zero, int32_t *windows)
{
    const quad nothing = (quad)1e-26;
    int order = 0;
    while (order < 4 && absolute(g->d[order]) <= nothing * g->scale[order]) {
        order++;
    }
    *zero = T;
    if (order == 4) {
        return NO_ZERO;
    }
    if (g->d[order] < 0) {
        *zero = 0;
        return A_ZERO;
    }
    if (s->paired && s->q == 0) {
        return zero_of_parabola(g, T, zero);
    }
    place at;
    split(s, g, &at);
    quad t = 0, h = T;
    if (order > 0) {
        const quad most = bound(s, &at, order + 1);
        t = most > 0 ? g->d[order] * (order + 1) / most / 2 : T;
        if (t >= T) {
            return NO_ZERO;
        }
        advance(s, &at, t);
        h = t;
    }
    const quad floor = nothing * g->scale[0];
    for (; *windows < MOST_OF_A_MOTION; ++*windows) {
        quad ahead_of_it;
        if (falls_to_zero(s, &at, T - t, &ahead_of_it)) {
            *zero = t + ahead_of_it;
            return A_ZERO;
        }
        const outlook o = ahead(s, &at);
        h = 4 * h < T - t ? 4 * h : T - t;
        while (h > (quad)1e-28 * T && !is_clear(s, &at, &o, h, floor)) {
            h /= 2;
        }
        if (!(h > (quad)1e-28 * T)) {
            return absolute(at.value) + still_to_come(s, &at, &o, T - t) < 100 * floor ? NO_ZERO : UNKNOWN;
        }
        if (h >= T - t) {
            return NO_ZERO;
        }
        t += h;
        advance(s, &at, h);
    }
    return UNKNOWN;
}
