/* What libFuzzer does with earlier findings, without libFuzzer: each file that is named goes to the target once, in SECONDS at most. */
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

enum { LONGEST = 4096, SECONDS = 20 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int main(int count, char **names)
{
    static uint8_t data[LONGEST];
    for (int n = 1; n < count; n++) {
        FILE *file = fopen(names[n], "rb");
        if (file == NULL) {
            return 2;
        }
        const size_t size = fread(data, 1, LONGEST, file);
        fclose(file);
        fprintf(stderr, "%s\n", names[n]);
        alarm(SECONDS);
        LLVMFuzzerTestOneInput(data, size);
        alarm(0);
    }
    return 0;
}
