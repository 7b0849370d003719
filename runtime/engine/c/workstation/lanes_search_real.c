/* SPDX-License-Identifier: MIT-0
 *
 * Many stances at a time, each of its own robot. A stance is searched as one that is solved by itself, by the same
 * functions; but where those evaluate the propagator at the end of an interval, or on the way to a root, it waits until
 * that is done for many stances at a time, one in each lane. A lane whose stance has ended takes the next one.
 */
#include "chain_real.h"
#include "columns_real.h"
#include "lanes_real.h"
#include "plan_real.h"

enum {
    PLANS = LANES_real + BLOCK_real, /* so that a block of them is free */
    FEW = LANES_real / 4,            /* the last stances go on one by one */
    PHASES_OF_LANE = 16,             /* a stance whose list is wanted and takes more is solved by itself */
    WAITS = -1,                      /* no ending of a stance: an evaluation is wanted */
    NO_STANCE = -1
};

/* A plan with the run of its stances. */
typedef struct {
    hopform_plan_real plan; /* without propagators at its nodes where the run is of one stance */
    hopform_run_real run;
    bool several;  /* stances in the run */
    int32_t users; /* lanes with a stance of it */
} planned;

/* A stance under way. */
typedef struct {
    int64_t index;
    planned *planned;
    hopform_step_real step;
    hopform_state_real start;
    stance_chain_real chain;
    stance_search_real search;
    bool quiet;             /* nothing happens in the interval but that a stop may be met */
    int32_t tries;          /* roots that are located in it */
    crossing_real crossing; /* of the function whose root is located, if one is */
    hopform_phase_real phases[PHASES_OF_LANE];
} lane;

typedef struct {
    const hopform_stances_in_real *in;
    const hopform_stances_out_real *out;
    int64_t next, last;
    int32_t kept;
    int32_t busy; /* lanes with a stance */
    lanes_code_real code;
    planned *plans;
    planned *runs[BLOCK_real]; /* what is planned ahead, */
    int32_t ahead;             /* so many of them, */
    int32_t run;               /* and the one whose stances are taken */
    poles_columns cubics;      /* of these */
    lane *stances;             /* in each lane */
    lanes_real w;
} batch;

/* ---- the search ---- */

/* The interval of a lane ends at t, where W is wanted. */
static int32_t reach_for(batch *b, int l, real t, bool quiet) {
    lane *one = &b->stances[l];
    one->quiet = quiet;
    one->tries = 0;
    one->crossing.function = -1;
    b->w.t[l] = t;
    b->w.wants[l] = 1.0;
    b->w.seeks[l] = 0.0;
    return WAITS;
}

/* Whether a lane seeks the root of a function of this shape or behind that has crossed zero in its interval. */
static bool seek_first(batch *b, int l, int32_t shape) {
    lane *one = &b->stances[l];
    lanes_real *w = &b->w;
    const event_set_real *set = &one->search.events.set;
    interval_real *in = &one->search.in;
    if (one->tries >= MOST_TRIES_real || !first_crossing_real(set, in, shape, &one->crossing)) {
        one->crossing.function = -1;
        return false;
    }
    one->tries++;
    const int32_t function = one->crossing.function;
    keep_function(&w->function, l, true, &set->function[function]);
    keep_jet(&w->from, l, true, &in->from[function]);
    keep_jet(&w->to, l, true, &in->to);
    w->share[l] = one->crossing.share;
    w->low[l] = in->low;
    w->high[l] = in->high.t;
    w->refines[l] = 1.0;
    w->seeks[l] = 1.0;
    w->wants[l] = 1.0;
    return true;
}

/* What follows from the end of an interval, as in stance_end_search, which takes over where the bound on intervals is
 * met: the ending of the stance, 0 if another phase follows. */
static int32_t end_interval(batch *b, int l) {
    lane *one = &b->stances[l];
    stance_search_real *search = &one->search;
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    const int32_t shape = one->quiet ? DISTANCE_real : MAY_TURN_real;
    bool certified = false;
    while (!certified && (one->quiet || in->count < HOPFORM_MOST_INTERVALS)) {
        if (seek_first(b, l, shape)) { return WAITS; }
        in->count += one->quiet ? 0 : 1;
        certified = one->quiet || are_certified_real(set, in);
        one->tries = 0; /* if it is not, the interval has been cut */
    }
    certified = certified && (one->quiet || find_event_real(&one->chain, search, true));
    if (certified && is_open_real(search)) {
        real end = search->limit;
        const bool quiet = next_end_real(set, in, search->limit, &end);
        return reach_for(b, l, end, quiet);
    }
    if (certified) {
        stance_conclude_real(search);
    } else {
        stance_end_search_real(&one->chain, search);
    }
    return stance_end_phase_real(&one->chain, search);
}

/* W at t is known, or a root has not been found soon, or the lane goes on alone. */
static int32_t arrive(batch *b, int l) {
    const lanes_real *w = &b->w;
    const lane *one = &b->stances[l];
    const event_set_real *set = &one->search.events.set;
    interval_real *in = &b->stances[l].search.in;
    if (!(fabs_real(w->wants[l]) > 0.0)) {
        const hopform_basis_real basis = one_basis(&w->basis, l);
        in->high = propagator_of_real(set->poles, w->t[l], &basis);
    } else if (one->crossing.function >= 0) {
        end_at_crossing_real(set, in, &one->crossing);
    } else {
        end_interval_at_real(set, in, w->t[l]);
    }
    in->found = one->crossing.function;
    return end_interval(b, l);
}

/* Begin a phase; the ending of the stance, if the phase has ended already. */
static int32_t begin_phase(batch *b, int l) {
    lane *one = &b->stances[l];
    stance_search_real *search = &one->search;
    const event_set_real *set = &search->events.set;
    stance_begin_phase_real(&one->chain);
    stance_begin_search_real(&one->chain, search);
    if (!search->open) {
        stance_end_search_real(&one->chain, search);
        return stance_end_phase_real(&one->chain, search);
    }
    keep_poles(&b->w.poles, l, true, set->poles);
    (void)reach_for(b, l, first_end_real(set, search->limit), false);
    if (set->node->t < search->limit && hopform_is_made_real(one->chain.plan)) {
        reach_ahead_real(set, &search->in, search->limit);
        b->w.wants[l] = 0.0;
        return end_interval(b, l);
    }
    return WAITS;
}

/* ---- stances in and out ---- */

/* Solve a stance by itself, or refuse it as its plan has been. */
static void solve_alone(batch *b, planned *of, int64_t i) {
    if (of->run.planned >= 0 && !hopform_is_made_real(&of->plan)) {
        of->run.planned = hopform_plan_init_real(&of->plan, &of->plan.robot);
    }
    const int32_t kept = hopform_solve_alone_real(&of->plan, of->run.planned, b->in, i, b->out);
    b->kept = kept > b->kept ? kept : b->kept;
}

/* The stance in a lane has come to its ending. */
static void put_out(batch *b, int l, int32_t ending) {
    lane *one = &b->stances[l];
    planned *of = one->planned;
    hopform_stance_real stance;
    const int32_t status = stance_report_real(&one->chain, &one->start, ending, &stance);
    if (status == HOPFORM_PHASES_NOT_KEPT && one->chain.capacity < hopform_phases_wanted_real(b->out)) {
        solve_alone(b, of, one->index);
    } else {
        const int32_t kept = hopform_put_stance_real(b->out, one->index, &of->plan.robot, status, &stance, one->phases);
        b->kept = kept > b->kept ? kept : b->kept;
    }
    of->users--;
    b->busy--;
    one->index = NO_STANCE;
}

/* Make the plans of some runs ahead, from stance i on. */
static void plan_ahead(batch *b, int64_t i) {
    b->ahead = 0;
    b->run = 0;
    for (int n = 0; n < PLANS && b->ahead < BLOCK_real && i < b->last; n++) {
        planned *one = &b->plans[n];
        if (one->users == 0) {
            one->plan.robot = hopform_robot_of_real(b->in, i);
            one->run.planned = rates_of_plan_real(&one->plan);
            one->run.end = hopform_end_of_run_real(b->in, i, b->last);
            one->several = one->run.end > i + 1;
            const hopform_rates_real *rates = &one->plan.rates;
            const hopform_poles_real cubic = {0.0, 0.0, 0.0, rates->s_1, rates->s_2, rates->s_3};
            keep_poles(&b->cubics, b->ahead, true, &cubic);
            b->runs[b->ahead++] = one;
            i = one->run.end;
        }
    }
    b->code.factor(&b->cubics);
    for (int n = 0; n < b->ahead; n++) {
        planned *one = b->runs[n];
        const hopform_poles_real both = one_poles(&b->cubics, n);
        if (one->run.planned >= 0) { one->run.planned = poles_of_plan_real(&one->plan, &both, one->several); }
    }
}

/* Put the next stance into a lane: its ending, if it has ended already. One that is refused is solved by itself, which
 * says why. */
static int32_t take(batch *b, int l) {
    lane *one = &b->stances[l];
    const int64_t i = b->next++;
    if (b->ahead == 0 || i == b->runs[b->run]->run.end) {
        b->run++;
        if (b->run >= b->ahead) { plan_ahead(b, i); }
    }
    planned *of = b->runs[b->run];
    const hopform_plan_real *plan = &of->plan;
    const real horizon = hopform_number_real(&b->in->horizon, i);
    const int32_t wanted = hopform_phases_wanted_real(b->out);
    one->start = hopform_start_of_real(b->in, i);
    one->step.t = 0.0;
    one->step.u = hopform_number_real(&b->in->u, i);
    if (of->run.planned < 0 || stance_status_real(&plan->robot, &one->start, horizon, b->in->max_phases) < 0
        || !hopform_is_finite_real(one->step.u)) {
        solve_alone(b, of, i);
        return HOPFORM_ENDING_REST;
    }
    one->index = i;
    one->planned = of;
    of->users++;
    b->busy++;
    stance_start_real(&one->chain, plan, &one->start, &one->step, 1, horizon, b->in->max_phases, one->phases,
                      wanted < PHASES_OF_LANE ? wanted : PHASES_OF_LANE);
    return stance_begin_real(&one->chain);
}

/* A lane goes on until it waits, or no stance is left. */
static void go_on(batch *b, int l, int32_t ending) {
    while (ending != WAITS) {
        if (ending == 0) {
            ending = begin_phase(b, l);
            continue;
        }
        if (b->stances[l].index != NO_STANCE) { put_out(b, l, ending); }
        if (b->next >= b->last) { return; }
        ending = take(b, l);
    }
}

int32_t hopform_solve_in_lanes_real(lanes_code_real code, int64_t count, const hopform_stances_in_real *in,
                                    const hopform_stances_out_real *out) {
    lane stances[LANES_real];
    planned plans[PLANS] = {{.users = 0}};
    batch b = {.in = in, .out = out, .last = count, .code = code, .plans = plans, .stances = stances};
    for (int l = 0; l < LANES_real; l++) {
        stances[l].index = NO_STANCE;
        go_on(&b, l, HOPFORM_ENDING_REST);
    }
    while (b.busy > FEW || b.next < b.last) {
        code.evaluate(&b.w);
        for (int l = 0; l < LANES_real; l++) {
            if (stances[l].index != NO_STANCE && !(b.w.wants[l] > 0.0)) { go_on(&b, l, arrive(&b, l)); }
        }
    }
    for (int l = 0; l < LANES_real; l++) {
        while (stances[l].index != NO_STANCE) {
            go_on(&b, l, arrive(&b, l));
        }
    }
    return b.kept;
}
