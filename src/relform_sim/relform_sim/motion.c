/* The motion of a vehicle over an interval (motion.py, rigid_body.py, contact.py, integrate.py). Every operation is that of the
 * Python code, in the same order, and none is fused with another: results are equal to the last bit. */

#include <math.h>

enum { N_STATE = 13, N_ROTORS = 4 };

/* The same as `_Vehicle` in motion_kernel.py. */
typedef struct {
  double mass, inertia[3], arm_length, thrust_coefficient, torque_coefficient, drag_coefficient[3];
  double spread, length, stiffness, damping, grip, reach; /* of the legs; reach -INFINITY: there is no ground */
  double step, rotor_time_constant;
  double rotor_speeds[N_ROTORS], commanded[N_ROTORS], wind_N[3], thrust_scale, rotor_scales[N_ROTORS]; /* of the interval */
  double state[N_STATE];
} Vehicle;

typedef struct {
  double thrust, torque[3];
} Wrench;

static Wrench wrench_after(const Vehicle *v, double time) {
  double squares[N_ROTORS];
  for (int i = 0; i < N_ROTORS; ++i) {
    double speed = v->commanded[i];
    if (v->rotor_time_constant != 0.0)
      speed = speed + (v->rotor_speeds[i] - speed) * exp(-time / v->rotor_time_constant);
    squares[i] = v->rotor_scales[i] * (speed * speed);
  }
  const double c_T = v->thrust_scale * v->thrust_coefficient, c_Q = v->thrust_scale * v->torque_coefficient;
  const double d = v->arm_length, front = squares[0], left = squares[1], back = squares[2], right = squares[3];
  return (Wrench){c_T * (front + left + back + right),
                  {d * c_T * (left - right), d * c_T * (back - front), c_Q * (front - left + back - right)}};
}

/* Adds what the ground does to a vehicle with this attitude: force in the world frame, torque in the body frame. */
static void add_ground_forces(const Vehicle *v, const double r[3][3], const double *state, double *force_N,
                              double *torque) {
  const double a = v->spread, z = -v->length, feet[4][2] = {{a, 0.0}, {0.0, a}, {-a, 0.0}, {0.0, -a}};
  const double wx = state[10], wy = state[11], wz = state[12];
  double force_x = 0.0, force_y = 0.0, force_z = 0.0, torque_x = 0.0, torque_y = 0.0, torque_z = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double x = feet[i][0], y = feet[i][1];
    const double depth = -(state[2] + (r[2][0] * x + r[2][1] * y + r[2][2] * z));
    if (depth <= 0.0) continue;
    const double ux = wy * z - wz * y, uy = wz * x - wx * z, uz = wx * y - wy * x;
    const double sx = state[3] + (r[0][0] * ux + r[0][1] * uy + r[0][2] * uz);
    const double sy = state[4] + (r[1][0] * ux + r[1][1] * uy + r[1][2] * uz);
    const double sz = state[5] + (r[2][0] * ux + r[2][1] * uy + r[2][2] * uz);
    const double fz = v->stiffness * depth * (1.0 - v->damping * sz);
    if (fz <= 0.0) continue;
    const double limit = FRICTION * fz;
    const double viscous = v->grip * limit / sqrt(limit * limit + v->grip * v->grip * (sx * sx + sy * sy));
    const double fx = -viscous * sx, fy = -viscous * sy;
    const double bx = r[0][0] * fx + r[1][0] * fy + r[2][0] * fz;
    const double by = r[0][1] * fx + r[1][1] * fy + r[2][1] * fz;
    const double bz = r[0][2] * fx + r[1][2] * fy + r[2][2] * fz;
    force_x += fx;
    force_y += fy;
    force_z += fz;
    torque_x += y * bz - z * by;
    torque_y += z * bx - x * bz;
    torque_z += x * by - y * bx;
  }
  force_N[0] += force_x;
  force_N[1] += force_y;
  force_N[2] += force_z;
  torque[0] += torque_x;
  torque[1] += torque_y;
  torque[2] += torque_z;
}

static void rate(const Vehicle *v, double time, const double *state, double *rates) {
  const double vx = state[3], vy = state[4], vz = state[5];
  const double x = state[6], y = state[7], z = state[8], w = state[9];
  const double wx = state[10], wy = state[11], wz = state[12];
  const double r11 = 1.0 - 2.0 * (y * y + z * z), r12 = 2.0 * (x * y - w * z), r13 = 2.0 * (x * z + w * y);
  const double r21 = 2.0 * (x * y + w * z), r22 = 1.0 - 2.0 * (x * x + z * z), r23 = 2.0 * (y * z - w * x);
  const double r31 = 2.0 * (x * z - w * y), r32 = 2.0 * (y * z + w * x), r33 = 1.0 - 2.0 * (x * x + y * y);
  const double m = v->mass, ix = v->inertia[0], iy = v->inertia[1], iz = v->inertia[2];
  const double dx = v->drag_coefficient[0], dy = v->drag_coefficient[1], dz = v->drag_coefficient[2];
  Wrench wrench = wrench_after(v, time);
  double external_N[3] = {v->wind_N[0], v->wind_N[1], v->wind_N[2]};
  if (state[2] < v->reach) {
    const double R_NB[3][3] = {{r11, r12, r13}, {r21, r22, r23}, {r31, r32, r33}};
    add_ground_forces(v, R_NB, state, external_N, wrench.torque);
  }
  const double fx = -dx * (r11 * vx + r21 * vy + r31 * vz);
  const double fy = -dy * (r12 * vx + r22 * vy + r32 * vz);
  const double fz = -dz * (r13 * vx + r23 * vy + r33 * vz) + wrench.thrust;
  const double hx = ix * wx, hy = iy * wy, hz = iz * wz;
  rates[0] = vx;
  rates[1] = vy;
  rates[2] = vz;
  rates[3] = (r11 * fx + r12 * fy + r13 * fz + external_N[0]) / m;
  rates[4] = (r21 * fx + r22 * fy + r23 * fz + external_N[1]) / m;
  rates[5] = (r31 * fx + r32 * fy + r33 * fz + external_N[2]) / m - GRAVITY;
  rates[6] = 0.5 * (w * wx + y * wz - z * wy);
  rates[7] = 0.5 * (w * wy + z * wx - x * wz);
  rates[8] = 0.5 * (w * wz + x * wy - y * wx);
  rates[9] = -0.5 * (x * wx + y * wy + z * wz);
  rates[10] = (wrench.torque[0] - (wy * hz - wz * hy)) / ix;
  rates[11] = (wrench.torque[1] - (wz * hx - wx * hz)) / iy;
  rates[12] = (wrench.torque[2] - (wx * hy - wy * hx)) / iz;
}

static void rk4_step(Vehicle *v, double time) {
  const double step = v->step, half = step / 2.0, sixth = step / 6.0;
  double k1[N_STATE], k2[N_STATE], k3[N_STATE], k4[N_STATE], at[N_STATE];
  rate(v, time, v->state, k1);
  for (int i = 0; i < N_STATE; ++i) at[i] = v->state[i] + half * k1[i];
  rate(v, time + half, at, k2);
  for (int i = 0; i < N_STATE; ++i) at[i] = v->state[i] + half * k2[i];
  rate(v, time + half, at, k3);
  for (int i = 0; i < N_STATE; ++i) at[i] = v->state[i] + step * k3[i];
  rate(v, time + step, at, k4);
  for (int i = 0; i < N_STATE; ++i) v->state[i] += sixth * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
}

void advance(Vehicle *v, long n_steps) {
  for (long i = 0; i < n_steps; ++i) {
    rk4_step(v, i * v->step);
    double *q = v->state + 6;
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int e = 0; e < 4; ++e) q[e] /= length;
  }
}
