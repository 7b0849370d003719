/* The first event of one mass that slips alone, by its displacement, in single
 * precision: judged in double. */
#include "hopform_f32.c"

typedef struct {
  double p, q;                  /* the poles */
  double velocity, draw, until; /* v, and v' + p v, at the start */
  double rounding;              /* of the draw */
  double guard[2];              /* displacements; below 0: none */
  double value, rate, bend;     /* of a function of s and v, its numerator;
                                   below 0: none */
} question;

typedef struct {
  double t, s, v, draw, rest_time;
  int32_t owner, evaluations;
} verdict;

/* The owner of a guard is its index, that of a rest 1: after a contact, before
 * what is held. That of a function is the last. */
void ask(const question *questions, int64_t count, verdict *verdicts) {
  for (int64_t i = 0; i < count; i++) {
    const question *q = &questions[i];
    const hopform_poles_f32 poles = pair_alone_f32((float)q->p, (float)q->q);
    evaluations_f32 evaluations = {1000};
    alone_search_f32 search;
    begin_alone_search_f32(&search, 0, &poles,
                           timescales_of_poles_f32(&poles).half_period);
    search.start = alone_start_f32(&search.pair, (float)q->velocity,
                                   (float)q->draw, (float)q->rounding);
    for (int n = 0; n < 2; n++) {
      if (q->guard[n] >= 0.0) {
        (void)add_alone_guard_f32(&search, (float)q->guard[n], 2 * n);
      }
    }
    if (q->value >= 0.0) {
      const numerator_f32 h = {(float)q->rate, (float)q->bend, 0.0f};
      (void)add_alone_function_f32(&search, &h, (float)q->value, 0.0f, 1.0f,
                                   LIMIT_f32, 0);
    }
    find_alone_event_f32(&search, true, (float)q->until, &evaluations);
    verdicts[i] = (verdict){
        search.end.t,     search.end.s, search.end.v,           search.end.draw,
        search.rest_time, search.owner,
        1000 - EVALUATIONS_OF_A_PHASE_f32 - evaluations.left};
  }
}
