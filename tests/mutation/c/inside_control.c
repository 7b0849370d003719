/* The judge of mutants in the controller: what it concludes from the ends of a
 * cell, function by function, against cubics whose values, slopes, roots and
 * extrema are known, and against the bounds of docs/explanation/controller.md.
 * Prints what is wrong and ends with 1.
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
    near(doubt_f64(&c), 0.25 * third + line / 32.0, 1e-12 * size / width,
         "the doubt");
    for (int n = 0; n <= 8; n++) {
      near(cubic_at_f64(&c, (double)n / 8.0),
           value_of(&f, width * (double)n / 8.0), 1e-13 * size,
           "the cubic of its ends");
    }
    near(least_slope_f64(&c), s.least_slope,
         1e-12 * size / width + third * 4e-7, "the least slope");
    must(!rises_f64(&c) || s.least_slope > 0.0, "what is said to rise");
    must(rises_f64(&c) == (s.least_slope > 4.0 * doubt_f64(&c)) ||
             fabs(s.least_slope - 4.0 * doubt_f64(&c)) < 1e-5 * size / width,
         "what rises without doubt");
    must(is_monotone_f64(&c) == (s.least_slope > 4.0 * doubt_f64(&c) ||
                                 s.most_slope < -4.0 * doubt_f64(&c)) ||
             fabs(s.least_slope - 4.0 * doubt_f64(&c)) < 1e-5 * size / width ||
             fabs(s.most_slope + 4.0 * doubt_f64(&c)) < 1e-5 * size / width,
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
    must(bound >= s.least - 4.0 * width * doubt_f64(&c) - 1e-12 * size ||
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
      near(bound, s.least - width * doubt_f64(&c), 1e-6 * size,
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

/* ---- cells ---- */

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

static T(cell) cell_of(T(trial) from, T(trial) to) {
  const T(cell) cell = {from, to, 0.0, 0};
  return cell;
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

/* An apex that is a line in u, a peak far below its limit: what a cell
 * promises, and where it is split, are known. */
static void lines(void) {
  const T(plan) plan = hopper_plan();
  for (row = 0; row < 600; row++) {
    const double side = row % 2 ? 1.0 : -1.0, near_zero = uniform(0.0, 1.0),
                 width = over(1e-4, 1.4), rate = uniform(-0.1, 0.1);
    const double wanted = uniform(0.0, 0.3), gap = uniform(-0.1, 0.1),
                 peak = uniform(0.0, 0.04);
    const double u = side * near_zero, v = side * (near_zero + width),
                 after = gap + rate * (v - u);
    const T(cell) cell = cell_of(trial_at(u, wanted + gap, rate, peak, 0.0),
                                 trial_at(v, wanted + after, rate, peak, 0.0));
    const T(search) s = search_for(&plan, wanted);
    near(width_of_f64(&cell), width, 1e-15 * (near_zero + width),
         "the width of a cell");
    const double promise = promise_of_f64(&s, &cell);
    if (gap * after > 0.0) {
      near(promise, fmin(fabs(gap), fabs(after)), 1e-13,
           "what a line promises");
    } else {
      must(promise <= 0.0, "a root that is not promised");
      near(share_to_try_f64(&s, &cell), gap / (gap - after), 1e-12,
           "the root of a line");
    }
    T(cell)
    high = cell; /* out of reach: x1 is beyond its limit at both ends, and rises
                    or falls in between */
    high.from.largest_x1 = limit + over(1e-9, 1e-2);
    high.to.largest_x1 = limit + over(1e-9, 1e-2);
    high.from.largest_x1_u =
        (high.to.largest_x1 - high.from.largest_x1) / (v - u);
    high.to.largest_x1_u = high.from.largest_x1_u;
    must(promise_of_f64(&s, &high) >= 1e300, "a cell beyond the limit");
    high.from.largest_x1 = limit; /* at it counts as beyond */
    high.from.largest_x1_u =
        (high.to.largest_x1 - high.from.largest_x1) / (v - u);
    high.to.largest_x1_u = high.from.largest_x1_u;
    must(promise_of_f64(&s, &high) >= 1e300 &&
             !is_admissible_f64(&s, &high.from),
         "a cell from the limit on");
    high.from.largest_x1 =
        limit + 1e-3; /* it dips below the limit in between */
    high.to.largest_x1 = limit + 1e-3;
    high.from.largest_x1_u = -side * 1.0 * 1e-2 / width;
    high.to.largest_x1_u = side * 1.0 * 1e-2 / width;
    must(promise_of_f64(&s, &high) < 1e300, "a cell that dips below the limit");
    T(cell) edge = cell; /* x1 rises through its limit */
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
    near(promise_of_f64(&s, &edge), larger(promise, inside - reach), 1e-9,
         "what is admissible up to the limit");
    const double aside = share_to_try_f64(&s, &edge);
    must(gap * after < 0.0 ||
             (starts ? aside < there && aside > there - 0.3
                     : aside > 1.0 - there && aside < 1.0 - there + 0.3),
         "just inside the limit");
  }
}

/* What the widths of docs/explanation/controller.md say: wider cells are not
 * judged by their ends. */
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
      const T(cell) cell = cell_of(from, to);
      const double promise = promise_of_f64(&s, &cell);
      const double wanted =
          n == 1 ? 0.0
                 : (row < 2
                        ? 0.4 - 0.01 * v
                        : (row == 2 ? 1e300 : 0.4 - 0.01 * v - 3.0 * v * 0.01));
      near(promise, wanted, 1e-12 * (1.0 + fabs(wanted)),
           "a promise of a cell as wide as is judged");
      T(cell) other = cell_of(to, from); /* the other way round */
      other.from.u = 0.0;
      other.to.u = v;
      must(row < 3 || fabs(promise_of_f64(&s, &other) - wanted) < 1e-12,
           "a step downwards");
    }
    const T(trial)
        held = {0.0, 0.0, 0.0, 0.0, 0.0, 1e300, 0.0, 0u, 0, false, true, true};
    T(cell) still = cell_of(held, held);
    still.to.u = most;
    must(promise_of_f64(&s, &still) >= 1e300,
         "an actuator that is held from one end to the other");
    still.to.held = false;
    must(!(promise_of_f64(&s, &still) > 0.0),
         "an actuator that begins to move");
  }
  const double u = 1.5;
  for (row = 0; row < 2; row++) { /* next to each other */
    const T(cell) narrow =
        cell_of(trial_at(u, 0.49, 0.0, 0.01, 0.0),
                trial_at(u * (1.0 + (row ? 3.1 : 1.9) * 2.22e-16), 0.51, 0.0,
                         0.01, 0.0));
    must((promise_of_f64(&s, &narrow) >= 1e300) == (row == 0),
         "a cell without a number in it");
  }
  const T(cell) two =
      cell_of(trial_at(1.0 - 0x1p-51, 0.49, 0.0, 0.01, 0.0),
              trial_at(1.0, 0.51, 0.0, 0.01, 0.0)); /* two ulp of 1 wide */
  must(promise_of_f64(&s, &two) >= 1e300, "a cell that is as narrow as counts");
  T(trial)
  lifts = trial_at(0.0, 0.1, 0.01, limit + 0.002, -0.1),
  falls = trial_at(0.01, 0.0, 0.0, 0.0, 0.0);
  falls.takes_off = false;
  T(cell)
  step = cell_of(lifts, falls); /* x1 may come below its limit by 2 widths of
                                   slope: 2 mm, not quite */
  must(promise_of_f64(&s, &step) >= 1e300, "a step beyond the limit");
  step.from.largest_x1 = limit + 0.0019;
  must(promise_of_f64(&s, &step) < 1e300,
       "a step that may come below the limit");
  T(trial)
  flat = trial_at(0.0, 0.1, 0.0, limit - 0.01, 1.0),
  over_it = trial_at(most / 64.0, 0.1, 0.0, limit + 0.01, -1.0);
  T(cell)
  edge = cell_of(flat, over_it); /* the slopes disagree: by the admissible one,
                                    if the cell is narrow */
  near(promise_of_f64(&s, &edge), 0.4, 1e-12,
       "a limit in a cell as narrow as is judged");
  near(share_of_limit_f64(&s, &edge), 0.01 / (most / 64.0), 1e-12,
       "the limit by the slope at its admissible end");
  edge.to.u = most / 64.0 * (1.0 + 1e-9);
  must(promise_of_f64(&s, &edge) <= 0.4 &&
           promise_of_edge_f64(
               &s, &edge,
               &(curve_f64){-0.4, 0.0, -0.4, 0.0, edge.to.u, true}) <= 0.0,
       "a limit in a wider cell");
}

/* Rebounds: quiet where the least y stays above zero by slopes. */
static void rebounds(void) {
  for (row = 0; row < 400; row++) {
    const double side = row % 2 ? 1.0 : -1.0, width = over(1e-3, 1.0),
                 low = over(1e-5, 1e-2), high = over(1e-5, 1e-2);
    T(cell)
    cell = cell_of(trial_at(0.0, 0.1, 0.0, 0.0, 0.0),
                   trial_at(side * width, 0.1, 0.0, 0.0, 0.0));
    must(minima_are_positive_f64(&cell), "no rebound, and not quiet");
    cell.from.minima = 1 + row % 3;
    cell.from.least_contact = low;
    cell.from.least_contact_u =
        0.9 * low / width * side * (row % 4 < 2 ? 1.0 : -1.0);
    must(minima_are_positive_f64(&cell), "a rebound that can not reach zero");
    cell.from.least_contact_u *= 1.2;
    must(!minima_are_positive_f64(&cell), "a rebound that might reach zero");
    cell.from.least_contact_u = low / width;
    must(!minima_are_positive_f64(&cell) || fabs(low / width) * width < low,
         "a rebound that just reaches zero");
    T(cell) other = cell_of(cell.to, cell.from);
    other.from.u = 0.0;
    other.to.u = side * width;
    other.to.least_contact_u = 0.9 * low / width;
    must(minima_are_positive_f64(&other),
         "a rebound at the far end that can not reach zero");
    other.to.least_contact_u = 1.1 * low / width;
    must(!minima_are_positive_f64(&other),
         "a rebound at the far end that might reach zero");
    cell.to.minima = 1;
    cell.to.least_contact = high;
    cell.from.least_contact_u = side * (high - low) / width;
    cell.to.least_contact_u = cell.from.least_contact_u;
    must(minima_are_positive_f64(&cell), "rebounds along a line above zero");
    cell.from.least_contact_u = -side * 8.0 * (low + high) / width;
    cell.to.least_contact_u = side * 8.0 * (low + high) / width;
    must(!minima_are_positive_f64(&cell), "rebounds that fall and rise again");
    T(plan) plan = hopper_plan();
    const T(search) s = search_for(&plan, 0.5);
    T(cell) down = cell; /* no take-off: split where the least y is least */
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

/* Where a cell is split: not where it is too wide to be judged, has been slow,
 * or at one end of which nothing takes off. */
static void splits(void) {
  const T(plan) plan = hopper_plan();
  const T(search) s = search_for(&plan, 0.2);
  const double most = plan.robot.u_max;
  for (row = 0; row < 200; row++) {
    const double v = most * over(1e-3, 0.5);
    T(cell)
    cell = cell_of(trial_at(0.0, 0.1, 0.2 / v * 0.25, 0.01, 0.0),
                   trial_at(v, 0.15, 0.05 / v, 0.01, 0.0));
    cell.to.apex = 0.2 + 0.05; /* a root: a quarter of the way from 0.1 below to
                                  0.05 above would be 2/3 */
    cell.from.apex_u = 0.15 / v;
    cell.to.apex_u = 0.15 / v;
    near(share_to_try_f64(&s, &cell), 2.0 / 3.0, 1e-12,
         "two thirds of the way");
    cell.slow = 1;
    near(share_to_try_f64(&s, &cell), 2.0 / 3.0, 1e-12, "slow once");
    cell.slow = 2;
    near(share_to_try_f64(&s, &cell), 0.5, 1e-300, "slow twice");
    cell.slow = 0;
    cell.to.takes_off = false;
    near(share_to_try_f64(&s, &cell), 0.5, 1e-300, "a step");
    cell.to.takes_off = true;
    cell.to.u = most * 0.5000001;
    near(share_to_try_f64(&s, &cell), 0.5, 1e-300, "too wide");
    cell.to.u = v; /* an extremum: the gap comes nearer from both ends */
    const double at = uniform(0.1, 0.9), deep = 0.02;
    cell.from.apex = 0.1 - deep * at * at;
    cell.to.apex = 0.1 - deep * (1.0 - at) * (1.0 - at);
    cell.from.apex_u = 2.0 * deep * at / v;
    cell.to.apex_u = -2.0 * deep * (1.0 - at) / v;
    near(share_to_try_f64(&s, &cell), at, 1e-9, "where the gap is least");
    cell.from.apex += 0.25; /* from above */
    cell.from.apex = 0.3 + deep * at * at;
    cell.to.apex = 0.3 + deep * (1.0 - at) * (1.0 - at);
    cell.from.apex_u = -2.0 * deep * at / v;
    cell.to.apex_u = 2.0 * deep * (1.0 - at) / v;
    near(share_to_try_f64(&s, &cell), at, 1e-9,
         "where the gap from above is least");
    const double rim = row % 2 ? 0.01 : 0.99; /* kept off the ends by a 32nd */
    cell.from.apex_u = -2.0 * deep * rim / v;
    cell.to.apex_u = 2.0 * deep * (1.0 - rim) / v;
    cell.from.apex = 0.3 + deep * rim * rim;
    cell.to.apex = 0.3 + deep * (1.0 - rim) * (1.0 - rim);
    near(share_to_try_f64(&s, &cell), row % 2 ? 1.0 / 32.0 : 31.0 / 32.0, 1e-15,
         "off the ends");
    cell.from.apex_u = 1.0; /* it only rises: in the middle */
    cell.to.apex_u = 1.0;
    cell.to.apex = cell.from.apex + v;
    near(share_to_try_f64(&s, &cell), 0.5, 1e-300, "no extremum");
    cell.from.largest_x1 =
        limit + 0.02 * at * at +
        0.001; /* out of reach at both ends: where x1 is least */
    cell.to.largest_x1 = limit + 0.02 * (1.0 - at) * (1.0 - at) + 0.001;
    cell.from.largest_x1_u = -0.04 * at / v;
    cell.to.largest_x1_u = 0.04 * (1.0 - at) / v;
    near(share_to_try_f64(&s, &cell), at, 1e-9, "where x1 is least");
  }
  T(cell)
  edge = cell_of(trial_at(0.0, 0.1, 0.001, limit - 0.01, 0.1),
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
  T(cell) back = cell_of(edge.to, edge.from);
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

/* ---- the row of cells ---- */

static void rows_of_cells(void) {
  const T(plan) plan = hopper_plan();
  T(search) s = search_for(&plan, 0.2);
  enum { CELLS = HOPFORM_SEARCH_CELLS_f64 };
  for (int n = 0; n < CELLS + 3;
       n++) { /* all may hold the root; what does not fit is reported */
    const double u = 0.03 * n;
    const T(trial) from = trial_at(u, 0.1, 5.0, 0.01, 0.0),
                   to = trial_at(u + 0.03, 0.25, 5.0, 0.01, 0.0);
    keep_f64(&s, &from, &to, n);
    must(s.count == (n < CELLS ? n + 1 : CELLS) && s.partial == (n >= CELLS),
         "a row that is full");
    must(n >= CELLS || (s.cells[n].slow == n && !(s.cells[n].promise > 0.0) &&
                        !(fabs(s.cells[n].from.u - u) > 0.0)),
         "a cell that is kept");
  }
  sift_f64(&s);
  must(s.count == CELLS && !(fabs(s.cells[CELLS - 1].from.u) > 0.0) &&
           fabs(s.cells[0].from.u - 0.03 * (CELLS - 1)) < 1e-12,
       "the nearest to 0 last");
  double sum = 0.0;
  for (int n = 0; n < CELLS; n++) {
    sum += s.cells[n].from.u;
  }
  near(sum, 0.03 * CELLS * (CELLS - 1) / 2.0, 1e-12, "a cell that is lost");
  s.cells[5].promise = -1.0; /* promises more */
  const double best = s.cells[5].from.u;
  sift_f64(&s);
  must(!(fabs(s.cells[CELLS - 1].from.u - best) > 0.0) && s.count == CELLS,
       "the most promising last");
  s.cells[7].promise = 1e300; /* nothing in it */
  const double gone = s.cells[7].from.u;
  sift_f64(&s);
  must(s.count == CELLS - 1 && !(fabs(s.cells[CELLS - 2].from.u - best) > 0.0),
       "a cell that is left");
  for (int n = 0; n < s.count; n++) {
    must(fabs(s.cells[n].from.u - gone) > 1e-9, "a cell that is not left");
  }
  s.found =
      true; /* something within 1e-3: cells that promise no better are left */
  s.best = trial_at(0.3, 0.201, 0.0, 0.0, 0.0);
  for (int n = 0; n < s.count; n++) {
    s.cells[n].promise = n % 2 ? 1e-3 : 1e-4;
  }
  const int count = s.count;
  sift_f64(&s);
  must(s.count == (count + 1) / 2, "what is no better");
  near(worth_f64(&s), 1e-3 - 4e-10, 1e-12, "what is worth looking for");
  s.best.apex = 0.2 + 3e-10;
  must(!(worth_f64(&s) > 0.0), "near enough");
  s.reached = true; /* only smaller currents matter, where a root is promised */
  s.best = trial_at(0.3, 0.2, 0.0, 0.0, 0.0);
  T(cell)
  c = cell_of(trial_at(0.29, 0.1, 0.0, 0.0, 0.0),
              trial_at(0.5, 0.3, 0.0, 0.0, 0.0));
  must(matters_f64(&s, &c), "a cell that begins nearer to 0");
  c.promise = 1e-13;
  must(!matters_f64(&s, &c), "a cell without a root");
  c.promise = 0.0;
  c.from.u = -0.3;
  must(!matters_f64(&s, &c), "a cell that begins as far from 0");
  T(search) none = search_for(&plan, 0.2);
  sift_f64(&none);
  must(none.count == 0 && !go_on_f64(&none), "an empty row");
}

static void what_is_better(void) {
  const T(plan) plan = hopper_plan();
  T(search) s = search_for(&plan, 0.2);
  T(command) command;
  say_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_NO_TAKEOFF &&
           !(fabs(command.u) + fabs(command.apex) > 0.0),
       "nothing found");
  T(trial) trial = trial_at(1.0, 0.1, 0.0, limit, 0.0);
  consider_f64(&s, &trial);
  must(!s.found, "x1 at its limit");
  trial.largest_x1 = limit - 1e-9;
  trial.takes_off = false;
  consider_f64(&s, &trial);
  must(!s.found, "no take-off");
  trial.takes_off = true;
  consider_f64(&s, &trial);
  must(s.found && !s.reached && !(fabs(s.best.u - 1.0) > 0.0), "the first");
  const double apexes[] = {0.31, 0.3, 0.29, 0.11, 0.2 + 1.1e-14,
                           0.2,  0.2, 0.2,  0.2}; /* from 0.1 wanted 0.2 */
  const double currents[] = {0.1, 0.1, 2.0, 0.1, 2.5, -2.0, 2.0, 1.5, -1.6};
  const double kept[] = {1.0, 1.0, 2.0, 2.0, 2.5, -2.0, -2.0, 1.5, 1.5};
  for (int n = 0; n < 9; n++) {
    trial.u = currents[n];
    trial.apex = apexes[n];
    row = n;
    consider_f64(&s, &trial);
    must(!(fabs(s.best.u - kept[n]) > 0.0) || n == 1 || n == 3,
         "the better one");
    s.best.u =
        n == 1 || n == 3 ? kept[n] : s.best.u; /* as near but for rounding */
    s.best.apex = n == 1 ? 0.1 : (n == 3 ? 0.29 : s.best.apex);
    must(s.reached == (n > 4), "reached");
  }
  trial.u = 0.1;
  trial.apex = 0.2 + 2e-14;
  consider_f64(&s, &trial);
  must(s.best.u > 1.0, "near, and not as near");
  s.datum = 0.05;
  say_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_REACHED &&
           fabs(command.apex - 0.15) < 1e-15 && !(fabs(command.u - 1.5) > 0.0),
       "what is said");
  s.best.apex = 0.2 + 1.99e-10;
  say_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_REACHED, "near enough to count");
  s.best.apex = 0.2 - 2.01e-10;
  say_f64(&s, &command);
  must(command.status == HOPFORM_COMMAND_NEAREST, "too far off to count");
  const T(cell) meets =
      cell_of(trial_at(0.0, 0.2, 0.1, 0.0, 0.0),
              trial_at(1.0, 0.3, 0.1, 0.0, 0.0)); /* an end that reaches it */
  must(gap_of_f64(&meets, 0.2).from > 0.0 && gap_of_f64(&meets, 0.3).to < 0.0,
       "an end that reaches it is on the other one's side");
  const T(cell) falls = cell_of(trial_at(0.0, 0.3, -0.1, 0.0, 0.0),
                                trial_at(-1.0, 0.2, 0.1, 0.0, 0.0));
  must(gap_of_f64(&falls, 0.2).to > 0.0 && gap_of_f64(&falls, 0.3).from < 0.0,
       "an end that reaches it from the other side");
  const T(cell) just =
      cell_of(trial_at(0.0, 1e-14, 0.1, 0.0, 0.0),
              trial_at(1.0, 0.1, 0.1, 0.0, 0.0)); /* as near as counts */
  const T(cell) ends = cell_of(trial_at(0.0, -0.1, 0.1, 0.0, 0.0),
                               trial_at(1.0, -1e-14, 0.1, 0.0, 0.0));
  must(gap_of_f64(&just, 0.0).from > 0.0 && gap_of_f64(&ends, 0.0).to < 0.0,
       "as near as counts, on the same side");
  const T(cell) across = cell_of(trial_at(0.0, -1e-14, 0.1, 0.0, 0.0),
                                 trial_at(1.0, 0.1, 0.1, 0.0, 0.0));
  const T(cell) beyond = cell_of(trial_at(0.0, -0.1, 0.1, 0.0, 0.0),
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
    const bool goes = go_on_f64(&s);
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
