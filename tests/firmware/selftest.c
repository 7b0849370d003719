/* Prints the words of the selftests, 8 hexadecimal digits: f32, and f64 unless -DSINGLE. */
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

static hopform_search_f32 search_f32;
static hopform_phase_f32 phases_f32[HOPFORM_SELFTEST_PHASES];
#ifndef SINGLE
static hopform_search_f64 search_f64;
static hopform_phase_f64 phases_f64[HOPFORM_SELFTEST_PHASES];
#endif

int main(void)
{
    board_text("f32 ");
    board_hex(hopform_selftest_f32(&search_f32, phases_f32, HOPFORM_SELFTEST_PHASES));
#ifndef SINGLE
    board_text(" f64 ");
    board_hex(hopform_selftest_f64(&search_f64, phases_f64, HOPFORM_SELFTEST_PHASES));
#endif
    const int misuse = hopform_selftest_f32(NULL, phases_f32, HOPFORM_SELFTEST_PHASES) != 0
                       || hopform_selftest_f32(&search_f32, phases_f32, HOPFORM_SELFTEST_PHASES - 1) != 0;
    board_text(misuse ? " misuse\n" : "\n");
    board_exit(misuse);
    return misuse;
}
