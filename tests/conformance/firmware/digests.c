/* Prints a digest of all bits of random stances, flights and commands (digest_of.h), in single precision, and in double
 * precision unless -DSINGLE. The selftest's cases are chosen to visit everything once; these are many. */
#include <math.h>
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

#ifndef DIGEST_ROBOTS
#define DIGEST_ROBOTS 30
#define DIGEST_COMMANDS 5
#define DIGEST_SAMPLES 70
#endif
enum { DIGEST_PHASES = 64 };

#ifndef DOUBLE_ALONE
#define REAL float
#define T(name) name##_f32
#include "digest_of.h"
#undef REAL
#undef T
#endif
#ifndef SINGLE
#define REAL double
#define T(name) name##_f64
#include "digest_of.h"
#endif

int main(void)
{
#ifndef DOUBLE_ALONE
    board_text("f32 ");
    board_hex(digest_of_f32(DIGEST_ROBOTS, DIGEST_COMMANDS));
#endif
#ifndef SINGLE
    board_text(" f64 ");
    board_hex(digest_of_f64(DIGEST_ROBOTS, DIGEST_COMMANDS));
#endif
    board_text("\n");
    board_exit(0);
    return 0;
}
