/* SPDX-License-Identifier: MIT-0
 *
 * A mechanism as an FMU: FMI 3.0 co-simulation with Event Mode, over the engine in double precision. This file is the
 * same for every solver; model.h has what it needs of one: how many values of each kind, their starts, the words of a
 * refusal.
 *
 * Between two changes of its input a motion is solved ahead, exactly, by a tick of a plant, hopform_plant_step, and is
 * read where the importer steps to: communication steps are no steps of a method. In Event Mode a step returns early at
 * each event, at its time, with the values before it; fmi3UpdateDiscreteStates brings those behind it and the time of
 * the next one. An input counts from where it is set until it is set again.
#if HOPFORM_HAS_CONTACT
 * A take-off is followed by the flight to the ground ahead, with the gains of the return, and that by the next stance.
#endif
 *
 * Bounds. PHASES phases, or LONGEST seconds, are solved ahead at a time. A step passes at most MOST_PHASES
 * phases, then it answers fmi3Error; so does a phase whose first event the engine does not certify. Memory is allocated
 * with an instance, and with a state of one that the importer keeps; nowhere else.
 */
#include "fmi3Functions.h"
#include "hopform_real.c" /* as one unit: private functions of a plant are called, nothing but fmi3... is exported */
#include "model.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PHASES = 64, ROOM = PHASES + 2, MOST_PHASES = 100000, TEXT = 512 };

#define LONGEST 1000.0

/* Value references: numbers first, codes behind them. */
enum {
    TIME,
    COORDINATE,
    FORCE = COORDINATE + COORDINATES,
    ENERGY = FORCE + FORCES,
    NEXT_EVENT = ENERGY + ENERGIES,
    INPUT,
#if HOPFORM_HAS_CONTACT
    GROUND = INPUT + INPUTS,
    GAIN,
    PARAMETER = GAIN + 2,
#else
    PARAMETER = INPUT + INPUTS,
#endif
    VALUES = PARAMETER + PARAMETERS,
    MODE = VALUES,
    LIMIT = MODE + MASSES,
    EVENT = LIMIT + HAS_LIMIT,
    EVENTS,
#if HOPFORM_HAS_CONTACT
    CONTACT,
    DESIGNED,
#endif
    ALL
};

/* The first value by which a motion is another one even where its input is the same, and the first that may be refused
 * when it is taken. */
#if HOPFORM_HAS_CONTACT
enum { FIRST_OF_ROBOT = GAIN, FIRST_SETTING = GROUND };
#else
enum { FIRST_OF_ROBOT = PARAMETER, FIRST_SETTING = PARAMETER };
#endif

/* Where an instance is in its life. */
typedef enum { INSTANTIATED, INITIALIZING, IN_EVENTS, STEPPING, TERMINATED } Life;

typedef struct {
    real value[VALUES];
    int32_t code[ALL - VALUES];
    real taken[VALUES]; /* values that count, while others are set */
    Life life;
    real t;                   /* [s] now */
    real stop;                /* [s] INFINITY if the importer has none */
    real from;                /* [s] when the motion that is solved begins */
    real span;                /* [s] for which it is solved at most */
    real u;                   /* the input under which */
    hopform_plant_real plant; /* where it begins */
    hopform_plant_real ahead; /* where it ends */
    hopform_phase_real phases[ROOM];
    hopform_stance_real stance;
    int32_t index;  /* of the phase at t */
    int32_t passed; /* events since `from` */
#if HOPFORM_HAS_CONTACT
    hopform_state_real takeoff; /* where the flight begins */
    hopform_flight_phase_real flown[ROOM];
    hopform_flight_real flight;
    real under; /* [m] height of the ground that was left, or is stood on */
    real left;  /* [m] the same; of a flight that began in the air, height of the foot there */
    bool flies;
    bool trips; /* the foot does not get above the ground ahead: no more happens */
    bool ground_changed;
    int32_t taken_designed;
#endif
    bool solved; /* else the motion goes on from where it was put at t */
    bool robot_changed, input_changed;
    bool at_event;          /* an event is reached, and not passed yet */
    bool event_mode, early; /* as instantiated; kept by a reset and by a state that is set, as the next two */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Model;

/* A robot, a start, forces and energies are read and written as arrays of their members. */
typedef char members_are_numbers[sizeof(hopform_robot_real) == PARAMETERS * sizeof(real)
                                         && sizeof(hopform_start_real) == COORDINATES * sizeof(real)
                                         && sizeof(hopform_forces_real) == FORCES * sizeof(real)
                                         && sizeof(hopform_energy_real) == ALL_ENERGIES * sizeof(real)
                                     ? 1
                                     : -1];

/* ---- what is said of a refusal ---- */

static void say(const Model *m, fmi3Status status, const char *text) {
    if (m->log != NULL) { m->log(m->environment, status, "logStatusError", text); }
}

static fmi3Status refuse(const Model *m, const char *format, ...) {
    char text[TEXT];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    say(m, fmi3Error, text);
    return fmi3Error;
}

/* The shortest decimal number that reads back as this one, as Python's repr writes it. */
static const char *shown(real value, char text[32]) {
    if (isnan(value)) { return "nan"; }
    if (isinf(value)) { return value < 0.0 ? "-inf" : "inf"; }
    int digits = 1;
    do {
        snprintf(text, 32, "%.*e", digits - 1, value);
    } while (strtod(text, NULL) != value && ++digits <= 17);
    char *e = strchr(text, 'e');
    const int exponent = atoi(e + 1);
    if (exponent >= -4 && exponent < 16) {
        snprintf(text, 32, "%.*f", digits - 1 - exponent > 1 ? digits - 1 - exponent : 1, value);
    } else {
        snprintf(e, (size_t)(text + 32 - e), "e%+03d", exponent);
    }
    return text;
}

/* Whether a number lies in the domain of a parameter; else its name, what is allowed and the number are said. */
static fmi3Status check_parameter(const Model *m, int n, real value) {
    const Parameter *p = &parameter[n];
    const bool above = p->with_low ? value >= p->low : value > p->low;
    const bool below = p->with_high ? value <= p->high : value < p->high;
    if (above && below) { return fmi3OK; }
    char text[32];
    return refuse(m, "%s must be %s%s, got %s", p->name, p->allowed, p->unit, shown(value, text));
}

/* Whether a position that is started from lies within its stops, of which there may be but one. */
static fmi3Status check_position(const Model *m, real below, real above) {
    const real position = m->value[COORDINATE];
    const char *name = name_of[COORDINATE];
    char low[32];
    char high[32];
    char text[32];
    const char *got = shown(position, text);
    if (position >= below && position <= above) { return fmi3OK; }
    if (!(below > -INFINITY)) {
        return refuse(m, "%s must be <= %s %s, its upper stop, got %s", name, shown(above, high), UNIT_OF_STOPS, got);
    }
    if (!(above < INFINITY)) {
        return refuse(m, "%s must be >= %s %s, its lower stop, got %s", name, shown(below, low), UNIT_OF_STOPS, got);
    }
    return refuse(m, "%s must be within its stroke %s .. %s %s, got %s", name, shown(below, low), shown(above, high),
                  UNIT_OF_STOPS, got);
}

/* Why a plan, a start or a motion is refused, where no single number is out of its domain. */
static fmi3Status refuse_status(const Model *m, int32_t status, const hopform_robot_real *robot) {
    char low[32];
    char high[32];
    const real below = lower_stop_real(robot);
    const real above = upper_stop_real(robot);
    if (status == HOPFORM_ERROR_ROBOT && !(below <= above)) {
        return refuse(m, "%s must be <= %s %s, got %s > %s", LOWER_STOP, UPPER_STOP, UNIT_OF_STOPS, shown(below, low),
                      shown(above, high));
    }
    if (status == HOPFORM_ERROR_ROBOT && HOPFORM_REST_MAY_LACK) {
        const excess_real more = excess_of_real(robot);
        const real least = fmin(fmin(more.up_1, more.down_1), fmin(more.up_2, more.down_2));
        return refuse(m, "friction at rest must not be less than that in motion, over the inertia it is by %s",
                      shown(-least, low));
    }
    if (status == HOPFORM_ERROR_STATE && STOPS_HOLD_FIRST) {
        const fmi3Status placed = check_position(m, below, above);
        if (placed != fmi3OK) { return placed; }
    }
    for (size_t n = 0; n < sizeof refusals / sizeof refusals[0]; n++) {
        if (refusals[n].status == status) { return refuse(m, "%s", refusals[n].meaning); }
    }
    return refuse(m, "refused with the status %d", (int)status);
}

static hopform_robot_real robot_of(const real *values) {
    hopform_robot_real robot;
    memcpy(&robot, values + PARAMETER, sizeof robot);
    return robot;
}

/* ---- a motion, solved ahead ---- */

/* What comes next: when, which event, or 0, and whether the motion that is solved ends with it. */
typedef struct {
    real t;
    int event;
    bool ends;
} Next;

static int event_or_none(int event) {
    return HOPFORM_IS_EVENT(event) ? event : 0;
}

static Next next_of_stance(const Model *m, int32_t index) {
    const Next never = {INFINITY, 0, false};
    const hopform_stance_real *s = &m->stance;
    if (index + 1 < s->phases_kept) {
        const hopform_phase_real *phase = &m->phases[index + 1];
        const Next next = {m->from + phase->t, event_or_none(phase->event), false};
        return next;
    }
    if (s->ending == HOPFORM_ENDING_REST) { return never; }
    Next end = {m->from + s->duration, 0, true};
    if (s->ending == HOPFORM_ENDING_TOO_MANY_PHASES) { end.event = event_or_none(m->phases[s->phases_kept].event); }
#if HOPFORM_HAS_CONTACT
    if (s->ending == HOPFORM_ENDING_TAKEOFF) { end.event = EVENT_TAKEOFF; }
#endif
    return end;
}

#if HOPFORM_HAS_CONTACT
static Next next_of_flight(const Model *m, int32_t index) {
    if (index + 1 < m->flight.phases_kept) {
        const hopform_flight_phase_real *phase = &m->flown[index + 1];
        const Next next = {m->from + phase->t, phase->event, false};
        return next;
    }
    const Next end = {m->from + m->flight.duration, EVENT_TOUCHDOWN, true};
    return end;
}
#endif

/* What comes behind a phase of the motion. */
static Next next_of(const Model *m, int32_t index) {
#if HOPFORM_HAS_CONTACT
    if (m->flies) { return next_of_flight(m, index); }
#endif
    return next_of_stance(m, index);
}

/* Whether nothing more can be simulated. */
static bool is_over(const Model *m) {
#if HOPFORM_HAS_CONTACT
    return m->trips;
#else
    (void)m;
    return false;
#endif
}

static void count_event(Model *m, int event) {
    if (event != 0) {
        m->code[EVENT - VALUES] = event;
        m->code[EVENTS - VALUES]++;
        m->passed++;
    }
}

#if HOPFORM_HAS_CONTACT
/* The flight from its take-off to the ground ahead, and the phase of it at t. Its motion does not depend on the ground
 * ahead, its end does. */
static fmi3Status solve_flight(Model *m) {
    const hopform_gains_real gains = {m->value[GAIN], m->value[GAIN + 1]};
    const real ground = m->value[GROUND] - m->left;
    hopform_flight_real flight;
    const int32_t status =
        hopform_solve_flight_real(&m->plant.plan, &m->takeoff, ground, m->code[DESIGNED - VALUES] != 0 ? NULL : &gains,
                                  LONGEST, PHASES, m->flown, ROOM, &flight);
    if (status < 0) { return refuse_status(m, status, &m->plant.plan.robot); }
    if (flight.ending != HOPFORM_FLIGHT_TOUCHDOWN && flight.ending != HOPFORM_FLIGHT_TRIPPED) {
        return refuse(m, "no touchdown within %g s and %d phases of flight", LONGEST, PHASES);
    }
    if (m->t > m->from && !(m->from + flight.duration > m->t)) {
        return refuse(m, "%s must be below the foot in flight", name_of[GROUND]);
    }
    m->flight = flight;
    m->index = 0;
    while (m->index + 1 < flight.phases_kept && m->from + m->flown[m->index + 1].t <= m->t) {
        m->index++;
    }
    return fmi3OK;
}
#endif

/* The motion from the plant on, for `least` seconds at the least, or LONGEST. */
static fmi3Status solve_stance(Model *m, real least) {
    const real left = m->stop - m->t;
    m->span = left > least ? left : least;
    m->span = m->span > 0.0 && m->span < LONGEST ? m->span : LONGEST;
    m->u = INPUTS > 0 ? m->value[INPUT] : 0.0;
    m->ahead = m->plant;
    hopform_report_real report;
    report.phases = m->phases;
    report.capacity = ROOM;
    const int32_t status = tick_real(&m->ahead, m->u, m->span, PHASES, &report);
    if (status < 0) { return refuse_status(m, status, &m->plant.plan.robot); }
    const hopform_stance_real none = {0};
    hopform_stance_real *s = &m->stance;
    *s = none;
    s->end = m->ahead.state;
    s->ending = report.ending;
    s->phase_count = report.count;
    s->phases_kept = report.count;
    s->event_count = report.event_count;
    s->duration = report.ending == HOPFORM_ENDING_REST ? m->phases[report.count - 1].t : report.duration;
    if (report.ending == HOPFORM_ENDING_UNCERTIFIED && !(report.duration > 0.0)) {
        return refuse(m, "the first event is not certified within the bound of a search");
    }
    m->index = 0;
    count_event(m, event_or_none(m->phases[0].event));
    while (m->index + 1 < s->phases_kept && !(m->phases[m->index + 1].t > 0.0)) { /* both slip at once */
        count_event(m, event_or_none(m->phases[++m->index].event));
    }
    return fmi3OK;
}

static fmi3Status solve(Model *m, real least) {
    if (m->solved) { return fmi3OK; }
    m->from = m->t;
    m->passed = 0;
    fmi3Status status = fmi3OK;
#if HOPFORM_HAS_CONTACT
    status = m->flies ? solve_flight(m) : solve_stance(m, least);
#else
    status = solve_stance(m, least);
#endif
    m->solved = status == fmi3OK;
    return status;
}

/* Pass what comes next. */
static fmi3Status pass(Model *m, const Next *next) {
    m->t = next->t;
    if (!next->ends) {
        m->index++;
        count_event(m, next->event);
        return fmi3OK;
    }
#if HOPFORM_HAS_CONTACT
    if (m->flies && m->flight.ending == HOPFORM_FLIGHT_TRIPPED) {
        m->trips = true;
        say(m, fmi3Warning, "the foot does not get above the ground ahead");
        return fmi3OK;
    }
    if (m->flies) {
        hopform_state_real state = m->flight.end;
        state.v2 = m->flight.v2_after;
        begin_at_real(&m->plant, &state);
        m->left += m->flight.ground;
        m->under = m->left;
    } else {
        m->plant = m->ahead;
        m->takeoff = m->ahead.state;
    }
    m->flies = m->flies ? false : next->event == EVENT_TAKEOFF;
#else
    m->plant = m->ahead;
#endif
    m->solved = false;
    count_event(m, next->event);
    return solve(m, 0.0);
}

/* Put the plant to where the motion is now: behind the event at t, if one has just been passed.
#if HOPFORM_HAS_CONTACT
 * In flight the next flight begins here.
#endif
 */
static fmi3Status settle(Model *m) {
    if (!m->solved) { return fmi3OK; }
    m->solved = false;
    const real dt = m->t - m->from;
#if HOPFORM_HAS_CONTACT
    if (m->flies) {
        if (HOPFORM_FLIGHT_HAS_DECAY) {
            m->solved = true;
            return refuse(m, "no parameter can be changed in flight while the damper of the leg relaxes");
        }
        if (!(dt > 0.0)) { return fmi3OK; }
        const int32_t read = hopform_flight_at_real(&m->plant.plan, m->flown, &m->flight, &dt, 1, &m->takeoff);
        m->takeoff.y -= m->flight.ground;
        return read < 0 ? refuse_status(m, read, &m->plant.plan.robot) : fmi3OK;
    }
#endif
    if (!(dt > 0.0)) { return fmi3OK; }
    const bool behind_event = m->index > 0 && m->from + m->phases[m->index].t >= m->t;
    hopform_report_real report;
    report.phases = NULL;
    report.capacity = 0;
    const int32_t status = behind_event ? tick_real(&m->plant, m->u, m->span, m->index, &report)
                                        : tick_real(&m->plant, m->u, dt, HOPFORM_TICK_PHASES, &report);
    if (status < 0) { return refuse_status(m, status, &m->plant.plan.robot); }
    /* an event within the rounding of t has been passed here and not there, or there and not here */
    if (!behind_event) { m->code[EVENTS - VALUES] += report.event_count - m->passed; }
    return fmi3OK;
}

/* ---- what is shown ---- */

static void show_state(Model *m, const hopform_state_real *state) {
    const hopform_start_real start = start_of_state_real(&m->plant.plan.robot, state);
    memcpy(m->value + COORDINATE, &start, sizeof start);
}

#if HOPFORM_HAS_CONTACT
/* A state of a flight, over the ground that was left. */
static void show_in_air(Model *m, const hopform_state_real *state) {
    hopform_state_real over = *state;
    over.y -= m->left - m->under;
    show_state(m, &over);
}
#endif

static void show_mode(Model *m, int mode) {
    for (int n = 0; n < MASSES; n++) {
        m->code[MODE - VALUES + n] = mass_of[n] == 0 ? mode / 3 - 1 : mode % 3 - 1;
    }
#if HAS_LIMIT
    m->code[LIMIT - VALUES] = mode % 3 - 1;
#endif
}

/* The values at t; `before`: those before the event there. */
static fmi3Status show_stance(Model *m, bool before) {
    const hopform_plan_real *plan = &m->plant.plan;
    const hopform_step_real step = {0.0, m->u};
    const bool inside = m->index + 1 < m->stance.phases_kept;
    const bool rests = !inside && m->stance.ending == HOPFORM_ENDING_REST;
    const real begin = m->phases[m->index].t;
    const real end = inside ? m->phases[m->index + 1].t : rests ? INFINITY : m->stance.duration;
    real since = before ? nextafter(end, -INFINITY) : m->t - m->from;
    since = since < end ? since : end;
    since = since > begin ? since : begin; /* rounding never leads back over an event */
    hopform_state_real state;
    int32_t status = before && inside
                         ? hopform_stance_before_real(plan, &step, m->phases, &m->stance, m->index + 1, &state)
                         : hopform_stance_at_real(plan, &step, m->phases, &m->stance, since, &state);
    if (inside && !(since < end)) { since = nextafter(end, -INFINITY) > begin ? nextafter(end, -INFINITY) : begin; }
#if FORCES > 0
    hopform_forces_real forces;
    if (status >= 0) {
        status = hopform_stance_forces_real(plan, &step, m->phases, &m->stance, &since, 1, &forces);
        memcpy(m->value + FORCE, &forces, sizeof forces);
    }
#endif
    real energy[ALL_ENERGIES];
    if (status >= 0) {
        hopform_energy_real energies;
        status = hopform_stance_energy_real(plan, &step, m->phases, &m->stance, &since, 1, &energies, NULL, NULL);
        memcpy(energy, &energies, sizeof energies);
        for (int n = 0; n < ENERGIES; n++) {
            m->value[ENERGY + n] = energy[energy_of[n]];
        }
    }
    if (status < 0) { return refuse_status(m, status, &plan->robot); }
    show_state(m, &state);
    show_mode(m, m->phases[m->index].mode);
    return fmi3OK;
}

#if HOPFORM_HAS_CONTACT
static fmi3Status show_flight(Model *m, bool before) {
    const hopform_plan_real *plan = &m->plant.plan;
    const Next next = next_of_flight(m, m->index);
    real since = before ? nextafter(next.t - m->from, -INFINITY) : m->t - m->from;
    since = since < m->flight.duration ? since : m->flight.duration;
    since = since > m->flown[m->index].t ? since : m->flown[m->index].t;
    hopform_state_real state;
    hopform_energy_real energies;
    hopform_flight_ledger_real ledger;
    real lost;
    int32_t status = hopform_flight_at_real(plan, m->flown, &m->flight, &since, 1, &state);
    if (status >= 0) {
        status = hopform_flight_energy_real(plan, m->flown, &m->flight, &since, 1, &energies, &ledger, &lost);
    }
    if (status < 0) { return refuse_status(m, status, &plan->robot); }
    state.y -= m->flight.ground;
    show_in_air(m, &state);
    real energy[ALL_ENERGIES];
    memcpy(energy, &energies, sizeof energies);
    for (int n = 0; n < ENERGIES; n++) {
        m->value[ENERGY + n] = energy[energy_of[n]];
    }
    for (int n = 0; n < FORCES; n++) {
        m->value[FORCE + n] = n == CONTACT_FORCE ? 0.0 : (real)NAN;
    }
    show_mode(m, 3 * (m->flown[m->index].side + 1) + (state.v2 < 0.0 ? 0 : 2));
    return fmi3OK;
}
#endif

/* When the next event of the motion is; INFINITY where none is ahead, as far as it is solved. */
static real next_event(const Model *m) {
    int32_t index = m->index;
    Next next = next_of(m, index);
    while (next.event == 0 && !next.ends && next.t < INFINITY) { /* a phase that no event begins */
        next = next_of(m, ++index);
    }
    return next.event != 0 ? next.t : (real)INFINITY;
}

static fmi3Status show(Model *m, bool before) {
    m->value[TIME] = m->t;
    m->value[NEXT_EVENT] = is_over(m) ? (real)INFINITY : next_event(m);
#if HOPFORM_HAS_CONTACT
    m->code[CONTACT - VALUES] = m->flies ? 0 : 1;
    if (m->flies) { return show_flight(m, before); }
#endif
    return show_stance(m, before);
}

/* ---- what the importer changes ---- */

/* A robot at coordinates: it stands, or is in the air. */
static fmi3Status place(Model *m) {
    const hopform_robot_real robot = robot_of(m->value);
    hopform_plan_real plan;
    const int32_t planned = hopform_plan_init_real(&plan, &robot);
    if (planned < 0) { return refuse_status(m, planned, &robot); }
    hopform_start_real start;
    memcpy(&start, m->value + COORDINATE, sizeof start);
#if HOPFORM_HAS_CONTACT
    const hopform_state_real state = state_from_start_real(&robot, &start);
    m->flies = m->flies || state.y < 0.0; /* in flight it may be below the ground that was left */
    if (m->flies) {                       /* from where the foot is, the leg relaxed */
        m->plant.plan = plan;
        m->takeoff = state;
        m->takeoff.y = 0.0;
        m->left = m->under - state.y;
        return fmi3OK;
    }
    m->left = m->under;
#endif
    const int32_t status = hopform_plant_begin_real(&m->plant, &robot, &start);
    return status < 0 ? refuse_status(m, status, &robot) : fmi3OK;
}

/* What is set counts from here on: a later refusal leads back to it. */
static void keep_settings(Model *m) {
    memcpy(m->taken, m->value, sizeof m->taken);
#if HOPFORM_HAS_CONTACT
    m->taken_designed = m->code[DESIGNED - VALUES];
#endif
}

static void restore_settings(Model *m) {
    memcpy(m->value + FIRST_SETTING, m->taken + FIRST_SETTING, (VALUES - FIRST_SETTING) * sizeof(real));
#if HOPFORM_HAS_CONTACT
    m->code[DESIGNED - VALUES] = m->taken_designed;
#endif
}

/* Continue as another robot, or to another ground ahead. */
static fmi3Status take_settings(Model *m, real least) {
    fmi3Status status = fmi3OK;
    if (m->robot_changed) {
#if HOPFORM_HAS_CONTACT
        if (m->flies) {
            show_in_air(m, &m->takeoff);
        } else {
            show_state(m, &m->plant.state);
        }
#else
        show_state(m, &m->plant.state);
#endif
        status = place(m);
    }
#if HOPFORM_HAS_CONTACT
    if (!m->robot_changed && m->solved && m->flies) { status = solve_flight(m); }
#endif
    return status == fmi3OK ? solve(m, least) : status;
}

/* Take what has been set since the last time. What is refused stays what it was, and the motion is as if it had not
 * been set. */
static fmi3Status take_changes(Model *m, real least) {
    fmi3Status status = fmi3OK;
#if HOPFORM_HAS_CONTACT
    const bool listens = !m->flies; /* to its input; in flight the law of the return sets that */
    const bool is_set = m->robot_changed || m->ground_changed;
#else
    const bool listens = true;
    const bool is_set = m->robot_changed;
#endif
    if (is_set) {
        const Model before = *m;
        if (m->robot_changed) { status = settle(m); }
        if (status == fmi3OK) { status = take_settings(m, least); }
        if (status == fmi3OK) {
            m->input_changed = m->input_changed && !m->robot_changed; /* taken with the robot */
            keep_settings(m);
        } else {
            *m = before;
            restore_settings(m);
        }
        m->robot_changed = false;
#if HOPFORM_HAS_CONTACT
        m->ground_changed = false;
#endif
    }
    fmi3Status moved = m->input_changed && listens ? settle(m) : fmi3OK;
    m->input_changed = false;
    if (moved == fmi3OK) { moved = solve(m, least); }
    return status == fmi3OK ? moved : status;
}

/* Pass all that happens at the time of the event that was reached. */
static fmi3Status pass_event(Model *m) {
    const real t = m->t;
    fmi3Status status = fmi3OK;
    while (m->at_event && status == fmi3OK) {
        const Next next = next_of(m, m->index);
        m->at_event = !is_over(m) && next.t <= t;
        if (m->at_event) { status = pass(m, &next); }
    }
    return status;
}

/* ---- FMI: stepping ---- */

static bool lives(Model *m, int states, const char *function, fmi3Status *status) {
    if ((states >> m->life & 1) != 0) { return true; }
    *status = refuse(m, "%s is not allowed here", function);
    return false;
}

#define REQUIRE(states)                                                                                                \
    Model *m = instance;                                                                                               \
    fmi3Status status = fmi3OK;                                                                                        \
    if (!lives(m, states, __func__, &status)) { return status; }

enum { ANY = 31, SETTABLE = 1 << INSTANTIATED | 1 << INITIALIZING | 1 << IN_EVENTS | 1 << STEPPING };

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    REQUIRE(1 << STEPPING)
    (void)noSetFMUStatePriorToCurrentPoint;
    const real target = currentCommunicationPoint + communicationStepSize;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = m->t;
    const real off = fabs(currentCommunicationPoint - m->t);
    if (!(communicationStepSize > 0.0) || !(target < INFINITY) || !(off <= 1e-9 * fmax(1.0, fabs(m->t)))) {
        char point[32];
        char size[32];
        char now[32];
        return refuse(m, "a step must begin at %s s, the time of the FMU, and be > 0 s long, got %s s from %s s",
                      shown(m->t, now), shown(communicationStepSize, size), shown(currentCommunicationPoint, point));
    }
    status = pass_event(m); /* which the importer has not */
    if (status == fmi3OK) { status = take_changes(m, target - m->t); }
    for (int32_t n = 0; n < MOST_PHASES && status == fmi3OK; n++) {
        const Next next = next_of(m, m->index);
        const bool reached = is_over(m) || !(next.event != 0 ? next.t <= target : next.t < target);
        if (reached || (next.event != 0 && m->event_mode && (m->early || !(next.t < target)))) {
            m->t = is_over(m) ? m->t : reached ? target : next.t;
            m->at_event = !reached;
            *eventHandlingNeeded = m->at_event;
            *earlyReturn = m->t < target;
            *terminateSimulation = is_over(m);
            *lastSuccessfulTime = m->t;
            return show(m, m->at_event);
        }
        status = pass(m, &next);
    }
    return status == fmi3OK ? refuse(m, "more than %d phases in a step", (int)MOST_PHASES) : status;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    REQUIRE(1 << IN_EVENTS)
    *discreteStatesNeedUpdate = *terminateSimulation = *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = *nextEventTimeDefined = fmi3False;
    status = pass_event(m);
    if (status == fmi3OK) { status = take_changes(m, 0.0); }
    if (status == fmi3OK) { status = show(m, false); }
    *terminateSimulation = is_over(m);
    *nextEventTimeDefined = m->value[NEXT_EVENT] < INFINITY;
    *nextEventTime = m->value[NEXT_EVENT];
    return status;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    REQUIRE(1 << INSTANTIATED)
    (void)toleranceDefined, (void)tolerance;
    if (!isfinite(startTime)) { return refuse(m, "the start time must be finite"); }
    m->t = startTime;
    m->stop = stopTimeDefined ? stopTime : (real)INFINITY;
    m->value[TIME] = startTime;
    m->life = INITIALIZING;
    return fmi3OK;
}

/* The start as it is set so far, so that what follows from it can be read. */
static fmi3Status initialize(Model *m) {
    m->solved = false;
    m->robot_changed = false;
    m->input_changed = false;
#if HOPFORM_HAS_CONTACT
    m->flies = false;
    m->under = 0.0;
    m->ground_changed = false;
#endif
    m->code[EVENT - VALUES] = 0;
    m->code[EVENTS - VALUES] = 0;
    real start[COORDINATES];
    memcpy(start, m->value + COORDINATE, sizeof start);
    fmi3Status status = place(m);
    if (status == fmi3OK) { status = solve(m, 0.0); }
    if (status == fmi3OK) { status = show(m, false); }
    keep_settings(m);
    if (m->life == INITIALIZING) { memcpy(m->value + COORDINATE, start, sizeof start); }
    return status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(1 << INITIALIZING)
    m->life = m->event_mode ? IN_EVENTS : STEPPING;
    status = initialize(m);
    m->life = status == fmi3OK ? m->life : TERMINATED;
    return status;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    REQUIRE(1 << STEPPING)
    if (!m->event_mode) { return refuse(m, "the FMU is instantiated without Event Mode"); }
    m->life = IN_EVENTS;
    return status;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(1 << IN_EVENTS)
    m->life = STEPPING;
    return status;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    REQUIRE(1 << IN_EVENTS | 1 << STEPPING)
    m->life = TERMINATED;
    return status;
}

/* ---- FMI: values ---- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    REQUIRE(ANY & ~(1 << INSTANTIATED))
    if (m->life == INITIALIZING) { status = initialize(m); }
    for (size_t n = 0; n < nValueReferences && status == fmi3OK; n++) {
        if (n >= nValues || valueReferences[n] >= VALUES) { return refuse(m, "no Float64 has this value reference"); }
        values[n] = m->value[valueReferences[n]];
    }
    return status;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    REQUIRE(SETTABLE)
    const bool begins = m->life == INSTANTIATED || m->life == INITIALIZING;
    for (size_t n = 0; n < nValueReferences; n++) { /* all of them, or none */
        const fmi3ValueReference which = valueReferences[n];
        if (n >= nValues || which >= VALUES) { return refuse(m, "no Float64 has this value reference"); }
        const bool is_coordinate = which >= COORDINATE && which < FORCE;
        if (which < COORDINATE || (which >= FORCE && which <= NEXT_EVENT) || (is_coordinate && !begins)) {
            return refuse(m, "%s cannot be set%s", name_of[which], is_coordinate ? " once a motion has begun" : "");
        }
        if (which >= PARAMETER) {
            status = check_parameter(m, (int)(which - PARAMETER), values[n]);
            if (status != fmi3OK) { return status; }
        } else if (!isfinite(values[n])) {
            char text[32];
            return refuse(m, "%s must be finite%s, got %s", name_of[which], unit_of[which], shown(values[n], text));
        }
#if HOPFORM_HAS_CONTACT
        if (which >= GAIN && which < PARAMETER && values[n] < 0.0) {
            char text[32];
            return refuse(m, "%s must be >= 0%s, got %s", name_of[which], unit_of[which], shown(values[n], text));
        }
#endif
    }
    for (size_t n = 0; n < nValueReferences; n++) { /* what has not changed leaves the motion as it is, to the bit */
        const fmi3ValueReference which = valueReferences[n];
        if (m->value[which] != values[n]) {
            m->value[which] = values[n];
            m->input_changed = m->input_changed || which < INPUT + INPUTS;
            m->robot_changed = m->robot_changed || which >= FIRST_OF_ROBOT;
#if HOPFORM_HAS_CONTACT
            m->ground_changed = m->ground_changed || which == GROUND;
#endif
        }
    }
    return fmi3OK;
}

static fmi3Status get_codes(Model *m, const fmi3ValueReference which[], size_t count, size_t room, int first, int end,
                            int32_t *codes, size_t n) {
    if (n >= room || n >= count || (int)which[n] < first || (int)which[n] >= end) {
        return refuse(m, "no variable of this type has this value reference");
    }
    *codes = m->code[which[n] - VALUES];
    return fmi3OK;
}

#define GETTER(Type, first, end)                                                                                       \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                        \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues) {                           \
        REQUIRE(ANY & ~(1 << INSTANTIATED))                                                                            \
        if (m->life == INITIALIZING) { status = initialize(m); }                                                       \
        for (size_t n = 0; n < nValueReferences && status == fmi3OK; n++) {                                            \
            int32_t code = 0;                                                                                          \
            status = get_codes(m, valueReferences, nValueReferences, nValues, first, end, &code, n);                   \
            values[n] = (fmi3##Type)code;                                                                              \
        }                                                                                                              \
        return status;                                                                                                 \
    }

GETTER(Int64, MODE, EVENTS) /* enumerations */
GETTER(Int32, EVENTS, EVENTS + 1)
GETTER(Boolean, EVENTS + 1, ALL)

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues) {
    REQUIRE(SETTABLE)
    for (size_t n = 0; n < nValueReferences; n++) {
#if HOPFORM_HAS_CONTACT
        if (n < nValues && valueReferences[n] == DESIGNED) {
            const int32_t code = values[n] ? 1 : 0;
            m->robot_changed = m->robot_changed || m->code[DESIGNED - VALUES] != code;
            m->code[DESIGNED - VALUES] = code;
            continue;
        }
#endif
        (void)valueReferences, (void)values, (void)nValues;
        return refuse(m, "no Boolean that can be set has this value reference");
    }
    return status;
}

/* ---- FMI: life of an instance ---- */

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

static void begin(Model *m) {
    Model fresh;
    memset(&fresh, 0, sizeof fresh);
    fresh.environment = m->environment;
    fresh.log = m->log;
    fresh.event_mode = m->event_mode;
    fresh.early = m->early;
    memcpy(fresh.value, start_of, sizeof start_of);
    fresh.value[NEXT_EVENT] = INFINITY;
#if HOPFORM_HAS_CONTACT
    fresh.code[DESIGNED - VALUES] = 1;
#endif
    *m = fresh;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)instanceName, (void)resourcePath, (void)visible, (void)loggingOn, (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    if (instantiationToken == NULL || strcmp(instantiationToken, TOKEN) != 0) {
        if (logMessage != NULL) {
            logMessage(instanceEnvironment, fmi3Error, "logStatusError", "the instantiation token is another one");
        }
        return NULL;
    }
    Model *m = calloc(1, sizeof *m);
    if (m != NULL) {
        m->environment = instanceEnvironment;
        m->log = logMessage;
        m->event_mode = eventModeUsed;
        m->early = earlyReturnAllowed;
        begin(m);
    }
    return m;
}

void fmi3FreeInstance(fmi3Instance instance) {
    free(instance);
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    begin(instance);
    return fmi3OK;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    (void)instance, (void)loggingOn, (void)nCategories, (void)categories; /* errors alone are said, always */
    return fmi3OK;
}

/* ---- FMI: the state of an instance, which has no pointer into itself ---- */

static void set_state(Model *m, const void *kept) {
    const Model now = *m;
    memcpy(m, kept, sizeof *m);
    m->environment = now.environment;
    m->log = now.log;
    m->event_mode = now.event_mode;
    m->early = now.early;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (*FMUState == NULL) { *FMUState = malloc(sizeof(Model)); }
    if (*FMUState == NULL) { return refuse(instance, "there is no memory for a state"); }
    memcpy(*FMUState, instance, sizeof(Model));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    if (FMUState == NULL) { return refuse(instance, "there is no state to set"); }
    set_state(instance, FMUState);
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    (void)instance;
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}

/* Behind the token, by which a state of another FMU is known. */
enum { SERIALIZED = sizeof TOKEN + sizeof(Model) };

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    (void)instance, (void)FMUState;
    *size = SERIALIZED;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    if (FMUState == NULL || size != SERIALIZED) { return refuse(instance, "a state takes %d bytes", (int)SERIALIZED); }
    Model kept = *(const Model *)FMUState;
    kept.environment = NULL; /* addresses are those of this process */
    kept.log = NULL;
    memcpy(serializedState, TOKEN, sizeof TOKEN);
    memcpy(serializedState + sizeof TOKEN, &kept, sizeof kept);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    if (size != SERIALIZED || memcmp(serializedState, TOKEN, sizeof TOKEN) != 0) {
        return refuse(instance, "these bytes are no state of this FMU");
    }
    const fmi3Status status = fmi3GetFMUState(instance, FMUState); /* for its memory */
    if (status == fmi3OK) { memcpy(*FMUState, serializedState + sizeof TOKEN, sizeof(Model)); }
    return status;
}

#include "absent.h"
