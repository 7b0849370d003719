/* Prints the word of the selftest in double precision. */
#include <stdio.h>

#include "hopform/hopform.h"

int main(void)
{
    static hopform_search_f64 search;
    static hopform_phase_f64 phases[HOPFORM_SELFTEST_PHASES];
    printf("%08x\n", (unsigned)hopform_selftest_f64(&search, phases, HOPFORM_SELFTEST_PHASES));
    return 0;
}
