/* The tests of mutants in headers: kernels, formulas and the search for events,
 * each function by itself, against long double arithmetic, against differences
 * and against what many samples show. Prints what is wrong and ends with 1, or
 * is silent.
 */
#include "checks.h"
#include "first_event_f64.h"
#include "linear_f64.h"
#include "trial_f64.h"

/* ---- kernels ---- */

static void elementary(void) {
  for (int n = -4000; n <= 4000; n++) {
    const double x = (double)n * 0.0173;
    const long double e = expl((long double)-fabs(x));
    const T(fade) fade = hopform_fade_by_f64(-fabs(x));
    near(fade.left, (double)e, 4e-16 * (double)e, "exp");
    near(fade.gone, (double)-expm1l((long double)-fabs(x)),
         5e-16 * fabs((double)expm1l((long double)-fabs(x))) + 1e-300,
         "1 - exp");
    const double turned = fabs(x) * 3.0;
    const T(turn) turn = hopform_turn_by_f64(turned);
    near(turn.sine, (double)sinl((long double)turned), 3e-16 + 5e-17 * turned,
         "sin");
    near(turn.cosine, (double)cosl((long double)turned), 3e-16 + 5e-17 * turned,
         "cos");
    near(hopform_log_f64(exp(x)), (double)logl((long double)exp(x)),
         4e-16 * (1.0 + fabs(x)), "log");
    const double angle = ((double)n + 4000.5) / 8001.0 * 3.14159265358979;
    near(hopform_angle_f64(7.0 * cos(angle), 7.0 * sin(angle)), angle, 2e-15,
         "angle");
    const double power = exp(4.0 * x);
    near(hopform_cube_root_f64(power), (double)cbrtl((long double)power),
         2.5e-16 * (double)cbrtl((long double)power), "cbrt");
  }
  must(fabs(hopform_exp_f64(-1e5)) <= 0.0 &&
           hopform_fade_by_f64(-1e5).gone >= 1.0,
       "exp far below");
  must(fabs(hopform_cube_root_f64(0.0)) <= 0.0 &&
           fabs(hopform_cube_root_f64(-1.0)) <= 0.0,
       "cbrt of what is not above 0");
  near(hopform_cube_root_f64(1e-315), (double)cbrtl(1e-315L), 1e-8 * 1e-105,
       "cbrt of a tiny number");
  for (int n = -17; n <= 17; n++) {
    const double s = (double)n * 0.01;
    near(hopform_area_tangent_f64(s),
         n ? (double)(atanhl((long double)s) / (long double)s) : 1.0, 4e-16,
         "artanh(s)/s");
  }
}

/* W'', W', W and its two integrals: z' = M z to long double precision, by
 * halving and a power series. */
static void exact_basis(const T(poles) * poles, double t, long double w[5]) {
  int halvings = 0;
  const long double size =
      (long double)(poles->s_1 + sqrt(poles->s_2)) * (long double)t;
  while (ldexpl(size, -halvings) > 0.25L && halvings < 60) {
    halvings++;
  }
  const long double h = ldexpl((long double)t, -halvings);
  long double phi[5][5];
  for (int column = 0; column < 5; column++) {
    long double term[5] = {0};
    term[column] = 1;
    for (int i = 0; i < 5; i++) {
      phi[i][column] = term[i];
    }
    for (int n = 1; n < 40; n++) { /* rates of (W'', W', W, int W, int int W) */
      const long double rate[5] = {-((long double)poles->s_1 * term[0] +
                                     (long double)poles->s_2 * term[1] +
                                     (long double)poles->s_3 * term[2]),
                                   term[0], term[1], term[2], term[3]};
      for (int i = 0; i < 5; i++) {
        term[i] = rate[i] * h / n;
        phi[i][column] += term[i];
      }
    }
  }
  for (; halvings > 0; halvings--) {
    long double twice[5][5] = {{0}};
    for (int i = 0; i < 5; i++) {
      for (int j = 0; j < 5; j++) {
        for (int k = 0; k < 5; k++) {
          twice[i][j] += phi[i][k] * phi[k][j];
        }
      }
    }
    memcpy(phi, twice, sizeof phi);
  }
  for (int i = 0; i < 5; i++) {
    w[i] = phi[i][0]; /* from W'' = 1 */
  }
}

static void basis_of(const T(poles) * poles) {
  const double speed = poles->s_1 + sqrt(poles->s_2);
  for (int n = -12; n <= 12; n++) {
    const double t = exp(0.55 * (double)n) / speed;
    long double w[5];
    exact_basis(poles, t, w);
    const T(basis) at = hopform_basis_at_f64(poles, t);
    const double scale[5] = {1.0, t, t * t / 2.0, t * t * t / 6.0,
                             t * t * t * t / 24.0};
    const double got[5] = {at.Wdd, at.Wd, at.W, at.W1, at.W2};
    for (int i = 0; i < 5; i++) {
      near(got[i], (double)w[i],
           4e-12 *
               larger(fabs((double)w[i]), 1e-3 * scale[i] / (1.0 + t * speed)),
           "the response of the poles");
    }
  }
}

static void all_poles(void) {
  static const double cubics[][3] = {
      /* rates of a, then p, q of the pair */
      {1.0, 0.2, 30.0},     {40.0, 3.0, 900.0},  {5.0, 10.0, 25.0},
      {5.0, 10.1, 25.5},    {3.0, 30.0, 200.0},  {0.01, 4.0, 900.0},
      {300.0, 1.0, 1.0},    {2.0, 4.0, 4.0},     {2.0, 4.000001, 4.0},
      {7.0, 100.0, 2400.0}, {10.0, 20.5, 105.0}, {1.0, 2.2, 1.25}};
  for (size_t n = 0; n < sizeof cubics / sizeof cubics[0]; n++) {
    const double a = cubics[n][0], p = cubics[n][1], q = cubics[n][2];
    const T(poles) poles = hopform_factor_cubic_f64(a + p, q + a * p, a * q);
    near(poles.a + poles.p, a + p, 1e-14 * (a + p), "the factors, s_1");
    near(poles.q + poles.a * poles.p, q + a * p, 1e-14 * (q + a * p),
         "the factors, s_2");
    near(poles.a * poles.q, a * q, 1e-13 * a * q, "the factors, s_3");
    basis_of(&poles);
    const T(poles) held = {0.0, p, q, p, q, 0.0};
    basis_of(&held);
  }
  const T(poles) still = hopform_factor_cubic_f64(0.0, 900.0, 0.0);
  near(still.q, 900.0, 1e-12, "no friction");
  basis_of(&still);
}

/* v'' + p v' + q v = 0 from v > 0: its first zero, by small steps and halving,
 * and what the library says. */
static void halts(void) {
  static const double damping[] = {0.0, 0.3, 0.95, 1.0, 1.05, 1.4, 3.0, 20.0};
  for (size_t n = 0; n < sizeof damping / sizeof damping[0]; n++) {
    for (int i = 0; i < 24; i += 4) {
      const double q = 400.0, p = 2.0 * damping[n] * 20.0, v = 0.3,
                   acc = -0.25 * (double)(1 + i * i) + 2.0;
      const T(poles) poles = {0.0, p, q, p, q, 0.0};
      const double t = time_to_rest_f64(&poles, v, acc);
      long double w[5], zero = -1.0L;
      for (int k = 1; k <= 200 && zero < 0.0L;
           k++) { /* v(t) = v (R' + p R) + acc R */
        exact_basis(&poles, (double)k * 1e-2, w);
        if ((long double)v * (w[0] + (long double)p * w[1]) +
                (long double)acc * w[1] <
            0.0L) {
          long double low = (long double)(k - 1) * 1e-2L,
                      high = (long double)k * 1e-2L;
          for (int m = 0; m < 50; m++) {
            const double middle = (double)(0.5L * (low + high));
            exact_basis(&poles, middle, w);
            if ((long double)v * (w[0] + (long double)p * w[1]) +
                    (long double)acc * w[1] <
                0.0L) {
              high = middle;
            } else {
              low = middle;
            }
          }
          zero = high;
        }
      }
      if (zero >= 0.0L) {
        near(t, (double)zero, 4e-16 * (1.0 + t), "when a mass comes to rest");
      } else {
        must(t > 1.9, "a mass that does not come to rest");
      }
    }
  }
}

/* Cubics of any poles, also nearly and exactly equal ones: the factors multiply
 * out to them, and the response is theirs. */
static void any_poles(void) {
  for (row = 0; row < 400; row++) {
    const double a = over(1e-3, 1e3), fast = over(1e-2, 1e3);
    const double p = 2.0 * fast *
                     (row % 4 == 0 ? 1.0
                                   : (row % 4 == 1 ? uniform(0.0, 0.99)
                                                   : over(1.0, 50.0))),
                 q = fast * fast;
    const double near_a =
        row % 8 < 6 ? a
                    : fast * (1.0 + (row % 8 == 6 ? 0.0 : over(1e-12, 1e-2)));
    const T(poles) poles =
        hopform_factor_cubic_f64(near_a + p, q + near_a * p, near_a * q);
    near(poles.a + poles.p, poles.s_1, 4e-15 * poles.s_1, "any factors, s_1");
    near(poles.q + poles.a * poles.p, poles.s_2, 1e-14 * poles.s_2,
         "any factors, s_2");
    near(poles.a * poles.q, poles.s_3, 1e-14 * poles.s_3, "any factors, s_3");
    const double mean = 0.5 * poles.p, square = mean * mean - poles.q;
    const double roots[2] = {square > 0.0 ? mean - sqrt(square) : mean,
                             square > 0.0 ? mean + sqrt(square) : mean};
    const double apart =
        larger(fabs(poles.a - roots[0]), sqrt(larger(0.0, -square)));
    must(!(square > 0.0) ||
             fabs(poles.a - roots[0]) >= (roots[1] - roots[0]) * 0.999 ||
             fabs(poles.a - roots[1]) >= (roots[1] - roots[0]) * 0.999 ||
             apart <= 1e-4 * poles.s_1,
         "the root that is apart");
    if (row % 4 == 0) {
      basis_of(&poles);
      const T(poles) held = {0.0, p, q, p, q, 0.0};
      basis_of(&held);
    }
  }
  const T(poles) one = hopform_factor_cubic_f64(30.0, 300.0, 1000.0);
  near(one.a, 10.0, 1e-3, "three roots in one");
  near(one.q + one.a * one.p, 300.0, 1e-12, "three roots in one, s_2");
  basis_of(&one);
  const T(poles) none = hopform_factor_cubic_f64(1e-110, 1e-220, 0.0);
  must(!(fabs(none.a) + fabs(none.p) + fabs(none.q) > 0.0),
       "poles that are slower than a number can say");
}

/* The first zero of v cos(w t) + (acc + p v/2) sin(w t)/w, or of two decays, by
 * its value on both sides. */
static void any_halts(void) {
  for (row = 0; row < 240; row++) {
    const double q = over(1.0, 1e5),
                 p = 2.0 * sqrt(q) *
                     (row % 3 == 0 ? uniform(0.0, 1.0) : over(1e-3, 50.0));
    const double v = over(1e-6, 10.0),
                 acc = v * sqrt(q) *
                       (row % 2 ? -over(1e-3, 1e3) : uniform(-3.0, 3.0));
    const T(poles) poles = {0.0, p, q, p, q, 0.0};
    const double t = time_to_rest_f64(&poles, v, acc);
    const double last = t < 1e300 ? t : 40.0 / sqrt(q);
    long double w[5];
    for (int n = 0; n <= 20; n++) { /* v(t) = v (R' + p R) + acc R: above zero
                                       before, below it behind */
      const double share = n < 20 ? (double)n / 20.0 : 1.0 - 1e-7,
                   at = last * share;
      exact_basis(&poles, at, w);
      must((long double)v * (w[0] + (long double)p * w[1]) +
                       (long double)acc * w[1] >
                   0.0L ||
               share > 0.999,
           "a halt that comes late");
    }
    exact_basis(&poles, t < 1e300 ? t : 0.0, w);
    const long double rate =
        (long double)acc * (w[0]) - (long double)q * (long double)v * w[1];
    const double left =
        (double)((long double)v * (w[0] + (long double)p * w[1]) +
                 (long double)acc * w[1]);
    must(!(t < 1e300) ||
             fabs(left) <= 2e-13 * t * fabs((double)rate) + 1e-16 * v,
         "a mass that has come to rest");
  }
  const T(poles) swings = {0.0, 4.0, 104.0, 4.0, 104.0, 0.0},
                 creeps = {0.0, 5.0, 4.0, 5.0, 4.0, 0.0};
  near(time_to_rest_f64(&swings, 0.0, 1.0), 3.14159265358979323846 / 10.0,
       1e-15, "a half turn from rest");
  must(time_to_rest_f64(&creeps, 0.0, 1.0) >= 1e300, "creeping from rest");
  must(!(time_to_rest_f64(&creeps, 0.0, -1.0) > 0.0) &&
           !(time_to_rest_f64(&swings, 0.0, -1.0) > 0.0),
       "away from rest the other way");
  must(time_to_rest_f64(&creeps, 0.0, 0.0) >= 1e300 &&
           time_to_rest_f64(&swings, 0.0, 0.0) >= 1e300,
       "nothing that moves");
}

/* ---- formulas that the library does not call ---- */

static void formulas(void) {
  for (row = 0; row < 50; row++) {
    T(robot) r = any_robot();
    r.g = 9.81;
    const T(state)
        s = {uniform(-0.1, 0.1), uniform(-1.0, 1.0), -over(0.1, 4.0), 0.0};
    const double aed = uniform(-5.0, 5.0), x1_T = uniform(-0.1, 0.1),
                 step = uniform(-0.1, 0.1), h_des = uniform(0.0, 0.5);
    const double lift = uniform(-0.1, 0.1), spring = uniform(0.0, 1.0),
                 weight = r.m_s * r.g, kinetic = 0.5 * r.m_s * s.v2 * s.v2;
    const double size = 1e-13 * (kinetic + fabs(aed) + weight +
                                 0.5 * r.k * (s.x1 * s.x1 + x1_T * x1_T));
    near(hopform_touchdown_velocity_f64(&r, h_des) *
             hopform_touchdown_velocity_f64(&r, h_des),
         2.0 * r.g * h_des * (1.0 - r.impact_loss), 1e-13,
         "the velocity after a drop");
    must(hopform_touchdown_velocity_f64(&r, h_des) < 0.0, "a drop upwards");
    near(weight *
             (hopform_apex_from_energy_f64(&r, &s, aed, x1_T, step) - s.x1),
         kinetic + aed - weight * step + 0.5 * r.k * s.x1 * s.x1 -
             0.5 * r.k * x1_T * x1_T,
         size, "(27), the apex");
    near(hopform_printed_objective_f64(&r, &s, aed, h_des, step),
         fabs(0.5 * weight * fabs(step) + kinetic + aed - weight * h_des), size,
         "(27) as printed");
    near(hopform_objective_f64(&r, &s, aed, x1_T, h_des, lift, spring),
         fabs(weight * lift + kinetic + aed - weight * h_des +
              spring * (0.5 * r.k * s.x1 * s.x1 + weight * s.x1 -
                        0.5 * r.k * x1_T * x1_T)),
         size, "(27)");
    near(hopform_threshold_current_f64(&r) * fabs(r.gamma2), r.m_eff * r.f1,
         1e-13 * r.m_eff * (r.f1 + 1e-9), "(5)");
  }
}

/* ---- the search for events ---- */

enum { SAMPLES = 240 };

static double value_of(const event_function_f64 *g, const T(poles) * poles,
                       double t) {
  const T(basis) basis = hopform_basis_at_f64(poles, t);
  return g->start + g->numerator.H3 * basis.Wd + g->numerator.H2 * basis.W +
         g->numerator.H1 * basis.W1;
}

/* The poles and the node of a phase of any robot. */
static void any_phase(T(poles) * poles, T(node) * node) {
  T(plan) plan;
  const T(robot) robot = any_robot();
  must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
  const double which = uniform(0.0, 1.0);
  *poles = which < 0.7 ? plan.both : (which < 0.85 ? plan.actuator : plan.body);
  *node = which < 0.7 ? plan.node_both
                      : (which < 0.85 ? plan.node_actuator : plan.node_body);
}

static T(poles) poles_of_any_robot(void) {
  T(poles) poles;
  T(node) node;
  any_phase(&poles, &node);
  return poles;
}

/* An event function that begins at 0 or above it, with an interval of it that
 * is shorter than half a period. */
static event_set_f64 any_function(const T(poles) * poles, const T(node) * node,
                                  double *h) {
  const double w = sqrt(poles->q > 0.0 ? poles->q : poles->s_2);
  const double start = uniform(0.0, 1.0) < 0.2 ? 0.0 : over(1e-3, 2.0);
  const double H3 = mostly(uniform(-1.0, 1.0), start > 0.0 ? 0.15 : 0.0) * w,
               H2 = mostly(uniform(-1.0, 1.0), 0.2) * w * w + poles->s_1 * H3;
  const double H1 =
      poles->a > 0.0 ? mostly(uniform(-1.0, 1.0), 0.2) * w * w * (w + poles->a)
                     : 0.0;
  const event_set_f64 set = {
      poles, node, 1, {{{start > 0.0 ? H3 : fabs(H3), H2, H1}, start, 0, 0}}};
  *h = 0.95 * smaller(node->half_period, 3.0 / w) *
       (uniform(0.0, 1.0) < 0.5 ? 1.0 : over(1e-2, 1.0));
  return set;
}

/* (18): what fades with the pole that is apart and what rings with the pair are
 * the whole. */
static void ringing(void) {
  int seen = 0;
  for (row = 0; row < 600; row++) {
    const T(poles) poles = poles_of_any_robot();
    const double chi = poles.q - poles.a * (poles.p - poles.a);
    if (!(poles.q > 0.0 &&
          chi > 0.2 * (poles.q + poles.a * poles.a + poles.a * poles.p))) {
      continue;
    }
    seen++;
    const double w = sqrt(poles.q) + poles.a, t = over(0.05, 5.0) / w;
    const T(numerator) numerator = {uniform(-1.0, 1.0), uniform(-1.0, 1.0) * w,
                                    uniform(-1.0, 1.0) * w * w};
    const T(decay) decay = hopform_decay_at_f64(poles.a, t);
    const T(pair) pair = hopform_pair_at_f64(&poles, t);
    const T(basis) basis = hopform_basis_at_f64(&poles, t);
    const T(ringing) parts =
        hopform_ringing_at_f64(&poles, chi, &numerator, &decay);
    const double whole = numerator.H3 * basis.Wd + numerator.H2 * basis.W +
                         numerator.H1 * basis.W1;
    const double size = fabs(parts.slow) + fabs(parts.X * pair.Rd) +
                        fabs(parts.Y * pair.R) + fabs(whole);
    near(parts.slow + parts.X * pair.Rd + parts.Y * pair.R, whole, 1e-11 * size,
         "(18), slow and ringing");
  }
  must(seen > 100, "too few that ring");
}

/* What many samples of a function show. */
typedef struct {
  double least, most, first; /* its least and largest magnitude; where it first
                                falls below zero, else negative */
  int crossings;
} shape;

static shape sampled(const event_set_f64 *set, double h) {
  shape seen = {INFINITY, 0.0, -1.0, 0};
  double before = 1.0;
  for (int n = 1; n <= SAMPLES; n++) {
    const double t = h * (double)n / SAMPLES,
                 g = value_of(&set->function[0], set->poles, t);
    seen.least = smaller(seen.least, g);
    seen.most = larger(seen.most, fabs(g));
    seen.crossings += (before > 0.0) != (g > 0.0);
    seen.first = g < 0.0 && seen.first < 0.0 ? t : seen.first;
    before = g;
  }
  return seen;
}

static int signs_said, pair_said, quiet_said, bernstein_said, roots_said,
    minima_said;

/* Each rule of the certificate against samples: where it says that there is no
 * root, there is none. */
static void any_certificate(const event_set_f64 *set, const interval_f64 *in,
                            const shape *seen) {
  const event_function_f64 *g = &set->function[0];
  const jet_f64 *from = &in->from[0], *to = &in->to[0];
  const double h = in->high.t,
               rounding = rounding_of_f64(g, &in->high, to->rate);
  const double tiny = 1e-13 * seen->most + rounding;
  const bool holds = seen->least >= -tiny,
             rings = set->node->half_period < HOPFORM_NEVER_f64;
  if (to->value > rounding) {
    const bool signs = has_no_root_f64(from, deflated_f64(set, g, from, 0.0),
                                       to, deflated_f64(set, g, to, h));
    const bool pair =
        rings && has_no_root_by_pair_f64(set->poles, g, &in->high, from, to);
    const bool apart =
        rings && is_held_up_by_bernstein_f64(set->poles, g, from, to, h, false,
                                             rounding);
    must(!signs || holds, "rule 2: a root by the real pole's chain");
    must(!pair || holds, "rule 2: a root by the pair's chain");
    must(!apart || holds, "rule 1: a root");
    signs_said += signs;
    pair_said += pair;
    bernstein_said += apart && !signs;
  }
  const double quiet = quiet_time_f64(set, from, rounding);
  must(!(quiet > h) || holds, "rule 5: a root while it is quiet");
  quiet_said += quiet > h;
  must(quiet > h || seen->first < 0.0 || seen->first > 0.999 * quiet,
       "rule 5: a root before it ends");
}

/* The bound of the sixth derivative against the derivative itself, which the
 * poles give from the others. */
static void any_sixth_derivative(const event_set_f64 *set, double h) {
  const T(poles) *poles = set->poles;
  if (!(set->node->half_period < HOPFORM_NEVER_f64)) {
    return;
  }
  const double bound = sixth_derivative_bound_f64(poles, &set->function[0]);
  double most = 0.0;
  for (int n = 0; n <= 40; n++) {
    const propagator_f64 then = propagator_at_f64(poles, h * (double)n / 40.0);
    const jet_f64 at = jet_at_f64(set->poles, &set->function[0], &then);
    double d[3] = {at.rate, at.curvature, at.third}; /* then the next ones */
    for (int k = 0; k < 3; k++) {
      const double next =
          -(poles->s_1 * d[2] + poles->s_2 * d[1] + poles->s_3 * d[0]);
      d[0] = d[1];
      d[1] = d[2];
      d[2] = next;
    }
    most = larger(most, fabs(d[2]));
  }
  must(most <= 1.0000001 * bound, "a sixth derivative above its bound");
}

/* The first root of an interval is where samples show it, and where g is 0; the
 * guesses are near. */
static void any_first_root(const event_set_f64 *set, interval_f64 *in,
                           const shape *seen) {
  const event_function_f64 *g = &set->function[0];
  const double h = in->high.t, step = h / SAMPLES;
  const double tiny = 1e-9 * seen->most;
  find_first_root_f64(set, in);
  if (in->found == 0) {
    roots_said++;
    const double t = in->high.t;
    const jet_f64 at = short_jet_at_f64(g, &in->high);
    const double rounding = rounding_of_f64(g, &in->high, at.rate);
    near(value_of(g, set->poles, t), 0.0, 4e-16 * t * fabs(at.rate) + rounding,
         "a root");
    must(seen->first < 0.0 || t <= seen->first + 1e-9 * h,
         "a root behind the first");
    must(t > 0.0 && t <= h, "a root outside");
    must(seen->first < 0.0 || t >= seen->first - step || seen->least < tiny,
         "a root where there is none");
  } else {
    must(!(in->high.t >= h) || seen->least > -tiny, "a root that is not found");
  }
}

static void any_minimum(const event_set_f64 *set, const interval_f64 *in,
                        const shape *seen) {
  const event_function_f64 *g = &set->function[0];
  const jet_f64 *from = &in->from[0], *to = &in->to[0];
  if (!has_minimum_f64(from, to) ||
      from->curvature + set->node->pole * from->rate < 0.0 ||
      to->curvature + set->node->pole * to->rate < 0.0) {
    return;
  }
  minima_said++;
  const propagator_f64 lowest =
      minimum_between_f64(set, g, 0.0, from, in->high.t, to);
  const jet_f64 least = short_jet_at_f64(g, &lowest);
  const double rounding = rounding_of_f64(g, &lowest, least.rate);
  must((least.value < -rounding) == (seen->least < -rounding) ||
           fabs(seen->least) < 1e-3 * seen->most,
       "rule 4: a minimum on the other side of zero");
  must(!is_held_up_by_tangents_f64(from, to, set->node->pole, in->high.t,
                                   rounding) ||
           seen->least > 0.0,
       "rule 4: held up, and below zero");
}

static void any_intervals(void) {
  for (row = 0; row < 4000; row++) {
    T(poles) poles;
    T(node) node;
    double h;
    any_phase(&poles, &node);
    const event_set_f64 set = any_function(&poles, &node, &h);
    interval_f64 in = {0};
    in.low = 0.0;
    in.found = -1;
    in.high = propagator_at_f64(&poles, h);
    in.from[0] = jet_at_start_f64(&poles, &set.function[0]);
    in.to[0] = short_jet_at_f64(&set.function[0], &in.high);
    if (!(in.from[0].value > 0.0) && !(in.from[0].rate > 0.0)) {
      continue;
    }
    const shape seen = sampled(&set, h);
    any_certificate(&set, &in, &seen);
    any_sixth_derivative(&set, h);
    for (double less = 1e-6; less < 0.02 && seen.least < set.function[0].start;
         less *= 3.0) { /* lowered below 0 */
      event_set_f64 low = set;
      interval_f64 then = in;
      low.function[0].start -= seen.least + less * seen.most;
      then.from[0].value = low.function[0].start;
      then.to[0] = short_jet_at_f64(&low.function[0], &in.high);
      const shape lowered = sampled(&low, h);
      if (then.from[0].value > 0.0) {
        any_certificate(&low, &then, &lowered);
      }
    }
    any_minimum(&set, &in, &seen);
    any_first_root(&set, &in, &seen);
  }
  must(signs_said > 500 && pair_said > 500 && quiet_said > 300 &&
           bernstein_said > 100 && roots_said > 500 && minima_said > 100,
       "a rule that hardly ever says anything");
}

/* A function at the start of a phase is what it is at the time 0 of it. */
static void first_jets(void) {
  for (row = 0; row < 200; row++) {
    T(poles) poles;
    T(node) node;
    double h;
    any_phase(&poles, &node);
    const event_set_f64 set = any_function(&poles, &node, &h);
    const event_function_f64 *g = &set.function[0];
    const T(basis) start = {1.0, 0.0, 0.0, 0.0, 0.0};
    const propagator_f64 then = propagator_of_f64(&poles, 0.0, &start);
    const jet_f64 first = jet_at_start_f64(&poles, g),
                  at = jet_at_f64(set.poles, g, &then);
    const double w = poles.s_1 + sqrt(poles.s_2),
                 size = 1e-12 * (fabs(first.value) + fabs(first.rate) / w +
                                 fabs(first.curvature) / (w * w) +
                                 fabs(g->numerator.H1) / (w * w * w));
    near(first.value, at.value, size, "g at 0");
    near(first.rate, at.rate, size * w, "its rate at 0");
    near(first.curvature, at.curvature, size * w * w,
         "its second derivative at 0");
    near(first.third, at.third, size * w * w * w, "its third derivative at 0");
  }
}

/* Tables: 1/n, and a rule that is exact for powers up to 23. */
static void tables(void) {
  for (int n = 1;
       n < (int)(sizeof hopform_inverse_f64 / sizeof hopform_inverse_f64[0]);
       n++) {
    near((double)((long double)hopform_inverse_f64[n] * (long double)n), 1.0,
         1.2e-16, "1/n");
  }
  for (int power = 0; power < 24; power++) {
    long double sum = 0.0L;
    for (int n = 0; n < HOPFORM_NODES_f64; n++) {
      long double term = (long double)hopform_weight_f64[n];
      for (int i = 0; i < power; i++) {
        term *= (long double)hopform_place_f64[n];
      }
      sum += term;
    }
    near((double)(sum * (power + 1)), 1.0, 1e-15,
         "an integral by Gauss's rule");
  }
  for (row = 0; row < 200;
       row++) { /* halved until the rule is exact, and not more often */
    const T(poles) poles = poles_of_any_robot();
    const double fastest = poles.s_1 + sqrt(poles.s_2),
                 t = row < 100 ? over(1e-3, 1e3) / fastest
                               : ldexp(4.0, row % 7) / fastest;
    const int times = hopform_doublings_f64(&poles, t);
    const double left = fastest * hopform_halved_f64(t, times);
    must(left <= 4.0 && (times == 0 || left > 2.0),
         "how often a time is halved");
  }
  T(poles) plain = {0.0, 4.0, 0.0, 4.0, 0.0, 0.0};
  must(hopform_doublings_f64(&plain, 1.0) == 0 &&
           hopform_doublings_f64(&plain, 8.0) == 3,
       "a time that need not be halved");
}

/* Phi of a mode: that of a sum of times is the product, it begins as 1, and a
 * mass that is held has no column. */
static void transitions(void) {
  for (row = 0; row < 180; row++) {
    const T(robot) r = any_robot();
    T(plan) plan;
    must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
    const int side_1 = row % 3 - 1, side_2 = row / 3 % 3 - 1;
    if (side_1 == 0 && side_2 == 0) {
      continue;
    }
    const T(drive) drive = hopform_drive_of_f64(
        &r, &plan.rates, uniform(-3.0, 3.0), (double)side_1, (double)side_2);
    const double w = sqrt(hopform_poles_of_f64(&plan, side_1, side_2)->s_2) +
                     hopform_poles_of_f64(&plan, side_1, side_2)->s_1;
    const double h = over(0.01, 1.0) / w, then = over(0.01, 1.0) / w;
    const T(matrix)
        one = hopform_transition_f64(&plan, &drive, side_1, side_2, h),
        two = hopform_transition_f64(&plan, &drive, side_1, side_2, then);
    const T(matrix)
        both = hopform_transition_f64(&plan, &drive, side_1, side_2, h + then),
        none = hopform_transition_f64(&plan, &drive, side_1, side_2, 0.0);
    for (int i = 0; i < Z_SIZE; i++) {
      for (int j = 0; j < Z_SIZE; j++) {
        double sum = 0.0, size = 1e-300;
        for (int k = 0; k < Z_SIZE; k++) {
          sum += two.at[i][k] * one.at[k][j];
          size += fabs(two.at[i][k] * one.at[k][j]);
        }
        const int held =
            (side_1 == 0 && j == Z_V1) || (side_2 == 0 && j == Z_V2);
        near(both.at[i][j], sum, 1e-12 * size, "Phi of a sum of times");
        near(none.at[i][j], i == j && !held ? 1.0 : 0.0, 1e-300,
             "Phi of no time");
        must(!held || !(fabs(one.at[i][j]) > 0.0),
             "a mass that is held, and moves something");
      }
    }
  }
}

/* The minima of y inside a phase in which both masses slide the same way, as
 * samples show them. */
static void dips(void) {
  int seen = 0, deep = 0, ways = 0;
  for (row = 0; row < 1500; row++) {
    T(robot) r = any_robot();
    T(plan) plan;
    r.g = 9.81;
    r.b1 *= 0.1;
    r.b2 *= 0.1;
    must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
    const T(state) start = {0.0, uniform(-1.0, 1.0), uniform(-1.0, 1.0),
                            uniform(0.0, 0.05)};
    const double w = sqrt(plan.both.q), length = over(0.3, 12.0) / w,
                 u = uniform(-3.0, 3.0);
    const int side = row % 2 ? 1 : -1;
    const T(state) none = {0};
    const T(drive) per_ampere = {plan.rates.a1_u, 0.0};
    const T(motion) motion =
        hopform_motion_of_f64(&plan, &start, u, side, side);
    const T(motion) by_u =
        hopform_motion_under_f64(&plan.rates, &per_ampere, &none, side, side);
    const event_function_f64 y = {
        {motion.H3_y, motion.H2_y, motion.H1_y}, start.y, 0, 0};
    const event_set_f64 set = {&plan.both, &plan.node_both, 1, {y}};
    enum { N = 4000 };
    double rate = start.v1 - start.v2, least = INFINITY, when = 0.0,
           steep = 0.0, fastest = fabs(rate);
    int all = 0, plain = 1, began = 0, turns = 0;
    for (int n = 1; n <= N; n++) {
      const propagator_f64 at =
          propagator_at_f64(&plan.both, length * (double)n / N);
      const double now = rate_at_f64(&y, &at);
      turns += (rate < 0.0) != (now < 0.0);
      if (rate < 0.0 && now >= 0.0) {
        const propagator_f64 middle =
            propagator_at_f64(&plan.both, length * ((double)n - 0.5) / N);
        const double lowest = value_at_f64(&y, &middle);
        all++;
        plain =
            plain && (double)(n - began) / N * length >
                         0.78 / w; /* a fall from one evaluation to the next */
        when = lowest < least ? length * ((double)n - 0.5) / N : when;
        steep = lowest < least ? (now - rate) * N / length : steep;
        least = fmin(least, lowest);
      }
      began = rate >= 0.0 && now < 0.0 ? n : began;
      fastest = larger(fastest, fabs(now));
      rate = now;
    }
    const propagator_f64 end = propagator_at_f64(&plan.both, length);
    const jet_f64 from = jet_at_start_f64(&plan.both, &y),
                  to = jet_at_f64(set.poles, &y, &end);
    const int most = length < 0.95 * plan.node_both.half_period
                         ? hopform_most_turns_f64(&plan.node_both, &from, &to)
                         : 9;
    must(turns <= most, "y' vanishes more often than rule 2 allows");
    ways += most <= 1;
    const T(least) found =
        hopform_least_minimum_f64(&set, &from, &to, &end, 64.0);
    must(found.count == all || (found.count < all && !plain),
         "how often y turns upwards");
    const double size = 0.05 + fabs(start.v1 - start.v2) / w;
    must(found.count < all || all == 0 ||
             fabs(found.value - least) < 1e-4 * size,
         "where y turns upwards");
    if (found.count == all && all > 0 &&
        steep > 0.1 * w * fastest) { /* where it is flat its time is known to
                                        few digits */
      const T(basis) basis = hopform_basis_at_f64(
          &plan.both, when); /* at rest in u's change: the response to 1 A */
      const T(state) change =
          hopform_arrive_f64(&none, &by_u, &basis, side, side);
      const T(state) there =
          hopform_arrive_f64(&none, &by_u, &found.basis, side, side);
      near(there.y, change.y,
           0.05 * (fabs(change.y) + 0.1 * fabs(plan.rates.a1_u) / (w * w)),
           "how that changes with the current");
      seen++;
    }
    deep += all > 1;
  }
  must(seen > 300 && deep > 30 && ways > 150,
       "too few that turn, or bend one way");
}

/* Rule 5 over long times: as long as a function is said to ring above zero it
 * does, be it sampled many times in each turn. */
static void any_ringing(void) {
  int quiet = 0;
  for (row = 0; row < 600; row++) {
    const double w = over(10.0, 1000.0), p = mostly(w * over(1e-5, 1e-2), 0.2),
                 a = over(0.05, 5.0), q = w * w;
    const T(poles) poles = hopform_factor_cubic_f64(a + p, q + a * p, a * q);
    const T(node) node = {3.141592653589793 / w,
                          HOPFORM_NEVER_f64,
                          poles.a,
                          0,
                          0,
                          0,
                          0,
                          0,
                          0,
                          0,
                          0};
    const double slow = uniform(-1.0, 1.0),
                 swing = uniform(-1.0, 1.0) * over(1e-3, 1.0),
                 other = uniform(-1.0, 1.0) * over(1e-3, 1.0);
    const event_set_f64 set = {
        &poles,
        &node,
        1,
        {{{w * swing, w * w * other + slow * a, w * w * a * uniform(-0.5, 0.5)},
          uniform(0.0, 2.0),
          0,
          0}}};
    const double from = over(0.01, 1.0), turns = over(10.0, 100.0) * 3.1416 / w;
    const propagator_f64 then = propagator_at_f64(&poles, from);
    const jet_f64 jet = jet_at_f64(set.poles, &set.function[0], &then);
    const double span = smaller(quiet_time_f64(&set, &jet, 1e-14), turns);
    double least = INFINITY, most = 0.0;
    for (int n = 0; n <= 1000; n++) {
      const double value =
          value_of(&set.function[0], &poles, from + turns * (double)n / 1000.0);
      must(turns * (double)n / 1000.0 >= span || value > 0.0,
           "a root in what is said to be quiet");
      least = smaller(least, value);
      most = larger(most, fabs(value));
    }
    quiet += span >= turns;
    must(span >= turns || least < 0.45 * most || p * turns > 0.2 ||
             a * turns > 0.2,
         "quiet, and not seen to be");
  }
  must(quiet > 80, "nothing that is quiet");
}

/* What creeps to its zero when nearly all has faded: from where rounding may
 * have put the root, to the root. */
static void late_roots(void) {
  int seen = 0;
  const T(poles) undrawn = {0.0, 2.0, 0.0, 2.0, 0.0, 0.0};
  const T(numerator) pulled = {-1.0, -1.0, 0.0};
  const T(basis) faded = hopform_basis_at_f64(&undrawn, 20.0);
  const double nowhere = hopform_settled_y_f64(&undrawn, -1.0, 0.0);
  must(nowhere >= 1e300, "what tends to nothing");
  must(!(fabs(steady_state_correction_f64(&undrawn, &pulled, 10.0, nowhere,
                                          &faded, 20.0)) > 0.0),
       "a root of what does not settle");
  for (row = 0; row < 600; row++) {
    const T(poles) poles = poles_of_any_robot();
    const double start = 1.0, settled = -over(1e-9, 1e-4);
    near(hopform_settled_y_f64(&poles, 3.0, 5.0),
         poles.s_3 > 0.0 ? 5.0 / poles.s_3 : 3.0 / poles.s_2, 1e-300,
         "what y tends to");
    const double w = poles.s_3 > 0.0 ? cbrt(poles.s_3) : sqrt(poles.s_2),
                 way = settled - start;
    const bool slow = poles.s_3 > 0.0;
    const double H3 = uniform(-1.0, 0.0) * w;
    const T(numerator)
        h = {H3, slow ? uniform(-1.0, 1.0) * w * w : way * poles.s_2,
             slow ? way * poles.s_3 : 0.0};
    double low = 1.0 / w, high = low;
    for (int n = 0; n < 60; n++) {
      const T(basis) basis = hopform_basis_at_f64(&poles, high);
      if (!(settled -
                hopform_residual_to_steady_state_f64(&poles, &h, &basis, way) >
            0.0)) {
        break;
      }
      low = high;
      high *= 1.2;
    }
    for (int n = 0; n < 200; n++) {
      const double middle = 0.5 * (low + high);
      const T(basis) basis = hopform_basis_at_f64(&poles, middle);
      if (settled -
              hopform_residual_to_steady_state_f64(&poles, &h, &basis, way) >
          0.0) {
        low = middle;
      } else {
        high = middle;
      }
    }
    const T(basis) there = hopform_basis_at_f64(&poles, low),
                   early = hopform_basis_at_f64(&poles, 0.5 * low);
    const double rate = h.H3 * there.Wdd + h.H2 * there.Wd + h.H1 * there.W;
    const double faded = fabs(there.Wdd) + fabs(w * there.Wd) +
                         (slow ? fabs(w * w * there.W) : 0.0);
    const double blurred =
        1e-15 / fabs(rate); /* what rounding of the start makes of the time */
    if (!(rate < 0.0 && faded < 1e-3 && blurred < 0.005 * low &&
          blurred > 1e-13 * low)) {
      continue;
    }
    seen++;
    must(!(fabs(steady_state_correction_f64(&poles, &h, start, settled, &early,
                                            0.5 * low)) > 0.0),
         "a root that is not near");
    for (int side = -1; side <= 1; side += 2) {
      const double t = low + side * blurred;
      const T(basis) basis = hopform_basis_at_f64(&poles, t);
      const double later =
          steady_state_correction_f64(&poles, &h, start, settled, &basis, t);
      near(t + later, low, 0.2 * blurred, "a late root");
    }
  }
  must(seen > 30, "too few late roots");
}

int main(int argc, char **argv) {
  listen(argc, argv);
  elementary();
  all_poles();
  halts();
  any_poles();
  any_halts();
  formulas();
  ringing();
  any_intervals();
  any_ringing();
  late_roots();
  first_jets();
  tables();
  transitions();
  dips();
  return conclude();
}
