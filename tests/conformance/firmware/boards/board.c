/* Semihosting, counters and the painted stack: for Cortex-M and RISC-V, and for a process of this computer. */
#include "board.h"

#if defined(__arm__)
static int32_t semihosting(int32_t operation, const void *argument)
{
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}
#elif defined(__riscv)
int32_t semihosting_call(int32_t operation, const void *argument);
static int32_t semihosting(int32_t operation, const void *argument)
{
    return semihosting_call(operation, argument);
}
#endif

#if defined(__arm__) || defined(__riscv)
void board_text(const char *text)
{
    semihosting(0x04, text);
}

void board_exit(int code)
{
    const uint32_t block[2] = {0x20026u, (uint32_t)code};
    semihosting(0x20, block);
    for (;;) {
    }
}

extern uint32_t __stack_limit[];
static const uint32_t PAINT = 0xC5C5C5C5u;
static volatile uint32_t *painted_from;

__attribute__((noinline)) void board_paint_stack(void)
{
    volatile uint32_t here = 0;
    volatile uint32_t *top = &here - 16;
    for (volatile uint32_t *word = __stack_limit; word < top; word++) {
        *word = PAINT;
    }
    painted_from = top;
}

__attribute__((noinline)) uint32_t board_used_stack(void)
{
    const volatile uint32_t *word = __stack_limit;
    while (*word == PAINT && word < painted_from) {
        word++;
    }
    return (uint32_t)((uintptr_t)painted_from - (uintptr_t)word);
}
#else
#include <stdio.h>
#include <stdlib.h>
void board_text(const char *text)
{
    fputs(text, stderr);
}

void board_exit(int code)
{
    exit(code);
}

void board_paint_stack(void)
{
}

uint32_t board_used_stack(void)
{
    return 0;
}
#endif

#if defined(__arm__)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
void board_start_counter(void)
{
    SYST_CSR = 0;
    SYST_RVR = 0xFFFFFFu;
    SYST_CVR = 0;
    SYST_CSR = 5; /* counts at the processor's clock, no interrupt */
}

uint32_t board_counter(void)
{
    return 0xFFFFFFu - SYST_CVR;
}

/* 2000 rounds of five instructions, counted: what 10 000 instructions make, by 10. */
uint32_t board_counts_of_1000(void)
{
    board_start_counter();
    const uint32_t before = board_counter();
    uint32_t rounds = 2000;
    __asm__ volatile("1: nop\n nop\n nop\n subs %0, %0, #1\n bne 1b\n" : "+r"(rounds) : : "cc");
    return (board_counter() - before) / 10;
}
#elif defined(__riscv)
void board_start_counter(void)
{
}

uint32_t board_counter(void)
{
    uint32_t count;
    __asm__ volatile("csrr %0, minstret" : "=r"(count));
    return count;
}

uint32_t board_counts_of_1000(void)
{
    return 1000;
}
#else
void board_start_counter(void)
{
}

uint32_t board_counter(void)
{
    return 0;
}

uint32_t board_counts_of_1000(void)
{
    return 1000;
}
#endif

void board_hex(uint32_t value)
{
    char text[9];
    for (int n = 0; n < 8; n++) {
        text[n] = "0123456789abcdef"[(value >> (28 - 4 * n)) & 15u];
    }
    text[8] = '\0';
    board_text(text);
}

void board_number(int32_t value)
{
    char text[12];
    uint32_t rest = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
    int at = 11;
    text[at] = '\0';
    do {
        text[--at] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest > 0);
    if (value < 0) {
        text[--at] = '-';
    }
    board_text(&text[at]);
}
