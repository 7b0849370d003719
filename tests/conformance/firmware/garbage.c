/* Garbage in: every call must come back with a negative status and a defined safe output, or with finite numbers. In
 * double precision with -DDOUBLE. */
#include <stddef.h>
#include <stdint.h>

#include "board.h"
#include "hopform/hopform.h"

#ifdef DOUBLE
typedef double real;
#define OF(name) hopform_##name##_f64
#define LARGEST 1.7976931348623157e308
#else
typedef float real;
#define OF(name) hopform_##name##_f32
#define LARGEST 3.4028234e38f
#endif

enum { CAPACITY = 16, FIELDS = HOPFORM_ROBOT_FIELDS };
static OF(phase) phases[CAPACITY];
static OF(flight_phase) flight_phases[CAPACITY];
static OF(search) search;
static int32_t calls;
static int32_t refused;
static int wrong;

static void must(int truth, const char *what)
{
    if (!truth && wrong++ < 20) {
        board_text("garbage: ");
        board_text(what);
        board_text("\n");
    }
}

static real of_bits(uint32_t bits)
{
    union {
        uint32_t bits;
        float value;
    } number;
    number.bits = bits;
    return number.value;
}

/* NaNs, infinities, zeros, denormals, the largest and least numbers, and sizes that overflow when multiplied. */
static const uint32_t nasty[] = {0x7fc00000u, 0xffc00000u, 0x7f800001u, 0x7f800000u, 0xff800000u, 0x00000000u,
                                 0x80000000u, 0x00000001u, 0x80000001u, 0x007fffffu, 0x00800000u, 0x7f7fffffu,
                                 0xff7fffffu, 0x7149f2cau, 0xf149f2cau, 0x0da24260u, 0x49742400u, 0xc9742400u};
enum { NASTY = (int)(sizeof nasty / sizeof nasty[0]) };

static const OF(robot) sound = {25.0f, 3.0f,   1200.0f, 0.4f, 0.0f,  150.0f, 5.0f, 0.78f,
                                0.6f,  -65.0f, 9.81f,   0.0f, 0.08f, 3.0f,   0.05f, 0.0f, 0.0f};

static int is_finite(real value)
{
    return value >= -LARGEST && value <= LARGEST;
}

static int is_zero(const void *memory, size_t size)
{
    const unsigned char *bytes = (const unsigned char *)memory;
    for (size_t n = 0; n < size; n++) {
        if (bytes[n] != 0) {
            return 0;
        }
    }
    return 1;
}

static void count(int32_t status)
{
    calls++;
    refused += status < 0;
}

/* One of everything with a plan. */
static void use(const OF(plan) *plan, const OF(state) *start, real u, real horizon, real h_des, int32_t capacity)
{
    OF(stance) stance;
    OF(state) state;
    OF(command) command;
    OF(flight) flight;
    const OF(step) step = {0.0f, u};
    const int32_t status =
        OF(solve_stance)(plan, start, &step, 1, horizon, CAPACITY, capacity > 0 ? phases : NULL, capacity, &stance);
    count(status);
    must(status >= 0 || is_zero(&stance, sizeof stance), "a refused stance is not zero");
    must(is_finite(stance.duration) && is_finite(stance.end.x1) && is_finite(stance.end.v1) && is_finite(stance.end.v2)
             && is_finite(stance.end.y) && is_finite(stance.apex) && is_finite(stance.aed),
         "a stance that is not finite");
    const int32_t at = OF(stance_at)(plan, &step, phases, &stance, stance.duration, &state);
    count(at);
    must(at >= 0 || is_zero(&state, sizeof state), "a refused state is not zero");
    must(status >= 0 || at < 0, "a state of a refused stance");
    must(is_finite(state.x1) && is_finite(state.v1) && is_finite(state.v2) && is_finite(state.y),
         "a state that is not finite");

    const OF(target) target = {h_des, 0.0f, 0.0f, horizon, 0, 0};
    int32_t chosen = OF(choose_current_begin)(&search, plan, start, &target, &command);
    must(!(command.u > 0.0f) && !(command.u < 0.0f), "a search that begins with a current");
    for (int n = 0; n < 12 && chosen == HOPFORM_SEARCHING; n++) {
        chosen = OF(choose_current_step)(&search, phases, CAPACITY, &command);
        must(command.u >= -plan->robot.u_max && command.u <= plan->robot.u_max && is_finite(command.apex),
             "a command out of range");
    }
    count(chosen);
    must(chosen >= 0 || (!(command.u > 0.0f) && !(command.u < 0.0f)), "a refused command is not 0");

    const int32_t flown = OF(solve_flight)(plan, start, 0, NULL, horizon, CAPACITY, flight_phases, CAPACITY, &flight);
    count(flown);
    must(flown >= 0 || is_zero(&flight, sizeof flight), "a refused flight is not zero");
    must(is_finite(flight.duration) && is_finite(flight.end.x1) && is_finite(flight.apex),
         "a flight that is not finite");
}

static void nasty_robots(void)
{
    const OF(state) start = {0.0f, 0.0f, -1.0f, 0.0f};
    for (int field = 0; field < FIELDS; field++) {
        for (int n = 0; n < NASTY; n++) {
            OF(robot) robot = sound;
            OF(plan) plan;
            ((real *)&robot)[field] = of_bits(nasty[n]);
            const int32_t status = OF(plan_init)(&plan, &robot);
            count(status);
            must(status >= 0 || is_zero(&plan, offsetof(OF(plan), made) + sizeof plan.made),
                 "a refused plan is not zero");
            const int not_a_number = n < 3;
            must(!not_a_number || status < 0, "a robot that is not a number");
            must(field > 1 || n != 5 || status < 0, "a mass of zero");
            use(&plan, &start, 1.0f, 0.5f, 0.1f, CAPACITY);
        }
    }
}

static void nasty_inputs(void)
{
    OF(plan) plan;
    must(OF(plan_init)(&plan, &sound) == HOPFORM_OK, "a sound robot is refused");
    for (int n = 0; n < NASTY; n++) {
        const real value = of_bits(nasty[n]);
        for (int place = 0; place < 7; place++) {
            const OF(state) start = {place == 0 ? value : 0.0f, place == 1 ? value : 0.0f, place == 2 ? value : -1.0f,
                                     place == 3 ? value : 0.0f};
            use(&plan, &start, place == 4 ? value : 1.0f, place == 5 ? value : 0.5f, place == 6 ? value : 0.1f,
                CAPACITY);
        }
    }
}

/* Memory that holds anything instead of a plan. */
static void plans_that_were_not_made(void)
{
    static const uint32_t patterns[] = {0x00000000u, 0xffffffffu, 0xa5a5a5a5u, 0x3f800000u, 0x7fc00000u};
    const OF(state) start = {0.0f, 0.0f, -1.0f, 0.0f};
    OF(plan) plan;
    for (size_t n = 0; n < sizeof patterns / sizeof patterns[0]; n++) {
        for (size_t word = 0; word < sizeof plan / sizeof(uint32_t); word++) {
            ((volatile uint32_t *)(void *)&plan)[word] = patterns[n];
        }
        OF(stance) stance;
        OF(command) command;
        OF(flight) flight;
        OF(gains) gains;
        const OF(step) step = {0.0f, 1.0f};
        const OF(target) target = {0.1f, 0.0f, 0.0f, 2.0f, 0, 0};
        must(OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &stance)
                 == HOPFORM_ERROR_ROBOT,
             "no plan, a stance");
        must(is_zero(&stance, sizeof stance), "no plan, and a stance that is not zero");
        must(OF(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command) == HOPFORM_ERROR_ROBOT,
             "no plan, a command");
        must(!(command.u > 0.0f) && !(command.u < 0.0f), "no plan, and a current");
        must(OF(solve_flight)(&plan, &start, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flight)
                 == HOPFORM_ERROR_ROBOT,
             "no plan, a flight");
        must(OF(design_return)(&plan, 0.1f, &gains) == HOPFORM_ERROR_ROBOT, "no plan, gains");
        calls += 4;
        refused += 4;
    }
}

/* Buffers without a length, and pointers to nothing. */
static void buffers(void)
{
    OF(plan) plan;
    OF(stance) with;
    OF(stance) without;
    OF(state) state;
    OF(command) command;
    const OF(state) start = {0.0f, 0.0f, -1.9f, 0.0f};
    const OF(step) step = {0.0f, 2.0f};
    const OF(target) target = {0.1f, 0.0f, 0.0f, 2.0f, 0, 0};
    must(OF(plan_init)(&plan, &sound) == HOPFORM_OK, "a sound robot is refused");
    must(OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &with) == HOPFORM_OK,
         "a sound stance");
    must(OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, NULL, 0, &without) == HOPFORM_PHASES_NOT_KEPT,
         "no buffer");
    must(!(with.duration < without.duration) && !(with.duration > without.duration) && with.ending == without.ending,
         "without a buffer the take-off is another");
    must(OF(stance_at)(&plan, &step, phases, &without, 0.0f, &state) < 0, "a state without phases");
    must(OF(solve_stance)(&plan, &start, &step, 0, 2.0f, CAPACITY, phases, CAPACITY, &with) < 0,
         "no step of the current");
    must(OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, -1, &with) < 0, "a negative capacity");
    must(OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, NULL, 1, &with) < 0, "a buffer that is NULL");
    must(OF(choose_current)(&search, &plan, &start, &target, phases, 0, &command) < 0, "a search without phases");
    must(!(command.u > 0.0f) && !(command.u < 0.0f), "a search without phases, and a current");
    must(OF(plan_init)(NULL, &sound) < 0 && OF(plan_init)(&plan, NULL) < 0, "no memory for a plan");
    must(OF(solve_stance)(NULL, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &with) < 0, "NULL for a plan");
    must(OF(choose_current)(&search, NULL, &start, &target, phases, CAPACITY, &command) < 0, "a search on NULL");
    calls += 11;
    refused += 9;
}

int main(void)
{
    nasty_robots();
    nasty_inputs();
    plans_that_were_not_made();
    buffers();
    board_number(calls);
    board_text(" calls, refused ");
    board_number(refused);
    board_text(", wrong ");
    board_number(wrong);
    board_text("\n");
    board_exit(wrong > 0);
    return wrong > 0;
}
