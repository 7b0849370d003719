/* exp, sqrt and the factors of a motion's characteristic polynomial in 113 bits. */
#include <math.h>

#include "checker.h"

quad checker_expm1(quad x)
{
    if (x < -300) {
        return -1;
    }
    int doublings = 0;
    for (; absolute(x) > (quad)1 / 16; x /= 2) {
        doublings++;
    }
    quad sum = 0;
    for (int n = 22; n > 0; n--) {
        sum = (sum + 1) * x / n;
    }
    for (; doublings > 0; doublings--) {
        sum = sum * (sum + 2);
    }
    return sum;
}

quad checker_sqrt(quad x)
{
    if (!(x > 0)) {
        return 0;
    }
    if (x < (quad)1e-250) { /* below the range of double */
        return checker_sqrt(x * (quad)1e240) / (quad)1e120;
    }
    quad root = sqrt((double)x);
    for (int n = 0; n < 3; n++) {
        root = (root + x / root) / 2;
    }
    return root;
}

void checker_spectrum_of_two(quad p, quad q, spectrum *out)
{
    const quad discriminant = p * p / 4 - q;
    out->p = p;
    out->q = q;
    out->paired = 1;
    if (discriminant > 0) {
        const quad fast = p / 2 + checker_sqrt(discriminant), slow = q / fast;
        if (fast > 4 * slow) {
            out->paired = 0;
            out->a[out->alone++] = fast;
            out->a[out->alone++] = slow;
        }
    }
}

/* A rate a with a^3 - s1 a^2 + s2 a - s3 = 0: it lies between s3/s2 and s1. */
static quad real_rate(quad s1, quad s2, quad s3)
{
    quad low = s3 / s2, high = s1;
    if (!(s3 > 0)) {
        return 0;
    }
    for (int n = 0; n < 400 && high - low > high * (quad)1e-33; n++) {
        const quad middle = high > 2 * low ? checker_sqrt(low * high) : (low + high) / 2;
        if (!(middle > low && middle < high)) {
            break;
        }
        if (((middle - s1) * middle + s2) * middle < s3) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return (low + high) / 2;
}

/* Newton's steps on (s + a)(s^2 + p s + q); the size of the last one, relative. */
static quad polish(quad s1, quad s2, quad s3, quad *a, quad *p, quad *q)
{
    quad left = 1;
    for (int n = 0; n < 8; n++) {
        const quad e1 = s1 - (*a + *p), e2 = s2 - (*a * *p + *q), e3 = s3 - *a * *q;
        const quad step = (e3 - *a * e2 + *a * *a * e1) / (*a * *a - *a * *p + *q);
        const quad step_q = e2 - *p * step - *a * e1 + *a * step;
        *p += e1 - step;
        *q += step_q;
        *a += step;
        left = absolute(step) / (s1 + checker_sqrt(s2)) + absolute(step_q) / s2;
    }
    return left;
}

int checker_spectrum_of_three(quad s1, quad s2, quad s3, spectrum *out)
{
    const quad sigma = s1 / 3;
    const quad Q = s2 - 3 * sigma * sigma, T = s3 - sigma * s2 + 2 * sigma * sigma * sigma;
    out->s1 = s1;
    out->s2 = s2;
    out->s3 = s3;
    if (s1 > 0 && 2 * absolute(Q) / (sigma * sigma) + 4 * absolute(T) / (sigma * sigma * sigma) <= (quad)0.5) {
        out->tripled = 1;
        out->sigma = sigma;
        return 1;
    }
    quad a = real_rate(s1, s2, s3), p = s1 - a, q = a > sigma ? s3 / a : s2 - a * p;
    const quad discriminant = p * p / 4 - q;
    if (discriminant > 0) {
        /* Of three real rates the one that stands most alone. */
        const quad high = p / 2 + checker_sqrt(discriminant), low = q / high;
        quad r[3] = {a, high, low};
        for (int i = 0; i < 2; i++) {
            for (int j = 0; j < 2; j++) {
                if (r[j] > r[j + 1]) {
                    const quad other = r[j];
                    r[j] = r[j + 1];
                    r[j + 1] = other;
                }
            }
        }
        const int slow = r[1] * r[1] > r[0] * r[2];
        a = slow ? r[0] : r[2];
        p = slow ? r[1] + r[2] : r[0] + r[1];
        q = slow ? r[1] * r[2] : r[0] * r[1];
    }
    if (polish(s1, s2, s3, &a, &p, &q) > (quad)1e-28) {
        return 0;
    }
    out->a[out->alone++] = a;
    checker_spectrum_of_two(p, q, out);
    return 1;
}
