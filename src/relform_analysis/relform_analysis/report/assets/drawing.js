// Draws a view of the flight: ground, paths, references, links coloured by their error, vehicles with their attitude.

const VEHICLE_PX = 9; // arm of a vehicle at least, so that it is visible from far away
const COLOURS_ALONE = 8; // vehicles that are told apart by colour alone, without their numbers
const LINKS_EVERY = 1; // [s] between the links that remain drawn
const TURN = Array.from({ length: 17 }, (_, index) => [Math.cos(index * Math.PI / 8), Math.sin(index * Math.PI / 8)]);

class Drawing {
  constructor(flight, playback, context) {
    Object.assign(this, { flight, playback, context, brush: new Brush(context) });
    this.layGround();
    this.readColours();
  }

  layGround() {
    const { position } = this.flight;
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let at = 0; at < position.length; at += 3) {
      for (const axis of [0, 1]) {
        low[axis] = Math.min(low[axis], position[at + axis]);
        high[axis] = Math.max(high[axis], position[at + axis]);
      }
    }
    const extent = Math.max(high[0] - low[0], high[1] - low[1]);
    this.grid = [1, 2, 5, 10, 20, 50, 100].find((step) => extent / step < 16) ?? 200;
    this.low = low.map((value) => (Math.floor(value / this.grid - 0.25)) * this.grid);
    this.high = high.map((value) => (Math.ceil(value / this.grid + 0.25)) * this.grid);
  }

  readColours() {
    const names = ["ink", "muted", "faint", "line", "panel", "ground", "link-low", "link-high"];
    this.colours = Object.fromEntries(names.map((name) => [name, theme.colour(name)]));
    this.brush.halo = this.colours.panel;
    this.dashes = this.flight.data.styles.map(({ dash }) => dash.map((length) => 1.9 * length));
    this.vehicleColours = this.flight.data.vehicles.map((_, vehicle) => theme.colour(this.flight.data.styles[vehicle].colour));
  }

  linkColour(error) {
    return mix(this.colours["link-low"], this.colours["link-high"], clamp(error / (2 * this.flight.data.claim), 0, 1));
  }

  /** One view; the close one shows more of the vehicles and less of the rest.
   * @param poses of all vehicles
   * @param small whether it is the view in the corner
   */
  view(camera, poses, overview, small) {
    this.camera = camera;
    this.brush.use(camera);
    this.drawGround(small);
    this.drawPaths(overview, small);
    if (overview && !small) this.drawPhaseNames();
    if (overview) this.drawLinksBehind();
    this.drawTeam(poses, overview, small);
    if (!small) this.drawAxes();
  }

  drawGround(small) {
    const { context, low, high, grid, colours } = this;
    context.beginPath();
    for (let x = low[0]; x <= high[0] + 1e-6; x += grid) this.brush.segment([x, low[1], 0], [x, high[1], 0]);
    for (let y = low[1]; y <= high[1] + 1e-6; y += grid) this.brush.segment([low[0], y, 0], [high[0], y, 0]);
    this.brush.stroke(colours.ground, 1);
    if (!small) {
      this.brush.text(`grid ${grid} m`, 12, this.camera.rectangle.height - 12, { colour: colours.muted, size: 11, align: "left" });
    }
  }

  drawPaths(overview, small) {
    const { flight, colours, playback, context } = this, thin = small ? 1 : 1.25;
    const now = indexAt(flight.tick, playback.time), last = flight.tick.length - 1;
    this.brush.polyline((tick) => { const [x, y] = flight.path(0, tick); return [x, y, 0]; }, 0, last);
    this.brush.stroke(colours.line, small ? 1.5 : 2.5);
    for (let vehicle = 0; vehicle < flight.count; vehicle++) {
      const colour = this.vehicleColours[vehicle];
      if (overview) {
        this.brush.polyline((tick) => flight.path(vehicle, tick), now, last);
        context.globalAlpha = 0.28;
        this.brush.stroke(colour, thin);
        context.globalAlpha = 1;
      }
      const from = overview ? 0 : indexAt(flight.tick, playback.time - 4);
      this.brush.polyline((tick) => flight.path(vehicle, tick), from, now);
      this.brush.stroke(colour, small ? 1.25 : 1.9, this.dashes[vehicle]);
    }
    this.brush.polyline((step) => flight.reference.subarray(3 * step, 3 * step + 3), 0, flight.step.length - 1);
    this.brush.stroke(colours.muted, 1, [5, 4]);
  }

  drawLinksBehind() {
    const { flight, playback, context } = this;
    for (let time = playback.begin; time < playback.time; time += LINKS_EVERY) {
      const tick = indexAt(flight.tick, time + 1e-4);
      context.beginPath();
      for (const { vehicles: [observer, target] } of flight.data.pairs) {
        this.brush.segment(flight.path(observer, tick), flight.path(target, tick));
      }
      this.brush.stroke(this.colours.faint, 1);
    }
  }

  drawPhaseNames() {
    const { flight, colours, playback } = this, written = [];
    for (const { name, start, end } of flight.data.phases) {
      const [x, y, z] = flight.path(0, indexAt(flight.tick, (start + end) / 2));
      const seen = this.camera.see(x, y, z);
      if (seen[2] < NEAR) continue;
      const [px, py] = this.camera.place(seen);
      if (written.some(([x, y]) => Math.abs(x - px) < 8 * name.length + 8 && Math.abs(y - py) < 16)) continue;
      written.push([px, py]);
      const current = playback.time >= start && playback.time < end;
      this.brush.text(name, px, py - 20, { colour: current ? colours.ink : colours.muted, size: 15, bold: true, halo: true });
    }
  }

  drawTeam(poses, overview, small) {
    const { flight, colours, context } = this, step = flight.stepAt(this.playback.time);
    context.beginPath();
    for (const { position: [x, y, z] } of poses) this.brush.segment([x, y, z], [x, y, 0]);
    this.brush.stroke(colours.faint, 1, [1, 3]);

    flight.data.pairs.forEach(({ vehicles: [observer, target] }, pair) => {
      const error = flight.error[step * flight.data.pairs.length + pair];
      context.beginPath();
      this.brush.segment(poses[observer].position, poses[target].position);
      this.brush.stroke(this.linkColour(error), (small ? 1.2 : 2) + 2 * clamp(error / (2 * flight.data.claim), 0, 1));
    });
    this.drawReferences(poses, step, overview);

    const seen = poses.map(({ position }) => this.camera.see(...position));
    const farFirst = seen.map((_, vehicle) => vehicle).sort((a, b) => seen[b][2] - seen[a][2]);
    this.seats = [];
    for (const vehicle of farFirst) {
      if (seen[vehicle][2] < NEAR) continue;
      this.drawVehicle(poses[vehicle], seen[vehicle], this.vehicleColours[vehicle], small);
      const [px, py] = this.camera.place(seen[vehicle]);
      this.seats[vehicle] = [px, py];
      const name = flight.data.vehicles[vehicle];
      if (!overview && !small) {
        this.brush.text(name, px, py - 34, { colour: colours.ink, size: 12, halo: true });
      } else if (!small && flight.count > COLOURS_ALONE) {
        this.brush.text(/\d+$/.exec(name)?.[0] ?? name, px, py - 14, { colour: this.vehicleColours[vehicle], size: 11, bold: true, halo: true });
      }
    }
    if (!small) this.onScreen = this.seats;
  }

  /** Reference positions: of the leader, and of the followers by the formation. */
  drawReferences(poses, step, overview) {
    const { flight, context } = this;
    const leader = flight.data.leader, spots = [[leader, flight.reference.subarray(3 * step, 3 * step + 3)]];
    if (!overview) {
      const { axes: [forward], position: [px, py, pz] } = poses[leader];
      const yaw = Math.atan2(forward[1], forward[0]);
      for (let vehicle = 0; vehicle < flight.count; vehicle++) {
        if (vehicle === leader) continue;
        const at = 3 * (step * flight.count + vehicle), [x, y, z] = flight.formation.subarray(at, at + 3);
        spots.push([vehicle, [px + Math.cos(yaw) * x - Math.sin(yaw) * y, py + Math.sin(yaw) * x + Math.cos(yaw) * y, pz + z]]);
      }
    }
    for (const [vehicle, spot] of spots) {
      const seen = this.camera.see(...spot);
      if (!(seen[2] > NEAR)) continue;
      const [px, py] = this.camera.place(seen);
      context.beginPath();
      context.arc(px, py, overview ? 3 : 0.05 * this.camera.scale(seen) + 3, 0, 2 * Math.PI);
      this.brush.stroke(this.vehicleColours[vehicle], 1.25);
    }
  }

  drawVehicle({ position, axes }, seen, colour, small) {
    const { context } = this, least = small ? 0.75 * VEHICLE_PX : VEHICLE_PX;
    const arm = Math.max(this.flight.data.arm, least / this.camera.scale(seen));
    const point = (x, y) => position.map((value, axis) => value + x * axes[0][axis] + y * axes[1][axis]);
    context.beginPath();
    this.brush.segment(point(-arm, 0), point(arm, 0));
    this.brush.segment(point(0, -arm), point(0, arm));
    this.brush.stroke(colour, 2);
    for (const [x, y] of [[0, arm], [-arm, 0], [0, -arm], [arm, 0]]) { // left, back, right, front: the front on top
      const ring = TURN.map(([cos, sin]) => this.camera.see(...point(x + 0.55 * arm * cos, y + 0.55 * arm * sin)));
      if (ring.some((corner) => corner[2] < NEAR)) continue;
      context.beginPath();
      ring.forEach((corner, index) => context[index ? "lineTo" : "moveTo"](...this.camera.place(corner)));
      context.globalAlpha = x > 0 ? 0.9 : 0.22;
      context.fillStyle = colour;
      context.fill();
      context.globalAlpha = 1;
      this.brush.stroke(colour, 1);
    }
  }

  drawAxes() {
    const origin = [34, this.camera.rectangle.height - 44], { camera, context, colours } = this;
    ["x", "y", "z"].forEach((name, axis) => {
      const tip = [origin[0] + 20 * camera.right[axis], origin[1] - 20 * camera.up[axis]];
      context.beginPath();
      context.moveTo(...origin);
      context.lineTo(...tip);
      this.brush.stroke(colours.muted, 1.25);
      const [x, y] = [origin[0] + 28 * camera.right[axis], origin[1] - 28 * camera.up[axis]];
      this.brush.text(name, x, y + 4, { colour: colours.muted, size: 11 });
    });
  }
}
