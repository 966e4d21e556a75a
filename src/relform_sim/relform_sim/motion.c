/* The motion of a vehicle over an interval (motion.py, rigid_body.py, integrate.py). Every operation is that of the
 * Python code, in the same order, and none is fused with another: results are equal to the last bit. */

#include <math.h>

enum { N_STATE = 13, N_ROTORS = 4 };

/* The same as `_Vehicle` in motion_kernel.py. */
typedef struct {
  double mass, inertia[3], arm_length, thrust_coefficient, torque_coefficient, drag_coefficient[3];
  double step, rotor_time_constant;
  double rotor_speeds[N_ROTORS], commanded[N_ROTORS], wind_N[3], thrust_scale; /* of the interval */
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
    squares[i] = speed * speed;
  }
  const double c_T = v->thrust_scale * v->thrust_coefficient, c_Q = v->thrust_scale * v->torque_coefficient;
  const double d = v->arm_length, front = squares[0], left = squares[1], back = squares[2], right = squares[3];
  return (Wrench){c_T * (front + left + back + right),
                  {d * c_T * (left - right), d * c_T * (back - front), c_Q * (front - left + back - right)}};
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
  const Wrench wrench = wrench_after(v, time);
  const double fx = -dx * (r11 * vx + r21 * vy + r31 * vz);
  const double fy = -dy * (r12 * vx + r22 * vy + r32 * vz);
  const double fz = -dz * (r13 * vx + r23 * vy + r33 * vz) + wrench.thrust;
  const double hx = ix * wx, hy = iy * wy, hz = iz * wz;
  rates[0] = vx;
  rates[1] = vy;
  rates[2] = vz;
  rates[3] = (r11 * fx + r12 * fy + r13 * fz + v->wind_N[0]) / m;
  rates[4] = (r21 * fx + r22 * fy + r23 * fz + v->wind_N[1]) / m;
  rates[5] = (r31 * fx + r32 * fy + r33 * fz + v->wind_N[2]) / m - GRAVITY;
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
