/* SPDX-License-Identifier: MIT-0
 *
 * What this library was generated from.
 */
#include "facts.h"
#include "hopform/hopform.h"

/* Who builds the library defines it, as a hash of the sources. */
#ifndef HOPFORM_SOURCE
#define HOPFORM_SOURCE ""
#endif

const char *hopform_layout(void) {
    return HOPFORM_LAYOUT;
}

const char *hopform_source(void) {
    return HOPFORM_SOURCE;
}
