/* What the judges of mutants share: how an error is printed, a generator of numbers, robots drawn from it, and how work
 * is counted. */
#ifndef CHECKS_H
#define CHECKS_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "events_f64.h"

#define T(name) hopform_##name##_f64

static int row;
static int wrong;
static double worst;
static int verbose;
static int prints_work;
static unsigned long blocks;

void __sanitizer_cov_trace_pc(void);

void __sanitizer_cov_trace_pc(void)
{
    blocks++;
}

static void fail(const char *what, double share)
{
    if (verbose) {
        printf("row %d: %s (%g of what is allowed)\n", row, what, share);
    }
    if (wrong++ > 20 || !verbose) {
        exit(1);
    }
}

static void must(int truth, const char *what)
{
    if (!truth) {
        fail(what, INFINITY);
    }
}

static void near(double got, double wanted, double allowed, const char *what)
{
    const double share = fabs(got - wanted) / allowed;
    if (!(share <= 1.0)) {
        fail(what, share);
    } else if (share > worst) {
        worst = share;
    }
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static uint64_t dice = 88172645463325252u; /* Marsaglia, "Xorshift RNGs", 2003 */

static double uniform(double low, double high)
{
    dice ^= dice << 13;
    dice ^= dice >> 7;
    dice ^= dice << 17;
    return low + (high - low) * ((double)(dice >> 11) / 9007199254740992.0);
}

static double over(double low, double high)
{
    return low * exp(uniform(0.0, 1.0) * log(high / low));
}

static double mostly(double value, double zero)
{
    return uniform(0.0, 1.0) < zero ? 0.0 : value;
}

static T(robot) any_robot(void)
{
    T(robot) r;
    r.m_s = over(0.3, 10.0);
    r.m_eff = r.m_s * over(0.02, 50.0);
    r.k = over(50.0, 50000.0);
    r.L0 = 0.4;
    r.c = mostly(uniform(-0.01, 0.01), 0.6);
    r.b1 = mostly(2.0 * sqrt(r.k * r.m_eff) * over(1e-3, 4.0), 0.15);
    r.b2 = mostly(2.0 * sqrt(r.k * r.m_s) * over(1e-3, 4.0), 0.15);
    r.f1 = mostly(over(0.02, 10.0), 0.15);
    r.f2 = mostly(over(0.02, 10.0), 0.15);
    r.u_max = 3.0;
    r.gamma2 = (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0) * r.m_eff * over(0.1, 6.0);
    r.g = mostly(9.81, 0.08);
    r.x1_min = uniform(0.0, 1.0) < 0.5 ? -INFINITY : -mostly(over(1e-3, 0.05), 0.4);
    r.x1_max = isfinite(r.x1_min) ? over(1e-3, 0.08) : INFINITY;
    r.impact_loss = 0.05;
    return r;
}

static void listen(int argc, char **argv)
{
    prints_work = argc > 1 && strcmp(argv[1], "work") == 0;
    verbose = argc > 1 && !prints_work;
}

static int conclude(void)
{
    if (verbose) {
        printf("%d rows, worst share %g, wrong %d\n", row, worst, wrong);
    }
    return wrong > 0;
}

#endif
