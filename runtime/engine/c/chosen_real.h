/* SPDX-License-Identifier: MIT-0
 *
 * By which inputs derivatives are wanted: columns of the model, inputs and times of steps.
 */
#ifndef HOPFORM_CHOSEN_H_real
#define HOPFORM_CHOSEN_H_real

#include <stdbool.h>

#include "hopform/hopform.h"

/* Columns by their codes; NULL stands for all that there are, in their order. */
typedef struct {
    const int32_t *codes;
    int32_t count;
} chosen_real;

enum { COLUMNS_real = HOPFORM_SENSITIVITY_COLUMNS };

static inline chosen_real chosen_of_real(const int32_t *codes, int32_t count, int32_t all) {
    const chosen_real chosen = {codes, codes != NULL ? count : all};
    return chosen;
}

static inline int32_t code_of_real(const chosen_real *chosen, int32_t column) {
    return chosen->codes != NULL ? chosen->codes[column] : column;
}

/* Whether each code is below a bound, and none is one that is no column; -1 where each is one. */
static inline bool are_columns_real(const chosen_real *chosen, int32_t bound, int32_t none) {
    bool sound = chosen->count >= 0;
    for (int32_t n = 0; chosen->codes != NULL && n < chosen->count; n++) {
        const int32_t code = chosen->codes[n];
        sound = sound && code >= 0 && code < bound && code != none;
    }
    return sound;
}

/* Whether they are columns of a stance: the first step has no time that moves. */
static inline bool are_of_stance_real(const chosen_real *chosen) {
    return are_columns_real(chosen, HOPFORM_COLUMN_OF_STEP(HOPFORM_MOST_STEPS), HOPFORM_COLUMN_OF_STEP_TIME(0));
}

#endif
