/* Eight numbers, on which every operation works at once, and functions of them without branches. */

typedef double lanes __attribute__((vector_size(64)));
typedef long long lane_bits __attribute__((vector_size(64)));

#define LANES 8

static inline lanes all_lanes(double x) { return (lanes){x, x, x, x, x, x, x, x}; }

static inline lanes lanes_if(lane_bits condition, lanes then, lanes otherwise) {
  return (lanes)(((lane_bits)then & condition) | ((lane_bits)otherwise & ~condition));
}

static inline lanes lanes_max(lanes a, lanes b) { return lanes_if(a > b, a, b); }

/* a' b of two vectors of whole lanes. */
static inline double dot(const double *a, const double *b, long size) {
  lanes sum = all_lanes(0.0);
  for (long e = 0; e < size; e += LANES) sum += *(const lanes *)(a + e) * *(const lanes *)(b + e);
  return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

/* 1 where a <= b, else 0. */
static inline lanes lanes_le(lanes a, lanes b) { return lanes_if(a <= b, all_lanes(1.0), all_lanes(0.0)); }

static inline lanes lanes_sqrt(lanes x) {
  lanes root;
  for (int l = 0; l < LANES; ++l) root[l] = __builtin_sqrt(x[l]);
  return root;
}

/* sin(x + quarters pi / 2). The argument is reduced by multiples of pi / 2 in three parts (Cody and Waite),
 * the polynomials are those of fdlibm on [-pi/4, pi/4]. Exact to the last digits up to 1e5 rad; beyond that
 * the digits run out, and a plan with such angles is of no use. */
static inline lanes lanes_sin_quarters(lanes x, double quarters) {
  const double to_integer = 6755399441055744.0; /* 1.5 * 2^52 */
  const lanes shifted = x * 0.63661977236758134308 + to_integer;
  const lanes n = shifted - to_integer;
  lanes r = x - n * 1.57079632673412561417e+00;
  r = r - n * 6.07710050630396597660e-11;
  r = r - n * 2.02226624879595063154e-21;
  const lane_bits quadrant = (lane_bits)(shifted + quarters);
  const lanes z = r * r;
  const lanes sine =
      r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 +
      z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  const lanes cosine =
      1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 +
      z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const lanes value = lanes_if((quadrant & 1) != 0, cosine, sine);
  return (lanes)((lane_bits)value ^ ((quadrant & 2) << 62));
}

static inline lanes lanes_sin(lanes x) { return lanes_sin_quarters(x, 0.0); }
static inline lanes lanes_cos(lanes x) { return lanes_sin_quarters(x, 1.0); }
