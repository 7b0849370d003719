/* The judge of mutants in headers: kernels, formulas and the search for events, each function by itself, against long
 * double arithmetic, against differences and against what many samples show. Prints what is wrong and ends with 1, or
 * is silent.
 */
#include "checks.h"
#include "linear_f64.h"
#include "trial_f64.h"

/* ---- kernels ---- */

static void elementary(void)
{
    for (int n = -4000; n <= 4000; n++) {
        const double x = (double)n * 0.0173;
        const long double e = expl((long double)-fabs(x));
        const T(fade) fade = hopform_fade_by_f64(-fabs(x));
        near(fade.left, (double)e, 4e-16 * (double)e, "exp");
        near(fade.gone, (double)-expm1l((long double)-fabs(x)),
             5e-16 * fabs((double)expm1l((long double)-fabs(x))) + 1e-300, "1 - exp");
        const double turned = fabs(x) * 3.0;
        const T(turn) turn = hopform_turn_by_f64(turned);
        near(turn.sine, (double)sinl((long double)turned), 3e-16 + 5e-17 * turned, "sin");
        near(turn.cosine, (double)cosl((long double)turned), 3e-16 + 5e-17 * turned, "cos");
        near(hopform_log_f64(exp(x)), (double)logl((long double)exp(x)), 4e-16 * (1.0 + fabs(x)), "log");
        const double angle = ((double)n + 4000.5) / 8001.0 * 3.14159265358979;
        near(hopform_angle_f64(7.0 * cos(angle), 7.0 * sin(angle)), angle, 2e-15, "angle");
        const double power = exp(4.0 * x);
        near(hopform_cube_root_f64(power), (double)cbrtl((long double)power),
             2.5e-16 * (double)cbrtl((long double)power), "cbrt");
    }
    must(fabs(hopform_exp_f64(-1e5)) <= 0.0 && hopform_fade_by_f64(-1e5).gone >= 1.0, "exp far below");
    must(fabs(hopform_cube_root_f64(0.0)) <= 0.0 && fabs(hopform_cube_root_f64(-1.0)) <= 0.0,
         "cbrt of what is not above 0");
    near(hopform_cube_root_f64(1e-315), (double)cbrtl(1e-315L), 1e-8 * 1e-105, "cbrt of a tiny number");
    for (int n = -17; n <= 17; n++) {
        const double s = (double)n * 0.01;
        near(hopform_area_tangent_f64(s), n ? (double)(atanhl((long double)s) / (long double)s) : 1.0, 4e-16,
             "artanh(s)/s");
    }
}

/* W'', W', W and its two integrals: z' = M z to long double precision, by halving and a power series. */
static void exact_basis(const T(poles) *poles, double t, long double w[5])
{
    int halvings = 0;
    const long double size = (long double)(poles->s_1 + sqrt(poles->s_2)) * (long double)t;
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
            const long double rate[5] = {-((long double)poles->s_1 * term[0] + (long double)poles->s_2 * term[1]
                                           + (long double)poles->s_3 * term[2]), term[0], term[1], term[2], term[3]};
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

static void basis_of(const T(poles) *poles)
{
    const double speed = poles->s_1 + sqrt(poles->s_2);
    for (int n = -12; n <= 12; n++) {
        const double t = exp(0.55 * (double)n) / speed;
        long double w[5];
        exact_basis(poles, t, w);
        const T(basis) at = hopform_basis_at_f64(poles, t);
        const double scale[5] = {1.0, t, t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0};
        const double got[5] = {at.Wdd, at.Wd, at.W, at.W1, at.W2};
        for (int i = 0; i < 5; i++) {
            near(got[i], (double)w[i], 4e-12 * larger(fabs((double)w[i]), 1e-3 * scale[i] / (1.0 + t * speed)),
                 "the response of the poles");
        }
    }
}

static void all_poles(void)
{
    static const double cubics[][3] = {/* rates of a, then p, q of the pair */
                                       {1.0, 0.2, 30.0},     {40.0, 3.0, 900.0},  {5.0, 10.0, 25.0},
                                       {5.0, 10.1, 25.5},    {3.0, 30.0, 200.0},  {0.01, 4.0, 900.0},
                                       {300.0, 1.0, 1.0},    {2.0, 4.0, 4.0},     {2.0, 4.000001, 4.0},
                                       {7.0, 100.0, 2400.0}, {10.0, 20.5, 105.0}, {1.0, 2.2, 1.25}};
    for (size_t n = 0; n < sizeof cubics / sizeof cubics[0]; n++) {
        const double a = cubics[n][0], p = cubics[n][1], q = cubics[n][2];
        const T(poles) poles = hopform_factor_cubic_f64(a + p, q + a * p, a * q);
        near(poles.a + poles.p, a + p, 1e-14 * (a + p), "the factors, s_1");
        near(poles.q + poles.a * poles.p, q + a * p, 1e-14 * (q + a * p), "the factors, s_2");
        near(poles.a * poles.q, a * q, 1e-13 * a * q, "the factors, s_3");
        basis_of(&poles);
        const T(poles) held = {0.0, p, q, p, q, 0.0};
        basis_of(&held);
    }
    const T(poles) still = hopform_factor_cubic_f64(0.0, 900.0, 0.0);
    near(still.q, 900.0, 1e-12, "no friction");
    basis_of(&still);
}

/* v'' + p v' + q v = 0 from v > 0: its first zero, by small steps and halving, and what the library says. */
static void halts(void)
{
    static const double damping[] = {0.0, 0.3, 0.95, 1.0, 1.05, 1.4, 3.0, 20.0};
    for (size_t n = 0; n < sizeof damping / sizeof damping[0]; n++) {
        for (int i = 0; i < 24; i += 4) {
            const double q = 400.0, p = 2.0 * damping[n] * 20.0, v = 0.3, acc = -0.25 * (double)(1 + i * i) + 2.0;
            const T(poles) poles = {0.0, p, q, p, q, 0.0};
            const double t = hopform_halt_time_f64(&poles, v, acc);
            long double w[5], zero = -1.0L;
            for (int k = 1; k <= 200 && zero < 0.0L; k++) { /* v(t) = v (R' + p R) + acc R */
                exact_basis(&poles, (double)k * 1e-2, w);
                if ((long double)v * (w[0] + (long double)p * w[1]) + (long double)acc * w[1] < 0.0L) {
                    long double low = (long double)(k - 1) * 1e-2L, high = (long double)k * 1e-2L;
                    for (int m = 0; m < 50; m++) {
                        const double middle = (double)(0.5L * (low + high));
                        exact_basis(&poles, middle, w);
                        if ((long double)v * (w[0] + (long double)p * w[1]) + (long double)acc * w[1] < 0.0L) {
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

/* Cubics of any poles, also nearly and exactly equal ones: the factors multiply out to them, and the response is
 * theirs. */
static void any_poles(void)
{
    for (row = 0; row < 400; row++) {
        const double a = over(1e-3, 1e3), fast = over(1e-2, 1e3);
        const double p = 2.0 * fast * (row % 4 == 0 ? 1.0 : (row % 4 == 1 ? uniform(0.0, 0.99) : over(1.0, 50.0))),
                     q = fast * fast;
        const double near_a = row % 8 < 6 ? a : fast * (1.0 + (row % 8 == 6 ? 0.0 : over(1e-12, 1e-2)));
        const T(poles) poles = hopform_factor_cubic_f64(near_a + p, q + near_a * p, near_a * q);
        near(poles.a + poles.p, poles.s_1, 4e-15 * poles.s_1, "any factors, s_1");
        near(poles.q + poles.a * poles.p, poles.s_2, 1e-14 * poles.s_2, "any factors, s_2");
        near(poles.a * poles.q, poles.s_3, 1e-14 * poles.s_3, "any factors, s_3");
        const double mean = 0.5 * poles.p, square = mean * mean - poles.q;
        const double roots[2] = {square > 0.0 ? mean - sqrt(square) : mean, square > 0.0 ? mean + sqrt(square) : mean};
        const double apart = larger(fabs(poles.a - roots[0]), sqrt(larger(0.0, -square)));
        must(!(square > 0.0) || fabs(poles.a - roots[0]) >= (roots[1] - roots[0]) * 0.999
                 || fabs(poles.a - roots[1]) >= (roots[1] - roots[0]) * 0.999 || apart <= 1e-4 * poles.s_1,
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
    must(!(fabs(none.a) + fabs(none.p) + fabs(none.q) > 0.0), "poles that are slower than a number can say");
}

/* The first zero of v cos(w t) + (acc + p v/2) sin(w t)/w, or of two decays, by its value on both sides. */
static void any_halts(void)
{
    for (row = 0; row < 240; row++) {
        const double q = over(1.0, 1e5), p = 2.0 * sqrt(q) * (row % 3 == 0 ? uniform(0.0, 1.0) : over(1e-3, 50.0));
        const double v = over(1e-6, 10.0), acc = v * sqrt(q) * (row % 2 ? -over(1e-3, 1e3) : uniform(-3.0, 3.0));
        const T(poles) poles = {0.0, p, q, p, q, 0.0};
        const double t = hopform_halt_time_f64(&poles, v, acc);
        const double last = t < 1e300 ? t : 40.0 / sqrt(q);
        long double w[5];
        for (int n = 0; n <= 20; n++) { /* v(t) = v (R' + p R) + acc R: above zero before, below it behind */
            const double share = n < 20 ? (double)n / 20.0 : 1.0 - 1e-7, at = last * share;
            exact_basis(&poles, at, w);
            must((long double)v * (w[0] + (long double)p * w[1]) + (long double)acc * w[1] > 0.0L || share > 0.999,
                 "a halt that comes late");
        }
        exact_basis(&poles, t < 1e300 ? t : 0.0, w);
        const long double rate = (long double)acc * (w[0]) - (long double)q * (long double)v * w[1];
        const double left = (double)((long double)v * (w[0] + (long double)p * w[1]) + (long double)acc * w[1]);
        must(!(t < 1e300) || fabs(left) <= 2e-13 * t * fabs((double)rate) + 1e-16 * v, "a mass that has come to rest");
    }
    const T(poles) swings = {0.0, 4.0, 104.0, 4.0, 104.0, 0.0}, creeps = {0.0, 5.0, 4.0, 5.0, 4.0, 0.0};
    near(hopform_halt_time_f64(&swings, 0.0, 1.0), 3.14159265358979323846 / 10.0, 1e-15, "a half turn from rest");
    must(hopform_halt_time_f64(&creeps, 0.0, 1.0) >= 1e300, "creeping from rest");
    must(!(hopform_halt_time_f64(&creeps, 0.0, -1.0) > 0.0) && !(hopform_halt_time_f64(&swings, 0.0, -1.0) > 0.0),
         "away from rest the other way");
    must(hopform_halt_time_f64(&creeps, 0.0, 0.0) >= 1e300 && hopform_halt_time_f64(&swings, 0.0, 0.0) >= 1e300,
         "nothing that moves");
}

/* ---- formulas that the library does not call ---- */

static void formulas(void)
{
    for (row = 0; row < 50; row++) {
        T(robot) r = any_robot();
        r.g = 9.81;
        const T(state) s = {uniform(-0.1, 0.1), uniform(-1.0, 1.0), -over(0.1, 4.0), 0.0};
        const double aed = uniform(-5.0, 5.0), x1_T = uniform(-0.1, 0.1), step = uniform(-0.1, 0.1),
                     h_des = uniform(0.0, 0.5);
        const double lift = uniform(-0.1, 0.1), spring = uniform(0.0, 1.0), weight = r.m_s * r.g,
                     kinetic = 0.5 * r.m_s * s.v2 * s.v2;
        const double size = 1e-13 * (kinetic + fabs(aed) + weight + 0.5 * r.k * (s.x1 * s.x1 + x1_T * x1_T));
        near(hopform_touchdown_velocity_f64(&r, h_des) * hopform_touchdown_velocity_f64(&r, h_des),
             2.0 * r.g * h_des * (1.0 - r.impact_loss), 1e-13, "the velocity after a drop");
        must(hopform_touchdown_velocity_f64(&r, h_des) < 0.0, "a drop upwards");
        near(weight * (hopform_apex_from_energy_f64(&r, &s, aed, x1_T, step) - s.x1),
             kinetic + aed - weight * step + 0.5 * r.k * s.x1 * s.x1 - 0.5 * r.k * x1_T * x1_T, size, "(27), the apex");
        near(hopform_printed_objective_f64(&r, &s, aed, h_des, step),
             fabs(0.5 * weight * fabs(step) + kinetic + aed - weight * h_des), size, "(27) as printed");
        near(hopform_objective_f64(&r, &s, aed, x1_T, h_des, lift, spring),
             fabs(weight * lift + kinetic + aed - weight * h_des
                  + spring * (0.5 * r.k * s.x1 * s.x1 + weight * s.x1 - 0.5 * r.k * x1_T * x1_T)),
             size, "(27)");
        near(hopform_threshold_current_f64(&r) * fabs(r.gamma2), r.m_eff * r.f1, 1e-13 * r.m_eff * (r.f1 + 1e-9),
             "(5)");
    }
}

/* ---- the search for events ---- */

enum { SAMPLES = 240 };

/* g at a time, from its numerator and the response of the poles. */
static double value_of(const T(watch) *watch, const T(poles) *poles, double t)
{
    const T(basis) basis = hopform_basis_at_f64(poles, t);
    return watch->start + watch->numerator.H3 * basis.Wd + watch->numerator.H2 * basis.W
           + watch->numerator.H1 * basis.W1;
}

static T(poles) poles_of_any_robot(void)
{
    T(plan) plan;
    const T(robot) robot = any_robot();
    must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
    const double which = uniform(0.0, 1.0);
    return which < 0.7 ? plan.both : (which < 0.85 ? plan.actuator : plan.body);
}

/* A function of time that begins at 0 or above it, with a window of it that is shorter than a half turn. */
static T(watch) any_watch(const T(poles) *poles, double *h)
{
    const double w = sqrt(poles->q > 0.0 ? poles->q : poles->s_2);
    const double start = uniform(0.0, 1.0) < 0.2 ? 0.0 : over(1e-3, 2.0);
    const double H3 = mostly(uniform(-1.0, 1.0), start > 0.0 ? 0.15 : 0.0) * w,
                 H2 = mostly(uniform(-1.0, 1.0), 0.2) * w * w + poles->s_1 * H3;
    const double H1 = mostly(uniform(-1.0, 1.0), 0.2) * w * w * (w + poles->a);
    const double half_turn =
        hopform_frequency_f64(poles) > 0.0 ? 3.141592653589793 / hopform_frequency_f64(poles) : 3.0 / w;
    *h = 0.97 * half_turn * (uniform(0.0, 1.0) < 0.5 ? 1.0 : over(1e-2, 1.0));
    return hopform_watch_of_f64(poles, start > 0.0 ? H3 : fabs(H3), H2, H1, start, 1.0, 0, 0);
}

/* (18): what fades with the pole that is apart and what rings with the pair are the whole. */
static void ringing(void)
{
    int seen = 0;
    for (row = 0; row < 600; row++) {
        const T(poles) poles = poles_of_any_robot();
        const double chi = poles.q - poles.a * (poles.p - poles.a);
        if (!(poles.q > 0.0 && chi > 0.2 * (poles.q + poles.a * poles.a + poles.a * poles.p))) {
            continue;
        }
        seen++;
        const double w = sqrt(poles.q) + poles.a, t = over(0.05, 5.0) / w;
        const T(numerator) numerator = {uniform(-1.0, 1.0), uniform(-1.0, 1.0) * w, uniform(-1.0, 1.0) * w * w};
        const T(decay) decay = hopform_decay_at_f64(poles.a, t);
        const T(pair) pair = hopform_pair_at_f64(&poles, t);
        const T(basis) basis = hopform_basis_at_f64(&poles, t);
        const T(ringing) parts = hopform_ringing_at_f64(&poles, chi, &numerator, &decay);
        const double whole = numerator.H3 * basis.Wd + numerator.H2 * basis.W + numerator.H1 * basis.W1;
        const double size = fabs(parts.slow) + fabs(parts.X * pair.Rd) + fabs(parts.Y * pair.R) + fabs(whole);
        near(parts.slow + parts.X * pair.Rd + parts.Y * pair.R, whole, 1e-11 * size, "(18), slow and ringing");
    }
    must(seen > 100, "too few that ring");
}

/* The same function, so much lower that it touches zero, has its minimum there; a little higher, it is above zero. */
static void any_bottom(const T(watch) *high, const T(poles) *poles, double h, double least, double most)
{
    for (int n = 0; n < 2; n++) {
        T(watch) watch = *high;
        watch.start -= least - (n == 0 ? 0.0 : 1e-3 * most);
        const T(sample) from = hopform_first_sample_f64(&watch, poles);
        const T(point) end = hopform_point_at_f64(&watch, poles, h);
        const T(point) bottom = hopform_bottom_between_f64(&watch, poles, 0.0, &from, h, &end.at);
        if (n == 0) {
            must(bottom.at.value <= bottom.at.noise && bottom.at.value >= -1e-3 * most,
                 "a bottom that is higher than what was seen");
            must(bottom.at.value < -bottom.at.noise
                     || fabs(bottom.at.rate) <= 1e-7 * (fabs(bottom.at.curvature) * h + most / h),
                 "a bottom that slopes");
        } else {
            must(bottom.at.value > 0.0, "a bottom that is below zero, and is not");
        }
    }
}

/* A step towards a root from 3 % beyond it leaves a tenth of that, but where g hardly falls. */
static void any_step(const T(watch) *watch, const T(poles) *poles, double root)
{
    const double w = hopform_frequency_f64(poles), t = 1.03 * root;
    const T(sample) from = hopform_first_sample_f64(watch, poles);
    const T(point) there = hopform_point_at_f64(watch, poles, root), near_it = hopform_point_at_f64(watch, poles, t);
    const bool plain = w > 0.0 && w * t < 3.0 && 0.5 * poles->p * t < 1.0 && poles->a * t < 1.0;
    if (plain && fabs(there.at.rate - near_it.at.rate) < 0.2 * fabs(there.at.rate)) {
        const double step = hopform_swing_step_f64(poles, &from, w, t);
        const double size =
            from.value + fabs(from.rate) / w + fabs(from.curvature) / (w * w) + fabs(from.third) / (w * w * w);
        near(t - step, root, 0.003 * root + 1e-4 * size / fabs(there.at.rate), "a step to a root");
    }
}

/* A verdict against samples: how often g changes its sign, and how often it turns upwards. */
static void any_verdicts(void)
{
    for (row = 0; row < 2500; row++) {
        const T(poles) poles = poles_of_any_robot();
        double h, g[SAMPLES + 1];
        const T(watch) watch = any_watch(&poles, &h);
        const T(point) end = hopform_point_at_f64(&watch, &poles, h);
        const T(sample) from = hopform_first_sample_f64(&watch, &poles);
        const double half_turn =
            hopform_frequency_f64(&poles) > 0.0 ? 3.141592653589793 / hopform_frequency_f64(&poles) : 1e300;
        if (!(from.value > 0.0) && !(from.rate > 0.0)) {
            continue;
        }
        const T(verdict) verdict = hopform_judge_f64(&from, &end.at, end.at.value, poles.a, h, h <= 0.5 * half_turn);
        double least = INFINITY, most = 0.0;
        int crossings = 0, lowest = 0;
        for (int n = 0; n <= SAMPLES; n++) {
            g[n] = value_of(&watch, &poles, h * (double)n / SAMPLES);
            most = larger(most, fabs(g[n]));
            if (n > 0 && g[n] < least) {
                least = g[n];
                lowest = n;
            }
            crossings += n > 0 && (g[n - 1] > 0.0) != (g[n] > 0.0) && (n > 1 || g[0] > 0.0);
        }
        const double tiny = 1e-13 * most + end.at.noise;
        must(verdict != KEEPS_SIGN_f64 || least >= -tiny, "a sign that is not kept");
        must(verdict != LOSES_SIGN_f64 || ((crossings == 1 || (crossings == 0 && !(g[0] > 0.0))) && g[SAMPLES] < tiny)
                 || fabs(g[SAMPLES]) < tiny,
             "a sign that is not lost once");
        must(verdict != DIPS_f64 || (crossings != 1 && crossings < 3) || fabs(g[SAMPLES]) < 1e-3 * most,
             "a dip that is none");
        must(crossings == 0 || verdict != KEEPS_SIGN_f64 || fabs(least) < tiny, "crossings that are not seen");
        if (verdict == LOSES_SIGN_f64 && crossings == 1 && g[SAMPLES] < -tiny) {
            const T(point) root = hopform_root_between_f64(&watch, &poles, 0.0, end);
            near(root.at.value, 0.0, 4e-16 * root.t * fabs(root.at.rate) + 0.5 * root.at.noise, "a root");
            must(root.t > 0.0 && root.t < h, "a root outside");
            any_step(&watch, &poles, root.t);
            const T(point) ahead =
                hopform_root_ahead_f64(&watch, &poles, 0.0, root.t * 1.01 < h ? root.t * 1.01 : h, h);
            near(ahead.t, root.t, 1e-14 * root.t + 4.0 * root.at.noise / fabs(root.at.rate), "a root that is expected");
            near(root.at.value, value_of(&watch, &poles, root.t), root.at.noise, "g at its root");
        }
        if (verdict == DIPS_f64 && least > tiny && lowest > 1 && lowest < SAMPLES - 1 && end.at.rate > 0.0
            && from.rate < 0.0) {
            const T(point) bottom = hopform_bottom_between_f64(&watch, &poles, 0.0, &from, h, &end.at);
            must(bottom.t > 0.0 && bottom.t < h && bottom.at.value >= least - 1e-4 * most,
                 "a bottom below what was seen");
            any_bottom(&watch, &poles, h, least, most);
        }
        if (verdict == DIPS_f64 && least < -tiny) {
            const T(point) bottom = hopform_bottom_between_f64(&watch, &poles, 0.0, &from, h, &end.at);
            must(bottom.at.value < 0.0, "a bottom that is not below zero");
        }
        const bool held_up =
            from.rate < 0.0 && end.at.rate > 0.0 && hopform_is_held_up_f64(&from, &end.at, end.at.value, poles.a, h);
        must(!held_up || h > half_turn || least > 0.0, "held up, and below zero");
        if (verdict == UNDECIDED_f64) {
            const double cut = hopform_turn_between_f64(&from, &end.at, h);
            must(cut >= h / 64.0 && cut <= h * 63.0 / 64.0, "a cut at the rim");
        }
    }
}

/* A function at the start of a phase is what it is at the time 0 of it; what the pair's part of it is there, too. */
static void first_samples(void)
{
    for (row = 0; row < 200; row++) {
        const T(poles) poles = poles_of_any_robot();
        double h;
        const T(watch) watch = any_watch(&poles, &h);
        const T(basis) start = {1.0, 0.0, 0.0, 0.0, 0.0};
        const T(sample) first = hopform_first_sample_f64(&watch, &poles),
                        at = hopform_sample_at_f64(&watch, &poles, &start, 0.0);
        const double w = poles.s_1 + sqrt(poles.s_2),
                     size = 1e-12
                            * (fabs(first.value) + fabs(first.rate) / w + fabs(first.curvature) / (w * w)
                               + fabs(watch.numerator.H1) / (w * w * w));
        near(first.value, at.value, size, "g at 0");
        near(first.rate, at.rate, size * w, "its rate at 0");
        near(first.curvature, at.curvature, size * w * w, "its second derivative at 0");
        near(first.third, at.third, size * w * w * w, "its third derivative at 0");
        near(first.turning, at.turning, size * w * w, "the turning at 0");
        near(first.noise, at.noise, size, "the noise at 0");
    }
}

/* Tables: 1/n, and a rule that is exact for powers up to 23. */
static void tables(void)
{
    for (int n = 1; n < (int)(sizeof hopform_inverse_f64 / sizeof hopform_inverse_f64[0]); n++) {
        near((double)((long double)hopform_inverse_f64[n] * (long double)n), 1.0, 1.2e-16, "1/n");
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
        near((double)(sum * (power + 1)), 1.0, 1e-15, "an integral by Gauss's rule");
    }
    for (row = 0; row < 200; row++) { /* halved until the rule is exact, and not more often */
        const T(poles) poles = poles_of_any_robot();
        const double fastest = poles.s_1 + sqrt(poles.s_2),
                     t = row < 100 ? over(1e-3, 1e3) / fastest : ldexp(4.0, row % 7) / fastest;
        const int times = hopform_doublings_f64(&poles, t);
        const double left = fastest * hopform_halved_f64(t, times);
        must(left <= 4.0 && (times == 0 || left > 2.0), "how often a time is halved");
    }
    T(poles) plain = {0.0, 4.0, 0.0, 4.0, 0.0, 0.0};
    must(hopform_doublings_f64(&plain, 1.0) == 0 && hopform_doublings_f64(&plain, 8.0) == 3,
         "a time that need not be halved");
}

/* Phi of a mode: that of a sum of times is the product, it begins as 1, and a mass that is held has no column. */
static void transitions(void)
{
    for (row = 0; row < 180; row++) {
        const T(robot) r = any_robot();
        T(plan) plan;
        must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
        const int side_1 = row % 3 - 1, side_2 = row / 3 % 3 - 1;
        if (side_1 == 0 && side_2 == 0) {
            continue;
        }
        const T(drive) drive =
            hopform_drive_of_f64(&r, &plan.rates, uniform(-3.0, 3.0), (double)side_1, (double)side_2);
        const double w =
            sqrt(hopform_poles_of_f64(&plan, side_1, side_2)->s_2) + hopform_poles_of_f64(&plan, side_1, side_2)->s_1;
        const double h = over(0.01, 1.0) / w, then = over(0.01, 1.0) / w;
        const T(matrix) one = hopform_transition_f64(&plan, &drive, side_1, side_2, h),
                        two = hopform_transition_f64(&plan, &drive, side_1, side_2, then);
        const T(matrix) both = hopform_transition_f64(&plan, &drive, side_1, side_2, h + then),
                        none = hopform_transition_f64(&plan, &drive, side_1, side_2, 0.0);
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = 0; j < Z_SIZE; j++) {
                double sum = 0.0, size = 1e-300;
                for (int k = 0; k < Z_SIZE; k++) {
                    sum += two.at[i][k] * one.at[k][j];
                    size += fabs(two.at[i][k] * one.at[k][j]);
                }
                const int held = (side_1 == 0 && j == Z_V1) || (side_2 == 0 && j == Z_V2);
                near(both.at[i][j], sum, 1e-12 * size, "Phi of a sum of times");
                near(none.at[i][j], i == j && !held ? 1.0 : 0.0, 1e-300, "Phi of no time");
                must(!held || !(fabs(one.at[i][j]) > 0.0), "a mass that is held, and moves something");
            }
        }
    }
}

/* The minima of y inside a phase in which both masses slide the same way, as samples show them. */
static void dips(void)
{
    int seen = 0, deep = 0, ways = 0;
    for (row = 0; row < 1500; row++) {
        T(robot) r = any_robot();
        T(plan) plan;
        r.g = 9.81;
        r.b1 *= 0.1;
        r.b2 *= 0.1;
        must(T(plan_init)(&plan, &r) == HOPFORM_OK, "no plan");
        const T(state) start = {0.0, uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.0, 0.05)};
        const double w = sqrt(plan.both.q), length = over(0.3, 12.0) / w, u = uniform(-3.0, 3.0);
        const int side = row % 2 ? 1 : -1;
        T(trial) trial = {0};
        trial.dip = 1e300;
        T(tally) tally = {&plan, {0.0, 0.0, 0.0, 0.0}, 0.0, &trial};
        const T(drive) per_ampere = {plan.rates.a1_u, 0.0};
        const T(stretch) stretch = {&plan.both, start, hopform_motion_of_f64(&plan, &start, u, side, side),
                                    hopform_motion_under_f64(&plan.rates, &per_ampere, &tally.change, side, side), side,
                                    side};
        enum { N = 4000 };
        double rate = start.v1 - start.v2, least = INFINITY, when = 0.0, steep = 0.0, fastest = fabs(rate);
        int all = 0, plain = 1, began = 0, up = 0, down = 0, straight = 1;
        for (int n = 1; n <= N; n++) {
            const double now = hopform_rate_of_y_f64(&stretch, length * (double)n / N);
            if (rate < 0.0 && now >= 0.0) {
                const T(basis) basis = hopform_basis_at_f64(&plan.both, length * ((double)n - 0.5) / N);
                const T(state) at = hopform_arrive_f64(&start, &stretch.motion, &basis, side, side);
                all++;
                plain = plain && (double)(n - began) / N * length > 0.78 / w; /* a fall from one look to the next */
                when = at.y < least ? length * ((double)n - 0.5) / N : when;
                steep = at.y < least ? (now - rate) * N / length : steep;
                least = fmin(least, at.y);
            }
            began = rate >= 0.0 && now < 0.0 ? n : began;
            const double change = now - rate, little = 1e-14 * (fabs(now) + fabs(start.v1) + fabs(start.v2));
            straight = straight && !(change > little && down) && !(change < -little && up);
            up = up || change > little;
            down = down || change < -little;
            fastest = larger(fastest, fabs(now));
            rate = now;
        }
        const T(basis) end = hopform_basis_at_f64(&plan.both, length);
        const bool one_way = hopform_bends_one_way_f64(&stretch, &end, length);
        must(!one_way || straight, "y'' that does not keep its sign");
        ways += one_way;
        hopform_find_dips_f64(&tally, &stretch, &end, length, start.v1 - start.v2, rate);
        must(trial.dips == all || (trial.dips < all && !plain), "how often y turns upwards");
        const double size = 0.05 + fabs(start.v1 - start.v2) / w;
        must(trial.dips < all || all == 0 || fabs(trial.dip - least) < 1e-4 * size, "where y turns upwards");
        if (trial.dips == all && all > 0
            && steep > 0.1 * w * fastest) { /* where it is flat its time is known to few digits */
            const T(basis) basis =
                hopform_basis_at_f64(&plan.both, when); /* at rest in u's change: the response to 1 A */
            const T(state) change = hopform_arrive_f64(&tally.change, &stretch.by_u, &basis, side, side);
            near(trial.dip_u, change.y, 0.05 * (fabs(change.y) + 0.1 * fabs(plan.rates.a1_u) / (w * w)),
                 "how that changes with the current");
            seen++;
        }
        deep += all > 1;
        trial.dips = 0;
        const T(stretch) apart = {&plan.both, start, stretch.motion, stretch.by_u, side, -side};
        hopform_find_dips_f64(&tally, &apart, &end, length, start.v1 - start.v2, rate);
        must(trial.dips == 0, "what can not turn");
    }
    must(seen > 300 && deep > 30 && ways > 150, "too few that turn, or bend one way");
}

/* A function that is called quiet has no root, be it sampled many times in each turn. */
static void any_quiet(void)
{
    int quiet = 0;
    for (row = 0; row < 600; row++) {
        const double w = over(10.0, 1000.0), p = mostly(w * over(1e-5, 1e-2), 0.2), a = over(0.05, 5.0), q = w * w;
        const T(poles) poles = hopform_factor_cubic_f64(a + p, q + a * p, a * q);
        const double slow = uniform(-1.0, 1.0), swing = uniform(-1.0, 1.0) * over(1e-3, 1.0),
                     other = uniform(-1.0, 1.0) * over(1e-3, 1.0);
        const T(watch) watch = hopform_watch_of_f64(&poles, w * swing, w * w * other + slow * a,
                                                    w * w * a * uniform(-0.5, 0.5), uniform(0.0, 2.0), 1.0, 0, 0);
        const double from = over(0.01, 1.0), to = from + over(10.0, 100.0) * 3.1416 / w;
        const bool says = hopform_is_quiet_f64(&watch, &poles, from, to);
        double least = INFINITY, most = 0.0;
        for (int n = 0; n <= 1000; n++) {
            const double value = value_of(&watch, &poles, from + (to - from) * (double)n / 1000.0);
            least = value < least ? value : least;
            most = larger(most, fabs(value));
        }
        must(!says || least > 0.0, "a root in what is called quiet");
        quiet += says;
        must(says || least < 0.45 * most || p * (to - from) > 0.2 || a * (to - from) > 0.2,
             "quiet, and not seen to be");
    }
    must(quiet > 80, "nothing that is quiet");
}

/* Swinging about a constant: the root that is predicted, to the error of its arc tangent. */
static void swings(void)
{
    for (row = 0; row < 300; row++) {
        const double w = over(1.0, 1e3), value = row % 4 ? uniform(0.01, 2.0) : 0.0, slope = uniform(-2.0, 2.0) * w,
                     curvature = uniform(-2.0, 2.0) * w * w;
        const T(sample) from = {value, slope, curvature, 0.0, 0.0, 0.0};
        const double found = hopform_swing_to_zero_f64(&from, w);
        double before = value, first = 1e300;
        for (int n = 1; n <= 3000; n++) { /* g = value + curvature/w^2 (1 - cos) + slope/w sin */
            const double angle = 3.14159265 * (double)n / 3000.0;
            const double now = value + curvature / (w * w) * (1.0 - cos(angle)) + slope / w * sin(angle);
            if (now < 0.0 && before > 0.0 && first > 1e299) {
                first = angle / w;
            }
            before = now;
        }
        must(first > 1e299 ? found > 1e299 || found * w > 3.1 || value + 2.0 * curvature / (w * w) < 0.05
                           : fabs(found - first) * w < 0.02 || first * w > 3.1 || (row % 4 == 0 && slope < 0.0),
             "a root that is predicted");
    }
    const T(sample) still = {1.0, -1.0, -1.0, 0.0, 0.0, 0.0};
    must(hopform_swing_to_zero_f64(&still, 0.0) >= 1e300, "what does not swing");
}

/* What creeps to its zero when nearly all has faded: from where rounding may have put the root, to the root. */
static void late_roots(void)
{
    int seen = 0;
    const T(poles) undrawn = {0.0, 2.0, 0.0, 2.0, 0.0, 0.0};
    const T(numerator) pulled = {-1.0, -1.0, 0.0};
    const T(basis) faded = hopform_basis_at_f64(&undrawn, 20.0);
    const double nowhere = hopform_settled_y_f64(&undrawn, -1.0, 0.0);
    must(nowhere >= 1e300, "what tends to nothing");
    must(!(fabs(hopform_root_is_later_f64(&undrawn, &pulled, 10.0, nowhere, &faded, 20.0)) > 0.0),
         "a root of what does not settle");
    for (row = 0; row < 600; row++) {
        const T(poles) poles = poles_of_any_robot();
        const double start = 1.0, settled = -over(1e-9, 1e-4);
        near(hopform_settled_y_f64(&poles, 3.0, 5.0), poles.s_3 > 0.0 ? 5.0 / poles.s_3 : 3.0 / poles.s_2, 1e-300,
             "what y tends to");
        const double w = poles.s_3 > 0.0 ? cbrt(poles.s_3) : sqrt(poles.s_2), way = settled - start;
        const bool slow = poles.s_3 > 0.0;
        const double H3 = uniform(-1.0, 0.0) * w;
        const T(numerator) h = {H3, slow ? uniform(-1.0, 1.0) * w * w : way * poles.s_2, slow ? way * poles.s_3 : 0.0};
        double low = 1.0 / w, high = low;
        for (int n = 0; n < 60; n++) {
            const T(basis) basis = hopform_basis_at_f64(&poles, high);
            if (!(settled - hopform_left_to_go_f64(&poles, &h, &basis, way) > 0.0)) {
                break;
            }
            low = high;
            high *= 1.2;
        }
        for (int n = 0; n < 200; n++) {
            const double middle = 0.5 * (low + high);
            const T(basis) basis = hopform_basis_at_f64(&poles, middle);
            if (settled - hopform_left_to_go_f64(&poles, &h, &basis, way) > 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        const T(basis) there = hopform_basis_at_f64(&poles, low), early = hopform_basis_at_f64(&poles, 0.5 * low);
        const double rate = h.H3 * there.Wdd + h.H2 * there.Wd + h.H1 * there.W;
        const double faded = fabs(there.Wdd) + fabs(w * there.Wd) + (slow ? fabs(w * w * there.W) : 0.0);
        const double blurred = 1e-15 / fabs(rate); /* what rounding of the start makes of the time */
        if (!(rate < 0.0 && faded < 1e-3 && blurred < 0.005 * low && blurred > 1e-13 * low)) {
            continue;
        }
        seen++;
        must(!(fabs(hopform_root_is_later_f64(&poles, &h, start, settled, &early, 0.5 * low)) > 0.0),
             "a root that is not near");
        for (int side = -1; side <= 1; side += 2) {
            const double t = low + side * blurred;
            const T(basis) basis = hopform_basis_at_f64(&poles, t);
            const double later = hopform_root_is_later_f64(&poles, &h, start, settled, &basis, t);
            near(t + later, low, 0.2 * blurred, "a late root");
        }
    }
    must(seen > 30, "too few late roots");
}

int main(int argc, char **argv)
{
    listen(argc, argv);
    elementary();
    all_poles();
    halts();
    any_poles();
    any_halts();
    formulas();
    ringing();
    any_verdicts();
    any_quiet();
    swings();
    late_roots();
    first_samples();
    tables();
    transitions();
    dips();
    return conclude();
}
