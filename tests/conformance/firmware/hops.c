/* A robot that hops on bare metal: the plant in one task, the library as its controller in another, at 1 kHz.
 *
 * At take-off the controller asks for the flight, which says in which state the leg will touch down, and begins to look
 * for the current of the next stance; each tick then solves one stance more. At touchdown that current is switched on.
 * The plant knows nothing of the closed form: it integrates the equations of motion (3), (4) with a small step.
 */
#include <stdbool.h>
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

enum { CAPACITY = 32, SUBSTEPS = 50, HOPS = 12 };

static const hopform_robot_f32 robot = {25.0f, 3.0f, 1200.0f, 0.4f, 0.0f, 150.0f, 5.0f, 0.78f,
                                        0.6f,  -65.0f, 9.81f,  0.0f, 0.08f, 3.0f,   0.05f, 0.0f, 0.0f};
static const float wanted[HOPS] = {0.15f, 0.15f, 0.12f, 0.1f, 0.12f, 0.15f, 0.18f, 0.2f, 0.17f, 0.14f, 0.11f, 0.12f};

/* ---- the plant ---- */

typedef struct {
    float x1, v1, x2, v2;
    bool stance;
    float apex; /* hop height of the highest point since take-off */
} plant;

static float sign_of(float value)
{
    return value > 0.0f ? 1.0f : (value < 0.0f ? -1.0f : 0.0f);
}

/* A velocity after h, under a free acceleration and Coulomb friction, which stops a mass but never pulls it back. */
static float velocity_after(float v, float acceleration, float friction, float h)
{
    if (v > 0.0f || v < 0.0f) {
        const float next = v + h * (acceleration - friction * sign_of(v));
        return next * v < 0.0f ? 0.0f : next;
    }
    const float size = acceleration < 0.0f ? -acceleration : acceleration;
    return size > friction ? h * (acceleration - friction * sign_of(acceleration)) : 0.0f;
}

static void move(plant *p, float u, float h)
{
    const hopform_robot_f32 *r = &robot;
    const float y = p->x1 - p->x2 + r->L0 + r->c;
    const float force = p->stance ? r->k * y : 0.0f;
    const float on_1 = (p->stance ? -force + r->k * r->c : r->k * r->c) - r->b1 * p->v1 - r->gamma2 * u;
    const float v1 = velocity_after(p->v1, on_1 / r->m_eff, r->f1, h);
    const float v2 =
        p->stance ? velocity_after(p->v2, (force - r->b2 * p->v2) / r->m_s - r->g, r->f2, h) : p->v2 - h * r->g;
    p->x1 += 0.5f * h * (p->v1 + v1);
    p->x2 += 0.5f * h * (p->v2 + v2);
    p->v1 = v1;
    p->v2 = v2;
    if (p->x1 < r->x1_min || p->x1 > r->x1_max) {
        p->x1 = p->x1 < r->x1_min ? r->x1_min : r->x1_max;
        p->v1 = 0.0f;
    }
}

/* ---- the controller ---- */

typedef struct {
    hopform_plan_f32 plan;
    hopform_search_f32 search;
    hopform_phase_f32 phases[CAPACITY];
    hopform_flight_phase_f32 flight_phases[CAPACITY];
    hopform_flight_f32 flight;
    hopform_command_f32 command;
    int32_t most_ticks;
    int32_t ticks;
} controller;

static controller control;

static bool at_takeoff(controller *c, const plant *p, float h_des)
{
    const hopform_state_f32 here = {p->x1, p->v1, p->v2, 0.0f};
    if (hopform_solve_flight_f32(&c->plan, &here, 0, NULL, 2.0f, CAPACITY, c->flight_phases, CAPACITY, &c->flight)
        != HOPFORM_OK) {
        return false;
    }
    const hopform_state_f32 touchdown = {c->flight.end.x1, c->flight.end.v1, c->flight.v2_after, 0.0f};
    const hopform_target_f32 target = {h_des, 0.0f, 0.001f, 2.0f, 0, 0};
    c->ticks = 0;
    return hopform_choose_current_begin_f32(&c->search, &c->plan, &touchdown, &target, &c->command)
           == HOPFORM_SEARCHING;
}

/* What the current is to be, one piece of work a tick. */
static float tick(controller *c, const plant *p)
{
    if (c->search.status == HOPFORM_SEARCHING && c->ticks++ >= 0) {
        (void)hopform_choose_current_step_f32(&c->search, c->phases, CAPACITY, &c->command);
        c->most_ticks = c->ticks > c->most_ticks ? c->ticks : c->most_ticks;
    }
    if (p->stance) {
        return c->command.u;
    }
    const float law = (c->flight.gains.Kp * p->x1 + c->flight.gains.Kd * p->v1) / robot.gamma2;
    return law > robot.u_max ? robot.u_max : (law < -robot.u_max ? -robot.u_max : law);
}

/* ---- both ---- */

int main(void)
{
    plant p = {0.0f, 0.0f, 0.4f, 1.7155174f, false, 0.0f}; /* thrown up by 15 cm */
    int hop = -1;
    int wrong = hopform_plan_init_f32(&control.plan, &robot) != HOPFORM_OK;
    wrong += !at_takeoff(&control, &p, wanted[0]);
    for (int32_t millisecond = 0; hop < HOPS && millisecond < 20000 && wrong == 0; millisecond++) {
        const float u = tick(&control, &p);
        for (int n = 0; n < SUBSTEPS && hop < HOPS; n++) {
            move(&p, p.stance ? control.command.u : u, 0.001f / (float)SUBSTEPS);
            const float foot = p.x2 - p.x1 - robot.L0 - robot.c;
            p.apex = p.x2 - robot.L0 > p.apex ? p.x2 - robot.L0 : p.apex;
            if (!p.stance && foot <= 0.0f && p.v2 < p.v1) {
                if (hop >= 0) {
                    const float off = p.apex - wanted[hop];
                    board_text("hop ");
                    board_number(hop + 1);
                    board_text(": wanted ");
                    board_number((int32_t)(wanted[hop] * 1e4f + 0.5f));
                    board_text(", reached ");
                    board_number((int32_t)(p.apex * 1e4f + 0.5f));
                    board_text(" (0.1 mm)\n");
                    wrong += !(off < 0.002f && off > -0.002f);
                }
                wrong += control.search.status == HOPFORM_SEARCHING;
                p.stance = true;
                p.v2 *= 0.97467943f; /* sqrt(1 - impact_loss) */
                hop++;
            } else if (p.stance && foot >= 0.0f && p.v2 > p.v1) {
                p.stance = false;
                p.apex = 0.0f;
                wrong += !at_takeoff(&control, &p, wanted[hop + 1 < HOPS ? hop + 1 : HOPS - 1]);
            }
        }
    }
    board_number(hop);
    board_text(" hops, at most ");
    board_number(control.most_ticks);
    board_text(" ticks for a current, wrong ");
    board_number(wrong);
    board_text("\n");
    board_exit(wrong > 0 || hop < HOPS);
    return wrong;
}
