// Boost.odeint, dopri5 with dense output: each phase starts anew; a crossing within a step is bracketed on the dense
// output.
#include <array>
#include <boost/math/tools/toms748_solve.hpp>
#include <boost/numeric/odeint.hpp>
#include <cstddef>

#include "rules.h"

namespace odeint = boost::numeric::odeint;
using state = std::array<double, 4>;

static int search(const leg_t *leg, const double side[2], double z[4], double limit, double tolerance, double *took)
{
    auto stepper = odeint::make_dense_output(0.01 * tolerance, tolerance, odeint::runge_kutta_dopri5<state>());
    const auto motion = [=](const state &x, state &d, double) { rates(leg, side, x.data(), d.data()); };
    state here;
    std::copy(z, z + 4, here.begin());
    stepper.initialize(here, 0.0, first_step(leg, side, z));
    double before[6], after[6];
    event_functions(leg, side, here.data(), before);
    for (;;) {
        stepper.do_step(motion);
        const double low = stepper.previous_time();
        double high = stepper.current_time();
        state reached = stepper.current_state();
        if (high > limit) {
            high = limit;
            stepper.calc_state(high, reached);
        }
        event_functions(leg, side, reached.data(), after);
        int which = NONE;
        double first = high;
        for (int n = 0; n < 6; n++) {
            if (before[n] > 0.0 && after[n] <= 0.0) {
                const auto value = [&](double t) {
                    state x;
                    double g[6];
                    stepper.calc_state(t, x);
                    event_functions(leg, side, x.data(), g);
                    return g[n];
                };
                std::uintmax_t most = 100;
                const auto root = boost::math::tools::toms748_solve(
                    value, low, high, before[n], after[n], boost::math::tools::eps_tolerance<double>(50), most);
                if (which == NONE || root.second < first) {
                    which = n;
                    first = root.second;
                }
            }
        }
        if (which != NONE) {
            stepper.calc_state(first, reached);
        }
        if (which != NONE || high >= limit) {
            *took = first;
            std::copy(reached.begin(), reached.end(), z);
            return which;
        }
        std::copy(after, after + 6, before);
    }
}

extern "C" RUN_ALL(run_odeint)
