/* The basis of the compiled kernels over arrays, for switchovers.py: the kernels are inline and have no public name. */
#include "kernels_f32.h"
#include "kernels_f64.h"

#define SCAN(real, suffix)                                                                                             \
    void scan_##suffix(const real *s_1, const real *s_2, const real *s_3, const real *t, int count, real *basis)       \
    {                                                                                                                  \
        for (int i = 0; i < count; i++) {                                                                              \
            const hopform_poles_##suffix held = {0, s_1[i], s_2[i], s_1[i], s_2[i], 0};                                \
            const hopform_poles_##suffix poles =                                                                       \
                s_3[i] > 0 ? factor_cubic_##suffix(s_1[i], s_2[i], s_3[i]) : held;                             \
            const basis_##suffix at = basis_at_##suffix(&poles, t[i]);                                 \
            const real values[5] = {at.Wdd, at.Wd, at.W, at.W1, at.W2};                                                \
            for (int n = 0; n < 5; n++) {                                                                              \
                basis[5 * i + n] = values[n];                                                                          \
            }                                                                                                          \
        }                                                                                                              \
    }

SCAN(float, f32)
SCAN(double, f64)
