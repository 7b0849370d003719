/* The mode logic that the compiled peers share; the same as tests/oracle/rules.py, which explains it.
 *
 * A peer defines    static int search(const leg_t *leg, const double side[2], double z[4], double limit,
 *                                     double tolerance, double *took)
 * which moves z to the first time at which one of the six event functions comes to zero and returns which one, or
 * moves it to `limit` and returns NONE; then RUN_ALL gives it its entry point. C99 and C++11.
 */
#ifndef RULES_H
#define RULES_H

#include <math.h>
#include <string.h>

enum { X1, V1, V2, Y };
enum { NONE = -1, LIFTS, STOPS, FIRST_UP, FIRST_DOWN, SECOND_UP, SECOND_DOWN, FAILED };
enum { X1_REVERSES = 1, X1_STICKS, X1_SLIPS, X1_HITS_STOP, X2_REVERSES, X2_STICKS, X2_SLIPS };
enum { TAKEOFF = 1, REST, HORIZON, TOO_MANY_PHASES };
enum { JOB = 19, MAX_PHASES = 64, HEAD = 8, WIDTH = HEAD + 2 * MAX_PHASES };
#define LONGEST 2.0
#define FAR_AWAY 1e300

typedef struct {
    double a1_y, a1_v, a1_0, f1, a2_y, a2_v, a2_0, f2, x1_min, x1_max, rate;
} leg_t;

static inline leg_t leg_of(const double *job)
{
    const double m_eff = job[0], m_s = job[1], k = job[2], c = job[4], b1 = job[5], b2 = job[6];
    leg_t leg = {-k / m_eff, -b1 / m_eff, (k * c - job[9] * job[18]) / m_eff, job[7], k / m_s, -b2 / m_s, -job[10],
                 job[8], fmax(job[11], -FAR_AWAY), fmin(job[12], FAR_AWAY),
                 sqrt(k / m_eff + k / m_s) + b1 / m_eff + b2 / m_s};
    return leg;
}

static inline void rates(const leg_t *leg, const double side[2], const double *z, double *d)
{
    d[X1] = z[V1];
    d[V1] = side[0] != 0.0 ? leg->a1_y * z[Y] + leg->a1_v * z[V1] + leg->a1_0 - side[0] * leg->f1 : 0.0;
    d[V2] = side[1] != 0.0 ? leg->a2_y * z[Y] + leg->a2_v * z[V2] + leg->a2_0 - side[1] * leg->f2 : 0.0;
    d[Y] = z[V1] - z[V2];
}

static inline void next_rates(const leg_t *leg, const double side[2], const double *z, double *d)
{
    d[X1] = z[V1];
    d[V1] = side[0] != 0.0 ? leg->a1_y * z[Y] + leg->a1_v * z[V1] : 0.0;
    d[V2] = side[1] != 0.0 ? leg->a2_y * z[Y] + leg->a2_v * z[V2] : 0.0;
    d[Y] = z[V1] - z[V2];
}

static inline double sign(double value)
{
    return value > 0.0 ? 1.0 : (value < 0.0 ? -1.0 : 0.0);
}

static inline int blocked(const leg_t *leg, double x1, double side)
{
    return leg->x1_min >= leg->x1_max || (side < 0.0 && x1 <= leg->x1_min) || (side > 0.0 && x1 >= leg->x1_max);
}

static inline double departure(double free, double friction, double drift)
{
    if (fabs(free) == friction) {
        return free * drift >= 0.0 ? sign(drift) : 0.0;
    }
    return free > friction ? 1.0 : (free < -friction ? -1.0 : 0.0);
}

/* Where mass 0 or 1 goes from rest. */
static inline double departure_of(int mass, const leg_t *leg, const double side[2], const double *z)
{
    const double modes[2] = {mass == 0 ? 0.0 : side[0], mass == 1 ? 0.0 : side[1]};
    const double a_y = mass == 0 ? leg->a1_y : leg->a2_y;
    const double free = a_y * z[Y] + (mass == 0 ? leg->a1_0 : leg->a2_0);
    const double friction = mass == 0 ? leg->f1 : leg->f2;
    double drift = 0.0;
    if (fabs(free) == friction) {
        double d1[4], d2[4];
        rates(leg, modes, z, d1);
        next_rates(leg, modes, d1, d2);
        drift = a_y * (d1[Y] != 0.0 ? d1[Y] : d2[Y]);
    }
    const double goes = departure(free, friction, drift);
    return mass == 0 && blocked(leg, z[X1], goes) ? 0.0 : goes;
}

/* Six functions, positive within a mode. */
static inline void event_functions(const leg_t *leg, const double side[2], const double *z, double *g)
{
    g[LIFTS] = z[Y];
    g[STOPS] = FAR_AWAY;
    g[FIRST_DOWN] = g[SECOND_DOWN] = 1.0;
    if (side[0] != 0.0) {
        g[STOPS] = side[0] > 0.0 ? leg->x1_max - z[X1] : z[X1] - leg->x1_min;
        g[FIRST_UP] = side[0] * z[V1];
    } else {
        const double free = leg->a1_y * z[Y] + leg->a1_0;
        g[FIRST_UP] = blocked(leg, z[X1], 1.0) ? 1.0 : leg->f1 - free;
        g[FIRST_DOWN] = blocked(leg, z[X1], -1.0) ? 1.0 : leg->f1 + free;
    }
    if (side[1] != 0.0) {
        g[SECOND_UP] = side[1] * z[V2];
    } else {
        const double free = leg->a2_y * z[Y] + leg->a2_0;
        g[SECOND_UP] = leg->f2 - free;
        g[SECOND_DOWN] = leg->f2 + free;
    }
}

static inline void slopes(const leg_t *leg, const double side[2], const double *d, double *g)
{
    g[LIFTS] = d[Y];
    g[STOPS] = -side[0] * d[X1];
    g[FIRST_UP] = side[0] != 0.0 ? side[0] * d[V1] : -leg->a1_y * d[Y];
    g[FIRST_DOWN] = side[0] != 0.0 ? 0.0 : leg->a1_y * d[Y];
    g[SECOND_UP] = side[1] != 0.0 ? side[1] * d[V2] : -leg->a2_y * d[Y];
    g[SECOND_DOWN] = side[1] != 0.0 ? 0.0 : leg->a2_y * d[Y];
}

/* A first step within which no function that starts at zero has returned to zero. */
static inline double first_step(const leg_t *leg, const double side[2], const double *z)
{
    double d1[4], d2[4], d3[4], g0[6], g1[6], g2[6], g3[6];
    rates(leg, side, z, d1);
    next_rates(leg, side, d1, d2);
    next_rates(leg, side, d2, d3);
    event_functions(leg, side, z, g0);
    slopes(leg, side, d1, g1);
    slopes(leg, side, d2, g2);
    slopes(leg, side, d3, g3);
    double h = 0.05 / leg->rate;
    for (int n = 0; n < 6; n++) {
        if (g0[n] == 0.0) {
            if (fabs(g1[n]) * leg->rate > 1e-7 * fabs(g2[n])) {
                h = g2[n] != 0.0 ? fmin(h, 0.5 * fabs(g1[n] / g2[n])) : h;
            } else if (g3[n] != 0.0) {
                h = fmin(h, 0.5 * fabs(g2[n] / g3[n]));
            }
        }
    }
    return fmax(h, 1e-9 / leg->rate);
}

static inline void begin(const double *job, const leg_t *leg, double *z, double side[2])
{
    z[X1] = job[15];
    z[V1] = job[16];
    z[V2] = job[17];
    z[Y] = 0.0;
    side[0] = sign(z[V1]);
    side[1] = sign(z[V2]);
    if (side[0] != 0.0 && blocked(leg, z[X1], side[0])) {
        z[V1] = side[0] = 0.0;
    }
    const int rests[2] = {side[0] == 0.0, side[1] == 0.0};
    for (int n = 0; n < 4; n++) {
        side[n % 2] = rests[n % 2] ? departure_of(n % 2, leg, side, z) : side[n % 2];
    }
}

/* State, modes and kind of the event (0: a touch) after an event function has come to zero. */
static inline int pass_event(const leg_t *leg, double side[2], double *z, int which)
{
    if ((which == STOPS || which == FIRST_UP) && side[0] != 0.0) {
        const double before = side[0], stop = before > 0.0 ? leg->x1_max : leg->x1_min;
        const int hits = which == STOPS || fabs(z[X1] - stop) <= 1e-13;
        z[X1] = hits ? stop : z[X1];
        z[V1] = 0.0;
        side[0] = departure_of(0, leg, side, z);
        return hits ? X1_HITS_STOP : (side[0] == 0.0 ? X1_STICKS : (side[0] != before ? X1_REVERSES : 0));
    }
    if (which == FIRST_UP || which == FIRST_DOWN) {
        side[0] = which == FIRST_UP ? 1.0 : -1.0;
        return X1_SLIPS;
    }
    if (which == SECOND_UP && side[1] != 0.0) {
        const double before = side[1];
        z[V2] = 0.0;
        side[1] = departure_of(1, leg, side, z);
        return side[1] == 0.0 ? X2_STICKS : (side[1] != before ? X2_REVERSES : 0);
    }
    side[1] = which == SECOND_UP ? 1.0 : -1.0;
    return X2_SLIPS;
}

static int search(const leg_t *leg, const double side[2], double z[4], double limit, double tolerance, double *took);

static inline void chain(const double *job, double tolerance, double *answer)
{
    const leg_t leg = leg_of(job);
    double z[4], side[2], t = 0.0;
    int phases = 1, count = 0, ending = TOO_MANY_PHASES;
    begin(job, &leg, z, side);
    while (phases <= MAX_PHASES) {
        if (side[0] == 0.0 && side[1] == 0.0) {
            ending = REST;
            break;
        }
        double took = 0.0;
        const int which = search(&leg, side, z, LONGEST - t, tolerance, &took);
        t += took;
        if (which == NONE || which == LIFTS || which == FAILED) {
            ending = which == NONE ? HORIZON : (which == LIFTS ? TAKEOFF : 0);
            break;
        }
        const int kind = pass_event(&leg, side, z, which);
        phases++;
        if (kind != 0 && phases <= MAX_PHASES) {
            answer[HEAD + 2 * count] = t;
            answer[HEAD + 2 * count + 1] = (double)kind;
            count++;
        }
    }
    const double w0 = job[15], w = z[X1] - z[Y];
    const double aed = 0.5 * job[1] * (z[V2] - job[17]) * (z[V2] + job[17]) + job[1] * job[10] * (w - w0)
                       + 0.5 * job[2] * (w - w0) * (w + w0);
    const double head[HEAD] = {(double)ending, t, z[X1], z[V1], z[V2], ending == TAKEOFF ? 0.0 : z[Y], aed,
                               (double)count};
    memcpy(answer, head, sizeof head);
}

/* The entry point: all jobs, `loops` times over. */
#define RUN_ALL(name)                                                                                                \
    void name(const double *jobs, int count, double tolerance, int loops, double *answers)                           \
    {                                                                                                                \
        for (int loop = 0; loop < loops; loop++) {                                                                   \
            for (int n = 0; n < count; n++) {                                                                        \
                chain(jobs + (size_t)n * JOB, tolerance, answers + (size_t)n * WIDTH);                               \
            }                                                                                                        \
        }                                                                                                            \
    }

#endif
