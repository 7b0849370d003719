/* SPDX-License-Identifier: MIT-0
 *
 * What happens first in a phase, with nothing stepped over.
 *
 * For g = y, v_1, v_2 or a free acceleration, m = (d/dt + a) g' = exp(-a t) d/dt(exp(a t) g') is a motion of the pair
 * of poles alone: A R' + B R. In a window shorter than a half turn of the pair it has at most one zero, so a sign that
 * is the same at both ends is kept in between; then exp(a t) g' is monotone, g' has at most one root, and the signs of
 * g and g' at the ends tell how often g vanishes. A window that is not decided so is cut in two where m has its zero.
 */
#ifndef HOPFORM_EVENTS_H_real
#define HOPFORM_EVENTS_H_real

#include <stdbool.h>

#include "kernels_real.h"

/* g and its derivatives at one time; `turning` is m, `noise` is what rounding may have done to g. */
typedef struct {
    real value;
    real rate;
    real curvature;
    real third;
    real turning;
    real noise;
} hopform_sample_real;

/* A function g(t) = start + rise(t), times the sign with which it begins, watched until it falls below zero. */
typedef struct {
    hopform_numerator_real numerator;
    hopform_pair_numerator_real left; /* of the numerator behind the real pole: A, B of m */
    real start;
    int32_t kind;
    int32_t side;
} hopform_watch_real;

static inline hopform_watch_real hopform_watch_of_real(const hopform_poles_real *poles, real H3, real H2, real H1,
                                                       real start, real sign, int32_t kind, int32_t side)
{
    const hopform_numerator_real numerator = {sign * H3, sign * H2, sign * H1};
    const hopform_watch_real watch = {numerator, hopform_behind_the_pole_real(poles, &numerator), sign * start, kind,
                                      side};
    return watch;
}

/* m; where the pair has faded against the real pole it is lost in W, and taken from the pair itself. */
static inline real hopform_turning_at_real(const hopform_poles_real *poles, const hopform_pair_numerator_real *left,
                                           const hopform_basis_real *basis, real t)
{
    if (poles->a > 0.0 && (0.5 * poles->p - poles->a) * t > 10.0) {
        const hopform_pair_real pair = hopform_pair_at_real(poles, t);
        return left->A * pair.Rd + left->B * pair.R;
    }
    return hopform_turning_real(poles, left, basis);
}

/* g and three derivatives, all that a step towards a root takes. */
static inline hopform_sample_real hopform_course_at_real(const hopform_watch_real *watch,
                                                         const hopform_poles_real *poles,
                                                         const hopform_basis_real *basis)
{
    const hopform_rise_real rise = hopform_rises_real(poles, &watch->numerator, basis);
    const hopform_sample_real sample = {
        watch->start + rise.rise, rise.rise_rate, rise.rise_curvature, rise.rise_third, 0.0, 0.0};
    return sample;
}

static inline hopform_sample_real hopform_sample_at_real(const hopform_watch_real *watch,
                                                         const hopform_poles_real *poles,
                                                         const hopform_basis_real *basis, real t)
{
    const hopform_numerator_real *h = &watch->numerator;
    hopform_sample_real sample = hopform_course_at_real(watch, poles, basis);
    sample.turning = hopform_turning_at_real(poles, &watch->left, basis, t);
    sample.noise = 16.0 * HOPFORM_EPS_real
                   * (fabs_real(watch->start) + fabs_real(h->H3 * basis->Wd) + fabs_real(h->H2 * basis->W)
                      + fabs_real(h->H1 * basis->W1) + t * fabs_real(sample.rate));
    return sample;
}

/* How much later than t the root next to it is. Where the poles have faded, the start and the rise cancel, and with
 * them most digits of the time; the final value and what is left of the way to it do not. 0 where they tell no more.
 */
static inline real hopform_root_is_later_real(const hopform_poles_real *poles, const hopform_numerator_real *h,
                                              real start, real settled, const hopform_basis_real *basis, real t)
{
    const real way = settled - start;
    const bool slow = poles->s_3 > 0.0; /* else W does not fade, but is not in it */
    const real by_2 = way * poles->s_2;
    const hopform_numerator_real fading = {h->H3, slow ? h->H2 : by_2, h->H1};
    const real value = settled - hopform_left_to_go_real(poles, &fading, basis, way);
    const real rate = h->H3 * basis->Wdd + h->H2 * basis->Wd + h->H1 * basis->W;
    const real of_time = t * fabs_real(rate);
    const real of_rise = fabs_real(start) + fabs_real(h->H3 * basis->Wd) + fabs_real(h->H2 * basis->W)
                         + fabs_real(h->H1 * basis->W1) + of_time;
    const real of_way = fabs_real(settled) + fabs_real(way * basis->Wdd)
                        + (fabs_real(h->H3) + fabs_real(way * poles->s_1)) * fabs_real(basis->Wd)
                        + (slow ? fabs_real(h->H2) + fabs_real(by_2) : 0.0) * fabs_real(basis->W) + of_time;
    const bool tells =
        (rate < 0.0) & (of_way < 0.25 * of_rise) & (fabs_real(value) <= 16.0 * HOPFORM_EPS_real * of_rise);
    const real later = -value / (tells ? rate : -1.0);
    const bool counts = (fabs_real(later) < 0.01 * t) & (fabs_real(later) > 16.0 * HOPFORM_EPS_real * t);
    return (tells & counts) ? later : 0.0;
}

/* The same at t = 0 of the phase. */
static inline hopform_sample_real hopform_first_sample_real(const hopform_watch_real *watch,
                                                            const hopform_poles_real *poles)
{
    const hopform_numerator_real *h = &watch->numerator;
    hopform_sample_real sample;
    sample.value = watch->start;
    sample.rate = h->H3;
    sample.curvature = h->H2 - h->H3 * poles->s_1;
    sample.third = h->H1 - h->H2 * poles->s_1 + h->H3 * (poles->s_1 * poles->s_1 - poles->s_2);
    sample.turning = watch->left.A;
    sample.noise = 16.0 * HOPFORM_EPS_real * fabs_real(watch->start);
    return sample;
}

/* The pair's frequency, 0 if its poles are real. */
static inline real hopform_frequency_real(const hopform_poles_real *poles)
{
    const real mean = 0.5 * poles->p;
    const real square = poles->q - mean * mean;
    return square > 0.0 ? sqrt_real(square) : 0.0;
}

/* Time to the root of g if it swung with the frequency w about a constant, NEVER if it keeps its sign for a half turn.
 */
static inline real hopform_swing_to_zero_real(const hopform_sample_real *from, real w)
{
    if (!(w * w > 0.0)) {
        return HOPFORM_NEVER_real;
    }
    const real per_w = 1.0 / w;
    const real slope = from->rate * per_w;
    const real bend = 2.0 * from->curvature * (per_w * per_w);
    const real value = from->value > 0.0 ? from->value : 0.0;
    const real discriminant = slope * slope - (value + bend) * value;
    if (!(discriminant >= 0.0)) {
        return HOPFORM_NEVER_real;
    }
    /* (value + bend) T^2 + 2 slope T + value = 0 with T = tan(w t/2); from zero the other root. */
    const real above = value > 0.0 ? value : -2.0 * slope;
    const real below = value > 0.0 ? sqrt_real(discriminant) - slope : bend;
    const bool falls = value > 0.0 ? below > 0.0 : (slope > 0.0 && below < 0.0);
    if (!falls) {
        return HOPFORM_NEVER_real;
    }
    const bool far = fabs_real(above) > fabs_real(below);
    const real near = far ? below / above : above / below;
    const real angle = near * (1.0584 - 0.273 * near); /* atan to 0.004 */
    return 2.0 * (far ? 1.5708 - angle : angle) * per_w;
}

/* From `t` to the root, nearer: a step of Halley's on what g's value and derivatives at the start make of all three
 * poles,
 *
 *     g = value - X - slow (1 - exp(-a t))/a + exp(-m t) (X cos(w t) + B sin(w t)),
 *
 * exp, sin and cos to about 1e-5 within a half turn. It guesses: no bound rests on it. */
static inline real hopform_swing_step_real(const hopform_poles_real *poles, const hopform_sample_real *from, real w,
                                           real t)
{
    const real a = poles->a;
    const real m = 0.5 * poles->p;
    const real chi = hopform_residue_real(poles);
    const real slow = -(from->third + poles->p * from->curvature + poles->q * from->rate) / (chi > 0.0 ? chi : 1.0);
    const real X = -(from->curvature + poles->p * from->rate + slow * (poles->p - a)) / poles->q;
    const real B = (from->rate + slow + m * X) / w;
    const real y = w * t - 1.5707964;
    const real yy = y * y;
    const real sine = 0.9999933 - yy * (0.4999124 - yy * (0.0414877 - yy * 0.0012712));
    const real cosine = -y * (0.9999966 - yy * (0.1666482 - yy * (0.0083063 - yy * 0.0001836)));
    const real fade = 0.5 * m * t;
    const real decay = 0.5 * a * t;
    const real left = 1.0 - 12.0 * fade / (12.0 + 6.0 * fade + fade * fade); /* the root of exp(-m t) */
    const real share = 12.0 / (12.0 + 6.0 * decay + decay * decay);
    const real gone = 0.5 * t * share * (2.0 - decay * share);
    const real swings = left * left * (X * cosine + B * sine);
    const real turned = left * left * (B * cosine - X * sine);
    const real still = slow * (1.0 - a * gone);
    const real value = from->value - X - slow * gone + swings;
    const real rate = w * turned - m * swings - still;
    const real curvature = a * still + (m * m - w * w) * swings - 2.0 * m * w * turned;
    const real below = rate * rate - 0.5 * value * curvature;
    return below > 0.0 ? value * rate / below : 0.0;
}

/* What a window says about g. */
typedef enum { KEEPS_SIGN_real, LOSES_SIGN_real, DIPS_real, UNDECIDED_real } hopform_verdict_real;

/* Whether g, which falls at the start of a window of length h, is kept above zero by its tangents: where exp(a t) g'
 * rises, g stays above the one at the start, and above one a little steeper than at the end, where it is `value`. */
static inline bool hopform_is_held_up_real(const hopform_sample_real *from, const hopform_sample_real *to, real value,
                                           real a, real h)
{
    if (from->turning < 0.0 || to->turning < 0.0) {
        return false;
    }
    const real last = a * h < 1.0 ? to->rate * (1.0 + a * h) : HOPFORM_NEVER_real;
    const real steeper = last - from->rate;
    const real cross = fabs_real(steeper) > 0.0 ? (from->value - value + last * h) / steeper : h;
    const real reach = cross < h ? (cross > 0.0 ? cross : 0.0) : h;
    return from->value + from->rate * reach > from->noise + to->noise;
}

/* Whether g, positive (or about to be) at the start of a window of length h, keeps its sign to the end of it, where it
 * is `value`.
 *
 * LOSES_SIGN: it has exactly one root. DIPS: it has one minimum inside, which may lie below zero.
 */
static inline hopform_verdict_real hopform_judge_real(const hopform_sample_real *from, const hopform_sample_real *to,
                                                      real value, real a, real h, bool short_of_quarter)
{
    /* What has faded away has no sign to go by, and what it may hide is looked for. */
    const bool pauses = !(fabs_real(to->rate) * h > to->noise);
    const bool turns =
        from->turning * to->turning < 0.0 || (fabs_real(from->turning) > 0.0 && !(fabs_real(to->turning) > 0.0));
    const bool keeps_direction = pauses ? turns : (from->rate < 0.0) == (to->rate < 0.0);
    bool monotone = keeps_direction;
    if (turns && keeps_direction && (from->rate < 0.0) == (from->turning > 0.0)) {
        /* exp(a t) g' comes nearer to zero and goes back: by no more than the integral of |m|. */
        const real growth = a * h < 1.0 ? 1.0 + 2.0 * a * h : HOPFORM_NEVER_real;
        monotone = short_of_quarter && fabs_real(from->rate) > fabs_real(from->turning) * h * growth;
        if (!monotone) {
            const real least = from->rate < to->rate * growth ? from->rate : to->rate * growth;
            /* A rate that begins above zero falls by no more than g'' = m - a g' lets it while m is below. */
            const real lowest =
                short_of_quarter ? -fabs_real(from->turning) * (a * h < 1.0 ? h : 1.0 / a) : -HOPFORM_NEVER_real;
            const real steepest = from->rate < 0.0 ? least : lowest;
            const bool far = value > 0.0 && from->value + steepest * h > from->noise + to->noise;
            return far ? KEEPS_SIGN_real : UNDECIDED_real;
        }
    }
    /* Below zero by more than rounding, or so steep that the root is near; else it touches, or has faded away. */
    if (value < 0.0 && (value < -to->noise || to->rate * h < -to->noise)) {
        return LOSES_SIGN_real;
    }
    if (monotone || !(from->rate < 0.0)) {
        return KEEPS_SIGN_real;
    }
    return hopform_is_held_up_real(from, to, value, a, h) ? KEEPS_SIGN_real : DIPS_real;
}

/* Where m, which has changed its sign within a window, has its zero: the chord's, kept off the ends. */
static inline real hopform_turn_between_real(const hopform_sample_real *from, const hopform_sample_real *to, real h)
{
    const real share = fabs_real(to->turning) > 0.0 ? from->turning / (from->turning - to->turning) : 0.25;
    const real inside = share > 0.015625 ? (share < 0.984375 ? share : 0.984375) : 0.015625;
    return inside * h;
}

/* Householder's step of third order towards a root of g, from its value and three derivatives. */
static inline real hopform_step_to_root_real(const hopform_sample_real *at)
{
    const real rate2 = at->rate * at->rate;
    const real below =
        6.0 * rate2 * at->rate - 6.0 * at->value * at->rate * at->curvature + at->value * at->value * at->third;
    return fabs_real(below) > 0.0 ? at->value * (6.0 * rate2 - 3.0 * at->value * at->curvature) / below
                                  : HOPFORM_NEVER_real;
}

/* The fourth derivative of a watched function but for its sign: the poles give it from the others. */
static inline real hopform_fourth_real(const hopform_poles_real *poles, const hopform_sample_real *at)
{
    return poles->s_1 * at->third + poles->s_2 * at->curvature + poles->s_3 * at->rate;
}

/* Whether what a Taylor series of the fourth order leaves out over a time d before or after t is lost in rounding: of
 * the fifth order in d/t and in r d, r above all poles. */
static inline bool hopform_is_near_real(const hopform_poles_real *poles, real t, real d)
{
    const real share = t > 0.0 ? d / t : 1.0;
    const real square = d * d * (poles->s_1 * poles->s_1 + poles->s_2) + share * share;
    return square * square * square <= 0.0078125 * HOPFORM_EPS_real;
}

/* True where one more of these steps lands on the root to rounding, and W can be carried there. Its error is of the
 * fourth order in the step: products of the derivatives up to the fourth, which do not change over a time that is short
 * for all poles. A step is also short where its numerator vanishes. */
static inline bool hopform_is_last_step_real(const hopform_poles_real *poles, const hopform_sample_real *at,
                                             real fourth, real t, real step)
{
    const real per_rate = fabs_real(step) / (fabs_real(at->rate) > 0.0 ? fabs_real(at->rate) : 1.0);
    const real bend = per_rate * fabs_real(at->curvature);
    const real twist = per_rate * fabs_real(step * at->third);
    const real error = bend * (0.7 * bend * bend + 0.5 * twist) + 0.05 * per_rate * fabs_real(step * step * fourth);
    return fabs_real(at->value) <= 2.0 * fabs_real(step * at->rate) && fabs_real(step) * error <= HOPFORM_EPS_real * t
           && hopform_is_near_real(poles, t, step);
}

/* A time, what the poles do until then, and g there. */
typedef struct {
    real t;
    hopform_basis_real basis;
    hopform_sample_real at;
} hopform_point_real;

static inline hopform_point_real hopform_point_at_real(const hopform_watch_real *watch, const hopform_poles_real *poles,
                                                       real t)
{
    hopform_point_real point;
    point.t = t;
    point.basis = hopform_basis_at_real(poles, t);
    point.at = hopform_sample_at_real(watch, poles, &point.basis, t);
    return point;
}

static inline hopform_basis_real hopform_carried_basis_real(const hopform_poles_real *poles,
                                                            const hopform_basis_real *from, real d)
{
    const hopform_carried_real later = hopform_carry_real(poles, from, d);
    const hopform_basis_real basis = {later.Wdd_t, later.Wd_t, later.W_t, later.W1_t, later.W2_t};
    return basis;
}

/* g at a time t that is this near to a point, from what the poles do there. */
static inline hopform_point_real hopform_carried_to_real(const hopform_watch_real *watch,
                                                         const hopform_poles_real *poles,
                                                         const hopform_point_real *from, real t)
{
    hopform_point_real point = {t, hopform_carried_basis_real(poles, &from->basis, t - from->t), from->at};
    point.at = hopform_sample_at_real(watch, poles, &point.basis, t);
    return point;
}

/* The one root of g between a time where g > 0 and a point where g < 0: Householder's steps, kept in the bracket. */
static inline hopform_point_real hopform_root_between_real(const hopform_watch_real *watch,
                                                           const hopform_poles_real *poles, real low,
                                                           hopform_point_real last)
{
    hopform_point_real high = last;
    for (int n = 0; n < 100; n++) {
        if (fabs_real(last.at.value)
            <= HOPFORM_EPS_real * last.t * fabs_real(last.at.rate)) { /* Newton's step: the other is 0 at an extremum */
            return last;
        }
        const real step = hopform_step_to_root_real(&last.at);
        real next = last.t - step;
        if (next > low && next < high.t
            && hopform_is_last_step_real(poles, &last.at, hopform_fourth_real(poles, &last.at), next, step)) {
            return hopform_carried_to_real(watch, poles, &last, next);
        }
        if (!(next > low && next < high.t) || (n > 8 && n % 2 == 1)) {
            next = low + 0.5 * (high.t - low);
        }
        if (!(next > low && next < high.t)) {
            return high;
        }
        last = hopform_point_at_real(watch, poles, next);
        if (last.at.value > 0.0) {
            low = next;
        } else if (last.at.value < 0.0) {
            high = last;
        } else {
            return last;
        }
    }
    return high;
}

/* An extremum of x_1, counted from a stop, that is this near to it touches it: 16 ulp of the terms. */
static inline real hopform_touch_real(const hopform_motion_real *motion, const hopform_state_real *start,
                                      const hopform_basis_real *basis)
{
    return 16.0 * HOPFORM_EPS_real
           * (fabs_real(start->x1) + fabs_real(start->v1 * basis->Wd) + fabs_real(motion->N2_1 * basis->W)
              + fabs_real(motion->N1_1 * basis->W1) + fabs_real(motion->N0_1 * basis->W2));
}

/* How far x_1 is beyond a stop, from which `start` counts it, how fast it gets there, and its further derivatives. */
typedef struct {
    hopform_sample_real at;
    real fourth;
} hopform_approach_real;

static inline hopform_approach_real hopform_approach_of_real(const hopform_poles_real *poles,
                                                             const hopform_motion_real *motion,
                                                             const hopform_state_real *start, real sign,
                                                             const hopform_basis_real *basis)
{
    const hopform_numerator_real h = {motion->H3_1, motion->H2_1, motion->H1_1};
    const hopform_rise_real rise = hopform_rises_real(poles, &h, basis);
    const hopform_at_real at = hopform_state_at_real(start, motion, basis);
    const hopform_sample_real beyond = {
        sign * at.x1_t, sign * at.v1_t, sign * rise.rise_rate, sign * rise.rise_curvature, 0.0, 0.0};
    const hopform_approach_real to = {beyond, sign * rise.rise_third};
    return to;
}

/* The root of g that Householder's steps find from a guess, if it is between two times and g falls there; else `t` is
 * 0. */
static inline hopform_point_real hopform_root_ahead_real(const hopform_watch_real *watch,
                                                         const hopform_poles_real *poles, real low, real guess,
                                                         real high)
{
    hopform_point_real none = {0.0, {1.0, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
    real t = guess;
    for (int n = 0; n < 6; n++) {
        hopform_point_real point;
        point.t = t;
        point.basis = hopform_basis_at_real(poles, t);
        point.at = hopform_course_at_real(watch, poles, &point.basis);
        const real step = hopform_step_to_root_real(&point.at);
        t = point.t - step;
        if (!(point.at.rate < 0.0)) {
            return none;
        }
        if (fabs_real(point.at.value) <= HOPFORM_EPS_real * point.t * fabs_real(point.at.rate)) {
            point.at = hopform_sample_at_real(watch, poles, &point.basis, point.t);
            return point;
        }
        if (!(t > low && t < high)) {
            return none;
        }
        if (hopform_is_last_step_real(poles, &point.at, hopform_fourth_real(poles, &point.at), t, step)) {
            return hopform_carried_to_real(watch, poles, &point, t);
        }
    }
    return none;
}

/* The minimum of g between two times, in a window shorter than a half turn, between which its rate becomes positive;
 * ends early where g < 0 is found, or where g is known to stay above zero. */
static inline hopform_point_real hopform_bottom_between_real(const hopform_watch_real *watch,
                                                             const hopform_poles_real *poles, real low,
                                                             const hopform_sample_real *at_low, real high,
                                                             const hopform_sample_real *at_high)
{
    hopform_sample_real before = *at_low;
    hopform_sample_real after = *at_high;
    const real turn = before.rate - after.rate;
    const real first = low + (high - low) * (turn < 0.0 ? before.rate / turn : 0.5);
    hopform_point_real last =
        hopform_point_at_real(watch, poles, first > low && first < high ? first : low + 0.5 * (high - low));
    for (int n = 0; n < 100 && !(last.at.value < -last.at.noise); n++) {
        if (last.at.rate < 0.0) {
            low = last.t;
            before = last.at;
        } else { /* a rate that has faded to 0 lies behind the extremum */
            high = last.t;
            after = last.at;
        }
        if (hopform_is_held_up_real(&before, &after, after.value, poles->a, high - low)) {
            break;
        }
        const bool usable = fabs_real(last.at.curvature) > 0.0;
        const real step = usable ? last.at.rate / last.at.curvature : 0.0;
        if (usable && fabs_real(step) <= 0.001 * HOPFORM_ROOT_EPS_real * last.t) {
            break;
        }
        real next = last.t - step;
        if (!usable || !(next > low && next < high) || (n > 8 && n % 2 == 1)) {
            next = low + 0.5 * (high - low);
        }
        if (!(next > low && next < high)) {
            break;
        }
        last = hopform_point_at_real(watch, poles, next);
    }
    return last;
}

/* When a mass that slips alone comes to rest, NEVER if it does not: v and v' = acc at t = 0, times its sign.
 *
 * v'' + p v' + q v = 0 without a constant force, so v keeps its relative accuracy however far it has faded: its first
 * zero is where v cos(w t) + (acc + p v/2) sin(w t)/w is 0, or where two decays have become equal.
 */
static inline real hopform_halt_time_real(const hopform_poles_real *poles, real v, real acc)
{
    const real mean = 0.5 * poles->p;
    const real discriminant = mean * mean - poles->q;
    if (!(v > 0.0)) { /* from rest a mass swings for a half turn, or creeps */
        return acc > 0.0 ? (discriminant < 0.0 ? 3.141592653589793 / sqrt_real(-discriminant) : HOPFORM_NEVER_real)
                         : (acc < 0.0 ? 0.0 : HOPFORM_NEVER_real);
    }
    if (discriminant < 0.0) {
        const real omega = sqrt_real(-discriminant);
        return hopform_angle_real(-(acc + mean * v) / omega, v) / omega;
    }
    const real half = sqrt_real(discriminant);
    const real slow = mean + half > 0.0 ? poles->q / (mean + half) : 0.0;
    const real back = -(acc + slow * v); /* what the slow decay alone would leave over */
    const real x = back > 0.0 ? 2.0 * half * (v / back) : 1.0;
    if (!(x < 1.0)) {
        return HOPFORM_NEVER_real;
    }
    const real s = x / (2.0 - x);
    if (s < 0.1716) {
        return 2.0 * (v / back) * hopform_area_tangent_real(s) / (2.0 - x);
    }
    const real ratio = -(acc + (mean + half) * v) / back;
    return ratio > 0.0 ? -hopform_log_real(ratio) / (2.0 * half) : HOPFORM_NEVER_real;
}

/* True if g has no root in [from, to]: its slow part, monotone, stays larger than the oscillation around it. */
static inline bool hopform_is_quiet_real(const hopform_watch_real *watch, const hopform_poles_real *poles, real from,
                                         real to)
{
    const real mean = 0.5 * poles->p;
    const real omega = hopform_frequency_real(poles);
    const real chi = hopform_residue_real(poles);
    const hopform_decay_real now = hopform_decay_at_real(poles->a, from);
    const hopform_decay_real then = hopform_decay_at_real(poles->a, to);
    const hopform_ringing_real first = hopform_ringing_at_real(poles, chi, &watch->numerator, &now);
    const hopform_ringing_real last = hopform_ringing_at_real(poles, chi, &watch->numerator, &then);
    const real from_zero = watch->start + first.slow;
    const real to_zero = watch->start + last.slow;
    const real amplitude = fabs_real(first.X) + fabs_real((first.Y - mean * first.X) / omega);
    const real least = from_zero < to_zero ? from_zero : to_zero;
    return least > 1.001 * amplitude * hopform_exp_real(-mean * from);
}

#endif
