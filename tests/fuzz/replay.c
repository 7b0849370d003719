/* A fuzzing target without a fuzzer: the inputs in the files that are named, then as many from a generator with a fixed
 * seed as the first argument says, both kinds, as they are and of a sensible size. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST = 256 };

int main(int argc, char **argv)
{
    static uint8_t bytes[MOST];
    for (int n = 2; n < argc; n++) {
        FILE *file = fopen(argv[n], "rb");
        const size_t size = file != NULL ? fread(bytes, 1, sizeof bytes, file) : 0;
        if (size == 0 || fclose(file) != 0) {
            fprintf(stderr, "%s can not be read\n", argv[n]);
            return 2;
        }
        LLVMFuzzerTestOneInput(bytes, size);
    }
    uint64_t state = 88172645463325252u; /* Marsaglia, "Xorshift RNGs", 2003 */
    for (long n = 0; n < (argc > 1 ? atol(argv[1]) : 0); n++) {
        for (int i = 0; i < MOST; i++) {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            bytes[i] = (uint8_t)(state >> 32);
        }
        bytes[0] |= n % 8 == 0 ? 0 : 1;
        LLVMFuzzerTestOneInput(bytes, MOST);
    }
    return 0;
}
