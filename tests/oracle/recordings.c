/* Recordings of one mass by time stepping: the midpoint rule in steps of at most 10 us, with friction that holds the
 * mass exactly; then what clock, logger and sensor make of them. Shares nothing with hopform.
 *
 *     m x'' = gamma u(t) - k (x - rest) - b x' - m f (1 + s e^(-(x'/v_s)^2)) sign(x')        on a spring
 *     m x'' = k (length - x) - b x' - m g - the same friction, while x < length              a drop, else x'' = -g
 *
 * Further forces act on a spring: drag |x'| x' of the air, a load that grows by `drift` per second, a torque ripple
 * `ripple` sin(2 pi x/pitch), and -k hard (x - rest)^3. Friction grows by `loaded` times the force that drive or spring
 * put on the mass. A link of mass `link` hangs on the mass by a spring of `link_k` and a damper of `link_b`; where
 * `at_link` is not 0 the sensor sees the link. At the place `stop` the mass loses its velocity. True time is `clock`
 * times that of the recording. The current holds from sample to sample, late by `delay`; the sensor follows x through
 * lag y' + y = x and a play of the width `play`, and shows gain y. */
#include <math.h>

#define STEP 1e-5
#define TURN 6.283185307179586

typedef struct {
    double mass, k, b, f, stribeck, speed, gamma, rest, drops, g, loss, start, held;
    double delay, gain, clock, lag;
    double drag, drift, play, stop;
    double ripple, pitch, hard, loaded;
    double link, link_k, link_b, at_link;
} Rig;

typedef struct {
    double x, v, y, t;
    int flies;
    double p, w; /* place and velocity of the link */
} State;

static double pull(const Rig *rig, const State *s, double x, double v, double u) {
    double further = rig->drift * s->t - rig->drag * fabs(v) * v, off = x - rig->rest;
    further += rig->ripple * sin(TURN * x / rig->pitch) - rig->k * rig->hard * off * off * off;
    further += rig->link_k * (s->p - x) + rig->link_b * (s->w - v);
    return (rig->gamma * u - rig->k * off - rig->b * v + further) / rig->mass - rig->g;
}

static double friction(const Rig *rig, double x, double v, double u) {
    double share = v / rig->speed, load = fabs(rig->gamma * u) + fabs(rig->k * (x - rig->rest));
    return rig->f * (1.0 + rig->stribeck * exp(-share * share)) + rig->loaded * load / rig->mass;
}

static void slide(const Rig *rig, State *s, double u, double h) {
    double free = pull(rig, s, s->x, s->v, u), level = friction(rig, s->x, s->v, u);
    if (s->v == 0.0 && fabs(free) <= level) {
        return;
    }
    double drag = copysign(level, s->v != 0.0 ? s->v : free);
    double middle = s->v + 0.5 * h * (free - drag);
    double level_there = copysign(friction(rig, s->x + 0.5 * h * s->v, middle, u), drag);
    double after = s->v + h * (pull(rig, s, s->x + 0.5 * h * s->v, middle, u) - level_there);
    if (after * drag < 0.0 && s->v * drag > 0.0) {
        double turn = h * s->v / (s->v - after);
        s->x += 0.5 * turn * s->v;
        s->v = 0.0;
        slide(rig, s, u, h - turn);
        return;
    }
    s->x += h * middle;
    s->v = after;
}

static void fall(const Rig *rig, State *s, double h) {
    double length = rig->rest;
    if (s->flies) {
        double below = s->x + h * (s->v - 0.5 * h * rig->g);
        if (below >= length) {
            s->x = below;
            s->v -= h * rig->g;
            return;
        }
        double impact = sqrt(s->v * s->v + 2.0 * rig->g * (s->x - length));
        double took = (s->v + impact) / rig->g;
        s->x = length;
        s->v = -impact * sqrt(1.0 - rig->loss);
        s->flies = 0;
        h = h > took ? h - took : 0.0;
    }
    slide(rig, s, 0.0, h);
    if (s->x > length && s->v > 0.0) { /* since the time at which the foot came off it has flown */
        s->v -= (s->x - length) / s->v * (pull(rig, s, s->x, s->v, 0.0) - friction(rig, s->x, s->v, 0.0) + rig->g);
        s->flies = 1;
    }
}

/* Half a step of the link before that of the mass, and its mirror image after it: together they are of second order. One
 * step of the link after one of the mass would be of first order: the spring between both, late by half a step, would
 * drive the mass as a negative damping of link_k h/2. */
static void link_begins(const Rig *rig, State *s, double half) {
    s->w -= half * (rig->link_k * (s->p - s->x) + rig->link_b * (s->w - s->v)) / rig->link;
    s->p += half * s->w;
}

static void link_ends(const Rig *rig, State *s, double half) {
    s->p += half * s->w;
    s->w -= half * (rig->link_k * (s->p - s->x) + rig->link_b * (s->w - s->v)) / (rig->link + half * rig->link_b);
}

static void advance(const Rig *rig, State *s, double u, double time) {
    int count = (int)ceil(time / STEP);
    double h = count > 0 ? time / count : 0.0, decay = rig->lag > 0.0 ? exp(-h / rig->lag) : 0.0;
    for (int n = 0; n < count; n++) {
        double before = s->x;
        if (rig->link > 0.0) {
            link_begins(rig, s, 0.5 * h);
        }
        if (rig->drops != 0.0) {
            fall(rig, s, h);
        } else {
            slide(rig, s, u, h);
        }
        if (rig->link > 0.0) {
            link_ends(rig, s, 0.5 * h);
        }
        s->t += h;
        if (s->x > rig->stop) {
            s->x = rig->stop;
            s->v = 0.0;
        }
        double seen = rig->at_link != 0.0 ? s->p : s->x;
        s->y = decay * s->y + (rig->lag > 0.0 ? (1.0 - decay) * 0.5 * (before + seen) : seen);
    }
}

/* measured: `count` samples `step` apart by the clock of the recording; u: the current at each. */
void record(const Rig *rig, const double *u, int count, double step, double *measured) {
    State s = {rig->start, 0.0, rig->start, 0.0, rig->drops != 0.0, rig->start, 0.0};
    double shown = rig->start; /* behind the play */
    for (int n = 0; n < count; n++) {
        shown = fmin(fmax(shown, s.y - 0.5 * rig->play), s.y + 0.5 * rig->play);
        measured[n] = rig->gain * shown;
        double begin = n * step, end = begin + step;
        if (end <= rig->held + 1e-12) {
            continue;
        }
        int now = (int)floor((begin - rig->delay) / step + 1e-9);
        while (begin < end - 1e-12) {
            double next = fmin((now + 1) * step + rig->delay, end);
            advance(rig, &s, u[now < 0 ? 0 : now >= count ? count - 1 : now], rig->clock * (next - begin));
            begin = next;
            now++;
        }
    }
}
