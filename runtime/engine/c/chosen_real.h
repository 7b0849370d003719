/* SPDX-License-Identifier: MIT-0
 *
 * By which inputs derivatives are wanted: columns of the model, inputs and times of steps.
 */
#ifndef HOPFORM_CHOSEN_H_real
#define HOPFORM_CHOSEN_H_real

#include <stdbool.h>

#include "hopform/hopform.h"

/* Columns by their codes; NULL stands for all of the model, in their order. */
typedef struct {
    const int32_t *codes;
    int32_t count;
} chosen_real;

enum { COLUMNS_real = HOPFORM_SENSITIVITY_COLUMNS };

static inline chosen_real chosen_of_real(const int32_t *codes, int32_t count) {
    const chosen_real chosen = {codes, codes != NULL ? count : (int32_t)COLUMNS_real};
    return chosen;
}

static inline int32_t code_of_real(const chosen_real *chosen, int32_t column) {
    return chosen->codes != NULL ? chosen->codes[column] : column;
}

/* Whether each code is one of a column: the first step has no time that moves. */
static inline bool are_columns_real(const chosen_real *chosen) {
    bool sound = chosen->count >= 0;
    for (int32_t n = 0; chosen->codes != NULL && n < chosen->count; n++) {
        const int32_t code = chosen->codes[n];
        sound = sound && code >= 0 && code <= HOPFORM_COLUMN_OF_STEP_TIME(HOPFORM_MOST_STEPS - 1)
                && code != HOPFORM_COLUMN_OF_STEP_TIME(0);
    }
    return sound;
}

#endif
