/* SPDX-License-Identifier: MIT-0
 *
 * Stances in vector registers of 256 bits, where the processor has them.
 */
#include "lanes_real.h"

#if defined(HOPFORM_X86_LANES)
#define LANES_NAME hopform_lanes_avx2_real
#define LANES_CODE __attribute__((noinline, flatten, target("avx2")))
#include "lanes_evaluation_real.h"
#endif
