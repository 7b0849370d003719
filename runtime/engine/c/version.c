/* SPDX-License-Identifier: MIT-0
 *
 * What this library was generated from.
 */
#include "facts.h"
#include "hopform/hopform.h"

const char *hopform_source(void) {
    return HOPFORM_SOURCE;
}
