/* Every public function refuses each value that is none, by name; contract.c has the pointers. In double precision with
 * -DDOUBLE. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "board.h"
#include "hopform/hopform.h"

#ifdef DOUBLE
typedef double real;
#define OF(name) hopform_##name##_f64
#else
typedef float real;
#define OF(name) hopform_##name##_f32
#endif

enum { CAPACITY = 16, MANY = 4096 };

static const OF(robot) sound = {25.0f, 3.0f,   1200.0f, 0.4f, 0.0f,  150.0f, 5.0f, 0.78f,
                                0.6f,  -65.0f, 9.81f,   0.0f, 0.08f, 3.0f,   0.05f, 0.0f, 0.0f};
static const OF(state) start = {0.0f, 0.0f, -1.9f, 0.0f};
static const OF(step) one_step[1] = {{0.0f, 2.0f}};
static OF(phase) phases[CAPACITY];
static OF(flight_phase) flight_phases[CAPACITY];
static OF(search) search;
static OF(plan) plan, unmade;
static OF(stance) solved;
static OF(flight) flown;
static real numbers[HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
static real columns[4][4];
static int32_t checks;
static int wrong;

static real of_bits(uint32_t bits)
{
    union {
        uint32_t bits;
        float value;
    } number;
    number.bits = bits;
    return number.value;
}

static real not_a_number(void)
{
    return of_bits(0x7fc00000u);
}

static real infinity(void)
{
    return of_bits(0x7f800000u);
}

static void is(int32_t got, int32_t wanted, int line)
{
    checks++;
    if (got != wanted && wrong++ < 20) {
        board_text("refusals.c, line ");
        board_number(line);
        board_text(": ");
        board_number(got);
        board_text(", not ");
        board_number(wanted);
        board_text("\n");
    }
}

/* Fills what a refusal must clear. */
static void soil(real *values, int32_t count)
{
    for (int32_t n = 0; n < count; n++) {
        values[n] = 7.0f;
    }
}

static void is_clear(const real *values, int32_t count, int line)
{
    for (int32_t n = 0; n < count; n++) {
        is(values[n] == 0.0f, 1, line);
    }
}

#define CLEAR(values) is_clear((const real *)&(values), (int32_t)(sizeof(values) / (sizeof(real))), __LINE__)
#define SOIL(values) soil((real *)&(values), (int32_t)(sizeof(values) / (sizeof(real))))
#define IS(call, wanted) is((call), (wanted), __LINE__)

static void robots(void)
{
    OF(plan) made;
    real fields[HOPFORM_ROBOT_FIELDS];
    IS(OF(plan_init)(&plan, &sound), HOPFORM_OK);
    for (int field = 0; field < HOPFORM_ROBOT_FIELDS; field++) {
        const real bad[] = {not_a_number(), infinity(), -infinity(), -1.0f, 0.0f, 1.0f};
        for (int n = 0; n < 6; n++) {
            OF(robot) robot = sound;
            for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
                fields[i] = ((const real *)&sound)[i];
            }
            ((real *)&robot)[field] = bad[n];
            const int upper = field == 12 || field == 13; /* x1_max, u_max */
            const int lower = field == 11;
            const int any_sign = field == 3 || field == 4 || field == 9;
            int refused = n == 0 || (n == 1 && !upper) || (n == 2 && !lower);
            refused = refused || (n == 3 && !any_sign && !lower) || (n == 4 && field < 3)
                      || (n == 5 && (lower || field == 14));
            IS(OF(plan_init)(&made, &robot), refused ? HOPFORM_ERROR_ROBOT : HOPFORM_OK);
            IS(made.made == (refused ? 0u : HOPFORM_PLAN_MADE), 1);
        }
    }
#ifdef DOUBLE
    const real most = 1e300;
#else
    const real most = 1e38f;
#endif
    for (int field = 0; field < HOPFORM_ROBOT_FIELDS; field++) { /* the least that is too much */
        for (int sign = -1; sign <= 1; sign += 2) {
            OF(robot) large = sound;
            ((real *)&large)[field] = (real)sign * most * (real)1.0001f;
            const int bound = field >= 11 && field <= 13 && (sign > 0) == (field != 11);
            IS(OF(plan_init)(&made, &large), bound ? HOPFORM_OK : HOPFORM_ERROR_ROBOT);
        }
    }
    OF(robot) robot = sound;
#ifdef DOUBLE
    robot.m_eff = 1e-200;
    robot.m_s = 1e-200;
#else
    robot.m_eff = 1e-30f;
    robot.m_s = 1e-30f;
#endif
    IS(OF(plan_init)(&made, &robot), HOPFORM_ERROR_NUMBERS); /* the square of a rate is infinite */
    robot = sound;
    robot.b1 = 0.0f;
    robot.gamma2 = 0.0f;
#ifdef DOUBLE
    robot.k = 1e-160;
    robot.m_eff = 1e-165;
#else
    robot.k = 1e-20f;
    robot.m_eff = 1e-24f;
#endif
    IS(OF(plan_init)(&made, &robot), HOPFORM_OK); /* the square of the mass is 0, and no quotient is */
    robot = sound;
#ifdef DOUBLE
    robot.k = 1e300;
    robot.m_eff = 1e-10;
#else
    robot.k = 1e38f;
    robot.m_eff = 1e-10f;
#endif
    IS(OF(plan_init)(&made, &robot), HOPFORM_ERROR_NUMBERS); /* k/m_eff is infinite */
    robot = sound;
    robot.m_eff = 1.0f;
    robot.m_s = 1.0f;
    robot.b2 = 0.0f;
#ifdef DOUBLE
    robot.k = 1e200;
    robot.b1 = 1e101;
#else
    robot.k = 1e22f;
    robot.b1 = 1e17f;
#endif
    IS(OF(plan_init)(&made, &robot), HOPFORM_ERROR_NUMBERS); /* b1 k is infinite, and nothing else */
    const OF(robot) *untouched = &sound;
    const real pushes[][2] = {{0.0f, 3e38f}, {3e37f, 0.0f}};
    for (int n = 0; n < 2; n++) {
        robot = *untouched;
        robot.m_eff = 1e-4f;
        robot.c = pushes[n][1] > 0.0f ? (real)1e36f : (real)0.0f;
        robot.gamma2 = pushes[n][0];
#ifdef DOUBLE
        robot.c *= 1e262;
        robot.gamma2 *= 1e262;
        robot.m_eff = 1e-10;
#endif
        IS(OF(plan_init)(&made, &robot), HOPFORM_ERROR_NUMBERS); /* the drive is infinite */
    }
}

static int32_t solve(const OF(state) *from, const OF(step) *steps, int32_t count, real horizon, int32_t max_phases,
                     int32_t capacity)
{
    OF(stance) stance;
    return OF(solve_stance)(&plan, from, steps, count, horizon, max_phases, phases, capacity, &stance);
}

static void stances(void)
{
    const real nan = not_a_number(), inf = infinity();
    OF(stance) s;
    IS(OF(solve_stance)(&plan, &start, one_step, 1, 2.0f, CAPACITY, phases, CAPACITY, &solved), HOPFORM_OK);
    IS(OF(solve_stance)(&unmade, &start, one_step, 1, 2.0f, CAPACITY, phases, CAPACITY, &s), HOPFORM_ERROR_ROBOT);
    for (int member = 0; member < 4; member++) {
        const real bad[] = {nan, inf, -inf};
        for (int n = 0; n < 3; n++) {
            OF(state) from = start;
            ((real *)&from)[member] = bad[n];
            IS(solve(&from, one_step, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STATE);
        }
    }
    const OF(state) beyond = {0.09f, 0.0f, -1.0f, 0.0f}, before = {-0.01f, 0.0f, -1.0f, 0.0f},
                    extended = {0.0f, 0.0f, -1.0f, -0.01f};
    IS(solve(&beyond, one_step, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STATE);
    IS(solve(&before, one_step, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STATE);
    IS(solve(&extended, one_step, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_EXTENDED);
    const OF(step) late[] = {{0.1f, 1.0f}}, early[] = {{-0.1f, 1.0f}}, same[] = {{0.0f, 1.0f}, {0.0f, 2.0f}};
    const OF(step) back[] = {{0.0f, 1.0f}, {0.2f, 2.0f}, {0.1f, 1.0f}}, never[] = {{0.0f, 1.0f}, {nan, 2.0f}};
    const OF(step) endless[] = {{0.0f, 1.0f}, {inf, 2.0f}}, too_much[] = {{0.0f, inf}}, none[] = {{0.0f, nan}},
                   unknown[] = {{nan, 0.0f}};
    const OF(step) less[] = {{0.0f, -inf}};
    IS(solve(&start, late, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, early, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, same, 2, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, back, 3, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, never, 2, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, endless, 2, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, too_much, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, less, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, none, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, unknown, 1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, one_step, 0, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, one_step, -1, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, one_step, 65536, 2.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_STEPS);
    IS(solve(&start, one_step, 1, 0.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, -1.0f, CAPACITY, CAPACITY), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, nan, CAPACITY, CAPACITY), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, inf, CAPACITY, CAPACITY), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, 2.0f, 0, CAPACITY), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, 2.0f, CAPACITY, -1), HOPFORM_ERROR_HORIZON);
    IS(solve(&start, one_step, 1, 2.0f, CAPACITY, 0), HOPFORM_PHASES_NOT_KEPT);
    IS(solve(&start, one_step, 1, 2.0f, 1, CAPACITY), HOPFORM_OK);
}

/* What reads a solved stance: the same refusals, whatever it reads. */
static void readers(void)
{
    const real nan = not_a_number(), inf = infinity();
    OF(state) state;
    OF(energy) energy;
    OF(ledger) ledger;
    real loss, t = 0.01f;
    OF(stance) lost = solved, empty = solved;
    lost.phases_kept = lost.phase_count - 1;
    empty.phases_kept = 0;
    empty.phase_count = 0;
    real *const each[4] = {columns[0], columns[1], columns[2], columns[3]};
    IS(OF(solve_stance)(&plan, &start, one_step, 1, 2.0f, CAPACITY, phases, CAPACITY, &solved), HOPFORM_OK);

    IS(OF(stance_at)(&plan, one_step, phases, &solved, t, &state), HOPFORM_OK);
    IS(OF(stance_at)(&unmade, one_step, phases, &solved, t, &state), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_at)(&plan, one_step, phases, &lost, t, &state), HOPFORM_ERROR_TIME);
    IS(OF(stance_at)(&plan, one_step, phases, &empty, t, &state), HOPFORM_ERROR_TIME);

    IS(OF(stance_states)(&plan, one_step, phases, &solved, &t, 1, each), HOPFORM_OK);
    IS(OF(stance_states)(&unmade, one_step, phases, &solved, &t, 1, each), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_states)(&plan, one_step, phases, &lost, &t, 1, each), HOPFORM_ERROR_TIME);
    IS(OF(stance_states)(&plan, one_step, phases, &empty, &t, 1, each), HOPFORM_ERROR_TIME);

    IS(OF(stance_energy)(&plan, one_step, phases, &solved, &t, 1, &energy, &ledger, &loss), HOPFORM_OK);
    IS(OF(stance_energy)(&plan, one_step, phases, &solved, &t, 1, &energy, NULL, NULL), HOPFORM_OK);
    const real back[2] = {0.02f, 0.01f};
    OF(energy) two[2];
    OF(ledger) two_ledgers[2];
    real two_losses[2];
    OF(state) two_states[2];
    IS(OF(stance_energy)(&plan, one_step, phases, &solved, back, 2, two, two_ledgers, two_losses), HOPFORM_ERROR_TIME);
    IS(OF(stance_energy)(&plan, one_step, phases, &solved, back, 2, two, NULL, NULL), HOPFORM_OK);

    IS(OF(stance_compression)(&plan, one_step, phases, &solved, numbers), HOPFORM_OK);
    IS(OF(stance_compression)(&unmade, one_step, phases, &solved, numbers), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_compression)(&plan, one_step, phases, &lost, numbers), HOPFORM_ERROR_TIME);
    IS(OF(stance_compression)(&plan, one_step, phases, &empty, numbers), HOPFORM_ERROR_TIME);

    IS(OF(stance_sensitivities)(&plan, one_step, phases, &solved, NULL, 0, numbers), HOPFORM_OK);
    IS(OF(stance_sensitivities)(&unmade, one_step, phases, &solved, NULL, 0, numbers), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_sensitivities)(&plan, one_step, phases, &lost, NULL, 0, numbers), HOPFORM_ERROR_TIME);
    IS(OF(stance_sensitivities)(&plan, one_step, phases, &empty, NULL, 0, numbers), HOPFORM_ERROR_TIME);

    static const int32_t chosen[][2] = {{4, HOPFORM_COLUMN_OF_STEP_TIME(1)},
                                        {HOPFORM_COLUMN_OF_STEP_TIME(HOPFORM_MOST_STEPS - 1), HOPFORM_COLUMN_OF_STEP(9)}};
    static const int32_t none[][2] = {{0, -1},
                                      {HOPFORM_COLUMN_OF_STEP_TIME(0), 0},
                                      {0, HOPFORM_COLUMN_OF_STEP(HOPFORM_MOST_STEPS)},
                                      {2147483647, 0}};
    for (int n = 0; n < 2; n++) {
        IS(OF(stance_sensitivities)(&plan, one_step, phases, &solved, chosen[n], 2, numbers), HOPFORM_OK);
        IS(OF(stance_tangents)(&plan, one_step, phases, &solved, chosen[n], 2, &t, 1, NULL, numbers), HOPFORM_OK);
    }
    for (int n = 0; n < 4; n++) {
        IS(OF(stance_sensitivities)(&plan, one_step, phases, &solved, none[n], 2, numbers), HOPFORM_ERROR_COLUMNS);
        IS(OF(stance_tangents)(&plan, one_step, phases, &solved, none[n], 2, &t, 1, NULL, numbers),
           HOPFORM_ERROR_COLUMNS);
    }
    IS(OF(stance_sensitivities)(&plan, one_step, phases, &solved, none[0], -1, numbers), HOPFORM_ERROR_COLUMNS);
    IS(OF(stance_sensitivities)(&plan, one_step, phases, &solved, none[0], 0, numbers), HOPFORM_OK);

    real *tangents = numbers;
    IS(OF(stance_tangents)(&plan, one_step, phases, &solved, NULL, 0, &t, 1, &state, tangents), HOPFORM_OK);
    IS(OF(stance_tangents)(&unmade, one_step, phases, &solved, NULL, 0, &t, 1, &state, tangents), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_tangents)(&plan, one_step, phases, &lost, NULL, 0, &t, 1, &state, tangents), HOPFORM_ERROR_TIME);
    IS(OF(stance_tangents)(&plan, one_step, phases, &empty, NULL, 0, &t, 1, &state, tangents), HOPFORM_ERROR_TIME);
    static real room[2 * HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    IS(OF(stance_tangents)(&plan, one_step, phases, &solved, NULL, 0, back, 2, two_states, room), HOPFORM_ERROR_TIME);

    static OF(phase) own[CAPACITY];
    for (int n = 0; n < CAPACITY; n++) {
        own[n] = phases[n];
    }
    IS(OF(stance_energy)(&plan, one_step, own, &solved, &inf, 1, (OF(energy) *)(void *)own, NULL, NULL),
       HOPFORM_ERROR_OVERLAP); /* comes before the times */

    const real bad[] = {nan, inf, -inf, -0.001f, 1.5f};
    for (int n = 0; n < 5; n++) {
        IS(OF(stance_at)(&plan, one_step, phases, &solved, bad[n], &state), HOPFORM_ERROR_TIME);
        IS(OF(stance_states)(&plan, one_step, phases, &solved, &bad[n], 1, each), HOPFORM_ERROR_TIME);
        IS(OF(stance_energy)(&plan, one_step, phases, &solved, &bad[n], 1, &energy, &ledger, &loss),
           HOPFORM_ERROR_TIME);
        IS(OF(stance_tangents)(&plan, one_step, phases, &solved, NULL, 0, &bad[n], 1, &state, tangents), HOPFORM_ERROR_TIME);
        IS(OF(stance_grid)(&plan, one_step, phases, &solved, bad[n], 0.01f, 2, each), HOPFORM_ERROR_TIME);
        IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, bad[n], 2, each), HOPFORM_ERROR_TIME);
    }
    SOIL(two), SOIL(two_ledgers), SOIL(two_losses), SOIL(two_states), SOIL(room), SOIL(columns);
    IS(OF(stance_energy)(&plan, one_step, phases, &solved, back, 2, two, two_ledgers, two_losses), HOPFORM_ERROR_TIME);
    CLEAR(two), CLEAR(two_ledgers), CLEAR(two_losses);
    IS(OF(stance_tangents)(&plan, one_step, phases, &solved, NULL, 0, back, 2, two_states, room), HOPFORM_ERROR_TIME);
    CLEAR(two_states), CLEAR(room);
    const real late[4] = {0.01f, 0.02f, 0.03f, 9.0f};
    IS(OF(stance_states)(&plan, one_step, phases, &solved, late, 4, each), HOPFORM_ERROR_TIME);
    CLEAR(columns);
    SOIL(columns), SOIL(two_states), SOIL(room);
    IS(OF(stance_states)(&unmade, one_step, phases, &solved, late, 4, each), HOPFORM_ERROR_ROBOT);
    CLEAR(columns);
    IS(OF(stance_tangents)(&unmade, one_step, phases, &solved, NULL, 0, back, 2, two_states, room), HOPFORM_ERROR_ROBOT);
    CLEAR(two_states), CLEAR(room);
    SOIL(columns), SOIL(two), SOIL(two_losses);
    IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, 9.0f, 4, each), HOPFORM_ERROR_TIME);
    CLEAR(columns);
    IS(OF(stance_energy)(&plan, one_step, phases, &lost, back, 2, two, NULL, NULL), HOPFORM_ERROR_TIME);
    CLEAR(two);
    const real dt = 0.01f;
    IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, dt, 2, each), HOPFORM_OK);
    IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, dt, 0, each), HOPFORM_OK);
    IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, dt, -1, each), HOPFORM_ERROR_TIME);
    IS(OF(stance_grid)(&plan, one_step, phases, &solved, 0.0f, 0.0f, 2, each), HOPFORM_ERROR_TIME);
    IS(OF(stance_grid)(&unmade, one_step, phases, &solved, 0.0f, dt, 2, each), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_grid)(&plan, one_step, phases, &lost, 0.0f, dt, 2, each), HOPFORM_ERROR_TIME);
    IS(OF(stance_grid)(&plan, one_step, phases, &empty, 0.0f, dt, 2, each), HOPFORM_ERROR_TIME);
}

static void is_safe(const OF(command) *command, int line)
{
    is(command->status, HOPFORM_COMMAND_NO_TAKEOFF, line);
    is(command->u > 0.0f || command->u < 0.0f || command->apex > 0.0f || command->apex < 0.0f, 0, line);
}

static void commands(void)
{
    const real nan = not_a_number(), inf = infinity();
    const OF(target) target = {0.1f, 0.0f, 0.0f, 2.0f, 0, 0};
    const OF(command) junk = {2.0f, 3.0f, 7};
    OF(command) command = junk;
    OF(trial) trials[2];
    const real currents[2] = {0.0f, 1.0f};
    search.best_u = 2.0f; /* what the memory may hold */
    search.found = true;
    search.datum = nan;
    IS(OF(choose_current)(&search, NULL, &start, &target, phases, CAPACITY, &command), HOPFORM_ERROR_NULL);
    is_safe(&command, __LINE__);
    command = junk;
    IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_ERROR_NULL); /* what was not begun */
    is_safe(&command, __LINE__);
    command = junk;
    IS(OF(choose_current)(&search, &unmade, &start, &target, phases, CAPACITY, &command), HOPFORM_ERROR_ROBOT);
    is_safe(&command, __LINE__);
    OF(plan) spoilt = plan; /* in the middle of a search that has found something */
    IS(OF(choose_current_begin)(&search, &spoilt, &start, &target, &command), HOPFORM_SEARCHING);
    for (int n = 0; n < 40 && !(command.u > 0.0f || command.u < 0.0f); n++) {
        IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_SEARCHING);
    }
    spoilt.made = 0u;
    for (int n = 0; n < 2; n++) {
        command = junk;
        IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_ERROR_ROBOT);
        is_safe(&command, __LINE__);
    }
    const real bad[] = {nan, inf, -inf, -1.0f};
    for (int member = 0; member < 4; member++) {
        for (int n = 0; n < 4; n++) {
            OF(target) to = target;
            ((real *)&to)[member] = bad[n];
            command = junk;
            IS(OF(choose_current)(&search, &plan, &start, &to, phases, CAPACITY, &command),
               member == 3 ? HOPFORM_ERROR_HORIZON : HOPFORM_ERROR_TARGET);
            is_safe(&command, __LINE__);
        }
    }
    OF(target) to = target;
    to.max_evaluations = -1;
    IS(OF(choose_current)(&search, &plan, &start, &to, phases, CAPACITY, &command), HOPFORM_ERROR_TARGET);
    to = target;
    to.max_candidates = -1;
    IS(OF(choose_current)(&search, &plan, &start, &to, phases, CAPACITY, &command), HOPFORM_ERROR_TARGET);
    to.max_candidates = 1;
    IS(OF(choose_current)(&search, &plan, &start, &to, phases, CAPACITY, &command), HOPFORM_CAPPED);
    to = target;
    to.horizon = 0.0f;
    IS(OF(choose_current)(&search, &plan, &start, &to, phases, CAPACITY, &command), HOPFORM_ERROR_HORIZON);
    OF(state) moved = start;
    moved.x1 = 0.5f;
    command = junk;
    IS(OF(choose_current)(&search, &plan, &moved, &target, phases, CAPACITY, &command), HOPFORM_ERROR_STATE);
    is_safe(&command, __LINE__);
    moved = start;
    moved.y = -0.1f;
    IS(OF(choose_current)(&search, &plan, &moved, &target, phases, CAPACITY, &command), HOPFORM_ERROR_EXTENDED);
    IS(OF(choose_current)(&search, &plan, &start, &target, phases, 0, &command), HOPFORM_ERROR_HORIZON);
    is_safe(&command, __LINE__);
    IS(OF(choose_current)(&search, &plan, &start, &target, phases, 1, &command), HOPFORM_PHASES_NOT_KEPT);

    IS(OF(choose_current_begin)(&search, &plan, &start, &target, &command), HOPFORM_SEARCHING);
    IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_SEARCHING);
    IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_SEARCHING);
    IS(OF(choose_current_step)(&search, phases, -1, &command), HOPFORM_ERROR_HORIZON);
    is_safe(&command, __LINE__);
    command = junk;
    IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_ERROR_HORIZON); /* and it stays so */
    is_safe(&command, __LINE__);

    IS(OF(choose_current_near)(&search, 1.0f), HOPFORM_ERROR_HORIZON);
    IS(OF(choose_current_near)(NULL, 1.0f), HOPFORM_ERROR_NULL);
    const real none_near[] = {nan, inf, -inf, 100.0f}; /* of which a search begins with 0 */
    for (int n = 0; n < 4; n++) {
        IS(OF(choose_current_begin)(&search, &plan, &start, &target, &command), HOPFORM_SEARCHING);
        IS(OF(choose_current_near)(&search, none_near[n]), HOPFORM_SEARCHING);
        IS(search.next > 0.0f || search.next < 0.0f, false);
    }

    const int32_t no_count[] = {-1, 1000}; /* a search that was written over ends */
    for (int n = 0; n < 2; n++) {
        IS(OF(choose_current_begin)(&search, &plan, &start, &target, &command), HOPFORM_SEARCHING);
        IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_SEARCHING);
        search.count = no_count[n];
        IS(OF(choose_current_step)(&search, phases, CAPACITY, &command), HOPFORM_OK);
    }

    OF(robot) robot = sound;
    OF(plan) other;
    robot.g = 0.0f;
    IS(OF(plan_init)(&other, &robot), HOPFORM_OK);
    IS(OF(choose_current)(&search, &other, &start, &target, phases, CAPACITY, &command), HOPFORM_ERROR_ROBOT);
    IS(OF(try_currents)(&other, &start, 1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_ERROR_ROBOT);
    IS(OF(solve_flight)(&other, &start, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flown), HOPFORM_ERROR_ROBOT);
    robot = sound;
    robot.u_max = inf;
    IS(OF(plan_init)(&other, &robot), HOPFORM_OK);
    IS(OF(choose_current)(&search, &other, &start, &target, phases, CAPACITY, &command), HOPFORM_ERROR_ROBOT);

    SOIL(trials[1].u);
    IS(OF(try_currents)(&plan, &start, 1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_OK);
    IS(trials[0].u == currents[0] && trials[1].u == currents[1], 1);
    const OF(state) starts[] = {start, start};
    SOIL(trials[1].u);
    IS(OF(try_currents)(&plan, starts, 2, currents, 1, 2.0f, phases, CAPACITY, trials), HOPFORM_OK);
    IS(trials[1].u == currents[0], 1);
    IS(OF(try_currents)(&plan, &start, 1, currents, 2, 2.0f, phases, 1, trials), HOPFORM_PHASES_NOT_KEPT);
    IS(OF(try_currents)(&unmade, &start, 1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_ERROR_ROBOT);
    IS(OF(try_currents)(&plan, &start, 1, currents, 2, nan, phases, CAPACITY, trials), HOPFORM_ERROR_HORIZON);
    IS(OF(try_currents)(&plan, &start, 0, currents, 2, nan, phases, CAPACITY, trials), HOPFORM_OK);
    IS(OF(try_currents)(&unmade, &start, -1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_ERROR_ROBOT);
    IS(OF(try_currents)(&plan, &start, -1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_OK);
    IS(OF(try_currents)(&plan, &moved, 1, currents, 2, 2.0f, phases, CAPACITY, trials), HOPFORM_ERROR_EXTENDED);
}

static void flights(void)
{
    const real nan = not_a_number(), inf = infinity();
    const OF(state) away = {0.01f, 0.1f, 1.5f, 0.0f};
    const OF(gains) law = {500.0f, 30.0f};
    OF(gains) gains;
    OF(flight) f;
    IS(OF(solve_flight)(&plan, &away, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &flown), HOPFORM_OK);
    IS(OF(solve_flight)(&plan, &away, 0, &law, 2.0f, CAPACITY, NULL, 0, &f), HOPFORM_PHASES_NOT_KEPT);
    IS(OF(solve_flight)(&unmade, &away, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f), HOPFORM_ERROR_ROBOT);
    for (int n = 0; n < 3; n++) {
        const real bad[] = {nan, inf, -inf};
        IS(OF(solve_flight)(&plan, &away, bad[n], &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f),
           HOPFORM_ERROR_STATE);
        for (int member = 0; member < 4; member++) {
            OF(state) from = away;
            ((real *)&from)[member] = bad[n];
            IS(OF(solve_flight)(&plan, &from, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f),
               HOPFORM_ERROR_STATE);
        }
    }
    OF(state) from = away;
    from.x1 = 0.09f;
    IS(OF(solve_flight)(&plan, &from, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f), HOPFORM_ERROR_STATE);
    from.x1 = -0.01f;
    IS(OF(solve_flight)(&plan, &from, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f), HOPFORM_ERROR_STATE);
#ifdef DOUBLE
    const OF(state) fast = {0.01f, 0.0f, -1e200, -0.1f};
#else
    const OF(state) fast = {0.01f, 0.0f, -1e30f, -0.1f};
#endif
    SOIL(f.impact_loss);
    IS(OF(solve_flight)(&plan, &fast, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f), HOPFORM_ERROR_NUMBERS);
    CLEAR(f.impact_loss); /* the square of the velocity is infinite */
    const OF(state) into_stop = {0.0f, fast.v2, 1.5f, 0.0f};
    SOIL(f.start_loss);
    IS(OF(solve_flight)(&plan, &into_stop, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &f),
       HOPFORM_ERROR_NUMBERS);
    CLEAR(f.start_loss); /* likewise, where all that follows is finite */
    const real horizons[] = {0.0f, -1.0f, nan, inf};
    for (int n = 0; n < 4; n++) {
        IS(OF(solve_flight)(&plan, &away, 0, &law, horizons[n], CAPACITY, flight_phases, CAPACITY, &f),
           HOPFORM_ERROR_HORIZON);
        IS(OF(design_return)(&plan, horizons[n], &gains), HOPFORM_ERROR_TIME);
    }
    IS(OF(solve_flight)(&plan, &away, 0, &law, 2.0f, 0, flight_phases, CAPACITY, &f), HOPFORM_ERROR_HORIZON);
    IS(OF(solve_flight)(&plan, &away, 0, &law, 2.0f, CAPACITY, flight_phases, -1, &f), HOPFORM_ERROR_HORIZON);
    const OF(gains) bad_gains[] = {{nan, 0.0f}, {0.0f, nan}, {-1.0f, 0.0f}, {0.0f, -1.0f}, {inf, 0.0f}, {0.0f, inf}};
    for (int n = 0; n < 6; n++) {
        IS(OF(solve_flight)(&plan, &away, 0, &bad_gains[n], 2.0f, CAPACITY, flight_phases, CAPACITY, &f),
           HOPFORM_ERROR_GAINS);
    }
    IS(OF(design_return)(&plan, 0.1f, &gains), HOPFORM_OK);
    IS(OF(design_return)(&unmade, 0.1f, &gains), HOPFORM_ERROR_ROBOT);

    OF(state) state;
    OF(energy) energy[2];
    OF(flight_ledger) ledger[2];
    real loss[2], t = 0.01f;
    OF(flight) lost = flown, empty = flown;
    lost.phases_kept = lost.phase_count - 1;
    empty.phases_kept = 0;
    empty.phase_count = 0;
    IS(OF(solve_flight)(&plan, &away, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &flown), HOPFORM_OK);
    IS(OF(flight_at)(&plan, flight_phases, &flown, &t, 1, &state), HOPFORM_OK);
    IS(OF(flight_at)(&plan, flight_phases, &flown, NULL, 0, NULL), HOPFORM_OK);
    IS(OF(flight_at)(&plan, flight_phases, &lost, &t, 1, &state), HOPFORM_ERROR_TIME);
    IS(OF(flight_at)(&plan, flight_phases, &empty, &t, 1, &state), HOPFORM_ERROR_TIME);
    IS(OF(flight_energy)(&plan, flight_phases, &flown, &t, 1, energy, ledger, loss), HOPFORM_OK);
    IS(OF(flight_energy)(&plan, flight_phases, &flown, NULL, 0, NULL, NULL, NULL), HOPFORM_OK);
    IS(OF(flight_energy)(NULL, flight_phases, &flown, &t, -1, energy, ledger, loss), HOPFORM_ERROR_NULL);
    IS(OF(flight_energy)(&plan, flight_phases, &lost, &t, 1, energy, ledger, loss), HOPFORM_ERROR_TIME);
    const real back[2] = {0.02f, 0.01f}, bad[] = {nan, inf, -0.001f, 1.9f};
    IS(OF(flight_at)(&unmade, flight_phases, &flown, &t, 1, &state), HOPFORM_ERROR_ROBOT);
    OF(state) states[2];
    SOIL(energy), SOIL(ledger), SOIL(loss), SOIL(states);
    IS(OF(flight_energy)(&plan, flight_phases, &flown, back, 2, energy, ledger, loss), HOPFORM_ERROR_TIME);
    CLEAR(energy), CLEAR(ledger), CLEAR(loss);
    SOIL(energy), SOIL(ledger), SOIL(loss);
    IS(OF(flight_energy)(&unmade, flight_phases, &flown, back, 2, energy, ledger, loss), HOPFORM_ERROR_ROBOT);
    CLEAR(energy), CLEAR(ledger), CLEAR(loss);
    IS(OF(flight_at)(&unmade, flight_phases, &flown, back, 2, states), HOPFORM_ERROR_ROBOT);
    CLEAR(states);
    for (int n = 0; n < 4; n++) {
        IS(OF(flight_at)(&plan, flight_phases, &flown, &bad[n], 1, &state), HOPFORM_ERROR_TIME);
        IS(OF(flight_energy)(&plan, flight_phases, &flown, &bad[n], 1, energy, ledger, loss), HOPFORM_ERROR_TIME);
    }
}

static void contacts(void)
{
    const real nan = not_a_number(), inf = infinity();
    const OF(detector) detector = {0.6f, 0.4f, 2};
    const OF(detector)
        bad[] = {{0.4f, 0.6f, 2}, {nan, 0.4f, 2}, {0.6f, nan, 2}, {inf, 0.4f, 2}, {0.6f, -inf, 2}, {0.6f, 0.4f, 0}};
    OF(contact) contact = {0, 0, 0};
    for (int n = 0; n < 6; n++) {
        IS(OF(touchdown)(&bad[n], &contact, 0.5f), HOPFORM_ERROR_DETECTOR);
    }
    IS(OF(touchdown)(&detector, &contact, nan), HOPFORM_ERROR_DETECTOR);
    IS(OF(touchdown)(&detector, &contact, inf), HOPFORM_ERROR_DETECTOR);
    IS(OF(touchdown)(&detector, &contact, -inf), HOPFORM_ERROR_DETECTOR);
    const real samples[] = {0.6f, 0.5f, 0.5f, 0.3f, 0.5f, 0.3f, 0.3f, 0.5f};
    const int32_t expected[] = {0, HOPFORM_CONTACT_TOUCHDOWN, 0, 0, HOPFORM_CONTACT_TAKEOFF, 0, 0, 0};
    for (int n = 0; n < 8; n++) {
        IS(OF(touchdown)(&detector, &contact, samples[n]), expected[n]);
    }
}

/* Starts in the coordinates of the model's file: x1, v1, x2, v2. */
static void starts(void)
{
    const real nan = not_a_number(), inf = infinity();
    const OF(start) fine = {0.0f, 0.0f, 0.4f, -1.9f};
    const OF(start) not_finite[] = {{nan, 0.0f, 0.4f, -1.9f}, {0.0f, inf, 0.4f, -1.9f}, {0.0f, 0.0f, -inf, -1.9f},
                                    {0.0f, 0.0f, 0.4f, nan}};
    const OF(start) beyond[] = {{-0.001f, 0.0f, 0.3f, -1.9f}, {0.081f, 0.0f, 0.3f, -1.9f}};
    const OF(start) extended = {0.0f, 0.0f, 0.401f, -1.9f};
    const OF(state) moves[] = {{nan, 0.0f, 0.0f, 0.0f}, {0.0f, inf, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f, -inf}};
    const OF(state) flies = {0.0f, 0.0f, 1.9f, -0.1f};
    OF(state) state;
    OF(start) back;
    IS(OF(state_of_start)(&plan, &fine, &state), HOPFORM_OK);
    IS(state.y > 0.0f || state.y < 0.0f, 0);
    IS(OF(state_of_start)(&unmade, &fine, &state), HOPFORM_ERROR_ROBOT);
    for (int n = 0; n < 4; n++) {
        SOIL(state);
        IS(OF(state_of_start)(&plan, &not_finite[n], &state), HOPFORM_ERROR_STATE);
        CLEAR(state);
    }
    IS(OF(state_of_start)(&plan, &beyond[0], &state), HOPFORM_ERROR_STATE);
    IS(OF(state_of_start)(&plan, &beyond[1], &state), HOPFORM_ERROR_STATE);
    SOIL(state);
    IS(OF(state_of_start)(&plan, &extended, &state), HOPFORM_ERROR_EXTENDED);
    CLEAR(state);
    IS(OF(start_of_state)(&plan, &flies, &back), HOPFORM_OK);
    IS(OF(start_of_state)(&unmade, &flies, &back), HOPFORM_ERROR_ROBOT);
    for (int n = 0; n < 3; n++) {
        SOIL(back);
        IS(OF(start_of_state)(&plan, &moves[n], &back), HOPFORM_ERROR_STATE);
        CLEAR(back);
    }
}

/* Forces, and the state before a phase. */
static void before(void)
{
    const real bad[] = {not_a_number(), infinity(), -0.001f, 1.5f}, t = 0.01f;
    OF(forces) forces;
    OF(state) state;
    OF(stance) lost = solved;
    lost.phases_kept = lost.phase_count - 1;
    IS(OF(stance_forces)(&plan, one_step, phases, &solved, &t, 1, &forces), HOPFORM_OK);
    IS(OF(stance_forces)(&unmade, one_step, phases, &solved, &t, 1, &forces), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_forces)(&plan, one_step, phases, &lost, &t, 1, &forces), HOPFORM_ERROR_TIME);
    for (int n = 0; n < 4; n++) {
        SOIL(forces);
        IS(OF(stance_forces)(&plan, one_step, phases, &solved, &bad[n], 1, &forces), HOPFORM_ERROR_TIME);
        CLEAR(forces);
    }
    IS(OF(stance_before)(&plan, one_step, phases, &solved, 1, &state), HOPFORM_OK);
    IS(OF(stance_before)(&unmade, one_step, phases, &solved, 1, &state), HOPFORM_ERROR_ROBOT);
    IS(OF(stance_before)(&plan, one_step, phases, &lost, 1, &state), HOPFORM_ERROR_TIME);
    const int32_t none[] = {0, -1, solved.phases_kept};
    for (int n = 0; n < 3; n++) {
        SOIL(state);
        IS(OF(stance_before)(&plan, one_step, phases, &solved, none[n], &state), HOPFORM_ERROR_TIME);
        CLEAR(state);
    }
}

/* A plant: none that was not begun, and no tick of no time; what is refused leaves it as it is. */
static void plants(void)
{
    const real nan = not_a_number(), inf = infinity();
    const OF(start) fine = {0.0f, 0.0f, 0.4f, -1.9f}, beyond = {-0.001f, 0.0f, 0.3f, -1.9f};
    OF(robot) none = sound;
    OF(plant) plant, begun;
    OF(report) report = {fine, 0.0f, 0, 0, 0, CAPACITY, phases};
    none.k = 0.0f;
    SOIL(plant);
    IS(OF(plant_begin)(&plant, &none, &fine), HOPFORM_ERROR_ROBOT);
    CLEAR(plant);
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_ERROR_ROBOT);
    SOIL(plant);
    IS(OF(plant_begin)(&plant, &sound, &beyond), HOPFORM_ERROR_STATE);
    CLEAR(plant);
    IS(OF(plant_begin)(&plant, &sound, &fine), HOPFORM_OK);
    begun = plant;
    IS(OF(plant_place)(&plant, &beyond), HOPFORM_ERROR_STATE);
    const real bad[] = {nan, inf, -inf, 0.0f, -0.001f, 5e9f};
    for (int n = 0; n < 6; n++) {
        IS(OF(plant_step)(&plant, 0.0f, bad[n], &report), HOPFORM_ERROR_HORIZON);
    }
    for (int n = 0; n < 3; n++) {
        IS(OF(plant_step)(&plant, bad[n], 0.01f, &report), HOPFORM_ERROR_STEPS);
    }
    report.capacity = -1;
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_ERROR_HORIZON);
    report.phases = NULL;
    report.capacity = 1;
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_ERROR_NULL);
    IS(memcmp(&plant, &begun, offsetof(OF(plant), begins)), 0);
    report.capacity = 0;
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_PHASES_NOT_KEPT);
    IS(report.ending, HOPFORM_ENDING_HORIZON);
    plant.mode = 9;
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_ERROR_STATE);
    plant.mode = -1;
    IS(OF(plant_step)(&plant, 0.0f, 0.01f, &report), HOPFORM_ERROR_STATE);
    IS(OF(plant_place)(&plant, &fine), HOPFORM_OK);
    plant.seconds = UINT32_MAX - 1u;
    IS(OF(plant_step)(&plant, 0.0f, 2.0f, &report), HOPFORM_ERROR_HORIZON);
}

int main(void)
{
    robots();
    stances();
    readers();
    commands();
    flights();
    contacts();
    starts();
    before();
    plants();
    IS((int32_t)OF(selftest)(&search, phases, HOPFORM_SELFTEST_PHASES - 1), 0);
    board_number(checks);
    board_text(" refusals, wrong ");
    board_number(wrong);
    board_text("\n");
    board_exit(wrong > 0);
    return wrong > 0;
}
