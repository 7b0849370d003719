/* SPDX-License-Identifier: MIT-0
 *
 * What a compiler is asked of a function or a loop beyond `static inline`: where it stands, or that it is written out.
 */
#ifndef HOPFORM_INLINING_H_real
#define HOPFORM_INLINING_H_real

/* Of a function that few phases enter: it stays out of those that all enter, and takes less flash and stack. Of one
 * whose result is better left in registers: it is inlined wherever it is called. Of a large one that is called from
 * several places: it stands once. */
#if defined(__clang__) /* of what is marked unused it warns where that is used */
#define SELDOM_real static inline __attribute__((noinline, cold))
#define SHARED_real static inline __attribute__((noinline))
#elif defined(__GNUC__)
#define SELDOM_real static __attribute__((noinline, cold, unused))
#define SHARED_real static __attribute__((noinline, unused))
#else
#define SELDOM_real static inline
#define SHARED_real static inline
#endif
#if defined(__GNUC__)
#define ALWAYS_real static inline __attribute__((always_inline))
#else
#define ALWAYS_real static inline
#endif

/* Of a loop over a few axes, rows or functions that most phases enter: it is written out, and what it makes stays in
 * registers, where gcc at -O2 would not do so by itself. */
#if defined(__GNUC__) && __GNUC__ >= 8 && !defined(__clang__) && !defined(__OPTIMIZE_SIZE__)
#define UNROLLED_real _Pragma("GCC unroll 4")
#else
#define UNROLLED_real
#endif

#endif
