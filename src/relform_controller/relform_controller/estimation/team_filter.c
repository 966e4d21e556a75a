/* The team filter of team_filter.py for any number of vehicles: the same algorithm, without overhead.

   This text follows the C code of the CasADi functions in team_model.py, and the constants of team_model.py and
   layout.py. Matrices are stored by row. A factor L of a covariance P = L L' is lower triangular, shape
   (size, size) with size = N_FILTER_STATE * n; work space is padded to whole panels, with ones on the diagonal.
   Loops over panels and tiles have fixed lengths, so that compilers keep a tile in vector registers. */

#include <math.h>
#include <string.h>

#define NX N_FILTER_STATE
#define TILE 4
#define PANEL 8
#define N_POSE 6   /* position, roll, pitch, yaw */
#define N_PLACE 4  /* position, yaw */
#define N_MONITORED 8 /* tilt, rates, specific force: the first rows of what a vehicle measures */
#define TAU 6.283185307179586476925286766559

static const long POSE[N_POSE] = {POSITION, POSITION + 1, POSITION + 2, ROLL, PITCH, YAW};
static const long PLACE[N_PLACE] = {POSITION, POSITION + 1, POSITION + 2, YAW};

static long padded(long size) { return (size + PANEL - 1) / PANEL * PANEL; }

static long least(long a, long b) { return a < b ? a : b; }

/* The same angle in (-pi, pi]. */
static double wrapped(double angle) {
    double rest = fmod(0.5 * TAU - angle, TAU);
    return 0.5 * TAU - (rest < 0.0 ? rest + TAU : rest);
}

/* ---- Dense linear algebra, by tiles of TILE rows and PANEL columns ------------------------------------------ */

/* sum += A' B over `count` rows of B; element (k, row) of A' is at A[k * a_step + row * a_row]. */
static void add_product(double sum[TILE][PANEL], const double *A, long a_row, long a_step, const double *B,
                        long b_step, long count) {
    double s[TILE][PANEL];
    memcpy(s, sum, sizeof s);
    for (long k = 0; k < count; k++)
        for (int i = 0; i < TILE; i++)
            for (int j = 0; j < PANEL; j++) s[i][j] += A[k * a_step + i * a_row] * B[k * b_step + j];
    memcpy(sum, s, sizeof s);
}

/* Replace the upper triangle of a positive definite matrix M by the triangular R with M = R' R.
   Returns 0, or 1 if M is not positive definite. */
static int factorise(double *M, long size) {
    for (long first = 0; first < size; first += PANEL) {
        for (long i = first; i < first + PANEL; i += TILE)
            for (long j = first; j < size; j += PANEL) {
                double sum[TILE][PANEL] = {{0.0}};
                add_product(sum, M + i, 1, size, M + j, size, first);
                for (int a = 0; a < TILE; a++)
                    for (int b = 0; b < PANEL; b++) M[(i + a) * size + j + b] -= sum[a][b];
            }
        for (long k = first; k < first + PANEL; k++) {
            double *row = M + k * size;
            if (!(row[k] > 0.0)) return 1;
            double scale = 1.0 / sqrt(row[k]);
            for (long j = k; j < size; j++) row[j] *= scale;
            for (long i = k + 1; i < first + PANEL; i++)
                for (long j = i; j < size; j++) M[i * size + j] -= row[i] * row[j];
        }
    }
    return 0;
}

/* Replace TILE rows of X by X R^(-1), for columns from `first` (a whole panel) on; those before are zero. */
static void divide_by_factor(double *X, const double *R, long size, long first) {
    for (long j = first; j < size; j += PANEL) {
        double x[TILE][PANEL] = {{0.0}};
        add_product(x, X + first, size, 1, R + first * size + j, size, j - first);
        for (int a = 0; a < TILE; a++)
            for (int b = 0; b < PANEL; b++) x[a][b] = X[a * size + j + b] - x[a][b];
        for (int c = 0; c < PANEL; c++) {
            const double *row = R + (j + c) * size + j;
            double scale = 1.0 / row[c];
            for (int a = 0; a < TILE; a++) {
                x[a][c] *= scale;
                for (int b = c + 1; b < PANEL; b++) x[a][b] -= x[a][c] * row[b];
            }
        }
        for (int a = 0; a < TILE; a++) memcpy(X + a * size + j, x[a], sizeof x[a]);
    }
}

/* ---- Prediction --------------------------------------------------------------------------------------------- */

/* L of F L L' F' + diag(noise), with the transition F of each vehicle. Returns 0, or 1: not positive definite.
   work: 2 padded matrices. */
int predict(long n, double *work, const double *states, const double *L, const double *thrusts, double duration,
            const double *noise, double *new_states, double *new_L) {
    const long size = NX * n, N = padded(size);
    double *G = work, *P = work + N * N; /* G = (F L)' */
    memset(G, 0, N * N * sizeof *G);
    for (long v = 0; v < n; v++) {
        double F[NX][NX], Ft[NX][NX + 1] = {{0.0}}; /* CasADi stores by column: F is the transpose */
        const double *arguments[] = {states + v * NX, thrusts + v * N_INPUT, &duration};
        double *results[] = {new_states + v * NX, F[0]};
        transition(arguments, results, 0, 0, 0);
        for (int i = 0; i < NX; i++) memcpy(Ft[i], F[i], sizeof F[i]);
        for (long k = 0; k < NX * (v + 1); k++) {
            double row[NX + 1] = {0.0};
            for (int m = 0; m < NX; m++)
                for (int i = 0; i < NX + 1; i++) row[i] += L[(v * NX + m) * size + k] * Ft[m][i];
            memcpy(G + k * N + v * NX, row, NX * sizeof *row);
        }
    }
    for (long i = 0; i < N; i += TILE)
        for (long j = i / PANEL * PANEL; j < N; j += PANEL) {
            double sum[TILE][PANEL] = {{0.0}};
            long count = least(size, ((i + TILE - 1) / NX + 1) * NX); /* L is lower triangular */
            add_product(sum, G + i, 1, N, G + j, N, count);
            for (int a = 0; a < TILE; a++) memcpy(P + (i + a) * N + j, sum[a], sizeof sum[a]);
        }
    for (long i = 0; i < size; i++) P[i * N + i] += noise[i];
    for (long i = size; i < N; i++) P[i * N + i] = 1.0;
    int failed = factorise(P, N);
    memset(new_L, 0, size * size * sizeof *new_L);
    for (long i = 0; i < size; i++)
        for (long k = 0; k <= i; k++) new_L[i * size + k] = P[k * N + i];
    return failed;
}

/* ---- Innovation --------------------------------------------------------------------------------------------- */

/* S = I + H P H' for rows of the whitened H that depend on few states.
   H is given by column, [count][rows]; column m belongs to state `state[m]`. Only the first `support` columns of
   these rows of L are not zero. */
static inline void innovation_covariance(double *S, int rows, const double *H, const long *state, int count,
                                         const double *L, long size, long support) {
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < rows; j++) S[i * rows + j] = i == j;
    for (long k = 0; k < support; k++) {
        double w[N_MONITORED] = {0.0}; /* a column of W = H L */
        for (int m = 0; m < count; m++)
            for (int i = 0; i < rows; i++) w[i] += L[state[m] * size + k] * H[m * rows + i];
        for (int i = 0; i < rows; i++)
            for (int j = 0; j < rows; j++) S[i * rows + j] += w[i] * w[j];
    }
}

/* Root^(-1) r for `count` rows of an innovation covariance S from `first` on; returns its squared length. */
static double normalise(const double *S, int rows, int first, int count, const double *r, double *normalised) {
    double root[N_MONITORED][N_MONITORED], squared = 0.0;
    for (int i = 0; i < count; i++) {
        double rest = r[i];
        for (int j = 0; j <= i; j++) {
            double sum = S[(first + i) * rows + first + j];
            for (int k = 0; k < j; k++) sum -= root[i][k] * root[j][k];
            root[i][j] = i == j ? sqrt(sum) : sum / root[j][j];
            if (j < i) rest -= root[i][j] * normalised[j];
        }
        normalised[i] = rest / root[i][i];
        squared += normalised[i] * normalised[i];
    }
    return squared;
}

/* What each vehicle measured of itself: measured minus expected, whitened, its derivative by the vehicle's state,
   and what the monitors ask of it. */
static void own_innovation(long v, const double *state, const double *L, long size, const double *thrusts,
                           const double *measured, const double *weights, double *own, double *own_by_state,
                           double *forces, double *torque_distance) {
    double expected[N_OWN_ROWS], H[NX][N_OWN_ROWS], monitored[NX][N_MONITORED], S[N_MONITORED * N_MONITORED];
    const double *arguments[] = {state, thrusts};
    double *results[] = {expected, H[0]}, unused[N_MONITORED];
    own_measurement(arguments, results, 0, 0, 0);
    long states[NX];
    for (int m = 0; m < NX; m++) states[m] = v * NX + m;
    for (int row = 0; row < N_OWN_ROWS; row++) {
        double difference = measured[row] - expected[row];
        if (row < RATE_ROWS || row == YAW_ROW) difference = wrapped(difference);
        own[row] = weights[row] * difference;
        for (int m = 0; m < NX; m++) own_by_state[row * NX + m] = weights[row] * H[m][row];
    }
    for (int m = 0; m < NX; m++)
        for (int row = 0; row < N_MONITORED; row++) monitored[m][row] = own_by_state[row * NX + m];
    innovation_covariance(S, N_MONITORED, monitored[VELOCITY], states + VELOCITY, THRUST_SCALE + 1 - VELOCITY, L,
                          size, NX * (v + 1));
    *torque_distance = normalise(S, N_MONITORED, 0, SPECIFIC_FORCE_ROWS, own, unused);
    normalise(S, N_MONITORED, SPECIFIC_FORCE_ROWS, 3, own + SPECIFIC_FORCE_ROWS, forces);
}

/* Squared distance of the leader's measured position and yaw. */
static double localization_distance(const double *own, const double *own_by_state, const double *L, long size) {
    static const int ROWS[N_PLACE] = {POSITION_ROWS, POSITION_ROWS + 1, POSITION_ROWS + 2, YAW_ROW};
    double r[N_PLACE], H[N_PLACE][N_PLACE], S[N_PLACE * N_PLACE], unused[N_PLACE];
    for (int i = 0; i < N_PLACE; i++) {
        r[i] = own[ROWS[i]];
        for (int m = 0; m < N_PLACE; m++) H[m][i] = own_by_state[ROWS[i] * NX + PLACE[m]];
    }
    innovation_covariance(S, N_PLACE, H[0], PLACE, N_PLACE, L, size, NX);
    return normalise(S, N_PLACE, 0, N_PLACE, r, unused);
}

/* A sighting (eqs. CameraRange1, 2): whitened innovation, its derivatives by the observer's pose and by the
   target's position. Returns its squared distance. */
static double sighting_innovation(long i, long j, const double *states, const double *L, long size,
                                  const double *measured, const double *weights, double *innovation,
                                  double *by_observer, double *by_target) {
    double expected[3], H[2][NX][3], difference[3], columns[N_POSE + 3][TILE] = {{0.0}}, S[TILE * TILE], unused[3];
    const double *arguments[] = {states + i * NX, states + j * NX};
    double *results[] = {expected, H[0][0], H[1][0]};
    sighting(arguments, results, 0, 0, 0);
    for (int row = 0; row < 3; row++) {
        difference[row] = measured[row] - expected[row];
        if (row > 0) difference[row] = wrapped(difference[row]);
    }
    long state[N_POSE + 3];
    for (int m = 0; m < N_POSE + 3; m++) {
        const double *column = m < N_POSE ? H[0][POSE[m]] : H[1][POSE[m - N_POSE]];
        state[m] = m < N_POSE ? i * NX + POSE[m] : j * NX + POSE[m - N_POSE];
        for (int row = 0; row < 3; row++) {
            for (int k = 0; k < 3; k++) columns[m][row] += weights[row * 3 + k] * column[k];
            *(m < N_POSE ? by_observer + row * N_POSE + m : by_target + row * 3 + m - N_POSE) = columns[m][row];
        }
    }
    for (int row = 0; row < 3; row++) {
        innovation[row] = 0.0;
        for (int k = 0; k < 3; k++) innovation[row] += weights[row * 3 + k] * difference[k];
    }
    innovation_covariance(S, TILE, columns[0], state, N_POSE + 3, L, size, NX * ((i > j ? i : j) + 1));
    return normalise(S, TILE, 0, 3, innovation, unused);
}

/* The fields of an Innovation, in their order. */
void innovate(long n, const double *states, const double *L, const double *thrusts, const double *own_measured,
              const double *own_weights, const double *sightings_measured, const double *sighting_weights,
              double *own, double *own_by_state, double *sightings, double *sightings_by_observer,
              double *sightings_by_target, double *forces, double *torque_distances, double *sighting_distances,
              double *leader_distance) {
    const long size = NX * n;
    for (long v = 0; v < n; v++)
        own_innovation(v, states + v * NX, L, size, thrusts + v * N_INPUT, own_measured + v * N_OWN_ROWS,
                       own_weights + v * N_OWN_ROWS, own + v * N_OWN_ROWS, own_by_state + v * N_OWN_ROWS * NX,
                       forces + v * 3, torque_distances + v);
    *leader_distance = localization_distance(own, own_by_state, L, size);
    for (long i = 0, pair = 0; i < n; i++)
        for (long j = 0; j < n; j++)
            if (i != j) {
                sighting_distances[pair] = sighting_innovation(
                    i, j, states, L, size, sightings_measured + pair * 3, sighting_weights + pair * 9,
                    sightings + pair * 3, sightings_by_observer + pair * 3 * N_POSE,
                    sightings_by_target + pair * 9);
                pair++;
            }
}

/* ---- Correction --------------------------------------------------------------------------------------------- */

/* Add h h' to the information matrix and h r to the information vector; h has few non-zero elements. */
static void add_information(double *information, double *vector, long N, const double *h, const long *state,
                            int count, double r) {
    for (int i = 0; i < count; i++) {
        if (h[i] == 0.0) continue;
        vector[state[i]] += h[i] * r;
        for (int j = 0; j < count; j++) information[state[i] * N + state[j]] += h[i] * h[j];
    }
}

/* The information H' H and H' r of a whole observation. */
static void gather_information(double *information, double *vector, long n, long N, const double *own,
                               const double *own_by_state, const double *sightings, const double *by_observer,
                               const double *by_target) {
    long state[NX];
    for (long v = 0; v < n; v++) {
        for (int m = 0; m < NX; m++) state[m] = v * NX + m;
        for (long row = v * N_OWN_ROWS; row < (v + 1) * N_OWN_ROWS; row++)
            add_information(information, vector, N, own_by_state + row * NX, state, THRUST_SCALE + 1, own[row]);
    }
    for (long i = 0, row = 0; i < n; i++)
        for (long j = 0; j < n; j++)
            for (int component = 0; i != j && component < 3; component++, row++) {
                double h[N_POSE + 3];
                memcpy(h, by_observer + row * N_POSE, N_POSE * sizeof *h);
                memcpy(h + N_POSE, by_target + row * 3, 3 * sizeof *h);
                for (int m = 0; m < N_POSE; m++) state[m] = i * NX + POSE[m];
                for (int m = 0; m < 3; m++) state[N_POSE + m] = j * NX + POSE[m];
                add_information(information, vector, N, h, state, N_POSE + 3, sightings[row]);
            }
}

/* With the information matrix A = H' H of the whitened measurements, the new factor is L U'^(-1), where
   I + L' A L = U U' and U is upper triangular, so that it is lower triangular, too. The change of the states is
   the new covariance times H' r. The columns of L are taken in reversed order: then U' becomes the upper
   triangular R of `factorise`. Returns 0, or 1: not positive definite.
   work: 3 padded matrices. */
int correct(long n, double *work, const double *states, const double *L, const double *own,
            const double *own_by_state, const double *sightings, const double *by_observer,
            const double *by_target, double *new_states, double *new_L) {
    const long size = NX * n, N = padded(size), last = N - 1;
    double *A = work, *X = work + N * N, *AX = work + 2 * N * N;
    double *M = A, *change = AX; /* they take the places of those that are no longer needed */
    double *vector = new_states; /* H' r, until the states come out */
    memset(work, 0, 3 * N * N * sizeof *work);
    memset(vector, 0, size * sizeof *vector);
    gather_information(A, vector, n, N, own, own_by_state, sightings, by_observer, by_target);
    for (long m = 0; m < size; m++) /* X is L with reversed columns: row m is zero before column last - m */
        for (long k = 0; k <= m; k++) X[m * N + last - k] = L[m * size + k];
    for (long m = size; m < N; m++) X[m * N + last - m] = 1.0;
    for (long v = 0; v < n; v++)
        for (long m = v * NX; m < v * NX + THRUST_SCALE + 1; m += TILE)
            for (long j = (last - least(m + TILE - 1, last)) / PANEL * PANEL; j < N; j += PANEL) {
                double sum[TILE][PANEL] = {{0.0}};
                long is_pose = m < v * NX + RATE;
                for (long w = is_pose ? 0 : v; w < (is_pose ? n : v + 1); w++) {
                    long from = w * NX, count = w == v ? THRUST_SCALE + 1 : RATE;
                    if (from + count > last - (j + PANEL - 1))
                        add_product(sum, A + m * N + from, N, 1, X + from * N + j, N, count);
                }
                for (int a = 0; a < TILE; a++) memcpy(AX + (m + a) * N + j, sum[a], sizeof sum[a]);
            }
    for (long i = 0; i < N; i += TILE)
        for (long j = i / PANEL * PANEL; j < N; j += PANEL) {
            double sum[TILE][PANEL] = {{0.0}};
            long from = last - (i + TILE - 1);
            add_product(sum, X + from * N + i, 1, N, AX + from * N + j, N, N - from);
            for (int a = 0; a < TILE; a++) {
                memcpy(M + (i + a) * N + j, sum[a], sizeof sum[a]);
                if (i + a >= j && i + a < j + PANEL) M[(i + a) * N + i + a] += 1.0;
            }
        }
    int failed = factorise(M, N);
    for (long m = 0; m < N; m += TILE) divide_by_factor(X + m * N, M, N, (last - (m + TILE - 1)) / PANEL * PANEL);
    memset(change, 0, N * sizeof *change); /* X' H' r: in coordinates of the factor */
    for (long m = 0; m < size; m++)
        for (long k = last - m; k < N; k++) change[k] += X[m * N + k] * vector[m];
    for (long m = 0; m < size; m++) {
        double sum[PANEL] = {0.0};
        for (long k = (last - m) / PANEL * PANEL; k < N; k += PANEL)
            for (int b = 0; b < PANEL; b++) sum[b] += X[m * N + k + b] * change[k + b];
        new_states[m] = states[m];
        for (int b = 0; b < PANEL; b++) new_states[m] += sum[b];
        if (m % NX == YAW) new_states[m] = wrapped(new_states[m]);
    }
    memset(new_L, 0, size * size * sizeof *new_L);
    for (long m = 0; m < size; m++)
        for (long k = 0; k <= m; k++) new_L[m * size + k] = X[m * N + last - k];
    return failed;
}

/* ---- The belief in the frames of the vehicles --------------------------------------------------------------- */

static void rotate_back(double yaw_cos, double yaw_sin, const double *v_N, double *v_I) {
    v_I[0] = yaw_cos * v_N[0] + yaw_sin * v_N[1];
    v_I[1] = yaw_cos * v_N[1] - yaw_sin * v_N[0];
    v_I[2] = v_N[2];
}

/* The functions of team_geometry.py. work: 2 padded matrices. */
void geometry(long n, double *work, const double *states, const double *L, double *states_I, double *p_I1I2_I1,
              double *yaw_I1I2, double *disturbances_I, double *pair_covariances, double *leader_covariance) {
    const long size = NX * n, N = padded(N_PLACE * n);
    double *rows = work, *P = work + N * size; /* L of the places, transposed, and their covariance */
    memset(rows, 0, N * size * sizeof *rows);
    for (long v = 0; v < n; v++)
        for (int m = 0; m < N_PLACE; m++)
            for (long k = 0; k < NX * (v + 1); k++)
                rows[k * N + v * N_PLACE + m] = L[(v * NX + PLACE[m]) * size + k];
    for (long i = 0; i < N; i += TILE)
        for (long j = 0; j < N; j += PANEL) {
            double sum[TILE][PANEL] = {{0.0}};
            add_product(sum, rows + i, 1, N, rows + j, N, least(size, NX * (i / N_PLACE + 1)));
            for (int a = 0; a < TILE; a++) memcpy(P + (i + a) * N + j, sum[a], sizeof sum[a]);
        }
    for (int i = 0; i < N_PLACE; i++) memcpy(leader_covariance + i * N_PLACE, P + i * N, N_PLACE * sizeof *P);
    for (long i = 0, pair = 0; i < n; i++) {
        const double *x = states + i * NX, c = cos(x[YAW]), s = sin(x[YAW]);
        memcpy(states_I + i * N_STATE, x, N_STATE * sizeof *x);
        memset(states_I + i * N_STATE + POSITION, 0, 3 * sizeof *x);
        states_I[i * N_STATE + YAW] = 0.0;
        rotate_back(c, s, x + VELOCITY, states_I + i * N_STATE + VELOCITY);
        rotate_back(c, s, x + DISTURBANCE, disturbances_I + i * 3);
        for (long j = 0; j < n; j++) {
            if (i == j) continue;
            const double *y = states + j * NX;
            double p_N[3], *p = p_I1I2_I1 + pair * 3;
            for (int k = 0; k < 3; k++) p_N[k] = y[POSITION + k] - x[POSITION + k];
            rotate_back(c, s, p_N, p);
            yaw_I1I2[pair] = wrapped(y[YAW] - x[YAW]);
            /* Derivatives by the places of observer and target; a turn of the observer turns what it sees back. */
            double J[N_PLACE][2 * N_PLACE] = {{-c, -s, 0, p[1], c, s, 0, 0},
                                              {s, -c, 0, -p[0], -s, c, 0, 0},
                                              {0, 0, -1, 0, 0, 0, 1, 0},
                                              {0, 0, 0, -1, 0, 0, 0, 1}};
            double JP[N_PLACE][2 * N_PLACE] = {{0.0}};
            for (int a = 0; a < N_PLACE; a++)
                for (int k = 0; k < 2 * N_PLACE; k++) {
                    const double *row = P + (k < N_PLACE ? i * N_PLACE + k : j * N_PLACE + k - N_PLACE) * N;
                    for (int b = 0; b < N_PLACE; b++) {
                        JP[a][b] += J[a][k] * row[i * N_PLACE + b];
                        JP[a][N_PLACE + b] += J[a][k] * row[j * N_PLACE + b];
                    }
                }
            for (int a = 0; a < N_PLACE; a++)
                for (int b = 0; b < N_PLACE; b++) {
                    double sum = 0.0;
                    for (int k = 0; k < 2 * N_PLACE; k++) sum += JP[a][k] * J[b][k];
                    pair_covariances[(pair * N_PLACE + a) * N_PLACE + b] = sum;
                }
            pair++;
        }
    }
}
