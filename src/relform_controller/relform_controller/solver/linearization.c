/* The functions of a stage at the guess (linearization.py). */

static void linearize_vehicles(Team *t) {
  const long N = t->N, items = t->n * N;
  t->vehicle_cost = 0.0;
  for (long first = 0; first < items; first += LANES) {
    lanes in[VEHICLE_IN], *out = t->vehicle_out + first / LANES * VEHICLE_OUT;
    const long filled = min_long(LANES, items - first);
    for (long l = 0; l < LANES; ++l) {
      const long item = first + min_long(l, filled - 1), i = item / N, k = item % N;
      const double *commands = t->commands + item * NU;
      vehicle_gather((double *)in + l, t->states + (i * (N + 1) + k) * NX, commands - (k > 0 ? NU : 0),
                     t->rotors + (i * (N + 1) + k) * NU, commands, t->disturbances + i * 4, &t->memory,
                     t->vehicle_weights);
    }
    vehicle(in, out);
    for (long l = 0; l < filled; ++l) {
      const long item = first + l, i = item / N, k = item % N;
      const double *value = (const double *)out + l;
      double *core = t->core + item * NX * NF, *gap = t->gap + (k * t->n + i) * NX;
      const double *next = t->states + (i * (N + 1) + k + 1) * NX;
      for (long a = 0; a < NX; ++a) gap[a] = value[vehicle_following[a] * LANES] - next[a];
      for (long e = 0; e < VEHICLE_CORE; ++e) core[vehicle_core_to[e]] = value[vehicle_core_from[e] * LANES];
      double *q = t->q_vehicle + (k * t->n + i) * NZS, *r = t->r_vehicle + (k * t->n + i) * NU;
      for (long e = 0; e < VEHICLE_GRADIENT; ++e) {
        const long to = vehicle_gradient_to[e];
        *(to < NZ ? q + to : r + to - NZ) = value[vehicle_gradient_from[e] * LANES];
      }
      t->vehicle_cost += value[vehicle_cost_from * LANES];
    }
  }
}

static void linearize_leader_and_pairs(Team *t) {
  const long N = t->N, items = t->n_pairs * N;
  lanes in[PAIR_HESSIAN_IN > LEADER_HESSIAN_IN ? PAIR_HESSIAN_IN : LEADER_HESSIAN_IN];
  const double none[4] = {0.0, 0.0, 0.0, 0.0};
  for (long first = 0; first < N; first += LANES) {
    for (long l = 0; l < LANES; ++l) {
      const long k = min_long(first + l, N - 1);
      leader_hessian_gather((double *)in + l, t->states + (k + 1) * NX, t->vehicle_frames, none,
                            t->leader_weights + k * LEADER_TERMS);
    }
    leader_hessian(in, t->leader_hessian_out + first / LANES * LEADER_HESSIAN_OUT);
  }
  for (long first = 0; first < items; first += LANES) {
    for (long l = 0; l < LANES; ++l) {
      const long item = min_long(first + l, items - 1), pair = item / N, k = item % N;
      const long *of = t->pairs + 2 * pair;
      pair_hessian_gather((double *)in + l, t->states + (of[0] * (N + 1) + k + 1) * NX,
                          t->states + (of[1] * (N + 1) + k + 1) * NX, t->pair_frames + pair * 4, none,
                          t->pair_weights + item * PAIR_TERMS);
    }
    pair_hessian(in, t->pair_hessian_out + first / LANES * PAIR_HESSIAN_OUT);
  }
}

/* Gradient and cost of the terms of leader and pairs in the measured geometry; returns the cost. */
static double gradient_of_leader_and_pairs(Team *t) {
  const long N = t->N, items = t->n_pairs * N, stride = t->n * NZS;
  lanes in[PAIR_GRADIENT_IN > LEADER_GRADIENT_IN ? PAIR_GRADIENT_IN : LEADER_GRADIENT_IN];
  lanes out[PAIR_GRADIENT_OUT > LEADER_GRADIENT_OUT ? PAIR_GRADIENT_OUT : LEADER_GRADIENT_OUT];
  double cost = 0.0;
  for (long e = 0; e < (N + 1) * stride; ++e) t->q[e] = t->q_vehicle[e];
  for (long first = 0; first < N; first += LANES) {
    const long filled = min_long(LANES, N - first);
    for (long l = 0; l < LANES; ++l) {
      const long k = first + min_long(l, filled - 1);
      leader_gradient_gather((double *)in + l, t->states + (k + 1) * NX, t->vehicle_frames,
                             t->leader_reference + (k + 1) * 4, t->leader_weights + k * LEADER_TERMS);
    }
    leader_gradient(in, out);
    for (long l = 0; l < filled; ++l) {
      const double *value = (const double *)out + l;
      double *q = t->q + (first + l + 1) * stride;
      cost += value[leader_cost_from * LANES];
      for (long e = 0; e < LEADER_GRADIENT; ++e) q[leader_gradient_to[e]] += value[leader_gradient_from[e] * LANES];
    }
  }
  for (long first = 0; first < items; first += LANES) {
    const long filled = min_long(LANES, items - first);
    for (long l = 0; l < LANES; ++l) {
      const long item = first + min_long(l, filled - 1), pair = item / N, k = item % N;
      const long *of = t->pairs + 2 * pair;
      pair_gradient_gather((double *)in + l, t->states + (of[0] * (N + 1) + k + 1) * NX,
                           t->states + (of[1] * (N + 1) + k + 1) * NX, t->pair_frames + pair * 4,
                           t->pair_reference + (pair * (N + 1) + k + 1) * 3, t->pair_weights + item * PAIR_TERMS);
    }
    pair_gradient(in, out);
    for (long l = 0; l < filled; ++l) {
      const long item = first + l, pair = item / N, k = item % N;
      const long *of = t->pairs + 2 * pair;
      const double *value = (const double *)out + l;
      double *q = t->q + (k + 1) * stride;
      cost += value[pair_cost_from * LANES];
      for (long e = 0; e < PAIR_GRADIENT; ++e) {
        const long to = pair_gradient_to[e];
        q[(to < NX ? of[0] * NZS : of[1] * NZS - NX) + to] += value[pair_gradient_from[e] * LANES];
      }
    }
  }
  return cost;
}

/* out += H in for the Hessians of eight items, whose upper triangles have the given values, rows and columns. */
static void times_lanes(const lanes *value, long size, const short *from, const short *row, const short *column,
                        const lanes *in, lanes *out) {
  for (long e = 0; e < size; ++e) {
    const lanes h = value[from[e]];
    out[row[e]] += h * in[column[e]];
    if (row[e] != column[e]) out[column[e]] += h * in[row[e]];
  }
}

/* [q; r] += [Q S'; S R] [z; u] of all stages; without u it is zero. */
static void add_hessian_times(const Team *t, const double *z, const double *u, double *q, double *r) {
  const long n = t->n, N = t->N, stride = n * NZS;
  for (long first = 0; first < n * N; first += LANES) {
    const long filled = min_long(LANES, n * N - first);
    lanes in[NZ + NU] = {{0}}, out[NZ + NU] = {{0}};
    for (long l = 0; l < filled; ++l) {
      const long place = (first + l) % N * n + (first + l) / N;
      for (int a = 0; a < NZ; ++a) in[a][l] = z[place * NZS + a];
      for (int a = 0; u && a < NU; ++a) in[NZ + a][l] = u[place * NU + a];
    }
    times_lanes(t->vehicle_out + first / LANES * VEHICLE_OUT, VEHICLE_HESSIAN, vehicle_hessian_from, vehicle_hessian_row,
                vehicle_hessian_column, in, out);
    for (long l = 0; l < filled; ++l) {
      const long place = (first + l) % N * n + (first + l) / N;
      for (int a = 0; a < NZ; ++a) q[place * NZS + a] += out[a][l];
      for (int a = 0; a < NU; ++a) r[place * NU + a] += out[NZ + a][l];
    }
  }
  for (long first = 0; first < N; first += LANES) {
    const long filled = min_long(LANES, N - first);
    lanes in[NX] = {{0}}, out[NX] = {{0}};
    for (long l = 0; l < filled; ++l)
      for (int a = 0; a < NX; ++a) in[a][l] = z[(first + l + 1) * stride + a];
    times_lanes(t->leader_hessian_out + first / LANES * LEADER_HESSIAN_OUT, LEADER_HESSIAN, leader_hessian_from,
                leader_hessian_row, leader_hessian_column, in, out);
    for (long l = 0; l < filled; ++l)
      for (int a = 0; a < NX; ++a) q[(first + l + 1) * stride + a] += out[a][l];
  }
  for (long first = 0; first < t->n_pairs * N; first += LANES) {
    const long filled = min_long(LANES, t->n_pairs * N - first);
    lanes in[2 * NX] = {{0}}, out[2 * NX] = {{0}};
    for (long l = 0; l < filled; ++l) {
      const long *of = t->pairs + (first + l) / N * 2, stage = ((first + l) % N + 1) * stride;
      for (int a = 0; a < NX; ++a) {
        in[a][l] = z[stage + of[0] * NZS + a];
        in[NX + a][l] = z[stage + of[1] * NZS + a];
      }
    }
    times_lanes(t->pair_hessian_out + first / LANES * PAIR_HESSIAN_OUT, PAIR_HESSIAN, pair_hessian_from,
                pair_hessian_row, pair_hessian_column, in, out);
    for (long l = 0; l < filled; ++l) {
      const long *of = t->pairs + (first + l) / N * 2, stage = ((first + l) % N + 1) * stride;
      for (int a = 0; a < NX; ++a) {
        q[stage + of[0] * NZS + a] += out[a][l];
        q[stage + of[1] * NZS + a] += out[NX + a][l];
      }
    }
  }
}
