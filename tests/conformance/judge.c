/* The motions of a problem by the engine of a model: UNIT is the
 * header of its chain, SOLVE and MOTION its function and what that fills; in
 * double precision with -DDOUBLE. Numbers of f32 go in and come out as double.
 */
#include <stdint.h>
#include <string.h>

#include "facts.h"
#include UNIT

#ifdef DOUBLE
#define OF(name) name##_f64
typedef double real;
#else
#define OF(name) name##_f32
typedef float real;
#endif
#define WITH_TYPE(name) OF(name)

enum { FIELDS = HOPFORM_ROBOT_FIELDS, MOST = 101, STEPS = 6 };

typedef struct {
  double robot[FIELDS], start[4], horizon, t[STEPS], u[STEPS];
  int64_t steps;
} problem;

typedef struct {
  double duration, end[4];
  int64_t ending, count, first;
} answer;

typedef struct {
  double t;
  int64_t kind;
} event;

/* The plan's status; fields of a robot are of one type. */
static int32_t plan_of(OF(hopform_plan) * plan, const problem *p) {
  real fields[FIELDS];
  OF(hopform_robot) robot;
  for (int n = 0; n < FIELDS; n++) {
    fields[n] = (real)p->robot[n];
  }
  memcpy(&robot, fields, sizeof robot);
  return OF(hopform_plan_init)(plan, &robot);
}

/* Solves `count` problems; the number of events, of which as many as fit are
 * written. Where a problem is refused its ending is below 0. */
int64_t solve(const problem *problems, int64_t count, answer *answers,
              event *events, int64_t capacity) {
  int64_t first = 0;
  for (int64_t i = 0; i < count; i++) {
    const problem *p = &problems[i];
    OF(hopform_plan) plan;
    OF(hopform_phase) kept[MOST];
    WITH_TYPE(MOTION) motion;
    OF(hopform_step) steps[STEPS];
    const OF(hopform_state) start = {(real)p->start[0], (real)p->start[1],
                                     (real)p->start[2], (real)p->start[3]};
    for (int n = 0; n < STEPS; n++) {
      steps[n].t = (real)p->t[n];
      steps[n].u = (real)p->u[n];
    }
    int32_t status = plan_of(&plan, p);
    if (status >= 0) {
      status =
          WITH_TYPE(SOLVE)(&plan, &start, steps, (int32_t)p->steps,
                           (real)p->horizon, MOST - 1, kept, MOST, &motion);
    }
    answers[i] = (answer){.ending = status, .first = first};
    if (status < 0) {
      continue;
    }
    answers[i] =
        (answer){motion.duration,
                 {motion.end.x1, motion.end.v1, motion.end.v2, motion.end.y},
                 motion.ending,
                 0,
                 first};
    for (int32_t n = 0; n < motion.phases_kept; n++) {
      if (!HOPFORM_IS_EVENT(kept[n].event)) {
        continue;
      }
      if (first < capacity) {
        events[first] = (event){kept[n].t, kept[n].event};
      }
      first++;
      answers[i].count++;
    }
  }
  return first;
}
