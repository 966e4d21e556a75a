/* Prepare and feedback (reference.py). */

/* [hz; hu] = [Q S'; S R] [z; u] of stage k; u and hu are not used at stage N. */
static void times_hessian(const Team *t, long k, const double *z, const double *u, double *hz, double *hu) {
  const long n = t->n;
  for (long e = 0; e < n * NZS; ++e) hz[e] = 0.0;
  if (k < t->N)
    for (long i = 0; i < n; ++i) {
      const long item = i * t->N + k;
      const double *value = (const double *)(t->vehicle_out + item / LANES * VEHICLE_OUT) + item % LANES;
      double in[NZ + NU], out[NZ + NU] = {0.0};
      for (int a = 0; a < NZ; ++a) in[a] = z[i * NZS + a];
      for (int a = 0; a < NU; ++a) in[NZ + a] = u[i * NU + a];
      for (long e = 0; e < VEHICLE_HESSIAN; ++e) {
        const long a = vehicle_hessian_row[e], b = vehicle_hessian_column[e];
        const double h = value[vehicle_hessian_from[e] * LANES];
        out[a] += h * in[b];
        if (a != b) out[b] += h * in[a];
      }
      for (int a = 0; a < NZ; ++a) hz[i * NZS + a] = out[a];
      for (int a = 0; a < NU; ++a) hu[i * NU + a] = out[NZ + a];
    }
  if (k > 0) {
    const double *leader =
        (const double *)(t->leader_hessian_out + (k - 1) / LANES * LEADER_HESSIAN_OUT) + (k - 1) % LANES;
    for (long e = 0; e < LEADER_HESSIAN; ++e) {
      const long a = leader_hessian_row[e], b = leader_hessian_column[e];
      const double h = leader[leader_hessian_from[e] * LANES];
      hz[a] += h * z[b];
      if (a != b) hz[b] += h * z[a];
    }
    for (long pair = 0; pair < t->n_pairs; ++pair) {
      const long item = pair * t->N + k - 1, i = t->pairs[2 * pair] * NZS, j = t->pairs[2 * pair + 1] * NZS - NX;
      const double *value = (const double *)(t->pair_hessian_out + item / LANES * PAIR_HESSIAN_OUT) + item % LANES;
      for (long e = 0; e < PAIR_HESSIAN; ++e) {
        const long a = pair_hessian_row[e] + (pair_hessian_row[e] < NX ? i : j);
        const long b = pair_hessian_column[e] + (pair_hessian_column[e] < NX ? i : j);
        const double h = value[pair_hessian_from[e] * LANES];
        hz[a] += h * z[b];
        if (a != b) hz[b] += h * z[a];
      }
    }
  }
}

/* Objective, KKT value and number of active bounds of the minimiser (reference.py). */
static void assess(Team *t, double constant) {
  const long n = t->n, N = t->N, nz = n * NZS, nu = n * NU;
  double objective = constant, change = 0.0, on_bounds = 0.0;
  double hz[nz], hu[nu], still[nu], costate[nz], free_response[(N + 1) * nz];
  for (long e = 0; e < nu; ++e) still[e] = 0.0;
  for (long e = 0; e < nz; ++e) free_response[e] = t->dz0[e];
  for (long k = 0; k < N; ++k)
    advance(t, k, free_response + k * nz, still, t->gap + k * n * NX, free_response + (k + 1) * nz);
  for (long k = N; k >= 0; --k) {
    const double *dz = t->dz + k * nz, *q = t->q + k * nz, *z = free_response + k * nz;
    if (k < N) {
      const double *du = t->du + k * nu, *r = t->r + k * nu, *slope = t->slope + k * nu;
      times_hessian(t, k, dz, du, hz, hu);
      for (long e = 0; e < nu; ++e) {
        objective += (r[e] + 0.5 * hu[e]) * du[e];
        on_bounds += magnitude(slope[e] * du[e]);
      }
    } else {
      times_hessian(t, k, dz, 0, hz, hu);
    }
    for (long e = 0; e < nz; ++e) objective += (q[e] + 0.5 * hz[e]) * dz[e];
    /* The gradient at du = 0, where the states follow the dynamics freely. */
    times_hessian(t, k, z, still, hz, hu);
    if (k < N) {
      const double *du = t->du + k * nu, *r = t->r + k * nu;
      for (long i = 0; i < n; ++i) {
        double by_z[NZS], by_u[NU];
        pull_back(t, k, i, costate + i * NZS, by_z, by_u);
        for (int a = 0; a < NU; ++a) change += (r[i * NU + a] + hu[i * NU + a] + by_u[a]) * du[i * NU + a];
        for (int a = 0; a < NZS; ++a) costate[i * NZS + a] = by_z[a] + q[i * NZS + a] + hz[i * NZS + a];
      }
    } else {
      for (long e = 0; e < nz; ++e) costate[e] = q[e] + hz[e];
    }
  }
  for (long k = 0; t->soft && k < N; ++k)
    for (long m = 0; m < t->n_rows; ++m) {
      const Row row = row_of(t, k, m);
      const double *price = t->row_prices + 2 * m, multiplier = t->multiplier[2 * N * nu + k * t->n_rows + m];
      const double h = constant_of(&row) + row_times(&row, t->dz + (k + 1) * nz);
      const double sigma = max_double(h, 0.0), guessed = max_double(constant_of(&row), 0.0);
      objective += sigma * (price[0] + 0.5 * price[1] * sigma);
      change += (price[0] + price[1] * guessed) * (sigma - guessed);
      on_bounds += magnitude(multiplier * (constant_of(&row) + row_times(&row, free_response + (k + 1) * nz) - guessed));
    }
  t->objective = objective;
  t->kkt = magnitude(change) + on_bounds;
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
      const double change = at_minimiser ? row_times(&row, t->dz + (k + 1) * t->n * NZS) : 0.0;
      if (constant_of(&row) + change > margin) return 1;
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
  t->iterations = 0;
  int status = NOT_CONVERGED;
  if (!is_violated(t, 0, -CLOSE)) status = solve_by_active_set(t);
  if (status == SOLVED && is_violated(t, 1, 0.0)) status = NOT_CONVERGED;
  t->soft = status == NOT_CONVERGED;
  if (t->soft) status = solve_by_interior_point(t);
  if (status != SOLVED) return status;
  assess(t, t->vehicle_cost + cost);
  return __builtin_isfinite(t->kkt) && __builtin_isfinite(t->objective) ? SOLVED : NOT_FINITE;
}
