/* The bytes of an input as numbers and as a robot, in single precision with -DSINGLE. */
#ifndef FUZZ_SOURCE_H
#define FUZZ_SOURCE_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hopform/hopform.h"

#ifdef SINGLE
typedef float real;
#define T(name) hopform_##name##_f32
#else
typedef double real;
#define T(name) hopform_##name##_f64
#endif

#define LONGEST 1e30 /* s */
enum { MAX_PHASES = 64, ROBOT = sizeof(T(robot)) / sizeof(real) };

#define must(truth) must_at((truth), __FILE__, __LINE__)
static void must_at(int truth, const char *file, int line)
{
    if (!truth) {
        fprintf(stderr, "%s, line %d\n", file, line);
        abort();
    }
}

typedef struct {
    const uint8_t *data;
    size_t left;
} source;

static uint8_t next_byte(source *from)
{
    const uint8_t value = from->left > 0 ? *from->data : 0;
    from->data += from->left > 0;
    from->left -= from->left > 0;
    return value;
}

static real next_real(source *from, int sensible, int positive)
{
    real value = 0;
    uint8_t bytes[sizeof(real)];
    if (sensible) { /* sign, magnitude 1e-4 to 1e4, and often exactly zero or the same as others */
        const uint8_t size = next_byte(from);
        const int sign = !positive && size % 2 ? -1 : 1;
        return size < 16 && !positive ? 0 : (real)(sign * pow(10.0, (size / 2 - 64) / 16.0));
    }
    for (size_t i = 0; i < sizeof bytes; i++) {
        bytes[i] = next_byte(from);
    }
    memcpy(&value, bytes, sizeof value);
    return value;
}

static T(robot) next_robot(source *from, int kind)
{
    T(robot) robot;
    real fields[ROBOT];
    for (int i = 0; i < ROBOT; i++) { /* friction at rest comes last */
        fields[i] = i < ROBOT - 2 || kind & 128 ? next_real(from, kind & 1, i < 3) : 0;
    }
    memcpy(&robot, fields, sizeof robot);
    if (kind & 1) {
        robot.b1 = (real)fabs(robot.b1);
        robot.b2 = (real)fabs(robot.b2);
        robot.f1 = (real)fabs(robot.f1);
        robot.f2 = (real)fabs(robot.f2);
        robot.f1_excess = (real)fabs(robot.f1_excess);
        robot.f2_excess = (real)fabs(robot.f2_excess);
        robot.g = (real)fabs(robot.g);
        robot.x1_min = (real)(kind & 2 ? -INFINITY : -fabs(robot.x1_min));
        robot.x1_max = (real)(kind & 2 ? INFINITY : fabs(robot.x1_max));
        robot.u_max = (real)fabs(robot.u_max);
        robot.impact_loss = 0;
    }
    return robot;
}

/* A horizon of at most so many half turns of the stiffest oscillation, and of LONGEST where its rate underflows: motion
 * that leaves the range of the format takes as many intervals as the cap of a phase allows, which is a tenth of a
 * second. One that is none, or infinite, stays as it is: to refuse it is part of what is tried. */
static inline real bounded(real horizon, const T(robot) *robot, double half_turns)
{
    const double rate = sqrt(robot->k / (double)robot->m_eff + robot->k / (double)robot->m_s);
    const double most = rate > 0 ? half_turns * 3.141592653589793 / rate : LONGEST;
    return isfinite(horizon) && horizon > most && (real)most > 0 ? (real)most : horizon;
}

#endif
