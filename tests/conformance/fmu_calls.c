/* Random calls of an FMU, good ones and bad ones: two instances in turns, states that are kept, set, and packed into bytes.
 * What is refused is said; what is shown is a number, but where there is none. Compiled with the sources of an FMU, which
 * it includes: it knows how many values there are.
 */
#include "fmi3.c"

enum { INSTANCES = 2, KEPT = 4, MOST_SHOWN = ALL };

static unsigned long long drawn;
static int said;
static long refused, answered, stepped, wrong;

#define MUST(truth)                                                                                                    \
    if (!(truth)) {                                                                                                    \
        fprintf(stderr, "line %d: %s\n", __LINE__, #truth);                                                            \
        wrong++;                                                                                                       \
    }

static unsigned draw(unsigned below) {
    drawn = drawn * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(drawn >> 33) % below;
}

static double between(double low, double high) {
    return low + (high - low) * (draw(1u << 30) / (double)(1u << 30));
}

static double number(void) {
    static const double bad[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e300, -1e300, 1e-300, -1.0, 1e9};
    return draw(4) == 0 ? bad[draw(sizeof bad / sizeof bad[0])] : between(-1.0, 1.0) * pow(10.0, between(-4.0, 2.0));
}

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)category;
    MUST(status == fmi3Error || status == fmi3Warning)
    MUST(message[0] != '\0' && strlen(message) < TEXT)
    said++;
}

static fmi3Instance made(bool event_mode, bool early) {
    return fmi3InstantiateCoSimulation("one", TOKEN, NULL, false, false, event_mode, early, NULL, 0, NULL, hear, NULL);
}

/* A number near the start of a value, or any. */
static double value_of(unsigned which) {
    return draw(3) > 0 ? start_of[which] * between(0.6, 1.6) : number();
}

static fmi3Status set_some(fmi3Instance one) {
    fmi3ValueReference which[3];
    fmi3Float64 values[3];
    const unsigned count = 1 + draw(3);
    for (unsigned n = 0; n < count; n++) {
        which[n] = draw(8) == 0 ? draw(ALL + 3) : draw(2) ? INPUT + draw(VALUES - INPUT) : 1 + draw(COORDINATES);
        values[n] = value_of(which[n] < VALUES ? which[n] : 0);
    }
    return fmi3SetFloat64(one, which, count, values, draw(50) == 0 ? count - 1 : count);
}

static fmi3Status show_some(fmi3Instance one) {
    fmi3ValueReference which[VALUES];
    fmi3Float64 values[VALUES];
    for (unsigned n = 0; n < VALUES; n++) {
        which[n] = n;
    }
    const fmi3Status status = fmi3GetFloat64(one, which, VALUES, values, VALUES);
    bool overflows = false; /* an energy of such numbers */
    for (unsigned n = 0; n < VALUES && status == fmi3OK; n++) {
        overflows = overflows || (fabs(values[n]) > 1e90 && isfinite(values[n]));
    }
    for (unsigned n = 0; n < FORCE && status == fmi3OK; n++) {
        MUST(isfinite(values[n]))
    }
    for (unsigned n = ENERGY; n < NEXT_EVENT && status == fmi3OK; n++) {
        MUST(overflows || isfinite(values[n]))
    }
    return status;
}

static fmi3Status show_codes(fmi3Instance one) {
    fmi3Int64 wide;
    fmi3Int32 count;
    fmi3Boolean truth;
    fmi3ValueReference which = MODE + draw(ALL - MODE + 2);
    const unsigned kind = draw(3);
    return kind == 0   ? fmi3GetInt64(one, &which, 1, &wide, 1)
           : kind == 1 ? fmi3GetInt32(one, &which, 1, &count, 1)
                       : fmi3GetBoolean(one, &which, 1, &truth, 1);
}

static fmi3Status step(fmi3Instance one, double *now) {
    static const double sizes[] = {1e-3, 1e-2, 0.1, 0.3, 1e-9, 1500.0};
    fmi3Boolean needs = true;
    fmi3Boolean over = true;
    fmi3Boolean early = true;
    const double size = draw(8) ? sizes[draw(6)] : number();
    const fmi3Status status = fmi3DoStep(one, draw(12) ? *now : number(), size, draw(2), &needs, &over, &early, now);
    stepped += status == fmi3OK;
    return status;
}

static fmi3Status update(fmi3Instance one) {
    fmi3Boolean truths[5];
    double t;
    return fmi3UpdateDiscreteStates(one, &truths[0], &truths[1], &truths[2], &truths[3], &truths[4], &t);
}

/* A state is packed into bytes and taken out again; some of these are no state. */
static fmi3Status pack(fmi3Instance one, fmi3FMUState *state) {
    static fmi3Byte bytes[SERIALIZED];
    size_t size = 0;
    fmi3Status status = fmi3SerializedFMUStateSize(one, *state, &size);
    MUST(size == SERIALIZED)
    if (status == fmi3OK) { status = fmi3SerializeFMUState(one, *state, bytes, *state != NULL ? size : 0); }
    if (status != fmi3OK) { return status; }
    const unsigned bad = draw(4);
    if (bad == 0) { bytes[draw(sizeof TOKEN - 1)] ^= 1; }
    return fmi3DeserializeFMUState(one, bytes, bad == 1 ? size - 1 : size, state);
}

static fmi3Status initialize_one(fmi3Instance one, double *now) {
    const double begin = draw(3) ? 0.0 : number();
    const fmi3Status status = fmi3EnterInitializationMode(one, false, 0.0, begin, draw(2), draw(2) ? 2.0 : number());
    *now = status == fmi3OK ? begin : *now;
    return status;
}

static fmi3Status reset(fmi3Instance one, double *now) {
    *now = 0.0;
    return fmi3Reset(one);
}

/* What an importer would do next. */
static fmi3Status next_call(fmi3Instance one, double *now) {
    switch (((const Model *)one)->life) {
    case INSTANTIATED: return initialize_one(one, now);
    case INITIALIZING: return fmi3ExitInitializationMode(one);
    case IN_EVENTS: return draw(2) ? update(one) : fmi3EnterStepMode(one);
    case TERMINATED: return reset(one, now);
    default: return draw(4) ? step(one, now) : fmi3EnterEventMode(one);
    }
}

static fmi3Status call(fmi3Instance *one, double *now, fmi3FMUState *kept, double *times) {
    const unsigned which = draw(KEPT);
    switch (draw(32)) {
    case 0:
    case 1: return set_some(*one);
    case 2: return show_some(*one);
    case 3: return show_codes(*one);
    case 4: return fmi3EnterEventMode(*one);
    case 5: return update(*one);
    case 6: return fmi3EnterStepMode(*one);
    case 7: times[which] = *now; return fmi3GetFMUState(*one, &kept[which]);
    case 8: *now = kept[which] != NULL ? times[which] : *now; return fmi3SetFMUState(*one, kept[which]);
    case 9: return pack(*one, &kept[which]);
    case 10: return draw(5) == 0 ? fmi3FreeFMUState(*one, &kept[which]) : fmi3OK;
    case 11: return initialize_one(*one, now);
    case 12: return fmi3ExitInitializationMode(*one);
    case 13: return draw(20) == 0 ? fmi3Terminate(*one) : fmi3OK;
    case 14: return draw(10) == 0 ? reset(*one, now) : fmi3OK;
    case 15: {
        const fmi3ValueReference truth = draw(3) ? ALL - 1 : draw(ALL);
        const fmi3Boolean value = draw(2);
        return fmi3SetBoolean(*one, &truth, 1, &value, 1);
    }
    default: return next_call(*one, now);
    }
}

int main(int count, char **arguments) {
    const long calls = count > 1 ? strtol(arguments[1], NULL, 10) : 1000;
    drawn = count > 2 ? strtoull(arguments[2], NULL, 10) : 1;
    fmi3Instance one[INSTANCES];
    fmi3FMUState kept[KEPT] = {NULL};
    double now[INSTANCES] = {0.0};
    double times[KEPT] = {0.0};
    MUST(fmi3InstantiateCoSimulation("", "another", NULL, 0, 0, 0, 0, NULL, 0, NULL, hear, NULL) == NULL && said == 1)
    one[0] = made(true, true);
    one[1] = made(draw(2), draw(2));
    for (long n = 0; n < calls; n++) {
        const unsigned which = draw(INSTANCES);
        said = 0;
        const fmi3Status status = call(&one[which], &now[which], kept, times);
        MUST(status == fmi3OK || (status == fmi3Error && said > 0))
        answered += status == fmi3OK;
        refused += status == fmi3Error;
    }
    for (int n = 0; n < KEPT; n++) {
        (void)fmi3FreeFMUState(one[0], &kept[n]);
    }
    for (int n = 0; n < INSTANCES; n++) {
        fmi3FreeInstance(one[n]);
    }
    printf("answered %ld refused %ld steps %ld wrong %ld\n", answered, refused, stepped, wrong);
    return wrong != 0;
}
