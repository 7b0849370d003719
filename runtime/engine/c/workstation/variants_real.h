/* SPDX-License-Identifier: MIT-0
 *
 * The ways in which a batch can be solved; each gives the same bits.
 */
#ifndef HOPFORM_VARIANTS_H_real
#define HOPFORM_VARIANTS_H_real

#include "hopform/hopform.h"

#if defined(__GNUC__) && defined(__x86_64__)
#define HOPFORM_X86_LANES
#endif

/* Stances `first` to `end` of one robot. */
int32_t hopform_lanes_baseline_real(const hopform_plan_real *plan, int64_t first, int64_t end,
                                    const hopform_stances_in_real *in, const hopform_stances_out_real *out);
#if defined(HOPFORM_X86_LANES)
int32_t hopform_lanes_avx2_real(const hopform_plan_real *plan, int64_t first, int64_t end,
                                const hopform_stances_in_real *in, const hopform_stances_out_real *out);
int32_t hopform_lanes_avx512_real(const hopform_plan_real *plan, int64_t first, int64_t end,
                                  const hopform_stances_in_real *in, const hopform_stances_out_real *out);
#endif

#endif
