// Chooses the direction of the overview: the flight spread out, little of it behind the small view.

const SIDES = 16, FIRST_SIDE = -0.75, OVERVIEW_ELEVATION = 0.42; // candidate directions [rad]
const COST_OF_HIDING = 4; // cost of hiding the whole path; the widest picture gains 1
const WIDE_ENOUGH = 0.85; // as a part of the widest; the first side this wide is taken
const EVERY = 5; // instants between the points that stand for a path

class Overview {
  constructor(flight) {
    this.team = [];
    this.ground = [];
    for (let tick = 0; tick < flight.tick.length; tick += EVERY) {
      for (let vehicle = 0; vehicle < flight.count; vehicle++) this.team.push([...flight.path(vehicle, tick)]);
      const [x, y] = flight.path(0, tick);
      this.ground.push([x, y, 0]);
    }
  }

  fit(camera, margin) {
    camera.fit([...this.team, ...this.ground], margin);
  }

  /** Share of the paths that is behind a rectangle on the screen. */
  hidden(camera, { x, y, width, height }) {
    const behind = this.team.filter((point) => {
      const [px, py] = camera.place(camera.see(...point));
      return px > x && px < x + width && py > y && py < y + height;
    });
    return behind.length / this.team.length;
  }

  /** Width of the flight from left to right [m]: a view along a path hides the path behind itself. */
  width(camera) {
    const across = this.ground.map((point) => camera.see(...point)[0]);
    return Math.max(...across) - Math.min(...across);
  }

  /** The azimuth of the best side; the small view then takes the corner in which it hides least. */
  bestAzimuth(camera, margin, corners) {
    const sides = Array.from({ length: SIDES }, (_, side) => {
      camera.azimuth = FIRST_SIDE + side * 2 * Math.PI / SIDES;
      this.fit(camera, margin);
      const hidden = Math.min(...corners.map((corner) => this.hidden(camera, corner)));
      return { azimuth: camera.azimuth, width: this.width(camera), hidden };
    });
    const widest = Math.max(...sides.map(({ width }) => width));
    const cost = ({ width, hidden }) => COST_OF_HIDING * hidden - Math.min(width / widest, WIDE_ENOUGH);
    return sides.reduce((best, side) => (cost(side) < cost(best) ? side : best)).azimuth;
  }
}
