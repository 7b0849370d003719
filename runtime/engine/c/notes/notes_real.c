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

#define NOTE_real(rule, function, from, to) note_real(in->evaluations, #rule, function, from, to)
#include "chain_real.h"

/* The value of an event function, or 0 if that is within its rounding bound. */
static real sure_value_real(const event_function_real *g, const propagator_real *at) {
    const real value = value_at_real(g, at);
    return fabs_real(value) > rounding_of_real(g, at, 0.0) ? value : 0.0;
}

static bool is_threshold_real(const stance_chain_real *chain, const event_function_real *g) {
    const bool of_element = g->owner != CONTACT_real && !(HOPFORM_HAS_LIMITS && g->owner == LIMIT_real);
    return of_element && !g->touch_is_no_event && side_of_mode_real(chain->mode, g->owner - ELEMENT_real) == 0;
}

static const char *kind_of_function_real(const stance_chain_real *chain, const event_function_real *g) {
    if (g->owner == CONTACT_real) { return "contact"; }
    if (HOPFORM_HAS_LIMITS && g->owner == LIMIT_real) { return "limit"; }
    if (g->touch_is_no_event) { return "stop"; }
    return is_threshold_real(chain, g) ? "threshold" : "velocity";
}

/* An event function that is searched: its kind, element and side, and its values. */
static void note_function_real(const stance_chain_real *chain, const stance_search_real *search, int32_t n) {
    evaluations_real *notes = chain->evaluations;
    const event_function_real *g = &search->events.set.function[n];
    const propagator_real *end = &search->in.high;
    const int element = g->owner - ELEMENT_real;
    (void)note_real(notes, kind_of_function_real(chain, g), n, (real)element, (real)g->side);
    if (is_threshold_real(chain, g)) {
        (void)note_real(notes, "excess", n, excess_to_side_real(&chain->plan->robot, element, g->side), 0.0);
    }
    /* in the modal form `start` is the final value, and at the start exp(-a t) = cos = 1 */
    const real start = is_modal_real(end) ? g->start + g->H3 + g->H2 : g->start;
    (void)note_real(notes, "values", n, start, sure_value_real(g, end));
    if (!g->needs_certificate) { (void)note_real(notes, "monotone", n, 0.0, end->t); }
    if (g->owner == search->owner && n == search->in.found) { (void)note_real(notes, "ends", n, 0.0, end->t); }
}

/* That whose first zero has a closed form: the velocity of what slips alone, or the stretch. */
static void note_closed_form_real(const stance_chain_real *chain, const stance_search_real *search) {
    evaluations_real *notes = chain->evaluations;
    const stance_events_real *events = &search->events;
    const propagator_real *end = &search->in.high;
    if (events->rests == NO_OWNER_real) { return; }
    const int32_t n = events->set.count;
    const bool contact = events->rests == CONTACT_real;
    const int element = contact ? 0 : events->rests - ELEMENT_real;
    const int axis = contact ? HOPFORM_STRETCH_AXIS : HOPFORM_VELOCITY_AXIS(element);
    const real sign = contact ? 1.0 : (real)side_of_mode_real(chain->mode, element);
    const numerator_real *h = contact ? &chain->numerators.of.stretch : &chain->numerators.of.velocity[element];
    const numerator_real towards = {sign * h->H3, sign * h->H2, sign * h->H1};
    const event_function_real g = event_function_of_real(&towards, sign * chain->at.of[axis]);
    (void)note_real(notes, contact ? "contact" : "velocity", n, (real)element, 0.0);
    (void)note_real(notes, "values", n, g.start, sure_value_real(&g, end));
    const bool never = !(events->rest_time < HOPFORM_NEVER_real);
    (void)note_real(notes, never ? "no_zero" : "zero", n, 0.0, events->rest_time);
    if (search->owner == events->rests && !(events->rest_time > end->t)) {
        (void)note_real(notes, "ends", n, 0.0, end->t);
    }
}

/* Finds the end of a phase, and describes the phase: its number is that of its row. */
static void note_phase_real(stance_chain_real *chain, stance_search_real *search) {
    evaluations_real *notes = chain->evaluations;
    stance_find_end_real(chain, search);
    if (!rests_of_mode_real(chain->mode)) {
        const hopform_poles_real *poles = search->events.set.poles;
        if (several_of_mode_real(chain->mode)) { (void)note_real(notes, "pole", -1, poles->a, 0.0); }
        (void)note_real(notes, "pair", -1, poles->p, poles->q);
        (void)note_real(notes, "sides", -1, (real)side_of_mode_real(chain->mode, 0),
                        (real)side_of_mode_real(chain->mode, 1));
        for (int32_t n = 0; n < search->events.set.count; n++) {
            note_function_real(chain, search, n);
        }
        note_closed_form_real(chain, search);
    }
    (void)note_real(notes, "phase", chain->count - 1, 0.0, search->in.high.t);
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
