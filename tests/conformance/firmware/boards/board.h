/* What a test program needs of a board: words to the terminal of the emulator, an exit code, a counter, the stack. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

void board_text(const char *text);
void board_number(int32_t value);
void board_hex(uint32_t value);
void board_exit(int code);

/* Starts the counter; then its reading, which grows. board_counts_of_1000 gives how many instructions a count is. */
void board_start_counter(void);
uint32_t board_counter(void);
uint32_t board_counts_of_1000(void);

/* Fills the free stack with a pattern; how many bytes of it are gone since. */
void board_paint_stack(void);
uint32_t board_used_stack(void);

#endif
