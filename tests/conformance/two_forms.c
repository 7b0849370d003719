/* The stances of a problem by a library of one form: with -DHOPFORM_MODAL=1 in
 * modal coordinates where a pair rings, in double precision with -DDOUBLE.
 * Numbers of f32 go in and come out as double. */
#ifdef DOUBLE
#define OF(name) name##_f64
typedef double real;
#else
#define OF(name) name##_f32
typedef float real;
#endif
#ifdef COUNTS
static long counted_node, counted_evaluation, counted_inside, counted_amplitude,
    counted_bernstein, counted_minimum, counted_cut, counted_quiet,
    counted_from_the_end;
#define MODAL_COUNT(what) (void)counted_##what++
#endif
#ifdef DOUBLE
#include "hopform_f64.c"
#else
#include "hopform_f32.c"
#endif

enum { FIELDS = HOPFORM_ROBOT_FIELDS, MOST = 101 };

typedef struct {
  double robot[FIELDS], start[4], u, horizon;
} problem;

typedef struct {
  double duration, end[4], aed;
  int32_t ending, count;
  int64_t first;
} answer;

typedef struct {
  double t, at[4];
  int8_t mode, event;
  uint16_t step;
} phase;

static OF(hopform_robot) robot_of(const problem *p) {
  OF(hopform_robot) robot;
  real *fields = &robot.m_eff;
  for (int n = 0; n < FIELDS; n++) {
    fields[n] = (real)p->robot[n];
  }
  return robot;
}

/* Solves `count` problems `loops` times; the number of phases, of which as many
 * as fit are written. */
int64_t solve(const problem *problems, int64_t count, int32_t loops,
              answer *answers, phase *phases, int64_t capacity) {
  int64_t first = 0;
  for (int64_t i = 0; i < count; i++) {
    const problem *p = &problems[i];
    const OF(hopform_robot) robot = robot_of(p);
    OF(hopform_plan) plan;
    OF(hopform_phase) kept[MOST];
    OF(hopform_stance) stance;
    const OF(hopform_state) start = {(real)p->start[0], (real)p->start[1],
                                     (real)p->start[2], (real)p->start[3]};
    const OF(hopform_step) step = {0, (real)p->u};
    int32_t status = OF(hopform_plan_init)(&plan, &robot);
    for (int n = 0; n < loops && status >= 0; n++) {
      status =
          OF(hopform_solve_stance)(&plan, &start, &step, 1, (real)p->horizon,
                                   MOST - 1, kept, MOST, &stance);
    }
    if (answers == NULL) {
      continue;
    }
    if (status < 0) {
      answers[i] = (answer){.ending = status, .first = first};
      continue;
    }
    answers[i] =
        (answer){stance.duration,
                 {stance.end.x1, stance.end.v1, stance.end.v2, stance.end.y},
                 stance.aed,
                 stance.ending,
                 stance.phases_kept,
                 first};
    for (int32_t n = 0; n < stance.phases_kept; n++, first++) {
      const OF(hopform_phase) *k = &kept[n];
      if (first < capacity) {
        phases[first] = (phase){
            k->t, {k->x1, k->v1, k->v2, k->y}, k->mode, k->event, k->step};
      }
    }
  }
  return first;
}

int64_t plan_size(void) { return (int64_t)sizeof(OF(hopform_plan)); }

/* Makes the plans of `count` problems. */
int32_t plans(const problem *problems, int64_t count) {
  int32_t sum = 0;
  for (int64_t i = 0; i < count; i++) {
    OF(hopform_plan) plan;
    const OF(hopform_robot) robot = robot_of(&problems[i]);
    sum += OF(hopform_plan_init)(&plan, &robot);
  }
  return sum;
}

#ifdef COUNTS
/* Nodes, evaluations, intervals that signs did not settle, and by what rule, so
 * far. */
void counts(int64_t *to) {
  const long all[9] = {
      counted_node,      counted_evaluation, counted_inside,
      counted_amplitude, counted_bernstein,  counted_minimum,
      counted_cut,       counted_quiet,      counted_from_the_end};
  for (int n = 0; n < 9; n++) {
    to[n] = all[n];
  }
}
#endif
