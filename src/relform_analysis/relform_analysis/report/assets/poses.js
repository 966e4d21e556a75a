// Poses of the vehicles at any time.

/** The flight, interpolated between the instants of its data. */
class Flight {
  constructor(data) {
    this.data = data;
    this.tick = unpack(data.tick);
    this.position = unpack(data.position);
    this.attitude = unpack(data.attitude);
    this.step = unpack(data.step);
    this.reference = unpack(data.reference);
    this.formation = unpack(data.formation);
    this.error = unpack(data.error);
    this.count = data.vehicles.length;
  }

  path(vehicle, tick) {
    const at = 3 * (tick * this.count + vehicle);
    return this.position.subarray(at, at + 3);
  }

  /** Position and rotation matrix (columns: body axes) of every vehicle. */
  poses(time) {
    const first = Math.min(indexAt(this.tick, time), Math.max(this.tick.length - 2, 0));
    const second = Math.min(first + 1, this.tick.length - 1);
    const part = second > first ? clamp((time - this.tick[first]) / (this.tick[second] - this.tick[first]), 0, 1) : 0;
    return this.data.vehicles.map((_, vehicle) => {
      const [a, b] = [this.path(vehicle, first), this.path(vehicle, second)];
      const position = [0, 1, 2].map((axis) => a[axis] + part * (b[axis] - a[axis]));
      const [p, q] = [first, second].map((tick) => 4 * (tick * this.count + vehicle))
        .map((at) => this.attitude.subarray(at, at + 4));
      const sign = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3] < 0 ? -1 : 1;
      const mixed = [0, 1, 2, 3].map((index) => p[index] + part * (sign * q[index] - p[index]));
      return { position, axes: axesOf(mixed) };
    });
  }

  /** The pair with the largest formation error in a step; its index is null if no error is known. */
  worst(step) {
    const count = this.data.pairs.length, found = { error: -Infinity, pair: null };
    for (let pair = 0; pair < count; pair++) {
      const error = this.error[step * count + pair];
      if (error > found.error) Object.assign(found, { error, pair });
    }
    return found;
  }

  stepAt(time) {
    return indexAt(this.step, time + 1e-4);
  }
}

/** Body axes in the world, from a quaternion (x, y, z, w) of any length. */
function axesOf(quaternion) {
  const length = Math.hypot(...quaternion);
  const [x, y, z, w] = quaternion.map((value) => value / length);
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}
