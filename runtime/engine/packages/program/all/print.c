/* Where there is a terminal: it prints what the program says. SPDX-License-Identifier: MIT-0 */
#include "hardware.h"

#include <stdio.h>

void hardware_print(const char *text, int32_t number) {
    (void)printf("%s%ld\n", text, (long)number);
}
