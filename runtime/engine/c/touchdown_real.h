/* SPDX-License-Identifier: MIT-0
 *
 * Touchdown and take-off from a noisy signal of contact: two thresholds, then a number of samples in a row.
 */
#ifndef HOPFORM_TOUCHDOWN_H_real
#define HOPFORM_TOUCHDOWN_H_real

#include <stdbool.h>

#include "kernels_real.h"

/* Take one sample; HOPFORM_CONTACT_TOUCHDOWN or HOPFORM_CONTACT_TAKEOFF where it detects one, else 0. A run in
 * the contact that is not in 1 .. count - 1 counts as 0. A refusal does not change the contact. */
int32_t hopform_touchdown_real(const hopform_detector_real *detector, hopform_contact_real *contact, real sample) {
    if (detector == NULL || contact == NULL) { return HOPFORM_ERROR_NULL; }
    const int32_t count = detector->count; /* read before the contact, in which the detector may lie, is written */
    if (!(detector->low <= detector->high && is_finite_real(detector->low) && is_finite_real(detector->high))
        || count < 1 || !is_finite_real(sample)) {
        return HOPFORM_ERROR_DETECTOR;
    }
    const bool above = sample >= (contact->above != 0 ? detector->low : detector->high);
    const bool touches = contact->touches != 0;
    const int32_t run = contact->run > 0 && contact->run < count ? contact->run : 0; /* whatever the memory held */
    contact->above = above ? 1 : 0;
    contact->run = above != touches ? run + 1 : 0;
    if (contact->run < count) { return HOPFORM_OK; }
    contact->run = 0;
    contact->touches = above ? 1 : 0;
    return above ? HOPFORM_CONTACT_TOUCHDOWN : HOPFORM_CONTACT_TAKEOFF;
}

#endif
