/* SPDX-License-Identifier: MIT-0
 *
 * Stances in the vector registers that every processor of the kind has.
 */
#include "lanes_real.h"

#define LANES_NAME hopform_lanes_baseline_real
#if defined(__GNUC__)
#define LANES_CODE __attribute__((noinline, flatten))
#else
#define LANES_CODE
#endif
#include "lanes_evaluation_real.h"
