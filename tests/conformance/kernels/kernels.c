/* Every float32 that each kernel may be given, against the same function in double precision: the largest error of
 * each.
 *
 * A line is: name, how many inputs, the largest error in units of the last place of the exact value, the largest
 * absolute one, where. Inputs are all non-negative floats up to the end of the kernel's range; the argument is one of
 * SHARES shares, done side by side.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "kernels_f32.h"

static double worst_ulp, worst_absolute;
static float where_ulp, where_absolute;
static uint64_t count;

static float of_bits(uint32_t bits)
{
    union {
        uint32_t bits;
        float value;
    } number;
    number.bits = bits;
    return number.value;
}

/* The distance between floats near a value, that of the least normal ones below them. */
static double ulp_of(double value)
{
    int exponent;
    frexp(value, &exponent);
    return ldexp(1.0, (exponent < -125 ? -125 : exponent) - 24);
}

static void note(float x, float got, double exact)
{
    const double error = fabs((double)got - exact), ulps = error / ulp_of(exact);
    count++;
    if (!(ulps <= worst_ulp)) {
        worst_ulp = ulps;
        where_ulp = x;
    }
    if (!(error <= worst_absolute)) {
        worst_absolute = error;
        where_absolute = x;
    }
}

static void print_errors(const char *name)
{
    printf("%s %llu %.9g %.9g %.9g %.9g\n", name, (unsigned long long)count, worst_ulp, (double)where_ulp,
           worst_absolute, (double)where_absolute);
    worst_ulp = worst_absolute = 0.0;
    count = 0;
}

#define EVERY(from, to) for (uint32_t bits = (from) + (uint32_t)share; bits <= (to); bits += (uint32_t)shares)
enum { LEAST_NORMAL = 0x00800000, ONE = 0x3f800000 };

int main(int argc, char **argv)
{
    const int share = argc > 1 ? atoi(argv[1]) : 0, shares = argc > 2 ? atoi(argv[2]) : 1;
    EVERY(0u, 0x42ae0000u) { /* exp(-x), 0 <= x <= 87 */
        const float x = of_bits(bits);
        note(x, exponential_f32(-x), x < 87.0f ? exp(-(double)x) : 0.0);
    }
    print_errors("exp(-x)");
    EVERY(0u, 0x42ae0000u) {
        const float x = of_bits(bits);
        note(x, fade_by_f32(-x).gone, -expm1(-(double)x));
    }
    print_errors("1-exp(-x)");
    EVERY(0u, 0x4b189680u) { /* up to 1e7, beyond which the angle counts as 0 */
        const float x = of_bits(bits);
        if (x < 1e4f) {
            note(x, turn_by_f32(x).sine, sin((double)x));
        }
    }
    print_errors("sin(x),x<1e4");
    EVERY(0u, 0x461c4000u) {
        const float x = of_bits(bits);
        note(x, turn_by_f32(x).cosine, cos((double)x));
    }
    print_errors("cos(x),x<=1e4");
    EVERY(LEAST_NORMAL, 0x7f7fffffu) { /* all normal numbers */
        const float x = of_bits(bits);
        note(x, logarithm_f32(x), log((double)x));
    }
    print_errors("ln(x)");
    EVERY(0u, 0x7f7fffffu) { /* denormals too */
        const float x = of_bits(bits);
        note(x, cube_root_f32(x), cbrt((double)x));
    }
    print_errors("cbrt(x)");
    EVERY(0u, 0x3e2fb7e9u) { /* 0 <= s <= 0.1716 */
        const float s = of_bits(bits);
        note(s, area_tangent_f32(s), s > 0.0f ? atanh((double)s) / (double)s : 1.0);
    }
    print_errors("artanh(s)/s");
    for (int quarter = 0; quarter < 4; quarter++) { /* of (x, y): y/x and x/y from 0 to 1, both signs of x */
        EVERY(0u, (uint32_t)ONE) {
            const float t = of_bits(bits);
            const float y = quarter & 1 ? 1.0f : t, x = (quarter & 2 ? -1.0f : 1.0f) * (quarter & 1 ? t : 1.0f);
            note(t, angle_f32(x, y), atan2((double)y, (double)x));
        }
    }
    print_errors("angle(x,y)");
    EVERY(0u, 0x42c80000u) { /* a = 1: 0 <= t <= 100 */
        const float t = of_bits(bits);
        note(t, decay_at_f32(1.0f, t).e1, -expm1(-(double)t));
    }
    print_errors("t*phi1(-t)");
    EVERY(0u, 0x42c80000u) {
        const float t = of_bits(bits);
        const double z = (double)t;
        const double exact = z < 1e-3 ? z * z * (0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z / 120.0)))
                                      : (double)(expm1l(-(long double)t) + (long double)t);
        note(t, decay_at_f32(1.0f, t).e2, exact);
    }
    print_errors("t^2*phi2(-t)");
    return 0;
}
