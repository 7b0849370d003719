/* The computation of the page to play with: a run of hops over rough ground, its samples, a map of reachability.
 *
 * It calls the library's public functions, keeps their buffers, and adds times, heights and energies bit for bit as
 * hopform.hopping.simulate. Compiled to WebAssembly it imports nothing. The page writes arrays, calls a function and
 * reads arrays, in SI units and double precision, with heights over level 0.
 */
#include "hopform.h"

enum { HOPS = 64, PHASES = 4096, KEPT = 16384, SAMPLES = 4096, HEIGHTS = 64, CURRENTS = 32, COLUMNS = 15 };
enum { COMPLETED = 0, STOPPED = 1, TRIPPED = 2 };
enum { TOUCHDOWN = 100, TAKEOFF = 101 };  /* among the events of a run */
static const double LONGEST_STANCE = 2.0; /* [s] */

#define PUBLIC __attribute__((visibility("default"))) /* an export of the module */

typedef struct {
    double ground, touchdown_time, x1, v1, v2, u, ending, duration, apex, aed, events, command;
    double y, force, spring, lowest, takes_off, stiff; /* readings of the warnings */
} hop_row;

/* Written by the page. */
PUBLIC hopform_robot_f64 play_robot;
PUBLIC double play_terrain[HOPS];      /* [m] */
PUBLIC double play_heights[HEIGHTS];   /* [m] hop heights of the map */
PUBLIC double play_currents[CURRENTS]; /* [A] of the map */

/* Read by the page: of a run, its samples, and a map. */
PUBLIC double play_duration[1]; /* [s] */
PUBLIC double play_counts[2];   /* of hops and events */
PUBLIC hop_row play_hops[HOPS];
PUBLIC double play_events[KEPT][4]; /* time [s], kind, sides of actuator and body behind it (2: in flight) */
PUBLIC double play_samples[SAMPLES][COLUMNS];
PUBLIC double play_apex[HEIGHTS * CURRENTS];       /* [m] height by height, NaN without take-off */
PUBLIC double play_admissible[HEIGHTS * CURRENTS]; /* 1 where it takes off within the stroke */
PUBLIC double play_lowest[HEIGHTS],
    play_highest[HEIGHTS]; /* [m] over all admissible currents, NaN where there is none */

/* A flight or a stance of the run. */
typedef struct {
    double begin, duration;   /* [s] */
    double ground;            /* [m] in flight that ahead */
    double level;             /* [J] the energy (23) predicted for its beginning */
    int32_t in_stance, first; /* first: of its phases */
    hopform_step_f64 current;
    hopform_stance_f64 stance;
    hopform_flight_f64 flight;
} leg;

static hopform_plan_f64 plan, model; /* of the robot, and of the controller's model */
static hopform_search_f64 search;
static hopform_phase_f64 work[PHASES], stance_phases[KEPT];
static hopform_flight_phase_f64 flight_phases[KEPT];
static leg legs[2 * HOPS + 1];
static int32_t leg_count, stance_used, flight_used;
static hopform_search_f32 search_f32;
static hopform_phase_f32 work_f32[HOPFORM_SELFTEST_PHASES];

PUBLIC uint32_t play_digest_f32(void) {
    return hopform_selftest_f32(&search_f32, work_f32, HOPFORM_SELFTEST_PHASES);
}
PUBLIC uint32_t play_digest_f64(void) {
    return hopform_selftest_f64(&search, work, HOPFORM_SELFTEST_PHASES);
}

static double larger(double a, double b) {
    return a > b ? a : b;
}
static double smaller(double a, double b) {
    return a < b ? a : b;
}
static double home(void) {
    return smaller(larger(0.0, play_robot.x1_min), play_robot.x1_max);
}

static double body_height(hopform_state_f64 state) /* [m] over the ground under the foot */
{
    const double length = state.x1 - state.y, unloaded = play_robot.L0 + play_robot.c;
    return length + unloaded;
}

static void event(double t, int32_t kind, int32_t side_1, int32_t side_2) {
    if (play_counts[1] >= KEPT) return;
    double *const row = play_events[(int32_t)play_counts[1]++];
    row[0] = t, row[1] = kind, row[2] = side_1, row[3] = side_2;
}

/* How far a ground [m] is above where the leg would stand at a drop from a hop height [m]; 0 within rounding. */
static double first_step(double height, double ground) {
    const double length = play_robot.L0 + play_robot.c, x2 = height + length;
    const double step = home() - (x2 - ground) + play_robot.L0 + play_robot.c;
    return larger(step, -step) <= 0x4p-52 * play_robot.L0 ? 0.0 : step;
}

/* Energy [J] that (23) adds to the energy in flight: that of the spring at a touchdown or a take-off. */
static double spring_energy(hopform_state_f64 at) {
    const double offset = at.x1 - at.y;
    return play_robot.k * (offset * offset) / 2.0;
}

static double energy_23(const leg *at, double t) /* [J] of the body, in stance with the spring; from level 0 on */
{
    hopform_energy_f64 energy = {0};
    const double weight = play_robot.m_s * play_robot.g;
    if (at->in_stance) {
        hopform_stance_energy_f64(&plan, &at->current, stance_phases + at->first, &at->stance, &t, 1, &energy, 0, 0);
    } else {
        hopform_flight_ledger_f64 ledger;
        double lost;
        hopform_flight_energy_f64(&plan, flight_phases + at->first, &at->flight, &t, 1, &energy, &ledger, &lost);
    }
    return energy.body + weight * at->ground;
}

/* Longer than any flight [s] from a state to ground that is so much higher [m]. */
static double horizon_of(const hopform_state_f64 *state, double step) {
    const double g = play_robot.g, v2 = state->v2, height = 1.0 + larger(step, -step);
    return 10.0 + 2.0 * (larger(v2, -v2) + __builtin_sqrt(v2 * v2 + 2.0 * g * height)) / g;
}

/* The gains of the return that the controller's model designs, of the force as the robot feels it. */
static int32_t believed_gains(const hopform_state_f64 *state, double horizon, hopform_gains_f64 *gains) {
    const double ratio = plan.robot.gamma2 / model.robot.gamma2;
    hopform_flight_f64 flight;
    const int32_t status = hopform_solve_flight_f64(&model, state, 0, 0, horizon, PHASES, 0, 0, &flight);
    *gains = (hopform_gains_f64){flight.gains.Kp * ratio, flight.gains.Kd * ratio};
    return status;
}

/* A flight from a state over the ground that is left to the ground ahead, which is `step` [m] higher. */
static int32_t fly(leg *at, const hopform_state_f64 *state, double step) {
    const double horizon = horizon_of(state, step);
    const int32_t is_model = model.robot.gamma2 == plan.robot.gamma2;
    hopform_gains_f64 gains;
    at->in_stance = 0;
    at->first = flight_used;
    int32_t status = is_model ? HOPFORM_OK : believed_gains(state, horizon, &gains);
    if (status < 0) return status;
    status = hopform_solve_flight_f64(&plan, state, step, is_model ? 0 : &gains, horizon, PHASES,
                                      flight_phases + flight_used, KEPT - flight_used, &at->flight);
    if (status < 0) return status;
    flight_used += at->flight.phases_kept;
    at->duration = at->flight.duration;
    for (int32_t n = 0; n < at->flight.phases_kept; n++) {
        const hopform_flight_phase_f64 *const phase = flight_phases + at->first + n;
        event(at->begin + phase->t, n ? phase->event : TAKEOFF, phase->side, 2);
    }
    return HOPFORM_OK;
}

static int32_t stand(leg *at, const hopform_state_f64 *touchdown) {
    at->in_stance = 1;
    at->first = stance_used;
    const int32_t status = hopform_solve_stance_f64(&plan, touchdown, &at->current, 1, LONGEST_STANCE, PHASES,
                                                    stance_phases + stance_used, KEPT - stance_used, &at->stance);
    if (status < 0) return status;
    stance_used += at->stance.phases_kept;
    at->duration = at->stance.duration;
    for (int32_t n = 0; n < at->stance.phases_kept; n++) {
        const hopform_phase_f64 *const phase = stance_phases + at->first + n;
        event(at->begin + phase->t, n ? phase->event : TOUCHDOWN, phase->mode / 3 - 1, phase->mode % 3 - 1);
    }
    return HOPFORM_OK;
}

/* The lowest height of the body in a stance [m], over the ground under the foot: where a phase begins or ends. */
static double lowest_of(const leg *at) {
    double lowest = body_height(at->stance.end);
    for (int32_t n = 0; n < at->stance.phases_kept; n++) {
        const hopform_phase_f64 *const phase = stance_phases + at->first + n;
        lowest = smaller(lowest, body_height((hopform_state_f64){phase->x1, phase->v1, phase->v2, phase->y}));
    }
    return lowest;
}

/* The largest compression in a stance [m]. */
static double spring_of(const leg *at) {
    double most = 0.0;
    hopform_stance_compression_f64(&plan, &at->current, stance_phases + at->first, &at->stance, &most);
    return most;
}

/* Drop from a hop height [m] over level 0 and hop over play_terrain: with the current `value` [A], or, controlled, with
 * the current after which the next apex is `value` [m], by a model whose gamma2 is `wrong` % off. COMPLETED, STOPPED,
 * TRIPPED, or a negative status. */
PUBLIC int32_t play_run(double height, int32_t controlled, double value, int32_t hops, double wrong) {
    const hopform_robot_f64 *const robot = &play_robot;
    hopform_state_f64 state = {home(), 0.0, 0.0, 0.0};
    double time = 0.0, level = 0.0;
    leg_count = stance_used = flight_used = 0;
    play_duration[0] = play_counts[0] = play_counts[1] = 0.0;
    hopform_robot_f64 believed = *robot;
    believed.gamma2 = robot->gamma2 * (1.0 + wrong / 100.0);
    int32_t status = hopform_plan_init_f64(&plan, robot);
    const int32_t stiff = status == HOPFORM_ILL_CONDITIONED;
    if (status >= 0) status = hopform_plan_init_f64(&model, &believed);
    if (status < 0) return status;
    for (int32_t index = 0; index <= hops && index <= HOPS; index++) {
        const int32_t last = index == hops || index == HOPS;
        const double ground = play_terrain[last ? index - 1 : index];
        const double ahead = index ? ground - play_terrain[index - 1] : first_step(height, ground);
        const double step = last ? 0.0 : ahead;
        leg *const flight = &legs[leg_count++];
        flight->begin = time, flight->ground = ground;
        status = fly(flight, &state, step);
        if (status < 0) return status;
        flight->level = level = index ? level : energy_23(flight, 0.0);
        time += flight->duration;
        play_duration[0] = last ? flight->begin + flight->flight.apex_time : time;
        if (last) return COMPLETED;
        if (flight->flight.ending != HOPFORM_FLIGHT_TOUCHDOWN)
            return flight->flight.ending == HOPFORM_FLIGHT_TRIPPED ? TRIPPED : STOPPED;
        hopform_state_f64 touchdown = flight->flight.end;
        touchdown.v2 = flight->flight.v2_after;
        hopform_command_f64 command = {value, 0.0, 0};
        const hopform_target_f64 target = {larger(value, ground), -ground, 0.0, LONGEST_STANCE, 0, 0};
        if (controlled)
            status = hopform_choose_current_f64(&search, &model, &touchdown, &target, work, PHASES, &command);
        if (status < 0) return status;
        leg *const stance = &legs[leg_count++];
        stance->begin = time, stance->ground = ground;
        stance->current = (hopform_step_f64){0.0, command.u};
        status = stand(stance, &touchdown);
        if (status < 0) return status;
        stance->level = level += spring_energy(touchdown) + flight->flight.impact_loss;
        const hopform_stance_f64 *const solved = &stance->stance;
        const int32_t lifts = solved->ending == HOPFORM_ENDING_TAKEOFF;
        play_hops[(int32_t)play_counts[0]++] = (hop_row){
            ground,
            time,
            touchdown.x1,
            touchdown.v1,
            touchdown.v2,
            command.u,
            solved->ending,
            solved->duration,
            lifts ? solved->apex + ground : __builtin_nan(""),
            solved->aed,
            solved->event_count,
            command.status,
            touchdown.y,
            -robot->gamma2 * command.u,
            spring_of(stance),
            lowest_of(stance),
            lifts,
            stiff,
        };
        time = play_duration[0] = stance->begin + solved->duration;
        if (!lifts) return STOPPED;
        state = solved->end;
        level += solved->aed - spring_energy(state);
    }
    return COMPLETED;
}

/* The leg at a time of the run: a touchdown is in its stance, a take-off too. */
static const leg *leg_at(double t) {
    int32_t found = 0;
    while (found + 1 < leg_count
           && (legs[found + 1].in_stance ? t >= legs[found + 1].begin : t > legs[found + 1].begin))
        found++;
    return &legs[found];
}

/* `count` samples from one time of the run to another [s]: t, x1, v1, x2, v2, foot, ground, u, compression, force of
 * the spring, pull of the motor on the actuator [N], kinetic and gravitational energy of the body, the same with the
 * spring as in (23) in stance, this as predicted with the AED [J], hop.
 */
PUBLIC void play_sample(double from, double to, int32_t count) {
    const hopform_robot_f64 *const robot = &play_robot;
    for (int32_t n = 0; n < count && n < SAMPLES && leg_count; n++) {
        const double asked = count > 1 ? from + (to - from) * n / (count - 1) : from;
        const leg *const at = leg_at(asked);
        const double t = smaller(larger(asked - at->begin, 0.0), at->duration);
        hopform_state_f64 state = {0};
        double u = at->current.u, foot = 0.0, aed = 0.0;
        if (at->in_stance) {
            hopform_energy_f64 energy;
            hopform_ledger_f64 ledger = {0};
            double lost;
            hopform_stance_at_f64(&plan, &at->current, stance_phases + at->first, &at->stance, t, &state);
            hopform_stance_energy_f64(&plan, &at->current, stance_phases + at->first, &at->stance, &t, 1, &energy,
                                      &ledger, &lost);
            aed = ledger.spring_work + ledger.viscous_2 + ledger.coulomb_2;
        } else {
            hopform_flight_at_f64(&plan, flight_phases + at->first, &at->flight, &t, 1, &state);
            const double law = at->flight.gains.Kp * state.x1 + at->flight.gains.Kd * state.v1;
            u = robot->gamma2 == 0.0 ? 0.0 : smaller(larger(law / robot->gamma2, -robot->u_max), robot->u_max);
            foot = -state.y;
        }
        const double y = at->in_stance ? state.y : 0.0, x2 = body_height(state) + at->ground;
        const double row[COLUMNS] = {
            asked,
            state.x1,
            state.v1,
            x2,
            state.v2,
            foot + at->ground,
            at->ground,
            u,
            y,
            robot->k * y,
            -robot->gamma2 * u,
            0.5 * robot->m_s * (state.v2 * state.v2) + robot->m_s * robot->g * x2,
            energy_23(at, t),
            at->level + aed,
            (double)((at - legs) / 2),
        };
        for (int32_t column = 0; column < COLUMNS; column++)
            play_samples[n][column] = row[column];
    }
}

/* The next apex after drops from play_heights under play_currents, on flat ground, and the bounds over all currents. */
PUBLIC int32_t play_reach(int32_t height_count, int32_t current_count) {
    static hopform_trial_f64 trials[CURRENTS];
    const hopform_robot_f64 *const robot = &play_robot;
    const double limit = robot->x1_min < robot->x1_max ? robot->x1_max : __builtin_inf();
    if (height_count > HEIGHTS || current_count > CURRENTS) return HOPFORM_ERROR_STEPS;
    int32_t status = hopform_plan_init_f64(&plan, robot);
    for (int32_t row = 0; row < height_count && status >= 0; row++) {
        const hopform_state_f64 drop = {home(), 0.0, 0.0, 0.0};
        const double step = first_step(play_heights[row], 0.0), horizon = horizon_of(&drop, step);
        hopform_flight_f64 flight;
        status = hopform_solve_flight_f64(&plan, &drop, step, 0, horizon, PHASES, 0, 0, &flight);
        if (status < 0) break;
        const hopform_state_f64 touchdown = {flight.end.x1, flight.end.v1, flight.v2_after, flight.end.y};
        status = hopform_try_currents_f64(&plan, &touchdown, 1, play_currents, current_count, LONGEST_STANCE, work,
                                          PHASES, trials);
        if (status < 0) break;
        for (int32_t column = 0; column < current_count; column++) {
            const hopform_trial_f64 *const trial = &trials[column];
            play_apex[row * current_count + column] = trial->takes_off ? trial->apex : __builtin_nan("");
            play_admissible[row * current_count + column] = trial->takes_off && trial->largest_x1 < limit;
        }
        const double wanted[2] = {0.0, 1000.0};
        double *const bound[2] = {&play_lowest[row], &play_highest[row]};
        for (int32_t n = 0; n < 2 && status >= 0; n++) {
            hopform_command_f64 command;
            const hopform_target_f64 target = {wanted[n], 0.0, 0.0, LONGEST_STANCE, 0, 0};
            status = hopform_choose_current_f64(&search, &plan, &touchdown, &target, work, PHASES, &command);
            *bound[n] = command.status == HOPFORM_COMMAND_NO_TAKEOFF ? __builtin_nan("") : command.apex;
        }
    }
    return status;
}
