/* SPDX-License-Identifier: MIT-0
 *
 * A phase: its poles and numerators by mode, its state over time, and how a change passes the event that ends it.
 */
#ifndef HOPFORM_PHASE_H_real
#define HOPFORM_PHASE_H_real

#include "mode_table_real.h"
#include "transition_real.h"

#if HOPFORM_HAS_CONTACT
/* True where the AED is a small difference of two energies of the body, and added up from the ledger instead. */
static inline bool stores_much_real(const hopform_robot_real *robot, const hopform_state_real *start) {
    return !(stored_energy_real(robot, start) <= 64.0 * moving_energy_real(robot, start, 1.0));
}
#endif

/* The poles, their time scales and the rates of a mode in a plan. */
static inline const hopform_poles_real *poles_of_real(const hopform_plan_real *plan, row_real mode) {
    return &plan->poles[form_of_mode_real(mode)];
}

static inline const hopform_timescales_real *timescales_of_real(const hopform_plan_real *plan, row_real mode) {
    return &plan->timescales[form_of_mode_real(mode)];
}

static inline const hopform_rates_real *rates_in_mode_real(const hopform_plan_real *plan, row_real mode) {
    return &plan->rates[rates_of_mode_real(mode)];
}

/* The constant accelerations of a mode under an input. */
static inline drive_real drive_in_mode_real(const hopform_plan_real *plan, row_real mode, real u) {
    return drive_of_real(&plan->robot, rates_in_mode_real(plan, mode), u, (real)side_of_mode_real(mode, 0),
                         (real)side_of_mode_real(mode, 1));
}

/* The numerators of a mode from the state in which the phase starts, under constant accelerations. */
static inline numerators_real motion_under_real(const hopform_rates_real *rates, const drive_real *drive,
                                                const hopform_state_real *state, row_real mode) {
#define MOTION_OF(form) motion_of_##form##_real(rates, drive, state)
    if (!rests_of_mode_real(mode)) { return HOPFORM_OF_FORM(MOTION_OF, form_of_mode_real(mode)); }
#undef MOTION_OF
    const numerators_real rest = {0};
    return rest;
}

/* The same under an input. */
static inline numerators_real motion_of_real(const hopform_plan_real *plan, const hopform_state_real *state, real u,
                                             row_real mode) {
    const drive_real drive = drive_in_mode_real(plan, mode, u);
    return motion_under_real(rates_in_mode_real(plan, mode), &drive, state, mode);
}

/* ---- the hold rule ---- */

/* Where an element that would slip to a side stands in a record of both sides of each. */
static inline int side_index_real(int element, int side) {
    return 2 * element + (side < 0 ? 1 : 0);
}

/* Friction of an element at rest that would slip to a side, less that in motion. */
static inline real excess_to_side_real(const hopform_robot_real *robot, int element, int side) {
    excess_by_side_real excess;
    excess.named = excess_of_real(robot);
    return excess.of[side_index_real(element, side)];
}

/* Level of friction of an element that slips. */
static inline real level_of_real(const hopform_robot_real *robot, int element) {
    friction_by_element_real levels;
    levels.named = friction_of_real(robot);
    return levels.of[element];
}

/* Level of friction of an element at rest that would slip to a side. */
static inline real level_at_rest_real(const hopform_robot_real *robot, int element, int side) {
    return level_of_real(robot, element) + excess_to_side_real(robot, element, side);
}

/* Where an element at rest goes, held while |a_i| <= f_s,i: 1 or -1, 0 if it stays. */
static inline real goes_real(real acceleration, real friction) {
    const real down = acceleration < -friction ? -1.0 : 0.0;
    return acceleration > friction ? 1.0 : down;
}

/* The free acceleration of an element that has come to rest alone, from its motion: it fades far below the digits of
 * the state. Without friction nothing but the sign is left of it in the end, and that is kept. */
static inline real free_after_rest_real(real side, real friction, real back) {
    return side * (friction - (back > HOPFORM_UNDERFLOW_real ? back : HOPFORM_UNDERFLOW_real));
}

/* Put the acceleration with which an element goes on from rest, alone, in place of that of the state. */
static inline void set_acceleration_from_rest_real(numerators_by_axis_real *numerators, const hopform_rates_real *rates,
                                                   int element, real acceleration) {
    (void)rates; /* without a gear */
    numerators->of.velocity[element].H3 = acceleration;
    if (element == HOPFORM_STOPPED_ELEMENT) { numerators->of.position.H3 = acceleration; /* its velocity is 0 */ }
    numerators->of.stretch.H2 = (real)HOPFORM_STRETCH_FOLLOWS(rates, element) * acceleration;
}

/* Whether the stretch may turn inside a phase. */
static inline bool stretch_may_turn_real(row_real mode) {
    return falls_of_mode_real(mode) && rises_of_mode_real(mode);
}

/* A state of a phase that began at `start`: what is held stays exactly where it is. */
static inline hopform_state_real held_in_place_real(const hopform_state_real *start, const state_by_axis_real *later,
                                                    row_real mode) {
    const bool stays = side_of_mode_real(mode, HOPFORM_STOPPED_ELEMENT) == 0;
    state_by_axis_real at = *later;
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        if (side_of_mode_real(mode, element) == 0) { at.of[HOPFORM_VELOCITY_AXIS(element)] = 0.0; }
    }
    at.named.x1 = stays ? start->x1 : at.named.x1;
    return at.named;
}

/* The state of a phase where the response of the poles is `basis`. */
static inline hopform_state_real arrive_real(const hopform_state_real *state, const numerators_real *numerators,
                                             const basis_real *basis, row_real mode) {
    state_by_axis_real at;
    at.later = state_at_real(state, numerators, basis);
    return held_in_place_real(state, &at, mode);
}

/* A plan that hopform_plan_init made, not memory that holds anything. */
static inline bool is_made_real(const hopform_plan_real *plan) {
    return plan->made == HOPFORM_PLAN_MADE;
}

#if HOPFORM_HAS_CONTACT
/* A plan of a robot that can take off, and comes down again. */
static inline bool hops_real(const hopform_plan_real *plan) {
    return is_made_real(plan) && fall_of_real(&plan->robot) > 0.0;
}
#endif

/* Index of the last phase that starts at or before t. */
static inline int32_t phase_index_real(const hopform_phase_real *phases, int32_t count, real t) {
    int32_t low = 0;
    int32_t high = count - 1;
    while (low < high) {
        const int32_t middle = (int32_t)(((uint32_t)low + (uint32_t)high + 1u) / 2u);
        if (phases[middle].t <= t) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    return low;
}

static inline row_real mode_of_phase_real(const hopform_phase_real *phase) {
    return mode_of_number_real(phase->mode);
}

/* The input of a mode during a step: at a limit of a law the current there, in place of the target. */
static inline real input_of_mode_real(const hopform_plan_real *plan, row_real mode, real u) {
    const int limit = limit_of_mode_real(mode);
    return limit != 0 ? input_at_limit_real(&plan->robot, u, (real)limit) : u;
}

static inline real input_of_phase_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                       const hopform_phase_real *phase) {
    return input_of_mode_real(plan, mode_of_phase_real(phase), steps[phase->step].u);
}

static inline hopform_state_real start_of_phase_real(const hopform_phase_real *phase) {
#define TAKE_MEMBER(name, domain) phase->name,
    const hopform_state_real start = {HOPFORM_STATE_MEMBERS(TAKE_MEMBER)};
#undef TAKE_MEMBER
    return start;
}

/* The course of a motion in a mode from a state on under constant accelerations: of a phase, or of a change of its
 * state. */
typedef struct {
    row_real mode;
    const hopform_poles_real *poles;
    const hopform_rates_real *rates;
    state_by_axis_real start;
    drive_by_element_real drive;
    numerators_by_axis_real numerators;
} course_real;

static inline course_real course_from_real(const hopform_plan_real *plan, row_real mode,
                                           const hopform_state_real *start, const drive_real *drive) {
    course_real course;
    course.mode = mode;
    course.poles = poles_of_real(plan, mode);
    course.rates = rates_in_mode_real(plan, mode);
    course.start.named = *start;
    course.drive.named = *drive;
    course.numerators.named = motion_under_real(course.rates, drive, start, mode);
    return course;
}

static inline course_real course_of_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u) {
    const row_real mode = mode_of_phase_real(phase);
    const hopform_state_real start = start_of_phase_real(phase);
    const drive_real drive = drive_in_mode_real(plan, mode, u);
    return course_from_real(plan, mode, &start, &drive);
}

/* The axes of y, v_1 and v_2. */
static const int axis_of_row_real[3] = {HOPFORM_STRETCH_AXIS, HOPFORM_VELOCITY_AXIS(0), HOPFORM_VELOCITY_AXIS(1)};

/* The rates of y, v_1 and v_2 where the response of the poles is `basis`. */
static inline rates_by_row_real rates_on_course_real(const course_real *course, const basis_real *basis) {
    rates_by_row_real w = {{0.0, 0.0, 0.0}};
    for (int n = 0; n < 3; n++) {
        const numerator_real *h = &course->numerators.core[axis_of_row_real[n] - 1];
        w.of[n] = h->H3 * basis->Wdd + h->H2 * basis->Wd + h->H1 * basis->W;
    }
    return w;
}

/* M times rates of the axes in a mode. */
static inline state_by_axis_real bend_in_mode_real(const hopform_rates_real *rates, row_real mode,
                                                   const state_by_axis_real *w) {
    const drive_real none = {0.0, 0.0};
    state_by_axis_real bend;
    bend.rates =
        speeds_of_real(rates, &none, (real)side_of_mode_real(mode, 0), (real)side_of_mode_real(mode, 1), &w->named);
    return bend;
}

/* Where y, v_1 and v_2 end, and how far from there they are, by what has not yet faded of their rates. */
typedef struct {
    core_by_row_real end, left;
} settling_real;

static inline settling_real settling_of_real(const hopform_rates_real *rates, const drive_real *drive,
                                             const rates_by_row_real *w) {
    settling_real settling;
    settling.end.named = settled_of_both_real(rates, drive);
    settling.left.named = unsettled_of_both_real(rates, &w->named);
    return settling;
}

/* Behind the transient of a real pole that is far beyond the pair velocities are small differences of what they were.
 * What has not yet faded of the rates says how far the state is from where it ends: z is that sum where its terms are
 * smaller. */
SELDOM_real void sharpen_late_state_real(const course_real *course, const basis_real *basis, state_by_axis_real *at) {
    const rates_by_row_real w = rates_on_course_real(course, basis);
    const settling_real to = settling_of_real(course->rates, &course->drive.named, &w);
    for (int n = 0; n < 3; n++) {
        const int axis = axis_of_row_real[n];
        const numerator_real *h = &course->numerators.core[axis - 1];
        const real terms = fabs_real(course->start.of[axis]) + fabs_real(h->H3 * basis->Wd)
                           + fabs_real(h->H2 * basis->W) + fabs_real(h->H1 * basis->W1);
        if (fabs_real(to.end.of[n]) + fabs_real(to.left.of[n]) < terms) { at->of[axis] = to.end.of[n] + to.left.of[n]; }
    }
}

/* Whether that is so: the real pole beyond the pair by so much, and its transient over. */
static inline bool is_late_on_course_real(const course_real *course, real t) {
    const hopform_poles_real *poles = course->poles;
    return !HOPFORM_MOVES_ALONE && poles->a * poles->a > HOPFORM_FAR_real * poles->q && poles->a * t >= 1.0
           && poles->s_3 > 0.0;
}

/* The state at time t since a motion began. */
static inline hopform_state_real state_on_course_real(const course_real *course, real t) {
    if (rests_of_mode_real(course->mode)) { return course->start.named; }
    const basis_real basis = basis_at_real(course->poles, t);
    state_by_axis_real at;
    at.named = arrive_real(&course->start.named, &course->numerators.named, &basis, course->mode);
    if (is_late_on_course_real(course, t)) { sharpen_late_state_real(course, &basis, &at); }
    return at.named;
}

static inline hopform_state_real state_in_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase,
                                                     real u, real t) {
    const course_real course = course_of_phase_real(plan, phase, u);
    return state_on_course_real(&course, t);
}

/* States at times that follow each other: the course of a phase is made once for those in it. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    const hopform_phase_real *phases;
    int32_t count;    /* of the phases */
    int32_t prepared; /* the phase whose course it is */
    course_real course;
} reader_real;

static inline void prepare_real(reader_real *reader, int32_t n) {
    const hopform_phase_real *phase = &reader->phases[n];
    reader->prepared = n;
    reader->course = course_of_phase_real(reader->plan, phase, input_of_phase_real(reader->plan, reader->steps, phase));
}

static inline reader_real reader_of_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                         const hopform_phase_real *phases, int32_t count) {
    reader_real reader;
    reader.plan = plan;
    reader.steps = steps;
    reader.phases = phases;
    reader.count = count;
    prepare_real(&reader, 0);
    return reader;
}

static inline hopform_state_real read_state_real(reader_real *reader, real t) {
    const int32_t n = phase_index_real(reader->phases, reader->count, t);
    if (n != reader->prepared) { prepare_real(reader, n); }
    return state_on_course_real(&reader->course, t - reader->phases[n].t);
}

/* The state just before the phase behind another one begins. Nothing jumps there but the velocity that a stop takes. */
static inline hopform_state_real state_before_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase,
                                                         real u, const hopform_phase_real *next) {
    state_by_axis_real at;
    at.named = start_of_phase_real(next);
    if (next->event == HOPFORM_EVENT_HITS_STOP) {
        state_by_axis_real met;
        met.named = state_in_phase_real(plan, phase, u, next->t - phase->t);
        const int velocity = HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT);
        at.of[velocity] = met.of[velocity];
    }
    return at.named;
}

/* ---- through an event, at which an axis is at a value: a velocity at 0, or a position at a stop ---- */

/* The axis that is at a value when an event comes; -1 where nothing jumps. */
static inline int axis_of_event_real(int event) {
    static const signed char axis_of_event[] = HOPFORM_AXIS_OF_EVENT;
    return axis_of_event[event];
}

/* The change of z right after an event of `axis`, in place of that before it. The event comes `late`r, which adds (z'
 * before - z' after) late; the value changes by `wanted`, that of a velocity by 0. A stop takes the velocity at once,
 * and all that it acts on jumps. At rest the acceleration of the element jumps alone. */
static inline void pass_event_at_axis_real(real change[HOPFORM_AXES], const real before[HOPFORM_AXES],
                                           const real after[HOPFORM_AXES], int axis, real wanted, real late) {
    const bool stops = axis == HOPFORM_POSITION_AXIS;
    const int velocity = stops ? HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT) : axis;
    for (int i = 0; stops && i < HOPFORM_AXES; i++) {
        change[i] += (before[i] - after[i]) * late;
    }
    change[axis] = wanted;
    change[velocity] = 0.0 - after[velocity] * late;
}

/* How the free acceleration of an element changes with the state. */
static inline real free_slope_real(const hopform_rates_real *rates, int element, const state_by_axis_real *change) {
    free_by_element_real slopes;
    slopes.named = free_slopes_real(rates, &change->change);
    return slopes.of[element];
}

/* The element that begins to slip at an event; -1 if none does. */
static inline int slips_at_event_real(int event) {
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        if (event == HOPFORM_EVENT_SLIPS(element)) { return element; }
    }
    return -1;
}

/* The change of z right after an element has begun to slip, `late`r: its velocity was 0 and grows. */
static inline void pass_slip_real(real change[HOPFORM_AXES], int element, real acceleration, real late) {
    change[HOPFORM_VELOCITY_AXIS(element)] -= acceleration * late;
}

/* ---- what ended a motion ---- */

/* Whether a stance has ended as its contact was lost. */
static inline bool is_left_real(const hopform_stance_real *stance) {
#if HOPFORM_HAS_CONTACT
    return stance->ending == HOPFORM_ENDING_TAKEOFF;
#else
    (void)stance;
    return false;
#endif
}

/* What set the time of an ending: a root of a contact force in the last phase, the event or the start that this phase
 * began with, at which it ended at once, the horizon, or nothing, where a search was given up. */
enum { ENDED_BY_NOTHING_real, ENDED_BY_ROOT_real, ENDED_BY_EVENT_real, ENDED_BY_HORIZON_real };

#if HOPFORM_HAS_CONTACT
/* The contact force is below 0, which it may be without a root: at the start, or where a velocity in it is lost at a
 * stop. A stretch does not jump. */
static inline bool contact_pulls_real(const hopform_robot_real *robot, const hopform_state_real *at) {
    return !HOPFORM_CONTACT_IS_STRETCH && contact_of_real(robot, at) < 0.0;
}
#endif

/* What set the time at which a stance ended, all of whose phases are at hand. */
static inline int ended_by_real(const hopform_plan_real *plan, const hopform_phase_real *phases,
                                const hopform_stance_real *stance) {
    if (stance->ending == HOPFORM_ENDING_HORIZON) { return ENDED_BY_HORIZON_real; }
    if (stance->ending == HOPFORM_ENDING_REST) { return ENDED_BY_EVENT_real; }
#if HOPFORM_HAS_CONTACT
    if (is_left_real(stance)) {
        const hopform_phase_real *last = &phases[stance->phases_kept - 1];
        const hopform_state_real begins = start_of_phase_real(last);
        const bool may_jump = stance->phases_kept == 1 || last->event == HOPFORM_EVENT_HITS_STOP;
        return may_jump && contact_pulls_real(&plan->robot, &begins) ? ENDED_BY_EVENT_real : ENDED_BY_ROOT_real;
    }
#endif
    (void)plan;
    (void)phases;
    return ENDED_BY_NOTHING_real;
}

/* ---- a stance that is followed phase by phase while it is solved ---- */

/* A phase that has been solved, before the event that ends it. */
typedef struct {
    const state_by_axis_real *start;
    const state_by_axis_real *arrived;
    const drive_by_element_real *drive;
    state_by_axis_real begins, ends; /* z' at its start, where an acceleration may be known exactly, and at its end */
    row_real mode;
    real length;
    int event;   /* with which it began */
    bool leaves; /* it ends as the contact is lost */
} solved_phase_real;

typedef struct current_variation_real current_variation_real;
typedef void observer_real(current_variation_real *variation, const solved_phase_real *phase);

#endif
