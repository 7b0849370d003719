/* SPDX-License-Identifier: MIT-0
 *
 * Stances in vector registers of 512 bits, where the processor has them.
 */
#include "lanes_real.h"

#if defined(HOPFORM_X86_LANES)
#define LANES_NAME hopform_lanes_avx512_real
#if defined(__clang__)
#define LANES_CODE                                                                                                     \
    __attribute__((noinline, flatten, target("avx512f,avx512dq,avx512vl,avx512bw"), min_vector_width(512)))
#else
#define LANES_CODE                                                                                                     \
    __attribute__((noinline, flatten, target("avx512f,avx512dq,avx512vl,avx512bw,prefer-vector-width=512")))
#endif
#include "lanes_evaluation_real.h"
#endif
