/* SPDX-License-Identifier: MIT-0
 *
 * Whether memory that a function writes holds some of what it reads.
 */
#include "overlap_real.h"

/* Addresses are compared as numbers, because C orders pointers within one object only; the difference wraps around
 * where the other range begins first. */
static bool overlap_meet_real(const hopform_memory_real *one, const hopform_memory_real *other)
{
    const uintptr_t from_one = (uintptr_t)one->first;
    const uintptr_t from_other = (uintptr_t)other->first;
    return from_one - from_other < other->size || from_other - from_one < one->size;
}

bool hopform_overlap_real(const hopform_memory_real *written, int written_count, const hopform_memory_real *read,
                          int read_count)
{
    bool overlap = false;
    for (int i = 0; i < written_count; i++) {
        for (int j = 0; j < read_count && written[i].size > 0; j++) {
            overlap = overlap || (read[j].size > 0 && overlap_meet_real(&written[i], &read[j]));
        }
    }
    return overlap;
}
