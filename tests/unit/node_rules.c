/* The rules of a node, asked about functions of given rates, and the constants
 * of a node. In single precision, whose answers are
 * judged in double, or with -DDOUBLE. */
static long intervals; /* of a stance that is solved */
#define NODE_COUNT(what) COUNT_##what
#define COUNT_node intervals++
#define COUNT_evaluation (void)0
#define COUNT_inside (void)0
#define COUNT_amplitude (void)0
#define COUNT_bernstein (void)0
#define COUNT_minimum (void)0
#define COUNT_cut (void)0
#define COUNT_quiet (void)0
#define COUNT_from_the_end (void)0
#ifdef DOUBLE
#define OF(name) name##_f64
typedef double real;
#include "hopform_f64.c"
#else
#define OF(name) name##_f32
typedef float real;
#include "hopform_f32.c"
#endif

typedef struct {
  double robot[HOPFORM_ROBOT_FIELDS];
  double w[3];        /* rates of y, v_1, v_2 at the start */
  double start, span; /* of the function, and how much of a node */
  double sign;
  int32_t row;
  int32_t spare;
} question;

typedef struct {
  double value, end, rate_end, deflated_end, pole; /* of the function at the
                                  start and at the end, as they are rounded */
  double a1_y, a1_v1, a1_v2, a2_y, a2_v1, a2_v2;   /* of the motion, as they are
                                                      rounded */
  double contact[3], length; /* the row of the contact force */
  double rounding, remainder;
  double root;  /* in the interval, of one that ends below zero; else -1 */
  double quiet; /* how long no function has a root, by rule 5 */
  double least; /* how much later its minimum is located, by rule 4; below 0: it
                    is not asked */
  double until; /* how long a search of the whole interval finds no root */
  int32_t refused, signs, amplitude, bernstein;
  int32_t intervals; /* of that search */
  int32_t found;     /* whether it has found one */
} verdict;

static int is_refused(OF(hopform_plan) * plan, const double *fields) {
  OF(hopform_robot) robot;
  real *to = &robot.m_eff;
  for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
    to[n] = (real)fields[n];
  }
  return OF(hopform_plan_init)(plan, &robot) < 0 || !(plan->transition.h > 0);
}

/* The constants of a robot's node: h, above, stays, gains, moves, and the rates
 * a1_y, a1_v1, a2_y, a2_v2; 0 where it has none. */
void constants(const double *fields, double *to) {
  OF(hopform_plan) plan;
  for (int n = 0; n < 28; n++) {
    to[n] = 0.0;
  }
  if (is_refused(&plan, fields)) {
    return;
  }
  const OF(hopform_transition) *at = &plan.transition;
  const OF(hopform_rates) *rates = &plan.rates[0];
  *to++ = at->h;
  *to++ = at->above[0];
  *to++ = at->above[1];
  for (int n = 0; n < 9; n++) {
    *to++ = at->stays[n];
  }
  for (int n = 0; n < 9; n++) {
    *to++ = at->gains[n];
  }
  for (int n = 0; n < 3; n++) {
    *to++ = at->moves[n];
  }
  *to++ = rates->a1_y;
  *to++ = rates->a1_v1;
  *to++ = rates->a2_y;
  *to++ = rates->a2_v2;
}

/* The search of an interval, from its beginning, by all rules in their order. */
static void search_whole(OF(node_search) * search, int n, real h, verdict *v) {
  const real end = search->low->t + h;
  uint32_t crossed = 0;
  while (crossed == 0 && search->low->t < end) {
    OF(put_node_after)(search, search->low, end - search->low->t, search->high);
    crossed = OF(certify_interval)(search);
    search->count++;
    v->until = search->high->t;
    if (crossed != 0) {
      OF(search_node) root;
      v->found = OF(first_root_of)(search, crossed, &root) == n;
      v->until = root.t;
    } else {
      OF(begin_next_interval)(search);
    }
  }
  v->intervals = search->count;
}

void ask(const question *questions, int64_t count, verdict *verdicts) {
  for (int64_t i = 0; i < count; i++) {
    const question *q = &questions[i];
    OF(hopform_plan) plan;
    verdict v = {.root = -1};
    v.refused = is_refused(&plan, q->robot);
    if (!v.refused) {
      const int n = q->row;
      const OF(hopform_poles) *poles = &plan.poles[0];
      OF(evaluations) evaluations = {OF(UNBOUNDED)};
      OF(node_search)
      search = {.plan = &plan, .evaluations = &evaluations};
      search.rings = (real)0.25 * poles->p * poles->p < poles->q;
      search.low = &search.node[0];
      search.high = &search.node[1];
      for (int k = 0; k < 3; k++) {
        search.w.of[k] = (real)q->w[k];
        search.sign[k] = (real)q->sign;
      }
      search.sign[0] = 1; /* of the compression there is one sign */
      search.low->w = search.w;
      const OF(rates_by_row) d = OF(deflated_rates)(&plan, &search.w);
      for (int k = 0; k < 3; k++) {
        OF(state_by_axis) one = {{0, 0, 0, 0}};
        one.of[OF(axis_of_row)[k]] = 1;
        search.contact[k] = OF(contact_slope)(&plan.robot, &one.named);
        v.contact[k] = search.contact[k];
      }
      for (int k = 0; k < 3; k++) {
        search.low->rate[k] =
            search.sign[k] * OF(function_of)(&search, k, search.w.of);
        search.low->deflated[k] =
            search.sign[k] * OF(function_of)(&search, k, d.of);
      }
      search.low->value[n] = (real)q->start;
      search.rounded[n] = search.low->value[n];
      const OF(hopform_transition) *node = &plan.transition;
      const real h = (real)q->span * node->h;
      if (q->span < 1.0) {
        OF(put_node_after)(&search, search.low, h, search.high);
      } else {
        const OF(gained) gained = OF(gained_by_rows)(
            node->stays, node->gains, node->moves, h, 0, &search.w);
        OF(put_node)(&search, search.low, &gained, h, search.high);
      }
      const real d_rate = OF(rate_of_deflated)(&search, n);
      v.value = search.low->value[n];
      v.end = search.high->value[n];
      v.rate_end = search.high->rate[n];
      v.deflated_end = search.high->deflated[n];
      v.pole = poles->a;
      v.a1_y = plan.rates[0].a1_y;
      v.a1_v1 = plan.rates[0].a1_v1;
      v.a1_v2 = plan.rates[0].a1_v2;
      v.a2_y = plan.rates[0].a2_y;
      v.a2_v1 = plan.rates[0].a2_v1;
      v.a2_v2 = plan.rates[0].a2_v2;
      v.length = h;
      v.rounding =
          OF(rounding_at_node)(&search, n, search.high, search.high->rate[n]);
      v.signs =
          OF(turns_down_only)(search.low->rate[n], search.low->deflated[n],
                              search.high->rate[n], search.high->deflated[n]);
      v.remainder =
          search.rings ? OF(remainder_of_quintic)(&search, n, h, d_rate) : 0;
      v.amplitude = OF(falls_too_little)(&search, n, h, d_rate);
      if (v.signs && v.end < -v.rounding) {
        OF(search_node) root;
        OF(put_root)(&search, n, &root);
        v.root = root.t;
      }
      v.bernstein = search.rings && OF(has_no_root_by_bernstein)(
                                        &search, n, h, d_rate, (real)v.rounding);
      for (int k = 0; k < 3; k++) { /* the others are nowhere near zero */
        search.low->value[k] = k == n ? search.low->value[k] : (real)1e30;
      }
      OF(node_search) whole = search;
      whole.low = &whole.node[0];
      whole.high = &whole.node[1];
      v.quiet = search.rings ? OF(quiet_time_at_node)(&search) : 0;
      v.least = -1;
      if (search.low->rate[n] < 0 && !(search.high->rate[n] < 0)) {
        OF(cut_at_minimum)(&search, n);
        v.least = search.high->t;
      }
      search_whole(&whole, n, h, &v);
    }
    verdicts[i] = v;
  }
}

/* Of a stance from v_1 and v_2 without a current, which is set twice more: its
 * intervals, the evaluations that it has used, its ending. */
void spend(const double *fields, double v1, double v2, double horizon,
           const double *again, int64_t *to) {
  OF(hopform_plan) plan;
  OF(hopform_phase) kept[100];
  OF(hopform_stance) stance;
  OF(evaluations) evaluations = {OF(UNBOUNDED)};
  const OF(hopform_state) start = {0, (real)v1, (real)v2, 0};
  const OF(hopform_step)
  steps[3] = {{0, 0}, {(real)again[0], 0}, {(real)again[1], 0}};
  intervals = 0;
  to[2] = is_refused(&plan, fields)
              ? 0
              : OF(solve_observed)(&plan, &start, steps, 3, (real)horizon, 100,
                                   kept, 100, &stance, &evaluations, NULL, NULL);
  to[0] = intervals;
  to[1] = OF(UNBOUNDED) - evaluations.left;
  to[2] = to[2] == HOPFORM_OK ? stance.ending : -1;
}
