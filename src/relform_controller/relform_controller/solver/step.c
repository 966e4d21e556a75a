/* Prepare and feedback (reference.py). */

/* The free response, and the gradient there (team_qp.py); returns what its cost adds to that of the guess. */
static double respond_freely(Team *t) {
  const long N = t->N, nz = t->n * NZS, nu = t->n * NU;
  double still[nu];
  for (long e = 0; e < nu; ++e) still[e] = 0.0;
  for (long e = 0; e < nz; ++e) t->free_response[e] = t->dz0[e];
  for (long k = 0; k < N; ++k) {
    double *z = t->free_response + k * nz;
    advance(t, k, z, still, t->gap + k * t->n * NX, z + nz);
  }
  const double before = dot(t->q, t->free_response, (N + 1) * nz);
  for (long e = 0; e < N * nu; ++e) t->r[e] = t->r_vehicle[e];
  add_hessian_times(t, t->free_response, 0, t->q, t->r);
  const double after = dot(t->q, t->free_response, (N + 1) * nz);
  for (long k = 0; k < N; ++k)
    for (long m = 0; m < t->n_rows; ++m) {
      const Row row = row_of(t, k, m);
      t->row_free[k * t->n_rows + m] = constant_of(&row) + row_times(&row, t->free_response + (k + 1) * nz);
    }
  return 0.5 * (before + after);
}

/* Objective and KKT value of the minimiser (reference.py). `constant` is the cost of the free response. */
static void assess(Team *t, double constant) {
  const long N = t->N, nz = t->n * NZS, n_bounds = N * t->n * NU;
  /* gradient . step at the free response and at the minimiser */
  double change = dot(t->q, t->dz, (N + 1) * nz), at_minimiser = 0.0, on_bounds = 0.0;
  for (long e = 0; e < n_bounds; ++e) {
    change += t->r[e] * t->du[e];
    at_minimiser += t->slope[e] * t->du[e];
    on_bounds += magnitude(t->slope[e] * t->du[e]);
  }
  double violation = 0.0, violation_change = 0.0;
  for (long k = 0; t->soft && k < N; ++k)
    for (long m = 0; m < t->n_rows; ++m) {
      const Row row = row_of(t, k, m);
      const double *price = t->row_prices + 2 * m, multiplier = t->multiplier[2 * n_bounds + k * t->n_rows + m];
      const double first = t->row_free[k * t->n_rows + m], dh = row_times(&row, t->dz + (k + 1) * nz);
      const double sigma_first = max_double(first, 0.0), sigma = max_double(first + dh, 0.0);
      violation += sigma * (price[0] + 0.5 * price[1] * sigma);
      violation_change += (price[0] + price[1] * sigma_first) * (sigma - sigma_first);
      at_minimiser -= multiplier * dh;
      on_bounds += magnitude(multiplier * (first - sigma_first));
    }
  t->objective = constant + 0.5 * (change + at_minimiser) + violation; /* the cost of the stages is quadratic */
  t->kkt = magnitude(change + violation_change) + on_bounds;
}

int prepare(Team *t) {
  linearize_vehicles(t);
  linearize_leader_and_pairs(t);
  predict_sides(t);
  clear_last_stage(t);
  t->corrected = t->has_barrier = 0;
  return factorize(t, t->N - 1) ? SOLVED : NOT_FINITE;
}

/* Whether a soft constraint is violated by more than `margin` at the guess, or at the minimiser. */
static int is_violated(const Team *t, int at_minimiser, double margin) {
  for (long k = 0; k < t->N; ++k)
    for (long m = 0; m < t->n_rows; ++m) {
      const Row row = row_of(t, k, m);
      const double h = at_minimiser ? t->row_free[k * t->n_rows + m] + row_times(&row, t->dz + (k + 1) * t->n * NZS)
                                    : constant_of(&row);
      if (h > margin) return 1;
    }
  return 0;
}

/* SOLVED if the active set settles at a minimiser without soft constraints. */
static int solve_by_active_set(Team *t) {
  const long nz = t->n * NZS;
  if (t->corrected) {
    predict_sides(t);
    clear_last_stage(t);
    if (!factorize(t, t->N - 1)) return NOT_FINITE;
    t->corrected = 0;
  }
  for (long e = 0; e < nz; ++e) t->p[t->N * nz + e] = t->q[t->N * nz + e];
  long last = t->N - 1;
  for (long iteration = 0; iteration < ACTIVE_SET_ITERATIONS_MAX; ++iteration) {
    ++t->iterations;
    sweep_back(t, last);
    sweep_forward(t);
    last = correct_sides(t);
    if (last < 0) return SOLVED;
    t->corrected = 1;
    if (!factorize(t, last)) return NOT_FINITE;
  }
  return NOT_CONVERGED;
}

/* How close to a bound the plan of the step before lay if it was at it [m, rad, m/s]. */
#define CLOSE 0.01

int feedback(Team *t) {
  const double cost = gradient_of_leader_and_pairs(t);
  double finite = cost;
  for (long e = 0; e < t->n * NZS; ++e) finite += t->dz0[e];
  if (!__builtin_isfinite(finite)) return NOT_FINITE;
  if (t->n_rows) linearize_rows(t);
  const double free_cost = t->vehicle_cost + cost + respond_freely(t);
  t->iterations = 0;
  int status = NOT_CONVERGED;
  if (!is_violated(t, 0, -CLOSE)) status = solve_by_active_set(t);
  if (status == SOLVED && is_violated(t, 1, 0.0)) status = NOT_CONVERGED;
  t->soft = status == NOT_CONVERGED;
  if (t->soft) status = solve_by_interior_point(t);
  if (status != SOLVED) return status;
  assess(t, free_cost);
  return __builtin_isfinite(t->kkt) && __builtin_isfinite(t->objective) ? SOLVED : NOT_FINITE;
}
