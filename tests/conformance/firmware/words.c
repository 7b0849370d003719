/* Prints a word for all bits of random stances, flights and commands (words_of.h), in single precision, and in double
 * precision unless -DSINGLE. The selftest's cases are chosen to visit everything once; these are many. */
#include <math.h>
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

#ifndef WORDS_ROBOTS
#define WORDS_ROBOTS 30
#define WORDS_COMMANDS 5
#define WORDS_SAMPLES 70
#endif
enum { WORDS_PHASES = 64 };

#ifndef DOUBLE_ALONE
#define REAL float
#define T(name) name##_f32
#include "words_of.h"
#undef REAL
#undef T
#endif
#ifndef SINGLE
#define REAL double
#define T(name) name##_f64
#include "words_of.h"
#endif

int main(void)
{
#ifndef DOUBLE_ALONE
    board_text("f32 ");
    board_hex(word_of_f32(WORDS_ROBOTS, WORDS_COMMANDS));
#endif
#ifndef SINGLE
    board_text(" f64 ");
    board_hex(word_of_f64(WORDS_ROBOTS, WORDS_COMMANDS));
#endif
    board_text("\n");
    board_exit(0);
    return 0;
}
