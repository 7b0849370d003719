/* The rules of a node in modal coordinates, asked about functions of given
 * coordinates, in single precision: what they say is judged in double. With
 * -DHOPFORM_MODAL=1. */
#include "hopform_f32.c"

typedef struct {
  double robot[HOPFORM_ROBOT_FIELDS];
  double f, c, s;     /* coordinates at the start */
  double start, span; /* of the function, and how much of a node */
  double sign;
  int32_t row;
  int32_t spare;
} question;

typedef struct {
  double value, end, rate_end; /* of the function at the start and at the end,
                                  as they are rounded */
  double a, mean, omega, fade, cosine, sine,
      length; /* the function: poles and row, as they are rounded */
  double rounding;
  int32_t refused, signs, amplitude, bernstein;
} verdict;

void ask(const question *questions, int64_t count, verdict *verdicts) {
  for (int64_t i = 0; i < count; i++) {
    const question *q = &questions[i];
    hopform_robot_f32 robot;
    float *fields = &robot.m_eff;
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
      fields[n] = (float)q->robot[n];
    }
    hopform_plan_f32 plan;
    verdict v = {0};
    v.refused =
        hopform_plan_init_f32(&plan, &robot) < 0 || !(plan.modal.h > 0.0f);
    if (!v.refused) {
      const hopform_modal_f32 *modal = &plan.modal;
      const int n = q->row;
      evaluations_f32 evaluations = {UNBOUNDED_f32};
      modal_search_f32 search = {
          .modal = modal, .first = 0, .evaluations = &evaluations};
      search.low = &search.node[0];
      search.high = &search.node[1];
      search.low->m = (modal_f32){(float)q->f, (float)q->c, (float)q->s};
      search.total = no_gain_f32(&search.low->m);
      search.amplitude = amplitude_of_f32(&search.low->m);
      for (int k = 0; k < MODAL_FUNCTIONS_f32; k++) {
        search.sign[k] = (float)q->sign;
        put_rates_f32(&search, k, search.low);
      }
      search.sign[0] = 1.0f; /* of the compression there is one sign */
      put_rates_f32(&search, 0, search.low);
      search.low->value[n] = (float)q->start;
      search.rounded[n] = search.low->value[n];
      const float h = (float)q->span * modal->h;
      const modal_gain_f32 gain =
          q->span < 1.0 ? gain_over_a_node_f32(modal, &search.low->m, h)
                        : gain_of_node_f32(modal, &search.low->m);
      end_modal_interval_f32(&search, h, &gain);
      const hopform_modal_row_f32 *row = &modal->row[n];
      v.value = search.low->value[n];
      v.end = search.high->value[n];
      v.rate_end = search.high->rate[n];
      v.a = modal->a;
      v.mean = modal->mean;
      v.omega = modal->omega;
      v.fade = search.sign[n] * row->rate_fade;
      v.cosine = search.sign[n] * row->rate_cosine;
      v.sine = search.sign[n] * row->rate_sine;
      v.length = h;
      v.rounding =
          modal_rounding_f32(&search, n, &gain, h, search.high->rate[n]);
      v.signs =
          turns_down_only_f32(search.low->rate[n], search.low->deflated[n],
                              search.high->rate[n], search.high->deflated[n]);
      v.amplitude = falls_too_little_f32(&search, n, h, search.amplitude);
      v.bernstein = has_modal_bernstein_f32(&search, n, h, search.amplitude,
                                            (float)v.rounding);
    }
    verdicts[i] = v;
  }
}
