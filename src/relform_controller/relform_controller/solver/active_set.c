/* The active set of the bounds (active_set.py). */

#define TOLERANCE 1e-9
#define ACTIVE_SET_ITERATIONS_MAX 8

static void predict_sides(Team *t) {
  const long nu = t->n * NU;
  for (long k = 0; k < t->N; ++k)
    for (long a = 0; a < nu; ++a)
      t->side[k * nu + a] = (bound_of(t, k, a, 1) <= TOLERANCE) - (bound_of(t, k, a, -1) >= -TOLERANCE);
}

/* Correct the guess of the active bounds; returns the last stage that changed, or -1. */
static long correct_sides(Team *t) {
  const long nu = t->n * NU;
  long last = -1;
  for (long k = 0; k < t->N; ++k)
    for (long a = 0; a < nu; ++a) {
      signed char *side = t->side + k * nu + a;
      const double du = t->du[k * nu + a];
      const signed char before = *side;
      if (before) {
        if (!(t->slope[k * nu + a] * before < 0.0)) *side = 0;
      } else if (du > bound_of(t, k, a, 1) + TOLERANCE) {
        *side = 1;
      } else if (du < bound_of(t, k, a, -1) - TOLERANCE) {
        *side = -1;
      }
      if (*side != before) last = k;
    }
  return last;
}
