/* SPDX-License-Identifier: MIT-0
 *
 * A stance with notes of how it is solved: of each phase its poles and event functions, and which rule of the
 * certificate says in which interval that none of them has a root. A library of its own, for explanation alone: the
 * unit of a stance once more, in which NOTE writes. No global is in it: the count of evaluations, which the search has
 * at hand wherever it decides, is the first member of the notes.
 */
#include "event_function_real.h"

/* What is decided or found; of which event function of the phase, by its number; from when to when since the phase
 * began, or two numbers. */
typedef struct {
    const char *what;
    int32_t function;
    real from, to;
} hopform_note_real;

/* Notes are counted, and kept as far as there is room. */
typedef struct {
    evaluations_real evaluations; /* first: a pointer to it is one to the notes */
    hopform_note_real *kept;
    int32_t room;
    int32_t count;
} notes_real;

static bool note_real(evaluations_real *evaluations, const char *what, int32_t function, real from, real to) {
    notes_real *notes = (notes_real *)evaluations;
    const hopform_note_real note = {what, function, from, to};
    if (notes->count < notes->room) { notes->kept[notes->count] = note; }
    notes->count++;
    return true;
}

/* What a search from node to node counts is noted of its interval, or of function n of it. */
#define NODE_NOTE_real(rule, function, to) (void)note_real(search->evaluations, rule, function, search->low->t, to)
#define NODE_COUNT_node NODE_NOTE_real("node", -1, search->low->t)
#define NODE_COUNT_amplitude NODE_NOTE_real("falls_too_little", n, search->high->t)
#define NODE_COUNT_bernstein NODE_NOTE_real("has_no_root_by_bernstein", n, search->high->t)
#define NODE_COUNT_minimum NODE_NOTE_real("cut_at_minimum", n, search->high->t)
#define NODE_COUNT_cut NODE_NOTE_real("cut", n, search->high->t)
#define NODE_COUNT_quiet NODE_NOTE_real("quiet_time_at_node", -1, search->low->t + quiet)
#define NODE_COUNT_evaluation (void)0
#define NODE_COUNT_inside (void)0
#define NODE_COUNT_from_the_end (void)0
#define NODE_COUNT(what) NODE_COUNT_##what
#include "chain_real.h"

/* ---- the event functions of a phase: kind, element and side; values at the start and at the end ---- */

/* Of a phase; `ends` the one whose zero ends it. */
static void note_function_real(const stance_chain_real *chain, int32_t n, const char *kind, int element, int side,
                               real start, real end, bool ends, real length) {
    evaluations_real *notes = chain->evaluations;
    (void)note_real(notes, kind, n, (real)element, (real)side);
    (void)note_real(notes, "values", n, start, ends ? 0.0 : end);
    if (ends) { (void)note_real(notes, "ends", n, 0.0, length); }
}

#if HOPFORM_BOTH_MOVE
/* Both slip: the contact, if it can be lost, the distance to a stop ahead, the velocities. */
static void note_both_real(const stance_chain_real *chain, const stance_search_real *search) {
    evaluations_real *notes = chain->evaluations;
    const real length = search->t;
    state_by_axis_real end = chain->at;
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        end.of[axis_of_row_real[n]] = search->arrival.z[axis_of_row_real[n]];
    }
#if HOPFORM_HAS_CONTACT
    const hopform_robot_real *robot = &chain->plan->robot;
    if (falls_of_mode_real(chain->mode) || chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0 || HOPFORM_CONTACT_IS_ROW) {
        note_function_real(chain, 0, "contact", 0, 0, contact_of_real(robot, &chain->at.named),
                           contact_of_real(robot, &end.named), search->owner == CONTACT_real, length);
    }
#endif
    const real gap = gap_ahead_real(chain);
    if (gap < HOPFORM_NEVER_real) {
        const int side = side_of_mode_real(chain->mode, HOPFORM_STOPPED_ELEMENT);
        note_function_real(chain, STOP_AHEAD_real, "stop", HOPFORM_STOPPED_ELEMENT, 0, gap,
                           gap - (real)side * search->arrival.moved, search->stops, length);
        (void)note_real(notes, "monotone", STOP_AHEAD_real, 0.0, length);
    }
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        const int axis = HOPFORM_VELOCITY_AXIS(element);
        const real side = (real)side_of_mode_real(chain->mode, element);
        note_function_real(chain, 1 + element, "velocity", element, 0, side * chain->at.of[axis], side * end.of[axis],
                           search->owner == ELEMENT_real + element && !search->stops, length);
    }
}
#endif

/* The kind of a guard or a function of one that slips alone. */
static const char *kind_of_owner_real(int owner) {
    if (owner == CONTACT_real) { return "contact"; }
    return HOPFORM_HAS_LIMITS && owner == LIMIT_real ? "limit" : "threshold";
}

/* Notes the excess of friction at rest where there is one to tell. */
static void note_excess_real(const stance_chain_real *chain, int32_t n, int owner, int side) {
    if (owner == CONTACT_real || (HOPFORM_HAS_LIMITS && owner == LIMIT_real)) { return; }
    (void)note_real(chain->evaluations, "excess", n,
                    excess_to_side_real(&chain->plan->robot, owner - ELEMENT_real, side), 0.0);
}

/* What a displacement of one that slips alone is of the function of a guard. */
static real scale_of_guard_real(const stance_chain_real *chain, int alone, const alone_guard_real *guard) {
    const int held = 1 - alone;
    if (guard->owner != ELEMENT_real + held) { return 1.0; }
    state_by_axis_real change = {{0.0, 0.0, 0.0, 0.0}};
    change.of[HOPFORM_STRETCH_AXIS] = 1.0;
    return fabs_real(free_slope_real(rates_of_chain_real(chain), held, &change));
}

/* One slips alone: guards by its displacement, functions of that and of its velocity, and what rests in closed form. */
static void note_alone_real(const stance_chain_real *chain, const stance_search_real *found) {
    evaluations_real *notes = chain->evaluations;
    const int alone = alone_of_mode_real(chain->mode);
    const alone_real *end = &found->alone;
    alone_search_real search;
    put_alone_search_real(chain, &search);
    int32_t n = 0;
    for (int m = 0; m < search.count; m++, n++) {
        const alone_guard_real *guard = &search.guard[m];
        const real scale = scale_of_guard_real(chain, alone, guard);
        const int element = guard->owner == CONTACT_real ? 0 : guard->owner - ELEMENT_real;
        const bool ends = found->owner == guard->owner && found->stops == guard->stops && found->side == guard->side;
        note_function_real(chain, n, guard->stops ? "stop" : kind_of_owner_real(guard->owner), element, guard->side,
                           scale * guard->s, scale * (guard->s - end->s), ends, end->t);
        if (!guard->stops) { note_excess_real(chain, n, guard->owner, guard->side); }
        (void)note_real(notes, "monotone", n, 0.0, end->t);
    }
    for (int m = 0; m < search.functions; m++, n++) {
        const alone_function_real *function = &search.function[m];
        const int element = function->owner < ELEMENT_real ? 0 : function->owner - ELEMENT_real;
        const known_pair_real response = response_over_real(&search.pair, end->t);
        const real fall = alone_after_real(&search.pair, &function->fall, end->t, &response).s;
        note_function_real(chain, n, kind_of_owner_real(function->owner), element, function->side, function->value,
                           function->value - fall, found->owner == function->owner && found->side == function->side,
                           end->t);
        note_excess_real(chain, n, function->owner, function->side);
        (void)note_real(notes, "pieces", n, 0.0, end->t);
    }
    if (search.rests == CONTACT_real) {
        const real start = chain->at.of[HOPFORM_STRETCH_AXIS];
        note_function_real(chain, n, "contact", 0, 0, start,
                           start + stretch_by_displacement_real(chain, alone) * end->s, found->owner == CONTACT_real,
                           end->t);
        (void)note_real(notes, search.rest_time < HOPFORM_NEVER_real ? "zero" : "no_zero", n, 0.0, search.rest_time);
        n++;
    }
    const real rest = alone_time_to_rest_real(&search, &search.start);
    note_function_real(chain, n, "velocity", alone, 0, search.start.v, end->v,
                       found->owner == ELEMENT_real + alone && !found->stops, end->t);
    (void)note_real(notes, rest < HOPFORM_NEVER_real ? "zero" : "no_zero", n, 0.0, rest);
}

/* Finds the end of a phase, and describes the phase: its number is that of its row. */
static void note_phase_real(stance_chain_real *chain, stance_search_real *search) {
    evaluations_real *notes = chain->evaluations;
    stance_find_end_real(chain, search);
    if (!rests_of_mode_real(chain->mode)) {
        const hopform_poles_real *poles = poles_of_real(chain->plan, chain->mode);
        if (several_of_mode_real(chain->mode)) { (void)note_real(notes, "pole", -1, poles->a, 0.0); }
        (void)note_real(notes, "pair", -1, poles->p, poles->q);
        (void)note_real(notes, "sides", -1, (real)side_of_mode_real(chain->mode, 0),
                        (real)side_of_mode_real(chain->mode, 1));
#if HOPFORM_HAS_LIMITS
        (void)note_real(notes, "at_limit", -1, (real)limit_of_mode_real(chain->mode), 0.0);
#endif
#if HOPFORM_BOTH_MOVE
        if (several_of_mode_real(chain->mode)) { note_both_real(chain, search); }
#endif
        if (alone_of_mode_real(chain->mode) >= 0) { note_alone_real(chain, search); }
    }
    (void)note_real(notes, "phase", chain->count - 1, 0.0, search->t);
}

/* A stance comes by here where it looks for the end of a phase. */
#define stance_find_end_real note_phase_real
#include "stance_real.h"

int32_t hopform_note_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                 const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                 hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance,
                                 hopform_note_real *notes, int32_t room, int32_t *count);

/* hopform_solve_stance, and notes of it as far as there is room; how many they are. */
int32_t hopform_note_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                 const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                 hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance,
                                 hopform_note_real *notes, int32_t room, int32_t *count) {
    notes_real all = {{UNBOUNDED_real}, notes, room, 0};
    const int32_t status = solve_observed_real(plan, start, steps, step_count, horizon, max_phases, phases, capacity,
                                               stance, &all.evaluations, NULL, NULL);
    *count = all.count;
    return status;
}
