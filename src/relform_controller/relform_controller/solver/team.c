/* One SQP step of the team: the algorithm of reference.py with its block structure.
 *
 * Generated before this text: the functions of a stage on lanes, tables of their outputs, N_ROTOR (4 if the
 * rotors may lag, else 0), and the structure Team. Per vehicle, the stage state z is [state 12, before 4,
 * rotors N_ROTOR] and padded with zeros to NZS numbers. A block is the part of a team matrix for two vehicles,
 * row by row. Symmetric team matrices have the blocks i <= j. */

enum {
  NX = 12,
  NU = 4,
  NZ = NX + NU + N_ROTOR,
  NZS = (NZ + 7) / 8 * 8,
  NF = NX + NU,     /* columns of [A | B_f]: by the state and by the mean thrusts f */
  NV = NF + 8,      /* columns of a product: x, f, before and rotors after the stage, padded */
  BLOCK = NZ * NZS,
};

enum { SOLVED = 0, NOT_FINITE = 1, NOT_CONVERGED = 2 };

static long min_long(long a, long b) { return a < b ? a : b; }
static double min_double(double a, double b) { return a < b ? a : b; }
static double max_double(double a, double b) { return a > b ? a : b; }
static double magnitude(double a) { return a < 0.0 ? -a : a; }

/* Block (i, j), i <= j, of the symmetric team matrix at `blocks`. */
static double *block_of(const Team *t, double *blocks, long i, long j) {
  return blocks + (i * t->n - i * (i - 1) / 2 + (j - i)) * BLOCK;
}

static double *blocks_of_stage(const Team *t, long k) { return t->P + k * (t->n * (t->n + 1) / 2) * BLOCK; }

/* Upper (side > 0) or lower bound of du. */
static double bound_of(const Team *t, long k, long a, int side) {
  const double command = t->commands[((a / NU) * t->N + k) * NU + a % NU];
  return (side > 0 ? t->thrust_max : t->thrust_min) - command;
}
