/* The Riccati recursion (riccati.py): sweeps of the matrices, then of the vectors. */

/* M = D_i' P D_j with D = [A | B_f, 0; 0, 1]: by state, mean thrusts, and what follows before and rotors. */
static void congruence(const double *P, int is_diagonal, const double *Ci, const double *Cj,
                       lanes M[NF + NZ - NX][NV / LANES]) {
  lanes W[NZ][3];
  for (int r = 0; r < NZ; r += 4) {
    lanes sum[4][2] = {{{0}}};
    const int is_below = is_diagonal && r >= LANES; /* `eliminate` keeps only what is above the diagonal */
    int s = 0;
    for (; s < CORE_END_1; ++s) {
      const lanes c0 = *(const lanes *)(Cj + s * NF), c1 = *(const lanes *)(Cj + s * NF + 8);
      for (int a = 0; a < 4; ++a) {
        const double factor = is_below && s < LANES ? P[s * NZS + r + a] : P[(r + a) * NZS + s];
        sum[a][0] += factor * c0;
        sum[a][1] += factor * c1;
      }
    }
    for (; s < NX; ++s) {
      const lanes c1 = *(const lanes *)(Cj + s * NF + 8);
      for (int a = 0; a < 4; ++a) sum[a][1] += P[(r + a) * NZS + s] * c1;
    }
    for (int a = 0; a < 4; ++a) {
      const double *row = P + (r + a) * NZS + NX;
      W[r + a][0] = sum[a][0];
      W[r + a][1] = sum[a][1];
      W[r + a][2] = N_ROTOR ? (lanes){row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]}
                            : (lanes){row[0], row[1], row[2], row[3], 0.0, 0.0, 0.0, 0.0};
    }
  }
  for (int v = 0; v < 3; ++v) {
    for (int a = 0; a < 3; ++a) M[a][v] = W[a][v]; /* a position moves nothing but itself */
    lanes sum = {0};
    for (int r = 0; r < CORE_END_0; ++r) sum += Ci[r * NF + 3] * W[r][v];
    M[3][v] = sum;
  }
  for (int a = 4; a < NF; a += 4) {
    lanes sum[4][3] = {{{0}}};
    const int end = a < 8 ? CORE_END_1 : NX;
    for (int r = 0; r < end; ++r)
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

/* G of stage k without its own cost: G_zz into P_k, G_uz into Y, and G_uu. */
static void propagate(Team *t, long k) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  double *G_uz = t->Y + k * nu * nz, *G_uu = t->G_uu + k * nu * nu;
  for (long i = 0; i < n; ++i)
    for (long j = i; j < n; ++j) {
      const double *P = block_of(t, blocks_of_stage(t, k + 1), i, j);
      double *G_zz = block_of(t, blocks_of_stage(t, k), i, j);
      lanes M[NF + NZ - NX][NV / LANES];
      congruence(P, i == j, t->core + (i * t->N + k) * NX * NF, t->core + (j * t->N + k) * NX * NF, M);
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
  double *G_uz = t->Y + k * nu * nz, *G_uu = t->G_uu + k * nu * nu;
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

/* L L' = G_ff, Y = L^-1 G_fz, P_k = G_zz - Y' Y. Rows of fixed commands remain those of G_uz. Returns whether
 * G_ff is positive definite. */
static int eliminate(Team *t, long k) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  const double *G_uu = t->G_uu + k * nu * nu;
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
  long free[nu], n_free = 0;
  for (long a = 0; a < nu; ++a)
    if (!side[a]) free[n_free++] = a;
  for (long panel = 0; panel < nu; panel += 4) {
    for (long c = 0; c < nz; c += LANES) {
      lanes sum[4];
      for (int a = 0; a < 4; ++a) sum[a] = *(const lanes *)(Y + (panel + a) * nz + c);
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
        if (NZS == 2 * LANES && i == j && a >= LANES) { /* only what is above the diagonal */
          lanes sum[4];
          for (int b = 0; b < 4; ++b) sum[b] = *(const lanes *)(P + (a + b) * NZS + LANES);
          for (long f = 0; f < n_free; ++f) {
            const double *y = Y + free[f] * nz + i * NZS;
            for (int b = 0; b < 4; ++b) sum[b] -= y[a + b] * *(const lanes *)(y + LANES);
          }
          for (int b = 0; b < 4; ++b) *(lanes *)(P + (a + b) * NZS + LANES) = sum[b];
          continue;
        }
        lanes sum[4][NZS / LANES];
        for (int b = 0; b < 4; ++b)
          for (int v = 0; v < NZS / LANES; ++v) sum[b][v] = *(const lanes *)(P + (a + b) * NZS + v * LANES);
        for (long f = 0; f < n_free; ++f) {
          const double *y = Y + free[f] * nz;
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

/* The Hessian of the interior-point method at stage k < N. */
static void add_barrier(Team *t, long k) {
  const long nu = t->n * NU;
  for (long a = 0; a < nu; ++a) t->G_uu[(k * nu + a) * nu + a] += t->bound_weight[k * nu + a];
  if (k > 0) add_rows(t, k);
}

/* P_N without soft constraints. */
static void clear_last_stage(Team *t) {
  double *last = blocks_of_stage(t, t->N);
  for (long e = 0; e < t->n * (t->n + 1) / 2 * BLOCK; ++e) last[e] = 0.0;
  add_leader_and_pairs(t, t->N);
}

/* Stages k <= last, for the commands that are free now. */
static int factorize(Team *t, long last) {
  for (long k = last; k >= 0; --k) {
    propagate(t, k);
    add_vehicles(t, k);
    if (k > 0) add_leader_and_pairs(t, k);
    if (t->has_barrier) add_barrier(t, k);
    if (!eliminate(t, k)) return 0;
  }
  return 1;
}

/* [A B]' costate of one vehicle. */
static void pull_back(const Team *t, long k, long i, const double *costate, double *by_z, double *by_u) {
  const double *C = t->core + (i * t->N + k) * NX * NF;
  double row[NV] = {0.0};
  for (int a = 0; a < NX; ++a)
    for (int b = 0; b < NF; ++b) row[b] += costate[a] * C[a * NF + b];
  for (int b = 0; b < NZ - NX; ++b) row[NF + b] = costate[NX + b];
  by_stage(t, row, by_z, by_u);
}

static void sweep_back(Team *t, long last) {
  const long n = t->n, nz = n * NZS, nu = n * NU;
  for (long k = last; k >= 0; --k) {
    const double *U = t->U + k * nu * nu, *Y = t->Y + k * nu * nz, *after = t->p + (k + 1) * nz;
    const double *q = t->q + k * nz, *r = t->r + k * nu;
    const signed char *side = t->side + k * nu;
    double *p = t->p + k * nz, *g_u = t->g_u + k * nu, *y = t->y + k * nu;
    for (long i = 0; i < n; ++i) {
      pull_back(t, k, i, after + i * NZS, p + i * NZS, g_u + i * NU);
      for (int a = 0; a < NZS; ++a) p[i * NZS + a] += q[i * NZS + a];
      for (int a = 0; a < NU; ++a) g_u[i * NU + a] += r[i * NU + a];
    }
    for (long c = 0; c < nu; ++c)
      if (side[c]) {
        const double w = bound_of(t, k, c, side[c]);
        const double *G_uu = t->G_uu + (k * nu + c) * nu, *G_uz = Y + c * nz;
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

/* z+ = A z + B u (+ gap) of one stage. */
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
  const long nz = t->n * NZS, nu = t->n * NU;
  for (long e = 0; e < nz; ++e) t->dz[e] = 0.0;
  for (long k = 0; k < t->N; ++k) {
    const double *U = t->U + k * nu * nu, *Y = t->Y + k * nu * nz, *dz = t->dz + k * nz;
    const signed char *side = t->side + k * nu;
    double *du = t->du + k * nu, *slope = t->slope + k * nu;
    for (long a = 0; a < nu; ++a) du[a] = -t->y[k * nu + a] - dot(Y + a * nz, dz, nz);
    for (long a = nu - 1; a >= 0; --a) {
      for (long b = a + 1; b < nu; ++b) du[a] -= U[a * nu + b] * du[b];
      du[a] /= U[a * nu + a];
    }
    for (long a = 0; a < nu; ++a)
      if (side[a]) du[a] = 0.0;
    for (long a = 0; a < nu; ++a) {
      slope[a] = 0.0;
      if (side[a]) {
        const double *G_uu = t->G_uu + (k * nu + a) * nu, *G_uz = Y + a * nz;
        double sum = t->g_u[k * nu + a] + dot(G_uz, dz, nz);
        for (long b = 0; b < nu; ++b) sum += side[b] ? 0.0 : G_uu[b] * du[b];
        slope[a] = sum;
      }
    }
    for (long a = 0; a < nu; ++a)
      if (side[a]) du[a] = bound_of(t, k, a, side[a]);
    advance(t, k, dz, du, 0, t->dz + (k + 1) * nz);
  }
}
