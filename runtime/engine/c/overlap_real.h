/* SPDX-License-Identifier: MIT-0
 *
 * Whether memory that a function writes holds some of what it reads, and what a refusal writes.
 */
#ifndef HOPFORM_OVERLAP_H_real
#define HOPFORM_OVERLAP_H_real

#include <stdbool.h>

#include "hopform/hopform.h"

/* A range of memory; a size of 0 stands for none. */
typedef struct {
    const void *first;
    size_t size;
} hopform_memory_real;

/* Times at which a stance is read, which do not decrease if they are in order. */
typedef struct {
    const real *at;
    int32_t count;
    bool in_order;
} hopform_times_real;

/* An array; a count below 0 stands for none. */
static inline hopform_memory_real hopform_array_real(const void *first, int32_t count, size_t element) {
    const hopform_memory_real memory = {first, count > 0 ? (size_t)count * element : 0};
    return memory;
}

/* Whether a range that is written has a byte in common with one that is read. */
bool hopform_overlap_real(const hopform_memory_real *written, int written_count, const hopform_memory_real *read,
                          int read_count);

/* The output of a refusal: zeros, in the arrays that are given; the status. */
int32_t hopform_refuse_real(int32_t status, const hopform_memory_real *written, int count);

#endif
