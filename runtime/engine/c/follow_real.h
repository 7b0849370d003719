/* SPDX-License-Identifier: MIT-0
 *
 * A stance that is followed phase by phase while it is solved: by the controller, which needs the change with the
 * current.
 */
#ifndef HOPFORM_FOLLOW_H_real
#define HOPFORM_FOLLOW_H_real

#include "phase_real.h"

/* A phase that has been solved, before the event that ends it. */
typedef struct {
    const hopform_numerators_real *motion;
    const hopform_basis_real *end; /* the propagator where it ends */
    real length;
    const hopform_state_by_axis_real *start;
    const hopform_state_by_axis_real *arrived;
    const int *side; /* of each element */
    int event;       /* with which it began */
} hopform_passage_real;

typedef struct hopform_tally_real hopform_tally_real;
typedef void hopform_follow_real(hopform_tally_real *tally, const hopform_passage_real *passage);

/* hopform_solve_stance of one current that shows every phase to `follow`; NULL for none. */
int32_t hopform_solve_followed_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                    const hopform_step_real *steps, int32_t step_count, real horizon,
                                    int32_t max_phases, hopform_phase_real *phases, int32_t capacity,
                                    hopform_stance_real *stance, hopform_follow_real *follow,
                                    hopform_tally_real *tally);

#endif
