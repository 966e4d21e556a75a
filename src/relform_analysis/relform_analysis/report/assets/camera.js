// A perspective camera that circles around a target; world axes as in the data: x east, y north, z up.

const FIELD_OF_VIEW = 0.6; // vertical [rad]
const NEAR = 0.05; // [m]
const DISTANCE_MIN = 9; // of a camera that fits its view to points [m]

class Camera {
  constructor(azimuth, elevation) {
    Object.assign(this, { azimuth, elevation, distance: 10, target: [0, 0, 0] });
    this.rectangle = { x: 0, y: 0, width: 1, height: 1 };
  }

  /** Call this after any change. */
  update() {
    const [cosA, sinA] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [cosE, sinE] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    this.right = [-sinA, cosA, 0];
    this.up = [-sinE * cosA, -sinE * sinA, cosE];
    this.forward = [-cosE * cosA, -cosE * sinA, -sinE];
    this.eye = this.target.map((value, axis) => value - this.distance * this.forward[axis]);
    this.focal = this.rectangle.height / 2 / Math.tan(FIELD_OF_VIEW / 2);
    this.centre = [this.rectangle.x + this.rectangle.width / 2, this.rectangle.y + this.rectangle.height / 2];
  }

  /** A point as seen from the camera: to the right, up, and how far ahead [m]. */
  see(x, y, z) {
    const dx = x - this.eye[0], dy = y - this.eye[1], dz = z - this.eye[2];
    const along = (axis) => dx * axis[0] + dy * axis[1] + dz * axis[2];
    return [along(this.right), along(this.up), along(this.forward)];
  }

  /** Where a point ahead of the camera is on the screen [px]. */
  place([right, up, ahead]) {
    return [this.centre[0] + this.focal * right / ahead, this.centre[1] - this.focal * up / ahead];
  }

  /** [px] per metre at the distance of a point. */
  scale([, , ahead]) {
    return this.focal / Math.max(ahead, NEAR);
  }

  /** Move so that the points fill the view. */
  fit(points, margin = 1.08) {
    this.target = [0, 1, 2].map((axis) => {
      const values = points.map((point) => point[axis]);
      return (Math.min(...values) + Math.max(...values)) / 2;
    });
    const slopeY = Math.tan(FIELD_OF_VIEW / 2), slopeX = slopeY * this.rectangle.width / this.rectangle.height;
    for (let round = 0; round < 6; round++) {
      this.update();
      const seen = points.map((point) => this.see(...point)).map(([x, y, ahead]) => [x, y, ahead - this.distance]);
      this.distance = Math.max(
        ...seen.map(([x, y, beyond]) => Math.max(Math.abs(x) / slopeX, Math.abs(y) / slopeY) * margin - beyond), DISTANCE_MIN);
      const middle = (values) => (Math.min(...values) + Math.max(...values)) / 2;
      const shiftX = middle(seen.map(([x, , beyond]) => x / (this.distance + beyond))) * this.distance;
      const shiftY = middle(seen.map(([, y, beyond]) => y / (this.distance + beyond))) * this.distance;
      this.target = this.target.map((value, axis) => value + shiftX * this.right[axis] + shiftY * this.up[axis]);
    }
    this.update();
  }

  turn(dx, dy) {
    this.azimuth -= 0.006 * dx;
    this.elevation = clamp(this.elevation + 0.006 * dy, -0.1, 1.55);
  }

  move(dx, dy) {
    const metres = this.distance / this.focal;
    this.target = this.target.map((value, axis) => value + metres * (dy * this.up[axis] - dx * this.right[axis]));
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.5, 500);
  }
}
