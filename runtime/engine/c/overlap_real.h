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
} memory_real;

/* An array; NULL, or a count below 0, stands for none. */
static inline memory_real array_real(const void *first, int32_t count, size_t element) {
    const memory_real memory = {first, first != NULL && count > 0 ? (size_t)count * element : 0};
    return memory;
}

/* Whether a range that is written has a byte in common with one that is read. Addresses are compared as numbers,
 * because C orders pointers within one object only; the difference wraps around where the other range begins first. */
static bool overlap_real(const memory_real *written, int written_count, const memory_real *read, int read_count) {
    bool overlap = false;
    for (int i = 0; i < written_count; i++) {
        for (int j = 0; j < read_count && written[i].size > 0; j++) {
            const uintptr_t ahead = (uintptr_t)written[i].first - (uintptr_t)read[j].first;
            const uintptr_t behind = (uintptr_t)read[j].first - (uintptr_t)written[i].first;
            overlap = overlap || (read[j].size > 0 && (ahead < read[j].size || behind < written[i].size));
        }
    }
    return overlap;
}

/* The outputs of a refusal: zeros, but where one has a byte of what is read it stays as it is. Returns the status. */
static int32_t refuse_real(int32_t status, const memory_real *written, int written_count, const memory_real *read,
                           int read_count) {
    for (int n = 0; n < written_count; n++) {
        unsigned char *bytes = (unsigned char *)(uintptr_t)written[n].first; /* the caller's, who may write there */
        const bool is_input = overlap_real(&written[n], 1, read, read_count);
        for (size_t i = 0; !is_input && i < written[n].size; i++) {
            bytes[i] = 0;
        }
    }
    return status;
}

#endif
