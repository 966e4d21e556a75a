/* One SQP step of the team: the algorithm of reference.py with its block structure.
 *
 * Generated before this text: lanes.c, the functions of a stage on lanes, N_ROTOR (4 if the rotors may lag,
 * else 0) and tables of their outputs. Per vehicle, the stage state z is [state 12, before 4, rotors N_ROTOR]
 * and padded with zeros to NZS numbers. A block is the part of a team matrix for two vehicles, row by row.
 * Symmetric team matrices have the blocks i <= j. */

enum {
  NX = 12,
  NU = 4,
  NZ = NX + NU + N_ROTOR,
  NZS = (NZ + 7) / 8 * 8,
  NF = NX + NU,     /* columns of [A | B_f]: by the state and by the mean thrusts f */
  NV = NF + 8,      /* columns of a product: x, f, before and rotors after the stage, padded */
  BLOCK = NZ * NZS,
};

typedef struct {
  /* Sizes. */
  long n, N, n_pairs;
  /* The problem of `prepare`. */
  double memory, decay, thrust_min, thrust_max;
  const double *states;           /* guess, [n][N + 1][12] */
  const double *commands;         /* guess, [n][N][4] */
  const double *rotors;           /* guess, [n][N + 1][4] */
  const double *disturbances;     /* [n][4] */
  const double *vehicle_weights;  /* [term] */
  const double *leader_weights;   /* [N][term] */
  const double *pair_weights;     /* [pair][N][term] */
  const long *pairs;              /* [pair][2] */
  const double *leader_frame;     /* p_NI_N, yaw_NI */
  const double *pair_frames;      /* [pair][4] */
  /* What `feedback` adds; the frames are then the measured ones. */
  const double *leader_reference; /* [N + 1][4] */
  const double *pair_reference;   /* [pair][N + 1][3] */
  const double *dz0;              /* [n * NZS] */
  /* Results. */
  double *dz;                     /* [N + 1][n * NZS] */
  double *du;                     /* [N][n * NU] */
  double *slope;                  /* [N][n * NU] */
  signed char *side;              /* [N][n * NU] */
  double kkt, objective;
  long iterations, active;
  /* Work. */
  lanes *vehicle_out;             /* [group][VEHICLE_OUT] */
  lanes *leader_hessian_out, *pair_hessian_out;
  double *core;                   /* [A | B_f], [n][N][NX][NF] */
  double *gap;                    /* [N][n][NX] */
  double *q_vehicle;              /* gradient by z of the terms of vehicles, [N + 1][n * NZS] */
  double *q;                      /* the whole gradient by z, [N + 1][n * NZS] */
  double *r;                      /* gradient by u, [N][n * NU] */
  double *P;                      /* [N + 1][block][BLOCK] */
  double *P_gap;                  /* P_{k+1} gap_k, [N][n * NZS] */
  double *p;                      /* [N + 1][n * NZS] */
  double *G_uz;                   /* [N][n * NU][n * NZS] */
  double *G_uu;                   /* [N][n * NU][n * NU] */
  double *U;                      /* L', [N][n * NU][n * NU] */
  double *Y;                      /* [N][n * NU][n * NZS] */
  double *g_u;                    /* with what the fixed commands add, [N][n * NU] */
  double *y;                      /* [N][n * NU] */
  double vehicle_cost;
  long corrected;                 /* whether the factors are no longer those of `prepare` */
} Team;

static long min_long(long a, long b) { return a < b ? a : b; }

/* Block (i, j), i <= j, of the symmetric team matrix at `blocks`. */
static double *block_of(const Team *t, double *blocks, long i, long j) {
  return blocks + (i * t->n - i * (i - 1) / 2 + (j - i)) * BLOCK;
}

static double *blocks_of_stage(const Team *t, long k) { return t->P + k * (t->n * (t->n + 1) / 2) * BLOCK; }

/* --- Linearisation ------------------------------------------------------------------------------------- */

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
      double *q = t->q_vehicle + (k * t->n + i) * NZS, *r = t->r + (k * t->n + i) * NU;
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
      leader_hessian_gather((double *)in + l, t->states + (k + 1) * NX, t->leader_frame, none,
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
      leader_gradient_gather((double *)in + l, t->states + (k + 1) * NX, t->leader_frame,
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

/* --- Backward sweep of the matrices ---------------------------------------------------------------------- */

/* M = D_i' P D_j with D = [A | B_f, 0; 0, 1]: by state, mean thrusts, and what follows before and rotors. */
static void congruence(const double *P, const double *Ci, const double *Cj, lanes M[NF + NZ - NX][NV / LANES]) {
  lanes W[NZ][3];
  for (int r = 0; r < NZ; r += 4) {
    lanes sum[4][2] = {{{0}}};
    for (int s = 0; s < NX; ++s) {
      const lanes c0 = *(const lanes *)(Cj + s * NF), c1 = *(const lanes *)(Cj + s * NF + 8);
      for (int a = 0; a < 4; ++a) {
        const double factor = P[(r + a) * NZS + s];
        sum[a][0] += factor * c0;
        sum[a][1] += factor * c1;
      }
    }
    for (int a = 0; a < 4; ++a) {
      const double *row = P + (r + a) * NZS + NX;
      W[r + a][0] = sum[a][0];
      W[r + a][1] = sum[a][1];
      W[r + a][2] = N_ROTOR ? (lanes){row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]}
                            : (lanes){row[0], row[1], row[2], row[3], 0.0, 0.0, 0.0, 0.0};
    }
  }
  for (int a = 0; a < NF; a += 4) {
    lanes sum[4][3] = {{{0}}};
    for (int r = 0; r < NX; ++r)
      for (int b = 0; b < 4; ++b) {
        const double factor = Ci[r * NF + a + b];
        for (int v = 0; v < 3; ++v) sum[b][v] += factor * W[r][v];
      }
    for (int b = 0; b < 4; ++b)
      for (int v = 0; v < 3; ++v) M[a + b][v] = sum[b][v];
  }
  for (int a = NX; a < NZ; ++a)
    for (int v = 0; v < 3; ++v) M[NF + a - NX][v] = W[a][v];
}

/* A row or column by (x, f, before+, rotors+) as one by (z, u):
 * f = memory rotors + (1 - memory) u, before+ = u, rotors+ = decay rotors + (1 - decay) u. */
static void by_stage(const Team *t, const double *row, double *z, double *u) {
  for (int a = 0; a < NX; ++a) z[a] = row[a];
  for (int a = NX; a < NZS; ++a) z[a] = 0.0;
  for (int a = 0; a < NU; ++a) {
    u[a] = (1.0 - t->memory) * row[NX + a] + row[NF + a];
    if (N_ROTOR) {
      z[NX + NU + a] = t->memory * row[NX + a] + t->decay * row[NF + NU + a];
      u[a] += (1.0 - t->decay) * row[NF + NU + a];
    }
  }
}

/* G of stage k without its own cost: G_zz into P_k, G_uz and G_uu. */
static void propagate(Team *t, long k) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  double *G_uz = t->G_uz + k * nu * nz, *G_uu = t->G_uu + k * nu * nu;
  for (long i = 0; i < n; ++i)
    for (long j = i; j < n; ++j) {
      const double *P = block_of(t, blocks_of_stage(t, k + 1), i, j);
      double *G_zz = block_of(t, blocks_of_stage(t, k), i, j);
      lanes M[NF + NZ - NX][NV / LANES];
      congruence(P, t->core + (i * t->N + k) * NX * NF, t->core + (j * t->N + k) * NX * NF, M);
      const double(*m)[NV] = (const double(*)[NV])M;
      double u[NU];
      for (int a = 0; a < NX; ++a) {
        by_stage(t, m[a], G_zz + a * NZS, u);
        if (i < j)
          for (int b = 0; b < NU; ++b) G_uz[(j * NU + b) * nz + i * NZS + a] = u[b];
      }
      for (int a = NX; a < NZ; ++a)
        for (int b = 0; b < NZS; ++b) G_zz[a * NZS + b] = 0.0;
      for (int a = 0; a < NU; ++a) {
        double row[NV];
        for (int b = 0; b < NV; ++b) {
          row[b] = (1.0 - t->memory) * m[NX + a][b] + m[NF + a][b];
          if (N_ROTOR) row[b] += (1.0 - t->decay) * m[NF + NU + a][b];
        }
        by_stage(t, row, G_uz + (i * NU + a) * nz + j * NZS, u);
        for (int b = 0; b < NU; ++b) G_uu[(i * NU + a) * nu + j * NU + b] = G_uu[(j * NU + b) * nu + i * NU + a] = u[b];
        if (N_ROTOR) {
          for (int b = 0; b < NV; ++b) row[b] = t->memory * m[NX + a][b] + t->decay * m[NF + NU + a][b];
          by_stage(t, row, G_zz + (NX + NU + a) * NZS, u);
          if (i < j)
            for (int b = 0; b < NU; ++b) G_uz[(j * NU + b) * nz + i * NZS + NX + NU + a] = u[b];
        }
      }
      if (i < j)
        for (int a = NX; a < NX + NU; ++a)
          for (int b = 0; b < NU; ++b) G_uz[(j * NU + b) * nz + i * NZS + a] = 0.0;
    }
}

/* Add the Hessian of the vehicles' terms at stage k < N. */
static void add_vehicles(Team *t, long k) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  double *G_uz = t->G_uz + k * nu * nz, *G_uu = t->G_uu + k * nu * nu;
  for (long i = 0; i < n; ++i) {
    const long item = i * t->N + k;
    const double *value = (const double *)(t->vehicle_out + item / LANES * VEHICLE_OUT) + item % LANES;
    double *Q = block_of(t, blocks_of_stage(t, k), i, i);
    for (long e = 0; e < VEHICLE_HESSIAN; ++e) {
      const long a = vehicle_hessian_row[e], b = vehicle_hessian_column[e];
      const double h = value[vehicle_hessian_from[e] * LANES];
      if (b < NZ) {
        Q[a * NZS + b] += h;
        if (a != b) Q[b * NZS + a] += h;
      } else if (a < NZ) {
        G_uz[(i * NU + b - NZ) * nz + i * NZS + a] += h;
      } else {
        G_uu[(i * NU + a - NZ) * nu + i * NU + b - NZ] += h;
        if (a != b) G_uu[(i * NU + b - NZ) * nu + i * NU + a - NZ] += h;
      }
    }
  }
}

/* Add the Hessians of leader and pairs at stage k > 0. */
static void add_leader_and_pairs(Team *t, long k) {
  const double *leader =
      (const double *)(t->leader_hessian_out + (k - 1) / LANES * LEADER_HESSIAN_OUT) + (k - 1) % LANES;
  double *blocks = blocks_of_stage(t, k);
  for (long e = 0; e < LEADER_HESSIAN; ++e) {
    const long a = leader_hessian_row[e], b = leader_hessian_column[e];
    const double h = leader[leader_hessian_from[e] * LANES];
    blocks[a * NZS + b] += h;
    if (a != b) blocks[b * NZS + a] += h;
  }
  for (long pair = 0; pair < t->n_pairs; ++pair) {
    const long i = t->pairs[2 * pair], j = t->pairs[2 * pair + 1], item = pair * t->N + k - 1;
    const double *value = (const double *)(t->pair_hessian_out + item / LANES * PAIR_HESSIAN_OUT) + item % LANES;
    double *Q_ii = block_of(t, blocks, i, i), *Q_jj = block_of(t, blocks, j, j);
    double *Q_ij = i < j ? block_of(t, blocks, i, j) : block_of(t, blocks, j, i);
    for (long e = 0; e < PAIR_HESSIAN; ++e) {
      const long a = pair_hessian_row[e], b = pair_hessian_column[e];
      const double h = value[pair_hessian_from[e] * LANES];
      if (b < NX) {
        Q_ii[a * NZS + b] += h;
        if (a != b) Q_ii[b * NZS + a] += h;
      } else if (a >= NX) {
        Q_jj[(a - NX) * NZS + b - NX] += h;
        if (a != b) Q_jj[(b - NX) * NZS + a - NX] += h;
      } else {
        *(i < j ? Q_ij + a * NZS + b - NX : Q_ij + (b - NX) * NZS + a) += h;
      }
    }
  }
}

/* L L' = G_ff, Y = L^-1 G_fz, P_k = G_zz - Y' Y. Rows of fixed commands become zero. Returns whether G_ff is
 * positive definite. */
static int eliminate(Team *t, long k) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  const double *G_uz = t->G_uz + k * nu * nz, *G_uu = t->G_uu + k * nu * nu;
  double *U = t->U + k * nu * nu, *Y = t->Y + k * nu * nz;
  const signed char *side = t->side + k * nu;
  for (long a = 0; a < nu; ++a) {
    double *row = U + a * nu;
    for (long b = a; b < nu; ++b) row[b] = side[a] || side[b] ? (a == b) : G_uu[a * nu + b];
    for (long s = 0; s < a; ++s) {
      const double factor = U[s * nu + a];
      for (long b = a; b < nu; ++b) row[b] -= factor * U[s * nu + b];
    }
    if (!(row[a] > 0.0) || row[a] > 1e300) return 0;
    const double scale = 1.0 / __builtin_sqrt(row[a]);
    for (long b = a; b < nu; ++b) row[b] *= scale;
  }
  for (long panel = 0; panel < nu; panel += 4) {
    for (long c = 0; c < nz; c += LANES) {
      lanes sum[4];
      for (int a = 0; a < 4; ++a) sum[a] = side[panel + a] ? all_lanes(0.0) : *(const lanes *)(G_uz + (panel + a) * nz + c);
      for (long s = 0; s < panel; ++s) {
        const lanes above = *(const lanes *)(Y + s * nz + c);
        for (int a = 0; a < 4; ++a) sum[a] -= U[s * nu + panel + a] * above;
      }
      for (int a = 0; a < 4; ++a) {
        for (int s = 0; s < a; ++s) sum[a] -= U[(panel + s) * nu + panel + a] * sum[s];
        sum[a] *= 1.0 / U[(panel + a) * nu + panel + a];
        *(lanes *)(Y + (panel + a) * nz + c) = sum[a];
      }
    }
  }
  for (long i = 0; i < n; ++i)
    for (long j = i; j < n; ++j) {
      double *P = block_of(t, blocks_of_stage(t, k), i, j);
      for (int a = 0; a < NZ; a += 4) {
        lanes sum[4][NZS / LANES];
        for (int b = 0; b < 4; ++b)
          for (int v = 0; v < NZS / LANES; ++v) sum[b][v] = *(const lanes *)(P + (a + b) * NZS + v * LANES);
        for (long s = 0; s < nu; ++s) {
          const double *y = Y + s * nz;
          for (int b = 0; b < 4; ++b)
            for (int v = 0; v < NZS / LANES; ++v)
              sum[b][v] -= y[i * NZS + a + b] * *(const lanes *)(y + j * NZS + v * LANES);
        }
        for (int b = 0; b < 4; ++b)
          for (int v = 0; v < NZS / LANES; ++v) *(lanes *)(P + (a + b) * NZS + v * LANES) = sum[b][v];
      }
    }
  return 1;
}

/* P_{k+1} gap_k. */
static void push_gap(Team *t, long k) {
  const long n = t->n;
  double *result = t->P_gap + k * n * NZS;
  for (long e = 0; e < n * NZS; ++e) result[e] = 0.0;
  for (long i = 0; i < n; ++i)
    for (long j = i; j < n; ++j) {
      const double *P = block_of(t, blocks_of_stage(t, k + 1), i, j);
      const double *gap_i = t->gap + (k * n + i) * NX, *gap_j = t->gap + (k * n + j) * NX;
      for (int a = 0; a < NX; ++a)
        for (int b = 0; b < NZS; ++b) result[j * NZS + b] += gap_i[a] * P[a * NZS + b];
      if (i < j)
        for (int a = 0; a < NZ; ++a) {
          double sum = 0.0;
          for (int b = 0; b < NX; ++b) sum += P[a * NZS + b] * gap_j[b];
          result[i * NZS + a] += sum;
        }
    }
}

/* Stages k <= last, for the commands that are free now. */
static int factorize(Team *t, long last) {
  for (long k = last; k >= 0; --k) {
    push_gap(t, k);
    propagate(t, k);
    add_vehicles(t, k);
    if (k > 0) add_leader_and_pairs(t, k);
    if (!eliminate(t, k)) return 0;
  }
  return 1;
}

/* --- Sweeps of the vectors ------------------------------------------------------------------------------- */

static double bound_of(const Team *t, long k, long a, int side) {
  const double command = t->commands[((a / NU) * t->N + k) * NU + a % NU];
  return (side > 0 ? t->thrust_max : t->thrust_min) - command;
}

static void sweep_back(Team *t, long last) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  for (long k = last; k >= 0; --k) {
    const double *U = t->U + k * nu * nu, *Y = t->Y + k * nu * nz, *after = t->p + (k + 1) * nz;
    const double *P_gap = t->P_gap + k * nz, *q = t->q + k * nz, *r = t->r + k * nu;
    const signed char *side = t->side + k * nu;
    double *p = t->p + k * nz, *g_u = t->g_u + k * nu, *y = t->y + k * nu;
    for (long i = 0; i < n; ++i) {
      const double *C = t->core + (i * t->N + k) * NX * NF;
      double costate[NZS], by[NF] = {0.0}, row[NV] = {0.0};
      for (int a = 0; a < NZS; ++a) costate[a] = after[i * NZS + a] + P_gap[i * NZS + a];
      for (int a = 0; a < NX; ++a)
        for (int b = 0; b < NF; ++b) by[b] += costate[a] * C[a * NF + b];
      for (int b = 0; b < NF; ++b) row[b] = by[b];
      for (int b = 0; b < NZ - NX; ++b) row[NF + b] = costate[NX + b];
      by_stage(t, row, p + i * NZS, g_u + i * NU);
      for (int a = 0; a < NZS; ++a) p[i * NZS + a] += q[i * NZS + a];
      for (int a = 0; a < NU; ++a) g_u[i * NU + a] += r[i * NU + a];
    }
    for (long c = 0; c < nu; ++c)
      if (side[c]) {
        const double w = bound_of(t, k, c, side[c]);
        const double *G_uu = t->G_uu + (k * nu + c) * nu, *G_uz = t->G_uz + (k * nu + c) * nz;
        for (long a = 0; a < nu; ++a) g_u[a] += w * G_uu[a];
        for (long a = 0; a < nz; ++a) p[a] += w * G_uz[a];
      }
    for (long a = 0; a < nu; ++a) y[a] = side[a] ? 0.0 : g_u[a];
    for (long a = 0; a < nu; ++a) {
      y[a] /= U[a * nu + a];
      for (long b = a + 1; b < nu; ++b) y[b] -= U[a * nu + b] * y[a];
      for (long b = 0; b < nz; ++b) p[b] -= Y[a * nz + b] * y[a];
    }
  }
}

/* x+ = A x + B u (+ gap) of one stage. */
static void advance(const Team *t, long k, const double *z, const double *u, const double *gap, double *next) {
  for (long i = 0; i < t->n; ++i) {
    const double *C = t->core + (i * t->N + k) * NX * NF, *zi = z + i * NZS, *ui = u + i * NU;
    double in[NF], *out = next + i * NZS;
    for (int a = 0; a < NX; ++a) in[a] = zi[a];
    for (int a = 0; a < NU; ++a)
      in[NX + a] = (1.0 - t->memory) * ui[a] + (N_ROTOR ? t->memory * zi[NX + NU + a] : 0.0);
    for (int a = 0; a < NX; ++a) {
      double sum = gap ? gap[i * NX + a] : 0.0;
      for (int b = 0; b < NF; ++b) sum += C[a * NF + b] * in[b];
      out[a] = sum;
    }
    for (int a = 0; a < NU; ++a) {
      out[NX + a] = ui[a];
      if (N_ROTOR) out[NX + NU + a] = t->decay * zi[NX + NU + a] + (1.0 - t->decay) * ui[a];
    }
    for (int a = NZ; a < NZS; ++a) out[a] = 0.0;
  }
}

static void sweep_forward(Team *t) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  for (long e = 0; e < nz; ++e) t->dz[e] = t->dz0[e];
  for (long k = 0; k < t->N; ++k) {
    const double *U = t->U + k * nu * nu, *Y = t->Y + k * nu * nz, *dz = t->dz + k * nz;
    const signed char *side = t->side + k * nu;
    double *du = t->du + k * nu, *slope = t->slope + k * nu;
    for (long a = 0; a < nu; ++a) {
      double sum = t->y[k * nu + a];
      for (long b = 0; b < nz; ++b) sum += Y[a * nz + b] * dz[b];
      du[a] = -sum;
    }
    for (long a = nu - 1; a >= 0; --a) {
      for (long b = a + 1; b < nu; ++b) du[a] -= U[a * nu + b] * du[b];
      du[a] /= U[a * nu + a];
    }
    for (long a = 0; a < nu; ++a)
      if (side[a]) du[a] = 0.0;
    for (long a = 0; a < nu; ++a) {
      slope[a] = 0.0;
      if (side[a]) {
        const double *G_uu = t->G_uu + (k * nu + a) * nu, *G_uz = t->G_uz + (k * nu + a) * nz;
        double sum = t->g_u[k * nu + a];
        for (long b = 0; b < nz; ++b) sum += G_uz[b] * dz[b];
        for (long b = 0; b < nu; ++b) sum += side[b] ? 0.0 : G_uu[b] * du[b];
        slope[a] = sum;
      }
    }
    for (long a = 0; a < nu; ++a)
      if (side[a]) du[a] = bound_of(t, k, a, side[a]);
    advance(t, k, dz, du, t->gap + k * n * NX, t->dz + (k + 1) * nz);
  }
}

/* --- Active set (active_set.py) --------------------------------------------------------------------------- */

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

/* --- Results ----------------------------------------------------------------------------------------------- */

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
  t->active = 0;
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
        on_bounds += slope[e] * du[e] < 0.0 ? -slope[e] * du[e] : slope[e] * du[e];
        t->active += t->side[k * nu + e] != 0;
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
        const double *C = t->core + (i * N + k) * NX * NF;
        double row[NV] = {0.0}, by_z[NZS], by_u[NU];
        for (int a = 0; a < NX; ++a)
          for (int b = 0; b < NF; ++b) row[b] += costate[i * NZS + a] * C[a * NF + b];
        for (int b = 0; b < NZ - NX; ++b) row[NF + b] = costate[i * NZS + NX + b];
        by_stage(t, row, by_z, by_u);
        for (int a = 0; a < NU; ++a) change += (r[i * NU + a] + hu[i * NU + a] + by_u[a]) * du[i * NU + a];
        for (int a = 0; a < NZS; ++a) costate[i * NZS + a] = by_z[a] + q[i * NZS + a] + hz[i * NZS + a];
      }
    } else {
      for (long e = 0; e < nz; ++e) costate[e] = q[e] + hz[e];
    }
  }
  t->objective = objective;
  t->kkt = (change < 0.0 ? -change : change) + on_bounds;
}

/* --- The two phases ---------------------------------------------------------------------------------------- */

enum { SOLVED = 0, NOT_FINITE = 1, UNSETTLED = 2 };

int prepare(Team *t) {
  linearize_vehicles(t);
  linearize_leader_and_pairs(t);
  predict_sides(t);
  double *last = blocks_of_stage(t, t->N);
  for (long e = 0; e < t->n * (t->n + 1) / 2 * BLOCK; ++e) last[e] = 0.0;
  add_leader_and_pairs(t, t->N);
  t->corrected = 0;
  return factorize(t, t->N - 1) ? SOLVED : NOT_FINITE;
}

int feedback(Team *t) {
  const long nz = t->n * NZS;
  const double cost = gradient_of_leader_and_pairs(t);
  double finite = cost;
  for (long e = 0; e < nz; ++e) finite += t->dz0[e];
  if (!__builtin_isfinite(finite)) return NOT_FINITE;
  if (t->corrected) {
    predict_sides(t);
    if (!factorize(t, t->N - 1)) return NOT_FINITE;
    t->corrected = 0;
  }
  for (long e = 0; e < nz; ++e) t->p[t->N * nz + e] = t->q[t->N * nz + e];
  long last = t->N - 1;
  for (t->iterations = 1; t->iterations <= ACTIVE_SET_ITERATIONS_MAX; ++t->iterations) {
    sweep_back(t, last);
    sweep_forward(t);
    last = correct_sides(t);
    if (last < 0) {
      assess(t, t->vehicle_cost + cost);
      return __builtin_isfinite(t->kkt) && __builtin_isfinite(t->objective) ? SOLVED : NOT_FINITE;
    }
    t->corrected = 1;
    if (!factorize(t, last)) return NOT_FINITE;
  }
  return UNSETTLED;
}

const long team_sizes[] = {VEHICLE_OUT, LEADER_HESSIAN_OUT, PAIR_HESSIAN_OUT, VEHICLE_TERMS, LEADER_TERMS, PAIR_TERMS, NZS, NF};
