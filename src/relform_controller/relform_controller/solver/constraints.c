/* Rows h = C dz + c of the soft constraints: first those of every vehicle, then those of pairs. */

static void linearize_rows(Team *t) {
  const long N = t->N;
#if VEHICLE_ROWS
  for (long first = 0; first < t->n * N; first += LANES) {
    lanes in[VEHICLE_ROWS_IN];
    for (long l = 0; l < LANES; ++l) {
      const long item = min_long(first + l, t->n * N - 1), i = item / N, k = item % N;
      vehicle_rows_gather((double *)in + l, t->states + (i * (N + 1) + k + 1) * NX, t->vehicle_frames + i * 4);
    }
    vehicle_rows(in, t->vehicle_rows_out + first / LANES * VEHICLE_ROWS_OUT);
  }
#endif
#if PAIR_ROWS
  for (long first = 0; first < t->n_pairs * N; first += LANES) {
    lanes in[PAIR_ROWS_IN];
    for (long l = 0; l < LANES; ++l) {
      const long item = min_long(first + l, t->n_pairs * N - 1), pair = item / N, k = item % N;
      const long *of = t->pairs + 2 * pair;
      pair_rows_gather((double *)in + l, t->states + (of[0] * (N + 1) + k + 1) * NX,
                       t->states + (of[1] * (N + 1) + k + 1) * NX, t->pair_frames + pair * 4);
    }
    pair_rows(in, t->pair_rows_out + first / LANES * PAIR_ROWS_OUT);
  }
#endif
}

/* Number m of the rows of stage k + 1. */
typedef struct {
  const double *values;     /* of the item, LANES apart */
  long value_from, n_slopes;
  const short *from, *column;
  long first, second;       /* where the states of vehicle, or of observer and target, begin in z */
} Row;

static Row row_of(const Team *t, long k, long m) {
  const long of_pair = t->rows[3 * m], item = t->rows[3 * m + 1], number = t->rows[3 * m + 2];
  const RowTables *tables = of_pair ? &pair_row_tables : &vehicle_row_tables;
  const lanes *out = of_pair ? t->pair_rows_out : t->vehicle_rows_out;
  const long place = item * t->N + k, begin = tables->begin[number];
  return (Row){
      .values = (const double *)(out + place / LANES * tables->n_out) + place % LANES,
      .value_from = tables->value[number],
      .n_slopes = tables->begin[number + 1] - begin,
      .from = tables->from + begin,
      .column = tables->column + begin,
      .first = (of_pair ? t->pairs[2 * item] : item) * NZS,
      .second = of_pair ? t->pairs[2 * item + 1] * NZS - NX : 0,
  };
}

static double constant_of(const Row *row) { return row->values[row->value_from * LANES]; }
static double slope_of(const Row *row, long e) { return row->values[row->from[e] * LANES]; }
static long place_of(const Row *row, long e) {
  return row->column[e] + (row->column[e] < NX ? row->first : row->second);
}

/* C dz of one row. */
static double row_times(const Row *row, const double *dz) {
  double sum = 0.0;
  for (long e = 0; e < row->n_slopes; ++e) sum += slope_of(row, e) * dz[place_of(row, e)];
  return sum;
}

/* q += factor C' of one row. */
static void add_row(const Row *row, double factor, double *q) {
  for (long e = 0; e < row->n_slopes; ++e) q[place_of(row, e)] += factor * slope_of(row, e);
}

/* Add weight C' C of every row to the Hessian at stage k > 0. */
static void add_rows(Team *t, long k) {
  double *blocks = blocks_of_stage(t, k);
  for (long m = 0; m < t->n_rows; ++m) {
    const Row row = row_of(t, k - 1, m);
    const double weight = t->row_weight[(k - 1) * t->n_rows + m];
    for (long e = 0; e < row.n_slopes; ++e)
      for (long f = 0; f < row.n_slopes; ++f) {
        const long a = place_of(&row, e), b = place_of(&row, f), i = a / NZS, j = b / NZS;
        if (i <= j) block_of(t, blocks, i, j)[a % NZS * NZS + b % NZS] += weight * slope_of(&row, e) * slope_of(&row, f);
      }
  }
}
