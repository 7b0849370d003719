/* A digest of all bits that the library gives for DIGEST_ROBOTS random robots, in one precision: included with REAL
 * and T defined.
 *
 * Half of the numbers have four digits in base 2, so that sums are exact and ties are met; the others have 24. Those of
 * every third robot are powers of 2, so that forces often balance exactly.
 */

typedef struct {
    uint32_t dice;
    uint32_t hash;
    int plain; /* powers of 2 alone */
} T(digest);

static uint32_t T(roll)(T(digest) *w)
{
    w->dice ^= w->dice << 13; /* Marsaglia, "Xorshift RNGs", 2003 */
    w->dice ^= w->dice >> 17;
    w->dice ^= w->dice << 5;
    return w->dice;
}

static void T(take)(T(digest) *w, uint32_t bits)
{
    w->hash = (w->hash ^ bits) * 2654435761u;
    w->hash ^= w->hash >> 15;
}

static void T(number)(T(digest) *w, REAL value)
{
    union {
        REAL value;
        uint32_t bits[sizeof(REAL) / sizeof(uint32_t)];
    } number;
    number.value = value;
    for (size_t n = 0; n < sizeof(REAL) / sizeof(uint32_t); n++) {
        T(take)(w, value == value ? number.bits[n] : 1u); /* not all processors make the same NaN */
    }
}

static void T(numbers)(T(digest) *w, const REAL *values, size_t size)
{
    for (size_t n = 0; n < size / sizeof(REAL); n++) {
        T(number)(w, values[n]);
    }
}

/* Between 2^low and 2^high, all sizes alike. */
static REAL T(over)(T(digest) *w, int low, int high)
{
    REAL value = (T(roll)(w) & 1u) != 0u ? (REAL)(8u + T(roll)(w) % 8u) / (REAL)8
                                         : (REAL)((1u << 23) + (T(roll)(w) >> 9)) / (REAL)(1u << 23);
    value = w->plain ? (REAL)1 : value;
    int power = low + (int)(T(roll)(w) % (uint32_t)(high - low));
    for (; power > 0; power--) {
        value *= (REAL)2;
    }
    for (; power < 0; power++) {
        value *= (REAL)0.5;
    }
    return value;
}

/* The same with either sign, or 0 in one of `zero` cases. */
static REAL T(signed_over)(T(digest) *w, int low, int high, uint32_t zero)
{
    const REAL value = T(roll)(w) % zero == 0u ? (REAL)0 : T(over)(w, low, high);
    return (T(roll)(w) & 1u) != 0u ? value : -value;
}

static REAL T(positive_over)(T(digest) *w, int low, int high, uint32_t zero)
{
    return T(roll)(w) % zero == 0u ? (REAL)0 : T(over)(w, low, high);
}

static T(hopform_robot) T(robot)(T(digest) *w)
{
    const uint32_t kind = T(roll)(w);
    T(hopform_robot) r;
    r.m_eff = T(over)(w, -2, 5);
    r.m_s = T(over)(w, -2, 5);
    r.k = T(over)(w, 6, 16);
    r.L0 = (REAL)0.5;
    r.c = T(signed_over)(w, -10, -6, 2);
    r.b1 = T(positive_over)(w, -3, 9, 5);
    r.b2 = T(positive_over)(w, -3, 7, 5);
    r.f1 = T(positive_over)(w, -5, 4, 5);
    r.f2 = T(positive_over)(w, -5, 4, 5);
    r.gamma2 = T(signed_over)(w, 2, 7, 20);
    r.g = (kind & 15u) == 0u ? (REAL)0 : (kind & 1u) != 0u ? (REAL)9.81 : (REAL)8;
    if ((kind & 0x700u) == 0u) { /* the body is held, the actuator swings and turns where it began */
        r.b1 = (REAL)0;
        r.f1 = (REAL)0;
        r.f2 = (REAL)131072;
    }
    const int stops = (kind & 6u) == 0u || (kind & 0x700u) == 0u;
    r.x1_min = stops ? -T(positive_over)(w, -9, -4, 3) : (REAL)-INFINITY;
    r.x1_max = stops ? T(over)(w, -9, -4) : (REAL)INFINITY;
    r.x1_max = (kind & 0xf000u) == 0u ? (REAL)0 : r.x1_max;
    r.x1_min = (kind & 0x1f0000u) == 0u ? r.x1_max : r.x1_min; /* locked, if there is a stop */
    r.x1_min = r.x1_min < (REAL)INFINITY ? r.x1_min : (REAL)0;
    r.u_max = (kind & 0x600000u) == 0u ? T(over)(w, -4, 2) : (REAL)3;
    r.u_max = (kind & 0x7800000u) == 0u ? (REAL)INFINITY : r.u_max;
    r.impact_loss = (kind & 8u) != 0u ? (REAL)0 : (REAL)0.0625;
    r.f1_excess = (kind & 0x40u) == 0u ? T(positive_over)(w, -5, 4, 5) : (REAL)0;
    r.f2_excess = (kind & 0x80u) == 0u ? T(positive_over)(w, -5, 4, 5) : (REAL)0;
    return r;
}

static void T(with_flight)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_state) *takeoff)
{
    enum { TIMES = 5 };
    static T(hopform_flight_phase) phases[DIGEST_PHASES];
    T(hopform_flight) flight;
    T(hopform_gains) gains, designed;
    gains.Kp = T(positive_over)(w, 2, 12, 6);
    gains.Kd = T(positive_over)(w, 0, 8, 6);
    const uint32_t kind = T(roll)(w);
    const REAL horizon = (kind & 6u) == 0u ? T(over)(w, -7, 2) : (REAL)2;
    const int32_t most = (kind & 56u) == 0u ? 1 + (int32_t)(T(roll)(w) % 4u) : DIGEST_PHASES;
    T(take)(w, (uint32_t)T(hopform_design_return)(plan, horizon, &designed));
    T(numbers)(w, &designed.Kp, sizeof designed);
    T(take)(w, (uint32_t)T(hopform_solve_flight)(plan, takeoff, 0, (kind & 1u) != 0u ? NULL : &gains, horizon, most,
                                                 phases, DIGEST_PHASES, &flight));
    T(numbers)(w, (const REAL *)&flight, offsetof(T(hopform_flight), ending));
    T(take)(w, (uint32_t)flight.ending + 16u * (uint32_t)flight.event_count + 4096u * (uint32_t)flight.phase_count);
    for (int32_t n = 0; n < flight.phases_kept; n++) {
        T(numbers)(w, &phases[n].t, 4 * sizeof(REAL));
        T(take)(w, (uint32_t)(phases[n].side + 8 * phases[n].limit + 64 * phases[n].event));
    }
    if (flight.phases_kept == flight.phase_count && flight.phase_count > 0) {
        const REAL times[TIMES] = {(REAL)0, flight.duration / (REAL)3, phases[flight.phase_count - 1].t,
                                   (phases[flight.phase_count - 1].t + flight.duration) / (REAL)2, flight.duration};
        T(hopform_state) states[TIMES];
        T(hopform_energy) energies[TIMES];
        T(hopform_flight_ledger) ledgers[TIMES];
        REAL losses[TIMES];
        T(take)(w, (uint32_t)T(hopform_flight_at)(plan, phases, &flight, times, TIMES, states));
        T(numbers)(w, &states[0].x1, sizeof states);
        for (int n = 0; n < TIMES; n++) { /* apart: the times of all need not increase */
            T(take)(w, (uint32_t)T(hopform_flight_energy)(plan, phases, &flight, &times[n], 1, &energies[n],
                                                          &ledgers[n], &losses[n]));
        }
        T(numbers)(w, &energies[0].body, sizeof energies);
        T(numbers)(w, &ledgers[0].motor_work, sizeof ledgers);
        T(numbers)(w, losses, sizeof losses);
    }
}

/* A flight from anywhere: up or down, above the ground ahead or below it, the actuator anywhere in its stroke. */
static void T(with_any_flight)(T(digest) *w, const T(hopform_plan) *plan)
{
    const T(hopform_robot) *robot = &plan->robot;
    const uint32_t kind = T(roll)(w);
    T(hopform_state) takeoff;
    takeoff.x1 = T(signed_over)(w, -9, -4, 4);
    takeoff.v1 = T(signed_over)(w, -6, 2, 3);
    takeoff.v2 = T(signed_over)(w, -3, 3, 9);
    takeoff.y = T(signed_over)(w, -9, -3, 2);
    if ((kind & 3u) == 0u || takeoff.x1 > robot->x1_max || takeoff.x1 < robot->x1_min) {
        takeoff.x1 = (kind & 4u) != 0u && robot->x1_max < (REAL)1 ? robot->x1_max
                     : robot->x1_min < (REAL)-1                   ? (REAL)0
                                                                  : robot->x1_min;
    }
    T(with_flight)(w, plan, &takeoff);
}

static void T(with_motion)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_step) *steps,
                           const T(hopform_phase) *phases, const T(hopform_stance) *stance)
{
    enum { TIMES = 4, GRID = DIGEST_SAMPLES + 1 };
    REAL times[TIMES], losses[TIMES];
    static REAL x1[GRID], v1[GRID], v2[GRID], y[GRID], matrix[HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    static REAL tangents[TIMES * HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    T(hopform_energy) energies[TIMES];
    T(hopform_ledger) ledgers[TIMES];
    T(hopform_state) states[TIMES];
    for (int n = 0; n < TIMES; n++) {
        times[n] = n < TIMES - 1 ? stance->duration * (REAL)n / (REAL)TIMES : stance->duration;
    }
    T(take)(w, (uint32_t)T(hopform_stance_states)(plan, steps, phases, stance, times, TIMES,
                                                  (REAL *const[]){x1, v1, v2, y}));
    T(numbers)(w, x1, TIMES * sizeof(REAL));
    T(numbers)(w, v1, TIMES * sizeof(REAL));
    T(numbers)(w, v2, TIMES * sizeof(REAL));
    T(numbers)(w, y, TIMES * sizeof(REAL));
    T(take)(w,
            (uint32_t)T(hopform_stance_energy)(plan, steps, phases, stance, times, TIMES, energies, ledgers, losses));
    T(numbers)(w, &energies[0].body, sizeof energies);
    T(numbers)(w, &ledgers[0].motor_work, sizeof ledgers);
    T(numbers)(w, losses, sizeof losses);
    T(take)(w, (uint32_t)T(hopform_stance_tangents)(plan, steps, phases, stance, NULL, 0, times, TIMES, states, tangents));
    T(numbers)(w, &states[0].x1, sizeof states);
    T(numbers)(w, tangents, sizeof tangents);
    T(take)(w, (uint32_t)T(hopform_stance_sensitivities)(plan, steps, phases, stance, NULL, 0, matrix));
    T(numbers)(w, matrix, sizeof matrix);
    const int32_t counts[3] = {GRID - 1, 1 + (int32_t)(T(roll)(w) % 70u), 65};
    for (int i = 0; i < 3 && stance->duration > (REAL)0; i++) {
        /* all of it, and from a start of a phase or behind it on */
        const int32_t count = counts[i];
        const REAL t0 = i == 0   ? (REAL)0
                        : i == 1 ? phases[stance->phase_count - 1].t
                                 : (stance->duration + phases[stance->phase_count / 2].t) / (REAL)2;
        const REAL dt = i == 0 ? stance->duration / (REAL)count : (stance->duration - t0) / (REAL)80;
        T(take)(w, (uint32_t)T(hopform_stance_grid)(plan, steps, phases, stance, t0, dt, count,
                                                    (REAL *const[]){x1, v1, v2, y}));
        for (int n = 0; n < count && dt > (REAL)0; n++) {
            const REAL state[4] = {x1[n], v1[n], v2[n], y[n]};
            T(numbers)(w, state, sizeof state);
        }
    }
}

/* The same with few phases: too small a buffer, or too few of them allowed. */
static void T(with_less)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_state) *start,
                         const T(hopform_step) *steps, int32_t count, REAL horizon)
{
    T(hopform_phase) phases[4];
    T(hopform_stance) stance;
    const uint32_t kind = T(roll)(w);
    const int32_t most = (kind & 8u) != 0u ? 1 + (int32_t)(kind & 7u) : DIGEST_PHASES;
    T(take)(w, (uint32_t)T(hopform_solve_stance)(plan, start, steps, count, horizon, most, phases,
                                                 (int32_t)(kind >> 4 & 3u), &stance));
    T(numbers)(w, &stance.duration, offsetof(T(hopform_stance), ending));
    T(take)(w, (uint32_t)stance.ending + 16u * (uint32_t)stance.event_count + 4096u * (uint32_t)stance.phase_count);
    for (int32_t n = 0; n < stance.phases_kept; n++) {
        T(numbers)(w, &phases[n].t, 5 * sizeof(REAL));
    }
}

static void T(with_stance)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_state) *start)
{
    static T(hopform_phase) phases[DIGEST_PHASES];
    T(hopform_stance) stance;
    T(hopform_step) steps[2] = {{(REAL)0, (REAL)0}, {(REAL)0, (REAL)0}}; /* drawn one by one: a list has no order */
    steps[0].u = T(signed_over)(w, -5, 1, 6);
    steps[1].t = T(over)(w, -9, 0);
    steps[1].u = T(signed_over)(w, -5, 1, 6);
    const int32_t count = 1 + (int32_t)(T(roll)(w) & 1u);
    const REAL horizon = T(over)(w, -3, 2);
    T(take)(w,
            (uint32_t)T(hopform_solve_stance)(plan, start, steps, count, horizon, 64, phases, DIGEST_PHASES, &stance));
    T(numbers)(w, &stance.duration, offsetof(T(hopform_stance), ending));
    T(take)(w, (uint32_t)stance.ending + 16u * (uint32_t)stance.event_count + 4096u * (uint32_t)stance.phase_count);
    for (int32_t n = 0; n < stance.phases_kept; n++) {
        T(numbers)(w, &phases[n].t, 5 * sizeof(REAL));
        T(take)(w, (uint32_t)(phases[n].mode + 16 * phases[n].event) + 4096u * phases[n].step);
    }
    if (stance.phases_kept == stance.phase_count && stance.phase_count > 0) {
        T(with_motion)(w, plan, steps, phases, &stance);
        if (stance.ending == HOPFORM_ENDING_TAKEOFF) {
            T(with_flight)(w, plan, &stance.end);
        }
    }
    T(with_less)(w, plan, start, steps, count, horizon);
}

static void T(with_command)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_state) *start)
{
    static T(hopform_phase) phases[DIGEST_PHASES];
    static T(hopform_search) search;
    T(hopform_command) command;
    T(hopform_target) target = {0};
    target.h_des = T(over)(w, -6, -1);
    target.datum = T(signed_over)(w, -8, -5, 2);
    target.stop_margin = T(positive_over)(w, -10, -8, 2);
    target.horizon = (REAL)2;
    T(take)(w, (uint32_t)T(hopform_choose_current)(&search, plan, start, &target, phases, DIGEST_PHASES, &command));
    T(number)(w, command.u);
    T(number)(w, command.apex);
    T(take)(w, (uint32_t)command.status + 16u * (uint32_t)search.trials);
    int32_t goes =
        T(hopform_choose_current_begin)(&search, plan, start, &target, &command); /* step by step, in little memory */
    for (int n = 0; n < 12 && goes == HOPFORM_SEARCHING; n++) {
        goes = T(hopform_choose_current_step)(&search, phases, 8, &command);
        T(take)(w, (uint32_t)goes + 16u * (uint32_t)command.status);
        T(number)(w, command.u);
        T(number)(w, command.apex);
    }
}

static void T(with_trials)(T(digest) *w, const T(hopform_plan) *plan, const T(hopform_state) *start)
{
    enum { CURRENTS = 3 };
    static T(hopform_phase) phases[DIGEST_PHASES];
    T(hopform_trial) trials[CURRENTS];
    REAL currents[CURRENTS];
    for (int n = 0; n < CURRENTS; n++) {
        currents[n] = T(signed_over)(w, -5, 1, 6);
    }
    const int32_t status =
        T(hopform_try_currents)(plan, start, 1, currents, CURRENTS, (REAL)1, phases, DIGEST_PHASES, trials);
    T(take)(w, (uint32_t)status);
    for (int n = 0; n < CURRENTS && status >= 0; n++) {
        T(numbers)(w, &trials[n].u, offsetof(T(hopform_trial), events));
        T(take)(w, trials[n].events);
        T(take)(w, (uint32_t)trials[n].minima
                       + 65536u * (uint32_t)(trials[n].takes_off + 2 * trials[n].held + 4 * trials[n].smooth));
    }
}

/* A signal of contact, whose samples often lie on a threshold. */
static void T(with_contact)(T(digest) *w)
{
    T(hopform_detector) detector;
    T(hopform_contact) contact;
    detector.low = (REAL)(T(roll)(w) % 6u) / (REAL)8;
    detector.high = (REAL)(T(roll)(w) % 8u) / (REAL)8;
    detector.count = (int32_t)(T(roll)(w) % 4u);
    contact.above = (int32_t)(T(roll)(w) & 1u);
    contact.touches = (int32_t)(T(roll)(w) & 1u);
    contact.run = (int32_t)(T(roll)(w) % 5u);
    for (int n = 0; n < 16; n++) {
        T(take)(w, (uint32_t)T(hopform_touchdown)(&detector, &contact, (REAL)(T(roll)(w) % 9u) / (REAL)8));
        T(take)(w, (uint32_t)(contact.above + 16 * contact.touches + 256 * contact.run));
    }
}

static uint32_t T(digest_of)(int robots, int commands)
{
    T(digest) w = {2463534242u, 0u, 0};
    for (int n = 0; n < robots; n++) {
        T(hopform_plan) plan;
        w.plain = n % 3 == 0;
        const T(hopform_robot) robot = T(robot)(&w);
        T(take)(&w, (uint32_t)T(hopform_plan_init)(&plan, &robot));
        for (int m = 0; m < 2; m++) {
            const uint32_t kind = T(roll)(&w);
            T(hopform_state) start;
            start.x1 = ((kind & 3u) == 0u && robot.x1_max < (REAL)1) || robot.x1_min > (REAL)0 ? robot.x1_max : (REAL)0;
            start.v1 = T(signed_over)(&w, -6, 1, 2);
            start.v2 = -T(over)(&w, -3, 2);
            start.y = T(positive_over)(&w, -9, -5, 2);
            T(with_stance)(&w, &plan, &start);
            if (n < commands && m == 0) {
                T(with_command)(&w, &plan, &start);
            }
            if (m == 1) {
                T(with_trials)(&w, &plan, &start);
            }
            T(with_any_flight)(&w, &plan);
        }
        T(with_contact)(&w);
    }
    return w.hash;
}
