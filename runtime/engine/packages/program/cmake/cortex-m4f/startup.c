/* Starts a Cortex-M4F that QEMU emulates, which loads .data and clears .bss, and prints by semihosting. Your vendor's
 * startup code takes its place. SPDX-License-Identifier: MIT-0 */
#include "../hardware.h"

extern void stack_top(void); /* an address, from the linker's script */
int main(void);
void reset(void);

static int32_t semihosting(int32_t operation, const void *argument) {
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void end_with(uint32_t code) {
    const uint32_t block[2] = {0x20026u, code};
    (void)semihosting(0x20, block);
    for (;;) {}
}

static void fault(void) {
    end_with(99u);
}

void reset(void) {
    *(volatile uint32_t *)0xE000ED88u |= 0x00F00000u; /* CPACR: floating point, before its first instruction */
    __asm__ volatile("dsb\n isb" : : : "memory");
    end_with((uint32_t)main());
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    stack_top, reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
};

void hardware_print(const char *text, int32_t number) {
    char digits[13] = "           \n"; /* written from the right */
    uint32_t rest = number < 0 ? 0u - (uint32_t)number : (uint32_t)number;
    char *at = &digits[11];
    do {
        *--at = (char)('0' + rest % 10u);
        rest /= 10u;
    } while (rest > 0u);
    if (number < 0) { *--at = '-'; }
    (void)semihosting(0x04, text);
    (void)semihosting(0x04, at);
}
