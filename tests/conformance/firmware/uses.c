/* Keeps functions of the library in an image, to see what they take of the flash: -DUSES=0 none, 1 a stance and its
 * states, 2 with the controller, 3 with the flight that it begins in, 4 with energies, grids and the rest, 5 with
 * sensitivities, 6 with the selftest; of a model without a contact, -DMOTION, 1 a motion and its states, 2 with a
 * plant. */
#include "board.h"
#include "hopform/hopform.h"

typedef void (*function)(void);

function volatile keep;

int main(void)
{
#ifdef MOTION
#if USES >= 1
    keep = (function)hopform_plan_init_f32;
    keep = (function)hopform_solve_motion_f32;
    keep = (function)hopform_motion_at_f32;
#endif
#if USES >= 2
    keep = (function)hopform_plant_begin_f32;
    keep = (function)hopform_plant_step_f32;
#endif
#else
#if USES >= 1
    keep = (function)hopform_plan_init_f32;
    keep = (function)hopform_solve_stance_f32;
    keep = (function)hopform_stance_at_f32;
#endif
#if USES >= 2
    keep = (function)hopform_choose_current_f32;
    keep = (function)hopform_choose_current_begin_f32;
    keep = (function)hopform_choose_current_near_f32;
    keep = (function)hopform_choose_current_step_f32;
#endif
#if USES >= 3
    keep = (function)hopform_solve_flight_f32;
#endif
#if USES >= 4
    keep = (function)hopform_stance_energy_f32;
    keep = (function)hopform_stance_compression_f32;
    keep = (function)hopform_stance_states_f32;
    keep = (function)hopform_stance_grid_f32;
    keep = (function)hopform_try_currents_f32;
    keep = (function)hopform_design_return_f32;
    keep = (function)hopform_flight_at_f32;
    keep = (function)hopform_flight_energy_f32;
    keep = (function)hopform_touchdown_f32;
    keep = (function)hopform_layout;
    keep = (function)hopform_source;
#endif
#if USES >= 5
    keep = (function)hopform_stance_sensitivities_f32;
#endif
#if USES >= 6
    keep = (function)hopform_selftest_f32;
#endif
#endif
    board_exit(0);
    return 0;
}
