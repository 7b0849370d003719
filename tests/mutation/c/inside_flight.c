/* The tests of mutants in the flight: its inner functions one by one, against
 * differences, against what many samples of a phase show, and where the truth
 * at an equality is known by algebra. Prints what is wrong and ends with 1, or
 * is silent.
 */
#include "flight_f64.c"

#include "checks.h"

enum { CAPACITY = 32, SAMPLES = 400 };
static hopform_flight_phase_f64 phases[CAPACITY];

/* The first phase of a flight, as the library begins it. */
static flight_chain_f64 chain_of(const T(plan) * plan, const T(state) * start,
                                 const T(gains) * gains, double horizon) {
  flight_chain_f64 chain = {0};
  chain.robot = &plan->robot;
  chain.largest = largest_force_f64(&plan->robot);
  chain.gains = *gains;
  chain.rates = hopform_flight_rates_of_f64(&plan->robot, gains, chain.largest);
  chain.horizon = horizon;
  chain.x1 = start->x1;
  chain.y = start->y;
  chain.v2 = start->v2;
  chain.actuator.x1 = start->x1;
  chain.actuator.v1 = start->v1;
  chain.airborne = start->y < 0.0;
  chain.max_phases = CAPACITY;
  chain.phases = phases;
  chain.capacity = CAPACITY;
  chain.highest = -1e300;
  flight_begin_f64(&chain);
  place_body_f64(&chain);
  return chain;
}

static flight_chain_f64 any_chain(T(plan) * plan) {
  T(robot) r = any_robot();
  r.g = 9.81;
  r.u_max = uniform(0.0, 1.0) < 0.3 ? INFINITY : over(0.05, 3.0);
  r.x1_min = -INFINITY;
  r.x1_max = INFINITY;
  must(T(plan_init)(plan, &r) == HOPFORM_OK, "no plan");
  const double rate = over(1.0, 60.0);
  const T(gains) gains = {mostly(r.m_eff * rate * rate, 0.15),
                          mostly(2.0 * r.m_eff * rate * over(0.05, 3.0), 0.2)};
  const T(state) start = {mostly(uniform(-0.05, 0.05), 0.1),
                          mostly(uniform(-1.0, 1.0), 0.1), uniform(-0.5, 2.5),
                          mostly(uniform(-0.1, 0.1), 0.4)};
  return chain_of(plan, &start, &gains, 1.0);
}

/* ---- a phase over time ---- */

/* Rate of the poles of a phase. */
static double fastest(const flight_chain_f64 *chain) {
  return chain->side == 0 ? 0.0 : chain->poles.p + sqrt(chain->poles.q);
}

/* When v1 vanishes. */
static double rest_of(const flight_chain_f64 *chain) {
  return chain->side == 0
             ? 1e300
             : zero_of_pair_f64(&chain->poles, chain->first.actuator.v1_t,
                                chain->first.actuator.acc1_t);
}

/* Each function's derivatives are those of its values. */
static void derivatives(void) {
  for (row = 0; row < 300; row++) {
    T(plan) plan;
    const flight_chain_f64 chain = any_chain(&plan);
    if (chain.side == 0) {
      continue;
    }
    const double rate = fastest(&chain) + 1.0, t = over(0.02, 3.0) / rate,
                 h = 1e-4 / rate;
    const instant_f64 at = look_f64(&chain, t),
                      before = look_f64(&chain, t - h),
                      after = look_f64(&chain, t + h);
    for (int f = WAY_f64; f <= FOOT_f64; f++) {
      const function_of_time_f64 g = (function_of_time_f64)f;
      const approach_f64 now = sample_of_f64(&chain, &at, g);
      const jet_f64 s = now.at, a = sample_of_f64(&chain, &before, g).at,
                    b = sample_of_f64(&chain, &after, g).at;
      const double size = fabs(s.value) + fabs(s.rate) / rate +
                          fabs(s.curvature) / (rate * rate) +
                          fabs(s.third) / (rate * rate * rate) + 1e-12;
      near(s.rate, (b.value - a.value) / (2.0 * h), 1e-6 * size * rate,
           "the rate of a function");
      near(s.curvature, (b.rate - a.rate) / (2.0 * h),
           1e-6 * size * rate * rate, "its second derivative");
      near(s.third, (b.curvature - a.curvature) / (2.0 * h),
           1e-6 * size * rate * rate * rate, "its third derivative");
      near(fabs(now.fourth), fabs(b.third - a.third) / (2.0 * h),
           1e-5 * (size + fabs(now.fourth) / pow(rate, 4.0)) * pow(rate, 4.0),
           "its fourth derivative");
    }
    const foot_point_f64 point = foot_point_of_f64(&at);
    must(!(fabs(point.t - t) + fabs(point.foot - at.foot.foot_t) +
               fabs(point.rate - at.foot.foot_rate) +
               fabs(point.curvature - at.foot.foot_curvature) +
               fabs(point.moved - at.actuator.moved) >
           0.0),
         "what is kept of an instant");
    const double fallen = chain.v2 * t - 0.5 * chain.robot->g * t * t;
    near(at.foot.foot_t, fallen - chain.y - at.actuator.moved, 1e-12,
         "the foot");
    const T(state) state = state_of_f64(&chain, &at);
    near(state.y, -at.foot.foot_t, 1e-300, "y of a state");
    near(state.v2, chain.v2 - 9.81 * t, 1e-12, "v2 of a state");
  }
}

/* A motion of the pair at an instant, one of three, and its rate. */
static jet_f64 motion_of(const flight_chain_f64 *chain, const instant_f64 *at,
                         int which) {
  const T(actuator_at) *x = &at->actuator;
  const jet_f64 motions[3] = {
      {x->v1_t, x->acc1_t, 0.0, 0.0},
      {x->jerk1_t, -chain->poles.p * x->jerk1_t - chain->poles.q * x->acc1_t,
       0.0, 0.0},
      {at->pull.pull_rate, at->pull.pull_curvature, 0.0, 0.0},
  };
  return motions[which];
}

/* The first change of sign of a motion of the pair: none that samples show is
 * missed, and it is one. */
static void zeros(void) {
  int found = 0, none = 0;
  for (row = 0; row < 1600; row++) {
    T(plan) plan;
    flight_chain_f64 chain = any_chain(&plan);
    if (chain.side == 0) {
      continue;
    }
    const int which = row % 3;
    const double until = over(0.01, 20.0) / (fastest(&chain) + 1.0);
    const double p = chain.poles.p, q = chain.poles.q,
                 square = 0.25 * p * p - q;
    const double half = 3.14159265358979323846 / sqrt(fabs(square));
    const jet_f64 from = motion_of(&chain, &chain.first, which);
    const double zero =
        which == 1 ? turn_of_jerk_f64(&chain)
                   : zero_of_pair_f64(&chain.poles, from.value, from.rate);
    const bool has = zero <= until;
    double first = 1e300, before = from.value;
    const double span = square < 0.0 && half < until ? half : until;
    for (int n = 1; n <= SAMPLES; n++) {
      const double t = span * (double)n / SAMPLES;
      const instant_f64 at = look_f64(&chain, t);
      const double value = motion_of(&chain, &at, which).value;
      if (value * before < 0.0 && first > 1e299) {
        first = t;
      }
      before = value;
    }
    const double size =
        fabs(from.value) + fabs(from.rate) / (fastest(&chain) + 1.0);
    if (has && fabs(from.value) > 1e-9 * size) {
      must(zero > 0.0 && zero <= first * (1.0 + 1e-12), "a zero that is late");
      must(zero >= first - 1.0001 * span / SAMPLES || first > 1e299,
           "a zero that is early");
      const instant_f64 there = look_f64(&chain, zero);
      const jet_f64 at = motion_of(&chain, &there, which);
      near(at.value, 0.0, 4e-16 * zero * fabs(at.rate) + 1e-14 * size,
           "a zero that is none");
      found++;
    } else if (!has) {
      must(first > 1e299, "a zero that is missed");
      none++;
    }
  }
  must(found > 150 && none > 50, "too few of a kind");
  T(plan) plan;
  T(robot) r = any_robot();
  r.m_eff = 4.0;
  r.b1 = 0.0;
  r.f1 = 0.0;
  r.c = 0.0;
  r.g = 8.0;
  r.u_max = INFINITY;
  r.x1_min = -INFINITY;
  r.x1_max = INFINITY;
  must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
  const T(gains) gains = {
      4.0 * 64.0, 0.0}; /* 8 rad/s; from rest at 1/16 the velocity begins at 0
                           and is 0 again after a half turn */
  const T(state) start = {0.0625, 0.0, 1.0, -1.0};
  flight_chain_f64 chain = chain_of(&plan, &start, &gains, 2.0);
  near(rest_of(&chain), 3.14159265358979323846 / 8.0, 1e-15,
       "a half turn from rest");
  must(chain.side == -1, "the way from rest");
}

/* Roots to the last digit, from both sides and from anywhere. */
static void roots(void) {
  for (row = 0; row < 500; row++) {
    T(plan) plan;
    const flight_chain_f64 chain = any_chain(&plan);
    const double until = over(0.05, 1.0);
    const instant_f64 end = look_f64(&chain, until);
    const double level =
        chain.first.foot.foot_t +
        uniform(0.05, 0.95) * (end.foot.foot_t - chain.first.foot.foot_t);
    const double sign = end.foot.foot_t < chain.first.foot.foot_t ? 1.0 : -1.0;
    int monotone = 1;
    double before = chain.first.foot.foot_t;
    for (int n = 1; n <= SAMPLES; n++) {
      const double now =
          look_f64(&chain, until * (double)n / SAMPLES).foot.foot_t;
      monotone = monotone && sign * (now - before) <= 0.0;
      before = now;
    }
    if (!monotone) {
      continue;
    }
    const instant_f64 root =
        root_between_f64(&chain, FOOT_f64, sign, level, 0.0, &end);
    const double noise = noise_of_foot_f64(&chain, root.t, root.actuator.moved);
    near(root.foot.foot_t, level,
         4e-16 * root.t * fabs(root.foot.foot_rate) + noise,
         "a root of the foot's height");
    const instant_f64 middle = look_f64(&chain, over(0.01, 0.99) * until);
    const instant_f64 same =
        root_from_f64(&chain, FOOT_f64, sign, level, 0.0, until, middle);
    near(same.t, root.t,
         1e-15 * root.t + 2.0 * noise / (fabs(root.foot.foot_rate) + 1e-300),
         "the same root from elsewhere");
    must(root.t > 0.0 && root.t < until, "a root outside");
  }
}

/* Points among which the foot's acceleration, and then its rate, keep their
 * signs. */
static void pieces(void) {
  int more = 0;
  for (row = 0; row < 600; row++) {
    T(plan) plan;
    flight_chain_f64 chain = any_chain(&plan);
    instant_f64 end = look_f64(&chain, over(0.02, 1.0));
    if (rest_of(&chain) <= end.t) {
      end = look_f64(&chain, rest_of(&chain));
    }
    foot_point_f64 points[MOST_POINTS_f64] = {0};
    int count = 0;
    points[count++] = foot_point_of_f64(&chain.first);
    if (chain.side != 0 && turn_of_jerk_f64(&chain) < end.t) {
      const instant_f64 turn = look_f64(&chain, turn_of_jerk_f64(&chain));
      points[count++] = foot_point_of_f64(&turn);
    }
    points[count++] = foot_point_of_f64(&end);
    const int begun = count;
    count = split_f64(&chain, FOOT_CURVATURE_f64, points, count);
    count = split_f64(&chain, FOOT_RATE_f64, points, count);
    more += count > begun;
    for (int n = 1; n < count; n++) {
      must(points[n].t >= points[n - 1].t, "points out of order");
      double before = points[n - 1].foot;
      const double way = points[n].foot - before,
                   step = (points[n].t - points[n - 1].t) / 20.0;
      for (int i = 1; i <= 20 && step > 0.0; i++) {
        const double now =
            look_f64(&chain, points[n - 1].t + step * i).foot.foot_t;
        must((now - before) * way >= -1e-14 * (1.0 + fabs(way)),
             "a piece on which the foot turns");
        before = now;
      }
    }
    if (is_concave_f64(&chain, &end)) {
      for (int i = 1; i < 20; i++) {
        must(look_f64(&chain, end.t * i / 20.0).foot.foot_curvature < 1e-9,
             "what is said to be concave");
      }
    }
    if (chain.airborne && stays_above_f64(&chain, &end)) {
      for (int i = 0; i <= 20; i++) {
        must(look_f64(&chain, end.t * i / 20.0).foot.foot_t > 0.0,
             "what is said to stay above");
      }
    }
  }
  must(more > 60, "too few pieces");
}

/* The first downward crossing by the foot, as samples show it. */
static void crossings(void) {
  int lands = 0, rises = 0;
  for (row = 0; row < 1600; row++) {
    T(plan) plan;
    flight_chain_f64 chain = any_chain(&plan);
    flight_phase_end_f64 end = {look_f64(&chain, over(0.02, 1.0)),
                                FLIGHT_END_LIMIT_f64, chain.limit};
    if (rest_of(&chain) <= end.at.t) {
      end.at = look_f64(&chain, rest_of(&chain));
    }
    const double last = end.at.t;
    int above = chain.airborne || (chain.first.foot.foot_t >= 0.0 &&
                                   chain.first.foot.foot_rate > 0.0),
        touched = 0;
    double when = 1e300, nearest = 1e300;
    for (int n = 0; n <= SAMPLES; n++) {
      const double t = last * (double)n / SAMPLES,
                   height = look_f64(&chain, t).foot.foot_t;
      nearest = n > 0 && n < SAMPLES ? fmin(nearest, fabs(height)) : nearest;
      touched = touched || (above && height < 0.0);
      when = touched && when > 1e299 ? t : when;
      above = above || height > 1e-12;
    }
    const double highest = chain.highest;
    flight_chain_f64 other = chain;
    flight_phase_end_f64 searched = end;
    watch_foot_f64(&chain, &end);
    search_foot_f64(&other, &searched); /* without the short cuts */
    must(end.kind == searched.kind &&
             fabs(end.at.t - searched.at.t) <= 1e-13 * last + 1e-14,
         "a short cut that leads elsewhere");
    must((end.kind == END_TOUCHDOWN_f64) == touched || nearest < 1e-4,
         "the foot comes down, or not");
    if (end.kind == END_TOUCHDOWN_f64 && touched) {
      must(end.at.t <= when && end.at.t >= when - 1.0001 * last / SAMPLES,
           "when the foot comes down");
      near(end.at.foot.foot_t, 0.0,
           4e-16 * end.at.t * fabs(end.at.foot.foot_rate) +
               noise_of_foot_f64(&chain, end.at.t, end.at.actuator.moved),
           "how high the foot is where it comes down");
      lands++;
    } else if (end.kind != END_TOUCHDOWN_f64) {
      must(chain.airborne == above || nearest < 1e-4,
           "above the ground, or not yet");
      rises += chain.airborne && !(highest > -1e299);
    }
  }
  must(lands > 150 && rises > 50, "too few that land, or rise");
}

/* The motor's limit: where the pull leaves it or reaches it first. */
static void limits(void) {
  int reached = 0;
  for (row = 0; row < 1600; row++) {
    T(plan) plan;
    flight_chain_f64 chain = any_chain(&plan);
    if (chain.side == 0 || !(chain.largest < 1e299)) {
      continue;
    }
    flight_phase_end_f64 end = {look_f64(&chain, over(0.02, 1.0)),
                                FLIGHT_END_LIMIT_f64, chain.limit};
    if (rest_of(&chain) <= end.at.t) {
      end.at = look_f64(&chain, rest_of(&chain));
    }
    const double last = end.at.t;
    double when = 1e300, nearest = 1e300;
    int side = 0;
    for (int n = 0; n <= SAMPLES; n++) {
      const double t = last * (double)n / SAMPLES,
                   pull = look_f64(&chain, t).pull.pull;
      const double room = chain.limit == 0
                              ? chain.largest - fabs(pull)
                              : (double)chain.limit * pull - chain.largest;
      nearest = n > 0 ? fmin(nearest, fabs(room)) : nearest;
      side = room < 0.0 && when > 1e299 ? (pull > 0.0 ? 1 : -1) : side;
      when = room < 0.0 && when > 1e299 ? t : when;
    }
    watch_pull_f64(&chain, &end);
    must((end.kind == END_PULL_f64) == (when < 1e299) ||
             nearest < 1e-3 * chain.largest,
         "the pull passes the limit, or not");
    if (end.kind == END_PULL_f64 && when < 1e299 && when > 0.0) {
      must(end.at.t <= when && end.at.t >= when - 1.0001 * last / SAMPLES,
           "when the pull passes the limit");
      must(end.limit == (chain.limit != 0 ? 0 : side),
           "to which side the pull goes");
      near(fabs(end.at.pull.pull), chain.largest,
           1e-12 * chain.largest +
               4e-16 * end.at.t * fabs(end.at.pull.pull_rate),
           "the pull at its limit");
      reached++;
    }
  }
  must(reached > 60, "too few that reach the limit");
}

/* A constant force against viscous friction and the law's damping: v = a (1 -
 * exp(-p t))/p reaches the limit at a known time, however little is left of its
 * rate where the phase ends. */
static void faded(void) {
  for (row = 0; row < 200; row++) {
    T(robot) r = any_robot();
    T(plan) plan;
    const double sign = row % 2 ? 1.0 : -1.0, p = over(10.0, 3000.0),
                 a = over(0.1, 100.0);
    r.b1 = 0.0;
    r.f1 = 0.0;
    r.g = 8.0;
    r.c = sign * a * r.m_eff / r.k;
    r.x1_min = -INFINITY;
    r.x1_max = INFINITY;
    r.gamma2 = 4.0;
    const T(gains) gains = {0.0, p * r.m_eff};
    const double share = uniform(0.01, 0.99);
    r.u_max = share * gains.Kd * a / p / 4.0;
    must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
    const T(state) start = {0.0, 0.0, 1.0, -100.0};
    T(flight) flight;
    must(T(solve_flight)(&plan, &start, &gains, 1.0, CAPACITY, phases, CAPACITY,
                         &flight) == HOPFORM_OK &&
             phases[1].event == HOPFORM_FLIGHT_EVENT_U_SATURATES &&
             phases[1].limit == (row % 2 ? 1 : -1),
         "a law that meets its limit");
    near(phases[1].t, (double)-log1pl((long double)-share) / p,
         1e-14 / p / (1.0 - share) + 4e-16 * phases[1].t,
         "when the law meets its limit");
  }
}

/* ---- integrals ---- */

/* Of v^2 over a phase, by Simpson's rule. */
static void squares_of_velocity(void) {
  for (row = 0; row < 300; row++) {
    const double q = row % 3 ? over(1.0, 1e4) : 0.0,
                 p = mostly(over(0.1, 300.0), 0.2);
    const T(poles) poles = {0.0, p, q, p, q, 0.0};
    T(flight_phase)
    phase = {0.0, 0.0, uniform(-1.0, 1.0), uniform(-20.0, 20.0), 1, 0, 0, 0};
    const double t = over(0.01, 8.0) / (p + sqrt(q) + 0.1);
    enum { N = 5000 };
    double sum = 0.0;
    for (int n = 0; n <= N; n++) {
      const T(actuator) from = {0.0, phase.v1, phase.acc1};
      const double v = move_f64(&from, &poles, 1, t * (double)n / N).v1_t;
      sum += v * v * (n == 0 || n == N ? 1.0 : (n % 2 ? 4.0 : 2.0));
    }
    sum *= t / (3.0 * N);
    near(square_of_velocity_f64(&poles, &phase, t), sum, 1e-11 * sum,
         "the integral of v^2");
    phase.side = 0;
    must(!(fabs(square_of_velocity_f64(&poles, &phase, t)) > 0.0),
         "the integral of what is held");
  }
}

/* ---- where the truth is known by algebra ---- */

static T(robot) plain_robot(void) {
  const T(robot) r = {4.0, 1.0, 1024.0, 0.5,    0.0,  0.0, 0.0, 0.0,
                      0.0, 4.0, 8.0,    -0.125, 0.25, 1.0, 0.0};
  return r;
}

static T(flight) fly(const T(robot) * robot, T(state) start, T(gains) gains,
                     double horizon) {
  T(plan) plan;
  T(flight) flight;
  memset(phases, 1, sizeof phases);
  must(T(plan_init)(&plan, robot) == HOPFORM_OK, "no plan");
  must(T(solve_flight)(&plan, &start, &gains, horizon, CAPACITY, phases,
                       CAPACITY, &flight) == HOPFORM_OK,
       "a flight that is refused");
  for (int n = 0; n < flight.phases_kept; n++) {
    must(phases[n].spare == 0, "what is spare is 0");
  }
  return flight;
}

/* Heights that meet the ground exactly: g = 8, powers of two. */
static void touches(void) {
  T(robot) r = plain_robot();
  r.f1 = 1e3; /* held throughout */
  const T(gains) none = {0.0, 0.0};
  for (int n = -6; n <= 1; n++) {
    const double v = ldexp(1.0, n), top = v * v / 16.0, rise = v / 8.0;
    row = n;
    T(flight) f = fly(&r, (T(state)){0.0, 0.0, v, 0.0}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TOUCHDOWN &&
             fabs(f.duration - 2.0 * rise) <= 2e-16 * f.duration,
         "up and down on flat ground");
    near(f.apex, top, 1e-300, "the top of a throw");
    near(f.apex_time, rise, 1e-300, "the time of the top");
    f = fly(&r, (T(state)){0.0, 0.0, v, top}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TRIPPED &&
             fabs(f.duration - rise) <= 1e-8 * rise && f.end.y >= 0.0 &&
             f.end.y < 1e-15,
         "a step as high as the throw");
    f = fly(&r, (T(state)){0.0, 0.0, v, top * (1.0 - 1e-6)}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TOUCHDOWN &&
             fabs(f.duration - rise * (1.0 + 1e-3)) < 1e-9,
         "a step a little lower than the throw");
    f = fly(&r, (T(state)){0.0, 0.0, v, top * (1.0 + 1e-6)}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TRIPPED &&
             fabs(f.duration - rise) <= 1e-8 &&
             fabs(f.end.y - 1e-6 * top) < 1e-15 && !(f.impact_loss < 0.0),
         "a step a little higher");
    f = fly(&r, (T(state)){0.0, 0.0, 0.0, -v * v / 16.0}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TOUCHDOWN &&
             fabs(f.duration - rise) <= 4e-16 * rise &&
             !(fabs(f.end.v2 + v) > 1e-15 * v),
         "a drop");
    must(!(fabs(f.apex_time) > 0.0) &&
             fabs(f.apex - top) < 1e-300 + 1e-16 * top,
         "the top of a drop");
    f = fly(&r, (T(state)){0.0, 0.0, -v, 0.0}, none, 2.0);
    must(f.ending == HOPFORM_FLIGHT_TRIPPED && !(f.duration > 0.0),
         "a foot that begins on the ground and falls");
    f = fly(&r, (T(state)){0.0, 0.0, v, 0.0}, none, 1.5 * rise);
    must(f.ending == HOPFORM_FLIGHT_HORIZON &&
             !(fabs(f.duration - 1.5 * rise) > 0.0),
         "a horizon in the air");
    f = fly(&r, (T(state)){0.0, 0.0, v, 1.0}, none, 0.5 * rise);
    must(f.ending == HOPFORM_FLIGHT_TRIPPED &&
             !(fabs(f.duration - 0.5 * rise) > 0.0),
         "a horizon below the ground ahead");
  }
}

/* Mirrored left and right, an actuator over ground that is far away does the
 * same, bit for bit. */
static void mirrored_flights(void) {
  static hopform_flight_phase_f64 kept[CAPACITY];
  int events = 0;
  for (row = 0; row < 600; row++) {
    T(robot) r = any_robot();
    r.g = 8.0;
    r.u_max = uniform(0.0, 1.0) < 0.3 ? INFINITY : over(0.05, 3.0);
    r.x1_min = uniform(0.0, 1.0) < 0.3 ? -INFINITY : -over(1e-3, 0.05);
    r.x1_max = uniform(0.0, 1.0) < 0.3 ? INFINITY : over(1e-3, 0.05);
    const double rate = over(1.0, 60.0), share = uniform(-1.0, 1.0);
    const T(gains)
        gains = {mostly(r.m_eff * rate * rate, 0.15),
                 mostly(2.0 * r.m_eff * rate * over(0.01, 3.0), 0.2)};
    const T(state) start = {mostly(share > 0.0 ? fmin(r.x1_max, 0.05 * share)
                                               : larger(r.x1_min, 0.05 * share),
                                   0.1),
                            mostly(uniform(-1.0, 1.0), 0.2), 1.0, -1e4};
    const double horizon = over(0.05, 2.0);
    const T(flight) one = fly(&r, start, gains, horizon);
    memcpy(kept, phases, sizeof kept);
    T(robot) other = r;
    other.c = -r.c;
    other.x1_min = -r.x1_max;
    other.x1_max = -r.x1_min;
    const T(flight) two =
        fly(&other, (T(state)){-start.x1, -start.v1, start.v2, start.y}, gains,
            horizon);
    must(one.phase_count == two.phase_count &&
             one.event_count == two.event_count &&
             !(fabs(one.end.x1 + two.end.x1) + fabs(one.end.v1 + two.end.v1) +
                   fabs(one.start_loss - two.start_loss) >
               0.0),
         "a flight that is mirrored");
    for (int n = 0; n < one.phases_kept && n < two.phases_kept; n++) {
      must(!(fabs(kept[n].t - phases[n].t) + fabs(kept[n].x1 + phases[n].x1) +
                 fabs(kept[n].v1 + phases[n].v1) +
                 fabs(kept[n].acc1 + phases[n].acc1) >
             0.0) &&
               kept[n].side == -phases[n].side &&
               kept[n].limit == -phases[n].limit &&
               kept[n].event == phases[n].event,
           "a phase that is mirrored");
    }
    events += one.event_count;
  }
  must(events > 500, "too few events");
}

/* Pulls, forces and places that are equal exactly. */
static void balances(void) {
  const T(gains) law = {64.0, 0.0}, damped = {64.0, 4.0};
  for (int side = -1; side <= 1; side += 2) {
    const double s = (double)side;
    row = side;
    T(robot) r = plain_robot();
    r.x1_min = -0.25;
    T(flight)
    f = fly(&r, (T(state)){s * 0.0625, s * 0.5, 1.0, -100.0}, law,
            1.0); /* the pull is 4, as the motor's largest */
    must(phases[0].limit == side && phases[0].side == side,
         "at the limit, and further");
    f = fly(&r, (T(state)){s * 0.0625, -s * 0.5, 1.0, -100.0}, law, 1.0);
    must(phases[0].limit == 0 && phases[0].side == -side,
         "at the limit, and back");
    f = fly(&r, (T(state)){s * 0.0625, 0.0, 1.0, -100.0}, law, 1.0);
    must(phases[0].limit == 0 && phases[0].side == -side &&
             !(fabs(phases[0].acc1 + s) > 0.0),
         "at the limit, and at rest");
    f = fly(&r, (T(state)){s * 0.03125, s * 0.5, 1.0, -100.0}, damped,
            1.0); /* 2 + 2; Kp v - Kd Kx/m = 32 - 4 > 0 */
    must(phases[0].limit == side, "at the limit by its speed, and further");
    r.b1 = 64.0; /* 32 - 4 (1 + 8) < 0 */
    f = fly(&r, (T(state)){s * 0.03125, s * 0.5, 1.0, -100.0}, damped, 1.0);
    must(phases[0].limit == 0, "at the limit by its speed, and back");
    r.b1 = 0.0;
    r.f1 = 1.0; /* of 4 kg: as much as the motor's largest */
    f = fly(&r, (T(state)){s * 0.25, 0.0, 1.0, -100.0}, law, 1.0);
    must(f.phase_count == 1 && phases[0].side == 0 && phases[0].limit == side &&
             f.event_count == 0,
         "held by as much as it is pulled");
    r.f1 = 1.0 - 0x1p-50;
    f = fly(&r, (T(state)){s * 0.25, 0.0, 1.0, -100.0}, law, 1.0);
    must(phases[0].side == -side, "pulled by a little more");
    r.f1 = 0.0;
    r.c = s * 0.0078125; /* pushed onto a stop by k c = 8, the law's 64 x 0.0625
                            = 4 holds against half of it */
    r.x1_min = -0.0625;
    r.x1_max = 0.0625;
    f = fly(&r, (T(state)){s * 0.0625, 0.0, 1.0, -100.0}, law, 1.0);
    must(f.phase_count == 1 && phases[0].side == 0, "pushed onto a stop");
    f = fly(&r, (T(state)){s * 0.0625, s * 0.5, 1.0, -100.0}, law, 1.0);
    must(f.phase_count == 1 && phases[0].side == 0 && f.event_count == 0 &&
             !(fabs(f.start_loss + 0.5) > 0.0),
         "moving into a stop at once");
    f = fly(&r, (T(state)){s * 0.0625, -s * 0.5, 1.0, -100.0}, law, 1.0);
    must(phases[0].side == -side && !(fabs(f.start_loss) > 0.0),
         "moving off a stop");
    f = fly(&r, (T(state)){-s * 0.0625, 0.0, 1.0, -100.0}, law, 1.0);
    must(phases[0].side == side && !(fabs(f.start_loss) > 0.0),
         "pushed off a stop");
    f = fly(&r, (T(state)){s * 0.0625, -s * 1e-30, 1.0, -100.0}, law,
            1.0); /* too little to leave it */
    must(f.event_count == 1 && phases[1].event == HOPFORM_EVENT_X1_STICKS &&
             phases[1].side == 0 && f.phase_count == 2,
         "a velocity that does not leave the stop");
    r.x1_min = s > 0.0 ? -0.125 : 0.0625;
    r.x1_max = s > 0.0 ? -0.0625
                       : 0.125; /* locked, as good as: between, and at both */
    f = fly(&r, (T(state)){-s * 0.0625, s * 0.5, 1.0, -100.0}, law, 1.0);
    must(f.phase_count == 1 && phases[0].side == 0 &&
             !(fabs(f.start_loss + 0.5) > 0.0),
         "a stop that is not at 0");
    r.x1_min = -s * 0.0625;
    r.x1_max = -s * 0.0625;
    f = fly(&r, (T(state)){-s * 0.0625, 0.0, 1.0, -100.0}, law, 1.0);
    must(f.phase_count == 1 && phases[0].side == 0 && f.event_count == 0,
         "locked");
  }
  T(robot)
  r = plain_robot(); /* without a law at constant force: exactly to the stop, in
                        (2 d/a)^(1/2) */
  r.c = 0x1p-7;
  r.x1_min = 0.0;
  const T(gains) none = {0.0, 0.0};
  T(flight)
  f = fly(&r, (T(state)){0.0, 0.0, 1.0, -100.0}, none,
          2.0); /* 2 m/s^2 over 0.25 m */
  must(f.event_count == 1 && phases[1].event == HOPFORM_EVENT_X1_HITS_STOP &&
           fabs(phases[1].t - 0.5) < 1e-15 &&
           !(fabs(phases[1].x1 - 0.25) > 0.0),
       "at a stop after half a second");
  f = fly(
      &r, (T(state)){0.25, -1.0, 1.0, -100.0}, none,
      2.0); /* comes to rest exactly at the other one, and goes back: a touch */
  must(phases[1].event == HOPFORM_EVENT_X1_HITS_STOP &&
           fabs(phases[1].t - 0.5) < 1e-7 && !(fabs(phases[1].x1) > 0.0) &&
           phases[1].side == 1,
       "a stop where it comes to rest");
  r.u_max = 0.0; /* no motor: no law */
  f = fly(&r, (T(state)){0.0, 0.0, 1.0, -100.0}, law, 2.0);
  must(!(f.gains.Kp > 0.0) && f.event_count == 1, "no motor");
  r.u_max = 1.0;
  r.gamma2 = 0.0;
  f = fly(&r, (T(state)){0.0, 0.0, 1.0, -100.0}, law, 2.0);
  must(!(f.gains.Kp > 0.0) && f.event_count == 1, "no drive");
}

/* The return that is designed: settled 50 ms before the body comes down to
 * where it left the ground, in 20 ms at least. */
static void designs(void) {
  T(plan) plan;
  T(robot) r = plain_robot();
  must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
  const double starts[][2] = {
      {1.0, 0.0},  {1.0, -0.0625}, {1.0, -0.0624}, {1.0, -0.1},   {-1.0, 0.0},
      {-1.0, 0.1}, {0.2, 0.0},     {0.28, 0.0},    {0.2801, 0.0}, {2.0, 0.25}};
  for (row = 0; row < 10; row++) {
    const double v = starts[row][0], x1 = starts[row][1],
                 square = v * v + 16.0 * x1;
    const double fall = square >= 0.0 ? (v + sqrt(square)) / 8.0 : 0.0;
    const T(state) start = {x1, 0.0, v, -1.0};
    T(flight) flight;
    T(gains) gains;
    must(T(solve_flight)(&plan, &start, NULL, 1.0, CAPACITY, phases, CAPACITY,
                         &flight) == HOPFORM_OK,
         "a flight that designs");
    must(T(design_return)(&plan, larger(fall - 0.05, 0.02), &gains) ==
             HOPFORM_OK,
         "a design");
    near(flight.gains.Kp, gains.Kp, 1e-12 * gains.Kp,
         "the stiffness of a design");
    near(flight.gains.Kd, gains.Kd, 1e-12 * gains.Kd,
         "the damping of a design");
  }
}

/* Numbers up to 1e300 are not refused as such; what comes of them may be out of
 * range. */
static void large_numbers(void) {
  T(plan) plan;
  T(robot) r = plain_robot();
  r.x1_min = -INFINITY;
  r.x1_max = INFINITY;
  must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
  for (int field = 0; field < 4; field++) {
    for (int sign = -1; sign <= 1; sign += 2) {
      double fields[4] = {0.0, 0.0, 1.0, -1.0};
      fields[field] = (double)sign * 1e300;
      T(state) start;
      memcpy(&start, fields, sizeof start);
      T(flight) flight;
      must(T(solve_flight)(&plan, &start, NULL, 1.0, CAPACITY, phases, CAPACITY,
                           &flight) != HOPFORM_ERROR_STATE,
           "the largest number");
    }
  }
  const T(state) start = {0.0, 0.0, 1.0, -1.0};
  T(flight) flight;
  T(gains) gains;
  const T(gains) stiff = {1e300, 0.0}, damped = {0.0, 1e300}, none = {0.0, 0.0};
  must(T(solve_flight)(&plan, &start, &stiff, 1.0, CAPACITY, phases, CAPACITY,
                       &flight) != HOPFORM_ERROR_GAINS,
       "the largest stiffness");
  must(T(solve_flight)(&plan, &start, &damped, 1.0, CAPACITY, phases, CAPACITY,
                       &flight) != HOPFORM_ERROR_GAINS,
       "the largest damping");
  must(T(design_return)(&plan, 1e300, &gains) == HOPFORM_OK,
       "the longest time");
  const T(gains) nothing_known = {1.0, 1.0};
  gains = nothing_known;
  must(T(design_return)(&plan, 1e-200, &gains) == HOPFORM_ERROR_NUMBERS &&
           !(fabs(gains.Kp) + fabs(gains.Kd) > 0.0),
       "gains that are out of range");
  r = plain_robot();
  must(T(plan_init)(&plan, &r) == HOPFORM_OK &&
           T(solve_flight)(&plan, &start, &none, 1e300, CAPACITY, phases,
                           CAPACITY, &flight) == HOPFORM_OK,
       "the longest horizon");
  r.u_max = 1e300; /* times gamma2: as much as a number may be */
  must(T(plan_init)(&plan, &r) == HOPFORM_OK &&
           !(fabs(largest_force_f64(&plan.robot) - 1e300) > 0.0),
       "the largest force");
}

/* Which phase a time belongs to: the later one where it begins. */
static void indices(void) {
  T(flight_phase) some[7] = {{0}};
  for (int count = 1; count <= 7; count++) {
    for (int n = 0; n < count; n++) {
      some[n].t = n > 3 ? n - 1 : n; /* two begin at 3 */
    }
    for (int n = 0; n < 2 * count; n++) {
      int wanted = 0;
      for (int i = 0; i < count; i++) {
        wanted = some[i].t <= 0.5 * n ? i : wanted;
      }
      must(phase_index_f64(some, count, 0.5 * n) == wanted,
           "the phase of a time");
    }
  }
}

int main(int argc, char **argv) {
  listen(argc, argv);
  derivatives();
  zeros();
  roots();
  pieces();
  crossings();
  limits();
  faded();
  squares_of_velocity();
  touches();
  mirrored_flights();
  balances();
  designs();
  large_numbers();
  indices();
  return conclude();
}
