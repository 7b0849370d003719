// The paper's closed form as one would write it by hand: poles a, mu +- i w; the actuator moves up all the time, the
// body down and then up, take-off. Nothing else may happen, nothing is proven: the roots are where Newton's method ends
// up.
#include <cmath>

enum { JOB = 19, HEAD = 8, WIDTH = HEAD + 2 * 64, MOST = 1024 };

namespace {

struct Poles {
    double a, mu, w, q, chi, s3;
};

// v = limit + alpha e^(-a t) + e^(-mu t) (A cos w t + B sin w t), from v, v', v'' at 0, and its limit.
struct Part {
    double limit, alpha, A, B;
    Part(const Poles &p, double v, double acceleration, double jerk, double limit) : limit(limit)
    {
        alpha = (jerk + 2.0 * p.mu * acceleration + p.q * (v - limit)) / p.chi;
        A = v - limit - alpha;
        B = (acceleration + p.a * alpha + p.mu * A) / p.w;
    }
};

// e^(-a t), e^(-mu t) cos w t, e^(-mu t) sin w t.
struct Basis {
    double decay, cosine, sine;
    Basis(const Poles &p, double t)
    {
        const double envelope = std::exp(-p.mu * t);
        decay = std::exp(-p.a * t);
        cosine = envelope * std::cos(p.w * t);
        sine = envelope * std::sin(p.w * t);
    }
};

double at(const Part &v, const Basis &b)
{
    return v.limit + v.alpha * b.decay + v.A * b.cosine + v.B * b.sine;
}

double slope(const Poles &p, const Part &v, const Basis &b)
{
    return -p.a * v.alpha * b.decay + (p.w * v.B - p.mu * v.A) * b.cosine - (p.w * v.A + p.mu * v.B) * b.sine;
}

double integral(const Poles &p, const Part &v, const Basis &b, double t)
{
    const double C = p.mu * v.A + p.w * v.B, S = p.mu * v.B - p.w * v.A;
    return v.limit * t + v.alpha / p.a * (1.0 - b.decay) + (C - C * b.cosine - S * b.sine) / p.q;
}

double root(const Poles &p, const Part &v, double t)
{
    for (int n = 0; n < 20; n++) {
        const Basis b(p, t);
        const double step = at(v, b) / slope(p, v, b);
        t -= step;
        if (std::fabs(step) < 1e-15) {
            break;
        }
    }
    return t;
}

struct State {
    double x1, v1, v2, y;
};

struct Leg {
    Poles poles;
    double k1, k2, b1, b2, force1, f1, g, f2;
};

Leg legs[MOST];

Leg leg_of(const double *job)
{
    const double m_eff = job[0], m_s = job[1], k = job[2];
    Leg leg = {{0, 0, 0, 0, 0, 0}, k / m_eff, k / m_s, job[5] / m_eff, job[6] / m_s,
               -job[9] / m_eff,    job[7],    job[10], job[8]};
    const double s1 = leg.b1 + leg.b2, s2 = leg.b1 * leg.b2 + leg.k1 + leg.k2, s3 = leg.k1 * leg.b2 + leg.k2 * leg.b1;
    double a = s3 / s2;
    for (int n = 0; n < 60; n++) {
        a -= (((s1 - a) * a - s2) * a + s3) / ((2.0 * s1 - 3.0 * a) * a - s2);
    }
    Poles &p = leg.poles;
    p.a = a;
    p.mu = 0.5 * (s1 - a);
    p.q = s2 - a * (s1 - a);
    p.w = std::sqrt(p.q - p.mu * p.mu);
    p.chi = a * a - 2.0 * p.mu * a + p.q;
    p.s3 = s3;
    return leg;
}

// The motion of both masses while the body goes one way.
struct Phase {
    State from;
    Part v1, v2, y;
    static Phase of(const Leg &leg, const State &z, double u, double side)
    {
        const double C1 = leg.force1 * u - leg.f1, C2 = -leg.g - side * leg.f2;
        const double a1 = C1 - leg.k1 * z.y - leg.b1 * z.v1, a2 = C2 + leg.k2 * z.y - leg.b2 * z.v2;
        const double dy = z.v1 - z.v2, j1 = -leg.k1 * dy - leg.b1 * a1, j2 = leg.k2 * dy - leg.b2 * a2;
        const double both = (leg.k2 * C1 + leg.k1 * C2) / leg.poles.s3;
        const double rest = (leg.b2 * C1 - leg.b1 * C2) / leg.poles.s3;
        return {z, Part(leg.poles, z.v1, a1, j1, both), Part(leg.poles, z.v2, a2, j2, both),
                Part(leg.poles, z.y, dy, a1 - a2, rest)};
    }
    State after(const Poles &p, double t) const
    {
        const Basis b(p, t);
        return {from.x1 + integral(p, v1, b, t), at(v1, b), at(v2, b), at(y, b)};
    }
};

double energy(const double *job, const State &z)
{
    const double height = z.x1 - z.y + job[3] + job[4], spring = z.x1 - z.y;
    return 0.5 * job[1] * z.v2 * z.v2 + job[1] * job[10] * height + 0.5 * job[2] * spring * spring;
}

void solve(const Leg &leg, const double *job, double *answer)
{
    const State start = {job[15], job[16], job[17], 0.0};
    const Phase down = Phase::of(leg, start, job[18], -1.0);
    const double turns = root(leg.poles, down.v2, 1.6 / leg.poles.w);
    State lowest = down.after(leg.poles, turns);
    lowest.v2 = 0.0;
    const Phase up = Phase::of(leg, lowest, job[18], 1.0);
    const double rises = root(leg.poles, up.y, 2.0 / leg.poles.w);
    State end = up.after(leg.poles, rises);
    end.y = 0.0;
    answer[0] = 1.0;
    answer[1] = turns + rises;
    answer[2] = end.x1;
    answer[3] = end.v1;
    answer[4] = end.v2;
    answer[5] = 0.0;
    answer[6] = energy(job, end) - energy(job, start);
    answer[7] = 1.0;
    answer[8] = turns;
    answer[9] = 5.0; // the body reverses
}

} // namespace

extern "C" void prepare(const double *jobs, int count)
{
    for (int n = 0; n < count && n < MOST; n++) {
        legs[n] = leg_of(jobs + n * JOB);
    }
}

extern "C" void by_hand(const double *jobs, int count, double, int loops, double *answers)
{
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            solve(legs[n], jobs + n * JOB, answers + n * WIDTH);
        }
    }
}
