/* A judge of stances: given a robot, a start and the chain of phases that a solver returned, it says in 113 bits
 * whether that chain is what the equations of motion (3), (4) do. It shares no code and no method with the solvers that
 * it judges.
 *
 * Positions are x = x_1 and the compression y = x_1 - x_2 + L_0 + c; SI units.
 */
#ifndef CHECKER_H
#define CHECKER_H

#include <float.h>
#include <stdint.h>

#if LDBL_MANT_DIG == 113
typedef long double quad;
#else
typedef __float128 quad;
#endif

enum { TAKEOFF = 1, REST, HORIZON, TOO_MANY_PHASES };
enum { NOTHING, X1_REVERSES, X1_STICKS, X1_SLIPS, X1_HITS_STOP, X2_REVERSES, X2_STICKS, X2_SLIPS };
enum { CERTIFIED, UNSETTLED, WRONG };

/* Why a stance is not certified. */
enum {
    FINE,
    START_MODE,      /* the modes at t = 0 */
    TAKES_OFF_AT_0,  /* it should, or it should not */
    BAD_WORD,        /* an event that these modes cannot have */
    NO_SUCH_ZERO,    /* nothing is zero where the event is said to be */
    TIME_RUNS_BACK,  /* two events in the wrong order, or a tie */
    HOLD_RULE,       /* sticks, reverses or goes on against |a| <= f at rest */
    WRONG_DIRECTION, /* a crossing that is none, or a touch */
    PASSED_STOP,     /* beyond a stop */
    MISSED,          /* an event between two events */
    NO_REST,         /* something can move */
    NO_HORIZON,      /* the ending is not at the horizon */
    POLES,           /* the poles could not be found to enough digits */
    TOO_MANY_STEPS   /* of the walk along a phase */
};

typedef struct {
    double m_eff, m_s, k, L0, c, b1, b2, f1, f2, gamma2, g, x1_min, x1_max, u_max, impact_loss;
    double f1_excess, f2_excess;
    double x1, v1, v2, y; /* the start */
    double u, horizon;
} checker_problem;

typedef struct {
    double t, x1, v1, v2, y;
    int8_t mode, event;
    uint16_t step;
} checker_phase;

typedef struct {
    double duration, x1, v1, v2, y, aed;
    int32_t ending, count; /* phases, of which the first is at `first` in the common array */
    int64_t first;
} checker_answer;

typedef struct {
    int32_t outcome, reason, phase, windows;
    double error_state, error_aed;         /* scaled, not divided by the condition */
    double condition_state, condition_aed; /* infinite if a perturbed chain cannot be followed */
} checker_verdict;

/* Judge `count` stances; conditions are computed only if asked for. */
void checker_judge(const checker_problem *problems, const checker_answer *answers, const checker_phase *phases,
                   int64_t count, int32_t with_condition, checker_verdict *verdicts);

/* ---- what the parts of the checker share ---- */

static inline quad absolute(quad x)
{
    return x < 0 ? -x : x;
}

quad checker_expm1(quad x); /* exp(x) - 1 for x <= 1 */
quad checker_sqrt(quad x);

/* Poles of a motion, in groups whose members are near one another: real ones that stand alone, and a pair or three. */
typedef struct {
    int alone;  /* how many real poles stand alone */
    quad a[3];  /* their rates */
    int paired; /* s^2 + p s + q: a complex pair, or two real rates within a factor 4 */
    quad p, q;
    int tripled; /* (s + sigma)^3 + Q (s + sigma) + T with Q, T small */
    quad sigma, s1, s2, s3;
} spectrum;

/* The factors of s^3 + s1 s^2 + s2 s + s3; 0 if they are not found to enough digits. */
int checker_spectrum_of_three(quad s1, quad s2, quad s3, spectrum *out);
void checker_spectrum_of_two(quad p, quad q, spectrum *out);

/* A function that must stay positive in (0, T): value and three derivatives at 0, and the first two of them at T. */
typedef struct {
    quad d[4];
    quad scale[4]; /* sums of the magnitudes that d[n] is made of */
    quad end[2];
    quad end_scale;
} watched;

/* CERTIFIED if it is positive in between; it may be zero at either end. */
int checker_stays_positive(const spectrum *poles, const watched *g, quad T, int32_t *windows);

enum { NO_ZERO, A_ZERO, UNKNOWN };

/* Whether it has a zero in [0, T), and the first one to 14 digits; it may be zero at 0 and rise from there. */
int checker_first_zero(const spectrum *poles, const watched *g, quad T, quad *zero, int32_t *windows);

#endif
