/* The interior-point method (interior_point.py). Slacks and multipliers of all constraints are one vector
 * each: upper bounds, lower bounds, h <= sigma, sigma >= 0. */

#define INTERIOR_POINT_ITERATIONS_MAX 60
#define COMPLEMENTARITY 1e-15
#define COMPLEMENTARITY_ACCEPTED 1e-9
#define STEP_BACK 0.995

static double complementarity(const Team *t, double length) {
  double sum = 0.0;
  for (long e = 0; e < t->n_constraints; ++e)
    sum += (t->slack[e] + length * t->d_slack[e]) * (t->multiplier[e] + length * t->d_multiplier[e]);
  return sum / t->n_constraints;
}

/* Commands well inside their bounds, and multipliers of the size of the gradient. */
static void start_inside(Team *t) {
  const long N = t->N, nu = t->n * NU, nz = t->n * NZS, n_bounds = N * nu, n_rows = N * t->n_rows;
  double size = 0.0;
  for (long e = 0; e < n_bounds; ++e) size += magnitude(t->r[e]);
  size = 1.0 + size / n_bounds;
  for (long e = 0; e < nz; ++e) t->dz_at[e] = 0.0;
  for (long k = 0; k < N; ++k) {
    for (long a = 0; a < nu; ++a) {
      const long e = k * nu + a;
      const double upper = bound_of(t, k, a, 1), lower = bound_of(t, k, a, -1), margin = 0.1 * (upper - lower);
      t->du_at[e] = max_double(lower + margin, min_double(upper - margin, 0.0));
      t->slack[e] = upper - t->du_at[e];
      t->slack[n_bounds + e] = t->du_at[e] - lower;
      t->multiplier[e] = t->multiplier[n_bounds + e] = size;
    }
    advance(t, k, t->dz_at + k * nz, t->du_at + k * nu, 0, t->dz_at + (k + 1) * nz);
    for (long m = 0; m < t->n_rows; ++m) {
      const Row row = row_of(t, k, m);
      const double h = t->row_free[k * t->n_rows + m] + row_times(&row, t->dz_at + (k + 1) * nz);
      const double sigma = 1.0 + max_double(h, 0.0);
      const long soft = 2 * n_bounds + k * t->n_rows + m, violation = soft + n_rows;
      t->slack[soft] = sigma - h;
      t->slack[violation] = sigma;
      t->multiplier[soft] = t->multiplier[violation] = 0.5 * (t->row_prices[2 * m] + t->row_prices[2 * m + 1] * sigma);
    }
  }
  for (long e = 0; e < t->n_constraints; ++e) t->d_slack[e] = t->d_multiplier[e] = t->product[e] = 0.0;
}

/* The part of the quadratic program that does not depend on the target: the weights of bounds and rows. */
static int factorize_barrier(Team *t) {
  const long n_bounds = t->N * t->n * NU, n_rows = t->N * t->n_rows;
  for (long e = 0; e < n_bounds; ++e)
    t->bound_weight[e] = t->multiplier[e] / t->slack[e] + t->multiplier[n_bounds + e] / t->slack[n_bounds + e];
  for (long e = 0; e < n_rows; ++e) {
    const long soft = 2 * n_bounds + e, violation = soft + n_rows;
    const double by_soft = t->multiplier[soft] / t->slack[soft];
    const double stiffness = t->row_prices[2 * (e % t->n_rows) + 1] + t->multiplier[violation] / t->slack[violation];
    t->row_weight[e] = by_soft * stiffness / (stiffness + by_soft);
  }
  clear_last_stage(t);
  add_rows(t, t->N);
  return factorize(t, t->N - 1);
}

/* Gradient of the cost of the stages at the iterate, without that of soft constraints. */
static void gradient_at_iterate(Team *t) {
  for (long e = 0; e < (t->N + 1) * t->n * NZS; ++e) t->q_at[e] = t->q_plain[e];
  for (long e = 0; e < t->N * t->n * NU; ++e) t->r_at[e] = t->r_plain[e];
  add_hessian_times(t, t->dz_at, t->du_at, t->q_at, t->r_at);
}

/* The changes dz and du of a Newton step towards products of slacks and multipliers of `target`; t->product holds
 * those of the changes. */
static void newton_step(Team *t, double target) {
  const long N = t->N, nu = t->n * NU, nz = t->n * NZS, n_bounds = N * nu, n_rows = N * t->n_rows;
  const double *s = t->slack, *m = t->multiplier;
  for (long e = 0; e < (N + 1) * nz; ++e) t->q[e] = t->q_at[e];
  for (long e = 0; e < n_bounds; ++e) {
    const long lower = n_bounds + e;
    t->r[e] = t->r_at[e] + (target - t->product[e]) / s[e] - (target - t->product[lower]) / s[lower];
  }
  for (long e = 0; e < n_rows; ++e) {
    const long soft = 2 * n_bounds + e, violation = soft + n_rows, k = e / t->n_rows;
    const double *price = t->row_prices + 2 * (e % t->n_rows), by_soft = m[soft] / s[soft];
    const double stiffness = price[1] + by_soft + m[violation] / s[violation];
    const double next_soft = (target - t->product[soft]) / s[soft];
    const double excess =
        next_soft + (target - t->product[violation]) / s[violation] - price[0] - price[1] * s[violation];
    const Row row = row_of(t, k, e % t->n_rows);
    t->row_offset[e] = next_soft - by_soft / stiffness * excess;
    t->row_excess[e] = excess / stiffness;
    add_row(&row, t->row_offset[e], t->q + (k + 1) * nz);
  }
  for (long e = 0; e < nz; ++e) t->p[N * nz + e] = t->q[N * nz + e];
  sweep_back(t, N - 1);
  sweep_forward(t);
  for (long e = 0; e < n_bounds; ++e) {
    const long lower = n_bounds + e;
    const double change = t->du[e];
    t->d_slack[e] = -change;
    t->d_slack[lower] = change;
    t->d_multiplier[e] = (target - t->product[e]) / s[e] + m[e] / s[e] * change - m[e];
    t->d_multiplier[lower] = (target - t->product[lower]) / s[lower] - m[lower] / s[lower] * change - m[lower];
  }
  for (long e = 0; e < n_rows; ++e) {
    const long soft = 2 * n_bounds + e, violation = soft + n_rows, k = e / t->n_rows;
    const double by_soft = m[soft] / s[soft];
    const double stiffness = t->row_prices[2 * (e % t->n_rows) + 1] + by_soft + m[violation] / s[violation];
    const Row row = row_of(t, k, e % t->n_rows);
    const double change = row_times(&row, t->dz + (k + 1) * nz);
    const double d_sigma = t->row_excess[e] + by_soft / stiffness * change;
    t->d_slack[soft] = d_sigma - change;
    t->d_slack[violation] = d_sigma;
    t->d_multiplier[soft] = t->row_offset[e] + t->row_weight[e] * change - m[soft];
    t->d_multiplier[violation] =
        (target - t->product[violation]) / s[violation] - m[violation] / s[violation] * d_sigma - m[violation];
  }
}

/* Part of the way at which the first slack or multiplier becomes zero. */
static double longest_step(const Team *t) {
  double length = 1.0;
  for (long e = 0; e < t->n_constraints; ++e) {
    if (t->slack[e] + t->d_slack[e] < 0.0) length = min_double(length, -t->slack[e] / t->d_slack[e]);
    if (t->multiplier[e] + t->d_multiplier[e] < 0.0) length = min_double(length, -t->multiplier[e] / t->d_multiplier[e]);
  }
  return length;
}

static int solve_by_interior_point(Team *t) {
  const long N = t->N, nu = t->n * NU, nz = t->n * NZS, n_bounds = N * nu;
  for (long e = 0; e < (N + 1) * nz; ++e) t->q_plain[e] = t->q[e];
  for (long e = 0; e < n_bounds; ++e) t->r_plain[e] = t->r[e];
  for (long e = 0; e < n_bounds; ++e) t->side[e] = 0;
  t->corrected = 1;
  t->has_barrier = 1;
  start_inside(t);
  double now = complementarity(t, 0.0);
  const double scale = 1.0 + now;
  for (long iteration = 0; iteration < INTERIOR_POINT_ITERATIONS_MAX; ++iteration) {
    if (now < COMPLEMENTARITY * scale) break;
    ++t->iterations;
    if (!factorize_barrier(t)) break;
    gradient_at_iterate(t);
    for (long e = 0; e < t->n_constraints; ++e) t->product[e] = 0.0;
    newton_step(t, 0.0);
    const double ahead = complementarity(t, longest_step(t)) / now;
    for (long e = 0; e < t->n_constraints; ++e) t->product[e] = t->d_slack[e] * t->d_multiplier[e];
    newton_step(t, now * ahead * ahead * ahead);
    const double length = min_double(1.0, STEP_BACK * longest_step(t));
    for (long e = 0; e < t->n_constraints; ++e) {
      t->slack[e] += length * t->d_slack[e];
      t->multiplier[e] += length * t->d_multiplier[e];
    }
    for (long e = 0; e < n_bounds; ++e) t->du_at[e] += length * t->du[e];
    for (long e = 0; e < (N + 1) * nz; ++e) t->dz_at[e] += length * t->dz[e];
    now = complementarity(t, 0.0);
    if (!__builtin_isfinite(now)) break;
  }
  t->has_barrier = 0;
  for (long e = 0; e < (N + 1) * nz; ++e) {
    t->q[e] = t->q_plain[e];
    t->dz[e] = t->dz_at[e];
  }
  for (long e = 0; e < n_bounds; ++e) {
    const long lower = n_bounds + e;
    t->r[e] = t->r_plain[e];
    t->du[e] = t->du_at[e];
    t->side[e] = (t->multiplier[e] > t->slack[e]) - (t->multiplier[lower] > t->slack[lower]);
    t->slope[e] = t->side[e] ? t->multiplier[lower] - t->multiplier[e] : 0.0;
  }
  if (!__builtin_isfinite(now)) return NOT_FINITE;
  return now < COMPLEMENTARITY_ACCEPTED * scale ? SOLVED : NOT_CONVERGED;
}
