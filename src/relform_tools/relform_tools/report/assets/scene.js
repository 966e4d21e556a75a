// The flight in 3D: paths, vehicles with their attitude, links of the formation coloured by their error.

const VEHICLE_PX = 9; // arm of a vehicle at least, so that it is seen from afar
const LINKS_EVERY = 1; // [s] between the links that stay behind
const TURN = Array.from({ length: 17 }, (_, index) => [Math.cos(index * Math.PI / 8), Math.sin(index * Math.PI / 8)]);

/** Where everything is at a time between two instants of the data. */
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

class Scene {
  constructor(canvas, flight, playback) {
    Object.assign(this, { canvas, flight, playback, context: canvas.getContext("2d"), main: "overview", onShow: (view) => this.show(view) });
    this.cameras = { overview: new Camera(-0.75, 0.42), follow: new Camera(-2.5, 0.4) };
    this.free = new Set(); // cameras that the user has moved: they are not fitted again
    this.layGround();
    this.readColours();
    theme.listeners.push(() => { this.readColours(); this.request(); });
    playback.onChange(() => this.request());
    new ResizeObserver(() => { this.resize(); this.request(); }).observe(canvas);
    this.listen();
    this.resize();
  }

  // ---- what is where

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
    this.vehicleColours = this.flight.data.vehicles.map((_, vehicle) => theme.colour(`vehicle-${vehicle % 7}`));
  }

  linkColour(error) {
    return mix(this.colours["link-low"], this.colours["link-high"], clamp(error / (2 * this.flight.data.claim), 0, 1));
  }

  resize() {
    const { width, height } = this.canvas.getBoundingClientRect();
    const ratio = devicePixelRatio || 1;
    this.width = width;
    this.height = height;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.ratio = ratio;
    this.arrange();
  }

  /** The two views: one fills the scene, the other is small in its corner. */
  arrange() {
    const width = Math.round(clamp(0.3 * this.width, 130, 230)), height = Math.round(clamp(0.36 * this.height, 100, 190));
    const inset = this.inset = { x: this.width - width - 10, y: 10, width, height };
    const other = this.main === "overview" ? "follow" : "overview";
    this.cameras[this.main].rectangle = { x: 0, y: 0, width: this.width, height: this.height };
    this.cameras[other].rectangle = inset;
    if (!this.free.has("overview")) this.fitOverview();
    if (!this.free.has("follow")) this.fitFollow();
    if (this.main === "overview") inset.y = this.freeCorner();
  }

  /** Top or bottom: where the small view covers less of the paths. */
  freeCorner() {
    const { flight, inset, cameras: { overview } } = this, bottom = this.height - inset.height - 10;
    let [above, below] = [0, 0];
    for (let tick = 0; tick < flight.tick.length; tick++) {
      const [x, y] = overview.place(overview.see(...flight.path(0, tick)));
      if (x > inset.x - 20) if (y < this.height / 2) above++; else below++;
    }
    return above > below ? bottom : 10;
  }

  fitOverview() {
    const { flight } = this, points = [];
    for (let tick = 0; tick < flight.tick.length; tick += 5) {
      for (let vehicle = 0; vehicle < flight.count; vehicle++) points.push([...flight.path(vehicle, tick)]);
      const [x, y] = flight.path(0, tick);
      points.push([x, y, 0]);
    }
    this.cameras.overview.fit(points, this.main === "overview" ? 1.12 : 1.05);
  }

  fitFollow() {
    const poses = this.flight.poses(this.playback.begin);
    const reach = Math.max(...poses.map(({ position }) => Math.hypot(...position.map((value, axis) => value - poses[0].position[axis]))));
    const camera = this.cameras.follow;
    camera.distance = (this.main === "follow" ? 2.4 : 2.9) * (reach + 0.6);
  }

  show(view) {
    this.main = view;
    this.arrange();
    this.request();
  }

  home() {
    this.free.clear();
    Object.assign(this.cameras.overview, { azimuth: -0.75, elevation: 0.42 });
    Object.assign(this.cameras.follow, { azimuth: -2.5, elevation: 0.4 });
    this.arrange();
    this.request();
  }

  // ---- the hand on the camera

  listen() {
    const { canvas } = this;
    let grip = null;
    canvas.addEventListener("pointerdown", (event) => {
      const inset = this.inInset(event);
      grip = { inset, view: inset ? this.other() : this.main, moved: 0, x: event.clientX, y: event.clientY };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      canvas.style.cursor = grip ? "grabbing" : this.inInset(event) ? "pointer" : "grab";
      if (!grip) return;
      const dx = event.clientX - grip.x, dy = event.clientY - grip.y, camera = this.cameras[grip.view];
      Object.assign(grip, { x: event.clientX, y: event.clientY, moved: grip.moved + Math.abs(dx) + Math.abs(dy) });
      if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
        if (grip.view === "overview") camera.move(dx, dy);
      } else {
        camera.turn(dx, dy);
      }
      this.free.add(grip.view);
      this.request();
    });
    canvas.addEventListener("pointerup", () => {
      if (grip?.inset && grip.moved < 4) this.onShow(this.other());
      grip = null;
    });
    canvas.addEventListener("pointercancel", () => { grip = null; });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // the wheel alone scrolls the page
      event.preventDefault();
      this.zoom(Math.exp(0.0015 * event.deltaY), this.inInset(event) ? this.other() : this.main);
    }, { passive: false });
  }

  zoom(factor, view = this.main) {
    this.cameras[view].zoom(factor);
    this.free.add(view);
    this.request();
  }

  other() {
    return this.main === "overview" ? "follow" : "overview";
  }

  inInset(event) {
    const box = this.canvas.getBoundingClientRect(), { x, y, width, height } = this.inset;
    const px = event.clientX - box.left - x, py = event.clientY - box.top - y;
    return px >= 0 && px <= width && py >= 0 && py <= height;
  }

  // ---- drawing

  request() {
    this.waiting ??= requestAnimationFrame(() => { this.waiting = null; this.draw(); });
  }

  draw() {
    const { context } = this, poses = this.flight.poses(this.playback.time);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.lineJoin = context.lineCap = "round";
    this.drawView(this.main, poses, false);
    const { x, y, width, height } = this.inset;
    context.save();
    context.beginPath();
    context.roundRect(x, y, width, height, 8);
    context.fillStyle = this.colours.panel;
    context.strokeStyle = this.colours.line;
    context.lineWidth = 2;
    context.fill();
    context.stroke();
    context.clip();
    this.drawView(this.other(), poses, true);
    context.restore();
    this.text(this.other(), x + 9, y + height - 8, { colour: this.colours.muted, size: 11, align: "left" });
  }

  drawView(view, poses, small) {
    const camera = this.camera = this.cameras[view], overview = view === "overview";
    if (!overview) {
      camera.target = [0, 1, 2].map((axis) => poses.reduce((sum, pose) => sum + pose.position[axis], 0) / poses.length);
    }
    camera.update();
    this.drawGround(small);
    this.drawPaths(overview, small);
    if (overview && !small) this.drawPhaseNames();
    this.drawLinksBehind(overview);
    this.drawTeam(poses, overview, small);
    if (!small) this.drawAxes();
  }

  drawGround(small) {
    const { context, low, high, grid, colours } = this;
    context.beginPath();
    for (let x = low[0]; x <= high[0] + 1e-6; x += grid) this.segment([x, low[1], 0], [x, high[1], 0]);
    for (let y = low[1]; y <= high[1] + 1e-6; y += grid) this.segment([low[0], y, 0], [high[0], y, 0]);
    this.stroke(colours.ground, 1);
    if (!small) {
      this.text(`grid ${grid} m`, 12, this.height - 12, { colour: colours.muted, size: 11, align: "left" });
    }
  }

  drawPaths(overview, small) {
    const { flight, colours, playback, context } = this, thin = small ? 1 : 1.25;
    const now = indexAt(flight.tick, playback.time), last = flight.tick.length - 1;
    this.polyline((tick) => { const [x, y] = flight.path(0, tick); return [x, y, 0]; }, 0, last);
    this.stroke(colours.line, small ? 1.5 : 2.5);
    for (let vehicle = 0; vehicle < flight.count; vehicle++) {
      const colour = this.vehicleColours[vehicle];
      if (overview) {
        this.polyline((tick) => flight.path(vehicle, tick), now, last);
        context.globalAlpha = 0.28;
        this.stroke(colour, thin);
        context.globalAlpha = 1;
      }
      const from = overview ? 0 : indexAt(flight.tick, playback.time - 4);
      this.polyline((tick) => flight.path(vehicle, tick), from, now);
      this.stroke(colour, small ? 1.25 : 1.9);
    }
    this.polyline((step) => flight.reference.subarray(3 * step, 3 * step + 3), 0, flight.step.length - 1);
    this.stroke(colours.muted, 1, [5, 4]);
  }

  drawLinksBehind(overview) {
    if (!overview) return;
    const { flight, playback, context } = this;
    for (let time = playback.begin; time < playback.time; time += LINKS_EVERY) {
      const tick = indexAt(flight.tick, time + 1e-4);
      context.beginPath();
      for (const { vehicles: [observer, target] } of flight.data.pairs) {
        this.segment(flight.path(observer, tick), flight.path(target, tick));
      }
      this.stroke(this.colours.faint, 1);
    }
  }

  drawPhaseNames() {
    const { flight, colours, playback } = this;
    for (const { name, start, end } of flight.data.phases) {
      const [x, y, z] = flight.path(0, indexAt(flight.tick, (start + end) / 2));
      const seen = this.camera.see(x, y, z);
      if (seen[2] < NEAR) continue;
      const [px, py] = this.camera.place(seen), current = playback.time >= start && playback.time < end;
      this.text(name, px, py - 20, { colour: current ? colours.ink : colours.muted, size: 15, bold: true, halo: true });
    }
  }

  drawTeam(poses, overview, small) {
    const { flight, colours, context } = this, step = flight.stepAt(this.playback.time);
    context.beginPath();
    for (const { position: [x, y, z] } of poses) this.segment([x, y, z], [x, y, 0]);
    this.stroke(colours.faint, 1, [1, 3]);

    flight.data.pairs.forEach(({ vehicles: [observer, target] }, pair) => {
      const error = flight.error[step * flight.data.pairs.length + pair];
      context.beginPath();
      this.segment(poses[observer].position, poses[target].position);
      this.stroke(this.linkColour(error), (small ? 1.2 : 2) + 2 * clamp(error / (2 * flight.data.claim), 0, 1));
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
      if (!overview && !small) {
        this.text(flight.data.vehicles[vehicle], px, py - 34, { colour: colours.ink, size: 12, halo: true });
      }
    }
    if (!small) this.onScreen = this.seats;
  }

  /** Where the leader should be, and where it and the formation put the followers. */
  drawReferences(poses, step, overview) {
    const { flight, context, colours } = this;
    const spots = [flight.reference.subarray(3 * step, 3 * step + 3)];
    if (!overview) {
      const [forward] = poses[0].axes, yaw = Math.atan2(forward[1], forward[0]);
      for (let vehicle = 1; vehicle < flight.count; vehicle++) {
        const at = 3 * (step * flight.count + vehicle), [x, y, z] = flight.formation.subarray(at, at + 3);
        const [px, py, pz] = poses[0].position;
        spots.push([px + Math.cos(yaw) * x - Math.sin(yaw) * y, py + Math.sin(yaw) * x + Math.cos(yaw) * y, pz + z]);
      }
    }
    for (const spot of spots) {
      const seen = this.camera.see(...spot);
      if (!(seen[2] > NEAR)) continue;
      const [px, py] = this.camera.place(seen);
      context.beginPath();
      context.arc(px, py, overview ? 3 : 0.05 * this.camera.scale(seen) + 3, 0, 2 * Math.PI);
      this.stroke(colours.muted, 1.25);
    }
  }

  drawVehicle({ position, axes }, seen, colour, small) {
    const { context } = this, least = small ? 0.75 * VEHICLE_PX : VEHICLE_PX;
    const arm = Math.max(this.flight.data.arm, least / this.camera.scale(seen));
    const point = (x, y) => position.map((value, axis) => value + x * axes[0][axis] + y * axes[1][axis]);
    context.beginPath();
    this.segment(point(-arm, 0), point(arm, 0));
    this.segment(point(0, -arm), point(0, arm));
    this.stroke(colour, 2);
    for (const [x, y] of [[0, arm], [-arm, 0], [0, -arm], [arm, 0]]) { // left, back, right, front: the front on top
      const ring = TURN.map(([cos, sin]) => this.camera.see(...point(x + 0.55 * arm * cos, y + 0.55 * arm * sin)));
      if (ring.some((corner) => corner[2] < NEAR)) continue;
      context.beginPath();
      ring.forEach((corner, index) => context[index ? "lineTo" : "moveTo"](...this.camera.place(corner)));
      context.globalAlpha = x > 0 ? 0.9 : 0.22;
      context.fillStyle = colour;
      context.fill();
      context.globalAlpha = 1;
      this.stroke(colour, 1);
    }
  }

  drawAxes() {
    const origin = [34, this.height - 44], { camera, context, colours } = this;
    ["x", "y", "z"].forEach((name, axis) => {
      const tip = [origin[0] + 20 * camera.right[axis], origin[1] - 20 * camera.up[axis]];
      context.beginPath();
      context.moveTo(...origin);
      context.lineTo(...tip);
      this.stroke(colours.muted, 1.25);
      const [x, y] = [origin[0] + 28 * camera.right[axis], origin[1] - 28 * camera.up[axis]];
      this.text(name, x, y + 4, { colour: colours.muted, size: 11 });
    });
  }

  // ---- strokes in space

  /** A line between two points, cut off at the camera. */
  segment(from, to) {
    let a = this.camera.see(...from), b = this.camera.see(...to);
    if (a[2] < NEAR && b[2] < NEAR) return;
    const cut = (behind, ahead) => {
      const part = (NEAR - behind[2]) / (ahead[2] - behind[2]);
      return behind.map((value, axis) => value + part * (ahead[axis] - value));
    };
    if (a[2] < NEAR) a = cut(a, b);
    if (b[2] < NEAR) b = cut(b, a);
    this.context.moveTo(...this.camera.place(a));
    this.context.lineTo(...this.camera.place(b));
  }

  polyline(point, from, to) {
    const { context, camera } = this;
    context.beginPath();
    let drawing = false;
    for (let index = from; index <= to; index++) {
      const seen = camera.see(...point(index));
      if (!(seen[2] > NEAR)) { drawing = false; continue; }
      const place = camera.place(seen);
      if (drawing) context.lineTo(...place); else context.moveTo(...place);
      drawing = true;
    }
  }

  stroke(colour, width, dash = []) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = width;
    this.context.setLineDash(dash);
    this.context.stroke();
  }

  text(text, x, y, { colour, size, bold = false, halo = false, align = "center" }) {
    const { context } = this;
    context.font = `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
    context.textAlign = align;
    if (halo) {
      context.setLineDash([]);
      context.lineWidth = 4;
      context.strokeStyle = this.colours.panel;
      context.strokeText(text, x, y);
    }
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }
}
