/* The tests of mutants in the controller: what it concludes from the ends of a
 * interval, function by function, against cubics whose values, slopes, roots
 * and extrema are known, and against the bounds of
 * docs/explanation/controller.md. Prints what is wrong and ends with 1.
 */
#include "control_f64.c"

#include "checks.h"

/* ---- functions of one variable ---- */

typedef struct {
  double c[4]; /* over 0 .. width */
} polynomial;

static double value_of(const polynomial *f, double x) {
  return f->c[0] + x * (f->c[1] + x * (f->c[2] + x * f->c[3]));
}

static double slope_of(const polynomial *f, double x) {
  return f->c[1] + x * (2.0 * f->c[2] + x * 3.0 * f->c[3]);
}

static curve_f64 ends_of(const polynomial *f, double width) {
  const curve_f64 c = {value_of(f, 0.0),
                       slope_of(f, 0.0),
                       value_of(f, width),
                       slope_of(f, width),
                       width,
                       true};
  return c;
}

/* The least value and slope by sampling, where the slope changes its sign
 * upwards, and whether it rises throughout. */
typedef struct {
  double least;
  double least_slope;
  double most_slope;
  double minimum;
  int bends_up;
} seen;

static seen look_at(const polynomial *f, double width) {
  enum { SAMPLES = 2000 };
  seen s = {INFINITY, INFINITY, -INFINITY, -1.0, 1};
  for (int n = 0; n <= SAMPLES; n++) {
    const double x = width * (double)n / SAMPLES,
                 before = width * (double)(n - 1) / SAMPLES;
    const double slope = slope_of(f, x);
    s.least = fmin(s.least, value_of(f, x));
    s.least_slope = fmin(s.least_slope, slope);
    s.most_slope = larger(s.most_slope, slope);
    if (n > 0 && slope >= 0.0 && slope_of(f, before) < 0.0) {
      s.minimum = (x - 0.5 * width / SAMPLES) / width;
    }
    s.bends_up = s.bends_up && (n == 0 || slope > slope_of(f, before));
  }
  return s;
}

static void cubics(void) {
  int convex = 0, monotone = 0, falling = 0, bottoms = 0;
  for (row = 0; row < 3000; row++) {
    const double width = over(1e-3, 3.0);
    polynomial f = {{uniform(-1.0, 1.0), uniform(-1.0, 1.0) / width,
                     mostly(uniform(-1.0, 1.0), 0.1) / (width * width),
                     mostly(uniform(-1.0, 1.0), 0.3) * over(1e-3, 1.0) /
                         (width * width * width)}};
    const curve_f64 c = ends_of(&f, width);
    const seen s = look_at(&f, width);
    const double size =
        fabs(f.c[0]) +
        width * (fabs(f.c[1]) + width * (fabs(f.c[2]) + width * fabs(f.c[3])));
    const double third = fabs(f.c[3]) * width * width,
                 line = fabs(c.from_rate - chord_f64(&c)) +
                        fabs(c.to_rate - chord_f64(&c));
    near(chord_f64(&c), (value_of(&f, width) - value_of(&f, 0.0)) / width,
         1e-13 * size / width, "the chord");
    near(fabs(lean_f64(&c)), third, 1e-12 * size / width,
         "its distance from a parabola");
    near(slope_error_f64(&c), 0.25 * third + line / 32.0, 1e-12 * size / width,
         "the doubt");
    for (int n = 0; n <= 8; n++) {
      near(cubic_at_f64(&c, (double)n / 8.0),
           value_of(&f, width * (double)n / 8.0), 1e-13 * size,
           "the cubic of its ends");
    }
    near(least_slope_f64(&c), s.least_slope,
         1e-12 * size / width + third * 4e-7, "the least slope");
    must(!rises_f64(&c) || s.least_slope > 0.0, "what is said to rise");
    must(rises_f64(&c) == (s.least_slope > 4.0 * slope_error_f64(&c)) ||
             fabs(s.least_slope - 4.0 * slope_error_f64(&c)) <
                 1e-5 * size / width,
         "what rises without doubt");
    must(is_monotone_f64(&c) == (s.least_slope > 4.0 * slope_error_f64(&c) ||
                                 s.most_slope < -4.0 * slope_error_f64(&c)) ||
             fabs(s.least_slope - 4.0 * slope_error_f64(&c)) <
                 1e-5 * size / width ||
             fabs(s.most_slope + 4.0 * slope_error_f64(&c)) <
                 1e-5 * size / width,
         "what is monotone without doubt");
    must(!is_convex_f64(&c) || s.bends_up, "what is said to be convex");
    must(is_convex_f64(&c) || f.c[2] <= 0.0 ||
             fabs(f.c[3]) * width > 0.2 * f.c[2],
         "a parabola that is convex");
    const double bottom = share_of_minimum_f64(&c);
    must((bottom > 0.0) == (s.minimum > 0.0) ||
             fabs(c.from_rate) < 1e-3 * size / width ||
             fabs(c.to_rate) < 1e-3 * size / width ||
             fabs(f.c[2] * f.c[2] - 3.0 * f.c[3] * f.c[1]) <
                 1e-5 * size * size / (width * width * width * width),
         "a minimum, or none");
    if (bottom > 0.0) {
      near(slope_of(&f, width * bottom), 0.0, 1e-7 * size / width,
           "the slope at a minimum");
      must(bottom < 1.0, "a minimum outside");
    } else {
      must(bottom >= -1.0, "no minimum");
    }
    const double bound = least_f64(&c);
    must(bound <= s.least + 1e-13 * size, "a bound that is above the function");
    must(bound >= s.least - 4.0 * width * slope_error_f64(&c) - 1e-12 * size ||
             is_convex_f64(&c),
         "a bound that is too low");
    if (is_monotone_f64(&c)) {
      near(bound, fmin(c.from, c.to), 0.0 + 1e-300,
           "the least of what is monotone");
    } else if (is_convex_f64(&c)) { /* where the tangents meet */
      const double meet =
          (c.to - c.from - c.to_rate * width) / (c.from_rate - c.to_rate);
      const double low = c.from_rate < 0.0 && c.to_rate > 0.0
                             ? c.from + c.from_rate * meet
                             : fmin(c.from, c.to);
      near(bound, low, 1e-9 * size, "the least of what is convex");
      convex += c.from_rate < 0.0 && c.to_rate > 0.0;
    } else {
      near(bound, s.least - width * slope_error_f64(&c), 1e-6 * size,
           "the least of a cubic");
    }
    const curve_f64 m = mirrored_f64(&c);
    must(!(fabs(m.from + c.from) + fabs(m.from_rate + c.from_rate) +
               fabs(m.to + c.to) + fabs(m.to_rate + c.to_rate) +
               fabs(m.width - c.width) >
           0.0) &&
             m.smooth == c.smooth,
         "the mirrored function");
    curve_f64 rough =
        c; /* the order of events changes: slopes are no bound inside */
    rough.smooth = false;
    const double less = fmin(c.from_rate, c.to_rate),
                 more = larger(c.from_rate, c.to_rate);
    must(rises_f64(&rough) ==
             (less > 0.0 && chord_f64(&c) > 0.0 && line <= 0.5 * less),
         "what rises where events change");
    if (is_monotone_f64(&rough)) {
      near(least_f64(&rough), fmin(c.from, c.to), 1e-300,
           "the least where events change");
      falling += more < 0.0;
    } else {
      near(least_f64(&rough), fmin(c.from, c.to) - width * line, 1e-13 * size,
           "the least by slopes where events change");
    }
    monotone += is_monotone_f64(&c);
    bottoms += bottom > 0.0;
  }
  must(convex > 100 && monotone > 300 && falling > 20 && bottoms > 300,
       "too few of a kind");
}

/* The inverse as a cubic: of a function whose inverse is one, the root is found
 * exactly. */
static void roots(void) {
  for (row = 0; row < 1000; row++) {
    const double low = -uniform(0.05, 1.0), high = uniform(0.05, 1.0),
                 span = high - low, width = over(1e-2, 2.0);
    const double first = row % 5 ? uniform(0.05, 2.9) : 1.0,
                 last = row % 5
                            ? uniform(0.05, 2.9)
                            : 1.0; /* slopes of the inverse in its chord's */
    const double sign = row % 2 ? 1.0 : -1.0, chord_of = sign * span / width;
    const curve_f64 c = {sign * low,  chord_of / first,
                         sign * high, chord_of / last,
                         width,       true};
    const double t =
        -low / span; /* the inverse from 0 to 1 with these slopes, at t */
    const double exact = t * t * (3.0 - 2.0 * t) +
                         first * t * (1.0 - t) * (1.0 - t) -
                         last * t * t * (1.0 - t);
    near(share_of_root_f64(&c), exact, 1e-13, "the root of the inverse");
    curve_f64 steep =
        c; /* slopes of the inverse beyond 3 turn it: they count as 3 */
    steep.from_rate = chord_of / over(3.0, 1e6);
    near(share_of_root_f64(&steep),
         t * t * (3.0 - 2.0 * t) + 3.0 * t * (1.0 - t) * (1.0 - t) -
             last * t * t * (1.0 - t),
         1e-13, "a flat begin");
    steep = c;
    steep.to_rate = chord_of / over(3.0, 1e6);
    near(share_of_root_f64(&steep),
         t * t * (3.0 - 2.0 * t) + first * t * (1.0 - t) * (1.0 - t) -
             3.0 * t * t * (1.0 - t),
         1e-13, "a flat end");
    curve_f64 against = c;
    against.from_rate = row % 3 ? -c.from_rate : 0.0;
    near(share_of_root_f64(&against), t, 1e-15, "a slope against the chord's");
    against = c;
    against.to_rate = row % 3 ? -c.to_rate : 0.0;
    near(share_of_root_f64(&against), t, 1e-15,
         "another slope against the chord's");
  }
}

/* ---- intervals ---- */

static const double limit = 0.05;

static T(plan) hopper_plan(void) {
  const T(robot) hopper = {25.0, 3.0,   1200.0, 0.4, 0.0,  150.0, 5.0, 0.78,
                           0.6,  -65.0, 9.81,   0.0, 0.08, 3.0,   0.05};
  T(plan) plan;
  must(T(plan_init)(&plan, &hopper) == HOPFORM_OK, "no plan");
  return plan;
}

static T(trial)
    trial_at(double u, double apex, double apex_u, double peak, double peak_u) {
  T(trial) trial = {0};
  trial.u = u;
  trial.apex = apex;
  trial.apex_u = apex_u;
  trial.largest_x1 = peak;
  trial.largest_x1_u = peak_u;
  trial.least_contact = 1e300;
  trial.takes_off = true;
  trial.smooth = true;
  trial.events = 7u;
  return trial;
}

static T(interval) interval_of(T(trial) from, T(trial) to) {
  const T(interval) interval = {from, to, 0.0, 0};
  return interval;
}

static T(search) search_for(const T(plan) * plan, double apex) {
  T(search) s;
  memset(&s, 0, sizeof s);
  s.plan = plan;
  s.apex = apex;
  s.limit = limit;
  s.horizon = 1.0;
  return s;
}

/* An apex that is a line in u, a peak far below its limit: what an interval
 * lower_bounds, and where it is split, are known. */
static void lines(void) {
  const T(plan) plan = hopper_plan();
  for (row = 0; row < 600; row++) {
    const double side = row % 2 ? 1.0 : -1.0, near_zero = uniform(0.0, 1.0),
                 width = over(1e-4, 1.4), rate = uniform(-0.1, 0.1);
    const double wanted = uniform(0.0, 0.3), gap = uniform(-0.1, 0.1),
                 peak = uniform(0.0, 0.04);
    const double u = side * near_zero, v = side * (near_zero + width),
                 after = gap + rate * (v - u);
    const T(interval) interval =
        interval_of(trial_at(u, wanted + gap, rate, peak, 0.0),
                    trial_at(v, wanted + after, rate, peak, 0.0));
    const T(search) s = search_for(&plan, wanted);
    near(width_of_f64(&interval), width, 1e-15 * (near_zero + width),
         "the width of an interval");
    const double lower_bound = lower_bound_of_f64(&s, &interval);
    if (gap * after > 0.0) {
      near(lower_bound, fmin(fabs(gap), fabs(after)), 1e-13,
           "what a line lower_bounds");
    } else {
      must(lower_bound <= 0.0, "a root that is not lower_boundd");
      near(share_to_try_f64(&s, &interval), gap / (gap - after), 1e-12,
           "the root of a line");
    }
    T(interval)
    high = interval; /* out of reach: x1 is beyond its limit at both ends, and
                    rises or falls in between */
    high.from.largest_x1 = limit + over(1e-9, 1e-2);
    high.to.largest_x1 = limit + over(1e-9, 1e-2);
    high.from.largest_x1_u =
        (high.to.largest_x1 - high.from.largest_x1) / (v - u);
    high.to.largest_x1_u = high.from.largest_x1_u;
    must(lower_bound_of_f64(&s, &high) >= 1e300, "a interval beyond the limit");
    high.from.largest_x1 = limit; /* at it counts as beyond */
    high.from.largest_x1_u =
        (high.to.largest_x1 - high.from.largest_x1) / (v - u);
    high.to.largest_x1_u = high.from.largest_x1_u;
    must(lower_bound_of_f64(&s, &high) >= 1e300 &&
             !is_admissible_f64(&s, &high.from),
         "a interval from the limit on");
    high.from.largest_x1 =
        limit + 1e-3; /* it dips below the limit in between */
    high.to.largest_x1 = limit + 1e-3;
    high.from.largest_x1_u = -side * 1.0 * 1e-2 / width;
    high.to.largest_x1_u = side * 1.0 * 1e-2 / width;
    must(lower_bound_of_f64(&s, &high) < 1e300,
         "a interval that dips below the limit");
    T(interval) edge = interval; /* x1 rises through its limit */
    const double there = uniform(0.05, 0.4);
    const int starts = row % 4 < 2;
    edge.from.largest_x1 =
        starts ? limit - 0.01 * there : limit + 0.01 * (1.0 - there);
    edge.to.largest_x1 =
        starts ? limit + 0.01 * (1.0 - there) : limit - 0.01 * there;
    edge.from.largest_x1_u =
        (edge.to.largest_x1 - edge.from.largest_x1) / (v - u);
    edge.to.largest_x1_u = edge.from.largest_x1_u;
    near(share_of_limit_f64(&s, &edge), starts ? there : 1.0 - there, 1e-9,
         "where x1 reaches its limit");
    const double inside = fabs(starts ? gap : after),
                 reach = 3.0 * fabs(rate) * 2.0 * there * width;
    near(lower_bound_of_f64(&s, &edge), larger(lower_bound, inside - reach),
         1e-9, "what is admissible up to the limit");
    const double aside = share_to_try_f64(&s, &edge);
    must(gap * after < 0.0 ||
             (starts ? aside < there && aside > there - 0.3
                     : aside > 1.0 - there && aside < 1.0 - there + 0.3),
         "just inside the limit");
  }
}

/* What the widths of docs/explanation/controller.md say: wider intervals are
 * not bounded by their ends. */
static void widths(void) {
  const T(plan) plan = hopper_plan();
  const T(search) s = search_for(&plan, 0.5);
  const double most = plan.robot.u_max;
  for (row = 0; row < 4; row++) {
    const double share =
        row == 0 ? 0.5
                 : (row == 1 ? 0.25 : (row == 2 ? 1.0 / 16.0 : 1.0 / 256.0));
    for (int n = 0; n < 2; n++) {
      const double v = most * share * (n == 0 ? 1.0 : 1.0 + 1e-9);
      T(trial)
      from = trial_at(0.0, 0.1, 0.01, 0.01, 0.0),
      to = trial_at(v, 0.1 + 0.01 * v, 0.01, 0.01, 0.0);
      to.events = row == 0 ? from.events : 8u;
      from.takes_off = row < 2;
      to.takes_off = row != 2;
      const T(interval) interval = interval_of(from, to);
      const double lower_bound = lower_bound_of_f64(&s, &interval);
      const double wanted =
          n == 1 ? 0.0
                 : (row < 2
                        ? 0.4 - 0.01 * v
                        : (row == 2 ? 1e300 : 0.4 - 0.01 * v - 3.0 * v * 0.01));
      near(lower_bound, wanted, 1e-12 * (1.0 + fabs(wanted)),
           "the lower bound of an interval as wide as is bounded");
      T(interval) other = interval_of(to, from); /* the other way round */
      other.from.u = 0.0;
      other.to.u = v;
      must(row < 3 || fabs(lower_bound_of_f64(&s, &other) - wanted) < 1e-12,
           "a step downwards");
    }
    const T(trial)
        held = {0.0, 0.0, 0.0, 0.0, 0.0, 1e300, 0.0, 0u, 0, false, true, true};
    T(interval) still = interval_of(held, held);
    still.to.u = most;
    must(lower_bound_of_f64(&s, &still) >= 1e300,
         "an actuator that is held from one end to the other");
    still.to.held = false;
    must(!(lower_bound_of_f64(&s, &still) > 0.0),
         "an actuator that begins to move");
  }
  const double u = 1.5;
  for (row = 0; row < 2; row++) { /* next to each other */
    const T(interval) narrow =
        interval_of(trial_at(u, 0.49, 0.0, 0.01, 0.0),
                    trial_at(u * (1.0 + (row ? 3.1 : 1.9) * 2.22e-16), 0.51,
                             0.0, 0.01, 0.0));
    must((lower_bound_of_f64(&s, &narrow) >= 1e300) == (row == 0),
         "a interval without a number in it");
  }
  const T(interval) two =
      interval_of(trial_at(1.0 - 0x1p-51, 0.49, 0.0, 0.01, 0.0),
                  trial_at(1.0, 0.51, 0.0, 0.01, 0.0)); /* two ulp of 1 wide */
  must(lower_bound_of_f64(&s, &two) >= 1e300,
       "a interval that is as narrow as counts");
  T(trial)
  lifts = trial_at(0.0, 0.1, 0.01, limit + 0.002, -0.1),
  falls = trial_at(0.01, 0.0, 0.0, 0.0, 0.0);
  falls.takes_off = false;
  T(interval)
  step = interval_of(lifts, falls); /* x1 may come below its limit by 2 widths
                                   of slope: 2 mm, not quite */
  must(lower_bound_of_f64(&s, &step) >= 1e300, "a step beyond the limit");
  step.from.largest_x1 = limit + 0.0019;
  must(lower_bound_of_f64(&s, &step) < 1e300,
       "a step that may come below the limit");
  T(trial)
  flat = trial_at(0.0, 0.1, 0.0, limit - 0.01, 1.0),
  over_it = trial_at(most / 64.0, 0.1, 0.0, limit + 0.01, -1.0);
  T(interval)
  edge = interval_of(flat, over_it); /* the slopes disagree: by the admissible
                                    one, if the interval is narrow */
  near(lower_bound_of_f64(&s, &edge), 0.4, 1e-12,
       "a limit in an interval as narrow as is bounded");
  near(share_of_limit_f64(&s, &edge), 0.01 / (most / 64.0), 1e-12,
       "the limit by the slope at its admissible end");
  edge.to.u = most / 64.0 * (1.0 + 1e-9);
  must(lower_bound_of_f64(&s, &edge) <= 0.4 &&
           lower_bound_at_limit_f64(
               &s, &edge,
               &(curve_f64){-0.4, 0.0, -0.4, 0.0, edge.to.u, true}) <= 0.0,
       "a limit in a wider interval");
}

/* Rebounds: quiet where the least y stays above zero by slopes. */
static void rebounds(void) {
  for (row = 0; row < 400; row++) {
    const double side = row % 2 ? 1.0 : -1.0, width = over(1e-3, 1.0),
                 low = over(1e-5, 1e-2), high = over(1e-5, 1e-2);
    T(interval)
    interval = interval_of(trial_at(0.0, 0.1, 0.0, 0.0, 0.0),
                           trial_at(side * width, 0.1, 0.0, 0.0, 0.0));
    must(minima_are_positive_f64(&interval), "no rebound, and not quiet");
    interval.from.minima = 1 + row % 3;
    interval.from.least_contact = low;
    interval.from.least_contact_u =
        0.9 * low / width * side * (row % 4 < 2 ? 1.0 : -1.0);
    must(minima_are_positive_f64(&interval),
         "a rebound that can not reach zero");
    interval.from.least_contact_u *= 1.2;
    must(!minima_are_positive_f64(&interval),
         "a rebound that might reach zero");
    interval.from.least_contact_u = low / width;
    must(!minima_are_positive_f64(&interval) || fabs(low / width) * width < low,
         "a rebound that just reaches zero");
    T(interval) other = interval_of(interval.to, interval.from);
    other.from.u = 0.0;
    other.to.u = side * width;
    other.to.least_contact_u = 0.9 * low / width;
    must(minima_are_positive_f64(&other),
         "a rebound at the far end that can not reach zero");
    other.to.least_contact_u = 1.1 * low / width;
    must(!minima_are_positive_f64(&other),
         "a rebound at the far end that might reach zero");
    interval.to.minima = 1;
    interval.to.least_contact = high;
    interval.from.least_contact_u = side * (high - low) / width;
    interval.to.least_contact_u = interval.from.least_contact_u;
    must(minima_are_positive_f64(&interval),
         "rebounds along a line above zero");
    interval.from.least_contact_u = -side * 8.0 * (low + high) / width;
    interval.to.least_contact_u = side * 8.0 * (low + high) / width;
    must(!minima_are_positive_f64(&interval),
         "rebounds that fall and rise again");
    T(plan) plan = hopper_plan();
    const T(search) s = search_for(&plan, 0.5);
    T(interval)
    down = interval; /* no take-off: split where the least y is least */
    down.from.takes_off = false;
    down.to.takes_off = false;
    const double share = share_to_try_f64(&s, &down);
    const polynomial f = {{low, -8.0 * (low + high), 0.0, 0.0}};
    const double sum = 0.0,
                 chord_of =
                     high - low; /* the cubic of these ends, over 0 .. 1 */
    const polynomial dip = {{low, f.c[1],
                             3.0 * chord_of - 2.0 * f.c[1] + f.c[1],
                             sum - 2.0 * chord_of}};
    near(slope_of(&dip, share), 0.0, 1e-9 * (low + high),
         "where a rebound is least");
    down.to.minima = 0;
    near(share_to_try_f64(&s, &down), 0.5, 1e-300, "a rebound at one end");
    down.to.minima = 1;
    down.from.minima = 0;
    near(share_to_try_f64(&s, &down), 0.5, 1e-300,
         "a rebound at the other end");
  }
}

/* Where an interval is split: not where it is too wide to be bounded, has been
 * slow, or at one end of which nothing takes off. */
static void splits(void) {
  const T(plan) plan = hopper_plan();
  const T(search) s = search_for(&plan, 0.2);
  const double most = plan.robot.u_max;
  for (row = 0; row < 200; row++) {
    const double v = most * over(1e-3, 0.5);
    T(interval)
    interval = interval_of(trial_at(0.0, 0.1, 0.2 / v * 0.25, 0.01, 0.0),
                           trial_at(v, 0.15, 0.05 / v, 0.01, 0.0));
    interval.to.apex = 0.2 + 0.05; /* a root: a quarter of the way from 0.1
                                  below to 0.05 above would be 2/3 */
    interval.from.apex_u = 0.15 / v;
    interval.to.apex_u = 0.15 / v;
    near(share_to_try_f64(&s, &interval), 2.0 / 3.0, 1e-12,
         "two thirds of the way");
    interval.slow = 1;
    near(share_to_try_f64(&s, &interval), 2.0 / 3.0, 1e-12, "slow once");
    interval.slow = 2;
    near(share_to_try_f64(&s, &interval), 0.5, 1e-300, "slow twice");
    interval.slow = 0;
    interval.to.takes_off = false;
    near(share_to_try_f64(&s, &interval), 0.5, 1e-300, "a step");
    interval.to.takes_off = true;
    interval.to.u = most * 0.5000001;
    near(share_to_try_f64(&s, &interval), 0.5, 1e-300, "too wide");
    interval.to.u = v; /* an extremum: the gap comes nearer from both ends */
    const double at = uniform(0.1, 0.9), deep = 0.02;
    interval.from.apex = 0.1 - deep * at * at;
    interval.to.apex = 0.1 - deep * (1.0 - at) * (1.0 - at);
    interval.from.apex_u = 2.0 * deep * at / v;
    interval.to.apex_u = -2.0 * deep * (1.0 - at) / v;
    near(share_to_try_f64(&s, &interval), at, 1e-9, "where the gap is least");
    interval.from.apex += 0.25; /* from above */
    interval.from.apex = 0.3 + deep * at * at;
    interval.to.apex = 0.3 + deep * (1.0 - at) * (1.0 - at);
    interval.from.apex_u = -2.0 * deep * at / v;
    interval.to.apex_u = 2.0 * deep * (1.0 - at) / v;
    near(share_to_try_f64(&s, &interval), at, 1e-9,
         "where the gap from above is least");
    const double rim = row % 2 ? 0.01 : 0.99; /* kept off the ends by a 32nd */
    interval.from.apex_u = -2.0 * deep * rim / v;
    interval.to.apex_u = 2.0 * deep * (1.0 - rim) / v;
    interval.from.apex = 0.3 + deep * rim * rim;
    interval.to.apex = 0.3 + deep * (1.0 - rim) * (1.0 - rim);
    near(share_to_try_f64(&s, &interval), row % 2 ? 1.0 / 32.0 : 31.0 / 32.0,
         1e-15, "off the ends");
    interval.from.apex_u = 1.0; /* it only rises: in the middle */
    interval.to.apex_u = 1.0;
    interval.to.apex = interval.from.apex + v;
    near(share_to_try_f64(&s, &interval), 0.5, 1e-300, "no extremum");
    interval.from.largest_x1 =
        limit + 0.02 * at * at +
        0.001; /* out of reach at both ends: where x1 is least */
    interval.to.largest_x1 = limit + 0.02 * (1.0 - at) * (1.0 - at) + 0.001;
    interval.from.largest_x1_u = -0.04 * at / v;
    interval.to.largest_x1_u = 0.04 * (1.0 - at) / v;
    near(share_to_try_f64(&s, &interval), at, 1e-9, "where x1 is least");
  }
  T(interval)
  edge = interval_of(trial_at(0.0, 0.1, 0.001, limit - 0.01, 0.1),
                     trial_at(0.1, 0.1001, 0.001, limit + 0.01, -1.0));
  const double rates = 3.0 * 0.001;
  const double aside =
      0.25 * 2e-10 /
      (rates * 0.1 +
       2e-10); /* a quarter of what the apex may be off, by slopes */
  const curve_f64 gap = gap_of_f64(&edge, 0.2);
  edge.from.largest_x1_u = 0.2; /* half of the way by the slope at the
                                   admissible end; the other one disagrees */
  near(share_inside_f64(&s, &edge, &gap), 0.5 - aside - 1.0 / 64.0, 1e-12,
       "just inside, short of it by a sixteenth of the square");
  edge.from.largest_x1_u = 0.1 / 0.98;
  near(share_inside_f64(&s, &edge, &gap), 0.98 - aside - 0.98 * 0.98 / 16.0,
       1e-12, "inside, near the end");
  edge.from.largest_x1_u = 0.01; /* a tenth of the way, and no more */
  must(share_inside_f64(&s, &edge, &gap) >= 1e299, "no way to the limit");
  T(interval) back = interval_of(edge.to, edge.from);
  back.from.u = 0.0;
  back.to.u = 0.1;
  const curve_f64 gap_back = gap_of_f64(&back, 0.2);
  back.to.largest_x1_u = -0.2;
  near(share_inside_f64(&s, &back, &gap_back), 0.5 + aside + 1.0 / 64.0, 1e-12,
       "just inside from the far end");
  back.to.largest_x1_u = -0.1 / 0.98;
  near(share_inside_f64(&s, &back, &gap_back),
       0.02 + aside + 0.98 * 0.98 / 16.0, 1e-12, "inside, near the near end");
  back.to.largest_x1_u = -0.01;
  must(share_inside_f64(&s, &back, &gap_back) <= -1e299,
       "no way to the limit from the far end");
  edge.from.largest_x1_u = -0.1; /* away from the limit: never */
  must(share_of_limit_f64(&s, &edge) >= 1e300, "a slope that leads away");
  edge.from.largest_x1_u = 0.0;
  must(share_of_limit_f64(&s, &edge) >= 1e300, "a slope that leads nowhere");
  edge.from.largest_x1_u = 0.1; /* exactly to its end */
  near(share_of_limit_f64(&s, &edge), 1.0, 1e-12,
       "a slope that leads to the end");
}

/* ---- the row of intervals ---- */

static void rows_of_cells(void) {
  const T(plan) plan = hopper_plan();
  T(search) s = search_for(&plan, 0.2);
  enum { CELLS = HOPFORM_SEARCH_INTERVALS_f64 };
  for (int n = 0; n < CELLS + 3;
       n++) { /* all may hold the root; what does not fit is reported */
    const double u = 0.03 * n;
    const T(trial) from = trial_at(u, 0.1, 5.0, 0.01, 0.0),
                   to = trial_at(u + 0.03, 0.25, 5.0, 0.01, 0.0);
    add_interval_f64(&s, &from, &to, n);
    must(s.count == (n < CELLS ? n + 1 : CELLS) && s.partial == (n >= CELLS),
         "a row that is full");
    must(n >= CELLS ||
             (s.intervals[n].slow == n && !(s.intervals[n].lower_bound > 0.0) &&
              !(fabs(s.intervals[n].from.u - u) > 0.0)),
         "a interval that is kept");
  }
  prune_f64(&s);
  must(s.count == CELLS && !(fabs(s.intervals[CELLS - 1].from.u) > 0.0) &&
           fabs(s.intervals[0].from.u - 0.03 * (CELLS - 1)) < 1e-12,
       "the nearest to 0 last");
  double sum = 0.0;
  for (int n = 0; n < CELLS; n++) {
    sum += s.intervals[n].from.u;
  }
  near(sum, 0.03 * CELLS * (CELLS - 1) / 2.0, 1e-12, "a interval that is lost");
  s.intervals[5].lower_bound = -1.0; /* lower_bounds more */
  const double best = s.intervals[5].from.u;
  prune_f64(&s);
  must(!(fabs(s.intervals[CELLS - 1].from.u - best) > 0.0) && s.count == CELLS,
       "the most promising last");
  s.intervals[7].lower_bound = 1e300; /* nothing in it */
  const double gone = s.intervals[7].from.u;
  prune_f64(&s);
  must(s.count == CELLS - 1 &&
           !(fabs(s.intervals[CELLS - 2].from.u - best) > 0.0),
       "a interval that is left");
  for (int n = 0; n < s.count; n++) {
    must(fabs(s.intervals[n].from.u - gone) > 1e-9,
         "a interval that is not left");
  }
  s.found = true; /* something within 1e-3: intervals that lower_bound no better
                     are left */
  s.best = trial_at(0.3, 0.201, 0.0, 0.0, 0.0);
  for (int n = 0; n < s.count; n++) {
    s.intervals[n].lower_bound = n % 2 ? 1e-3 : 1e-4;
  }
  const int count = s.count;
  prune_f64(&s);
  must(s.count == (count + 1) / 2, "what is no better");
  near(gap_to_beat_f64(&s), 1e-3 - 4e-10, 1e-12, "what is worth looking for");
  s.best.apex = 0.2 + 3e-10;
  must(!(gap_to_beat_f64(&s) > 0.0), "near enough");
  s.reached =
      true; /* only smaller currents matter, where a root is lower_boundd */
  s.best = trial_at(0.3, 0.2, 0.0, 0.0, 0.0);
  T(interval)
  c = interval_of(trial_at(0.29, 0.1, 0.0, 0.0, 0.0),
                  trial_at(0.5, 0.3, 0.0, 0.0, 0.0));
  must(may_improve_f64(&s, &c), "a interval that begins nearer to 0");
  c.lower_bound = 1e-13;
  must(!may_improve_f64(&s, &c), "a interval without a root");
  c.lower_bound = 0.0;
  c.from.u = -0.3;
  must(!may_improve_f64(&s, &c), "a interval that begins as far from 0");
  T(search) none = search_for(&plan, 0.2);
  prune_f64(&none);
  must(none.count == 0 && !branch_f64(&none), "an empty row");
}

static void what_is_better(void) {
  const T(plan) plan = hopper_plan();
  T(search) s = search_for(&plan, 0.2);
  T(command) command;
  report_command_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_NO_TAKEOFF &&
           !(fabs(command.u) + fabs(command.apex) > 0.0),
       "nothing found");
  T(trial) trial = trial_at(1.0, 0.1, 0.0, limit, 0.0);
  update_incumbent_f64(&s, &trial);
  must(!s.found, "x1 at its limit");
  trial.largest_x1 = limit - 1e-9;
  trial.takes_off = false;
  update_incumbent_f64(&s, &trial);
  must(!s.found, "no take-off");
  trial.takes_off = true;
  update_incumbent_f64(&s, &trial);
  must(s.found && !s.reached && !(fabs(s.best.u - 1.0) > 0.0), "the first");
  const double apexes[] = {0.31, 0.3, 0.29, 0.11, 0.2 + 1.1e-14,
                           0.2,  0.2, 0.2,  0.2}; /* from 0.1 wanted 0.2 */
  const double currents[] = {0.1, 0.1, 2.0, 0.1, 2.5, -2.0, 2.0, 1.5, -1.6};
  const double kept[] = {1.0, 1.0, 2.0, 2.0, 2.5, -2.0, -2.0, 1.5, 1.5};
  for (int n = 0; n < 9; n++) {
    trial.u = currents[n];
    trial.apex = apexes[n];
    row = n;
    update_incumbent_f64(&s, &trial);
    must(!(fabs(s.best.u - kept[n]) > 0.0) || n == 1 || n == 3,
         "the better one");
    s.best.u =
        n == 1 || n == 3 ? kept[n] : s.best.u; /* as near but for rounding */
    s.best.apex = n == 1 ? 0.1 : (n == 3 ? 0.29 : s.best.apex);
    must(s.reached == (n > 4), "reached");
  }
  trial.u = 0.1;
  trial.apex = 0.2 + 2e-14;
  update_incumbent_f64(&s, &trial);
  must(s.best.u > 1.0, "near, and not as near");
  s.datum = 0.05;
  report_command_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_REACHED &&
           fabs(command.apex - 0.15) < 1e-15 && !(fabs(command.u - 1.5) > 0.0),
       "what is said");
  s.best.apex = 0.2 + 1.99e-10;
  report_command_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_REACHED, "near enough to count");
  s.best.apex = 0.2 - 2.01e-10;
  report_command_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_NEAREST, "too far off to count");
  const T(interval) meets = interval_of(
      trial_at(0.0, 0.2, 0.1, 0.0, 0.0),
      trial_at(1.0, 0.3, 0.1, 0.0, 0.0)); /* an end that reaches it */
  must(gap_of_f64(&meets, 0.2).from > 0.0 && gap_of_f64(&meets, 0.3).to < 0.0,
       "an end that reaches it is on the other one's side");
  const T(interval) falls = interval_of(trial_at(0.0, 0.3, -0.1, 0.0, 0.0),
                                        trial_at(-1.0, 0.2, 0.1, 0.0, 0.0));
  must(gap_of_f64(&falls, 0.2).to > 0.0 && gap_of_f64(&falls, 0.3).from < 0.0,
       "an end that reaches it from the other side");
  const T(interval) just =
      interval_of(trial_at(0.0, 1e-14, 0.1, 0.0, 0.0),
                  trial_at(1.0, 0.1, 0.1, 0.0, 0.0)); /* as near as counts */
  const T(interval) ends = interval_of(trial_at(0.0, -0.1, 0.1, 0.0, 0.0),
                                       trial_at(1.0, -1e-14, 0.1, 0.0, 0.0));
  must(gap_of_f64(&just, 0.0).from > 0.0 && gap_of_f64(&ends, 0.0).to < 0.0,
       "as near as counts, on the same side");
  const T(interval) across = interval_of(trial_at(0.0, -1e-14, 0.1, 0.0, 0.0),
                                         trial_at(1.0, 0.1, 0.1, 0.0, 0.0));
  const T(interval) beyond = interval_of(trial_at(0.0, -0.1, 0.1, 0.0, 0.0),
                                         trial_at(1.0, 1e-14, 0.1, 0.0, 0.0));
  must(gap_of_f64(&across, 0.0).from > 0.0 && gap_of_f64(&beyond, 0.0).to < 0.0,
       "as near as counts, on the other side");
  near(gap_of_f64(&falls, 0.2).to_rate, -0.1, 1e-300, "a slope outward from 0");
}

/* 0 leaves the actuator on a stop: a current that pushes it onto that changes
 * nothing, one that pulls it off is tried. */
static void on_a_stop(void) {
  for (row = 0; row < 16; row++) {
    T(robot)
    robot = {25.0, 3.0,   1200.0, 0.4, 0.0,  150.0, 5.0, 0.78,
             0.6,  -65.0, 9.81,   0.0, 0.08, 3.0,   0.05};
    robot.gamma2 = row % 2 ? 65.0 : -65.0;
    T(plan) plan;
    must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
    T(search) s = search_for(&plan, 0.2);
    const int where =
        row / 2 % 3; /* at the lower stop, between, at the upper one */
    s.start.x1 = where == 0 ? 0.0 : (where == 1 ? 0.04 : 0.08);
    s.zero.held = row < 12;
    for (int sign = -1; sign <= 1; sign += 2) {
      const int pushes_up = (robot.gamma2 < 0.0) == (sign > 0); /* -gamma2 u */
      const int onto = where == 0 ? !pushes_up : (where == 2 && pushes_up);
      must(changes_nothing_f64(&s, (double)sign) == (s.zero.held && onto),
           "a current that pushes onto a stop");
    }
    s.limits = 2;
    s.count = 0;
    const bool goes = branch_f64(&s);
    const int first =
        s.zero.held && where == 0 && row % 2
            ? -1
            : (s.zero.held && where == 2 && row % 2 == 0 ? -1 : 1);
    must(goes && !(fabs(s.next - 3.0 * first) > 0.0) &&
             s.limits == (first > 0 ? 1 : 0),
         "the first limit to try");
  }
}

int main(int argc, char **argv) {
  listen(argc, argv);
  cubics();
  roots();
  lines();
  widths();
  rebounds();
  splits();
  rows_of_cells();
  what_is_better();
  on_a_stop();
  return conclude();
}
