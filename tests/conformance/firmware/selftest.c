/* Prints the digests of the selftests, 8 hexadecimal digits: f32, and f64 unless -DSINGLE; then ` ties-to-odd` where
 * the arithmetic in double precision is not IEEE 754's. libgcc's routines for ARM without such hardware round the
 * difference below, which lies half way between two numbers, to the odd one: __aeabi_dsub after a cancellation by one
 * bit. */
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

static hopform_search_f32 search_f32;
static hopform_phase_f32 phases_f32[HOPFORM_SELFTEST_PHASES];
#ifndef SINGLE
static hopform_search_f64 search_f64;
static hopform_phase_f64 phases_f64[HOPFORM_SELFTEST_PHASES];
#endif

#ifndef SINGLE
static int rounds_ties_to_odd(void)
{
    const volatile double one = 1.0, small = 1.9116469330043865e-10; /* 0x1.a46027ba7c18p-33 */
    const volatile double got = one - small;
    return got < 0.9999999998088354; /* 0x1.fffffffe5b9fep-1 is right, one less is not */
}
#endif

int main(void)
{
    board_text("f32 ");
    board_hex(hopform_selftest_f32(&search_f32, phases_f32, HOPFORM_SELFTEST_PHASES));
#ifndef SINGLE
    board_text(" f64 ");
    board_hex(hopform_selftest_f64(&search_f64, phases_f64, HOPFORM_SELFTEST_PHASES));
    board_text(rounds_ties_to_odd() ? " ties-to-odd" : "");
#endif
    const int misuse = hopform_selftest_f32(NULL, phases_f32, HOPFORM_SELFTEST_PHASES) != 0
                       || hopform_selftest_f32(&search_f32, phases_f32, HOPFORM_SELFTEST_PHASES - 1) != 0;
    board_text(misuse ? " misuse\n" : "\n");
    board_exit(misuse);
    return misuse;
}
