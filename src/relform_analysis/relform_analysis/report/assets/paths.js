// The paths of several flights over each other, from above and from the side, on one scale.

const GAP = 44, EDGE = 14, LEGEND_ROW = 18, NAME = 24;

/** A flight's positions at any time. */
class FlownPath {
  constructor({ label, colour, dash, vehicles, leader, tick, position }) {
    Object.assign(this, { label, colour, dash, leader, count: vehicles.length, tick: unpack(tick), position: unpack(position) });
  }

  /** Position of a vehicle at an instant of the data. */
  at(vehicle, tick) {
    const start = 3 * (tick * this.count + vehicle);
    return this.position.subarray(start, start + 3);
  }

  /** Positions of all vehicles at a time; null after the last and before the first instant. */
  positions(time) {
    if (time < this.tick[0] - 1e-6 || time > this.tick.at(-1) + 1e-6) return null;
    const first = indexAt(this.tick, time), second = Math.min(first + 1, this.tick.length - 1);
    const part = second > first ? (time - this.tick[first]) / (this.tick[second] - this.tick[first]) : 0;
    return Array.from({ length: this.count }, (_, vehicle) => {
      const [a, b] = [this.at(vehicle, first), this.at(vehicle, second)];
      return [0, 1, 2].map((axis) => a[axis] + part * (b[axis] - a[axis]));
    });
  }
}

class PathViews {
  constructor(canvas, flights, playback) {
    Object.assign(this, { canvas, playback, flights: flights.map((flight) => new FlownPath(flight)), context: canvas.getContext("2d") });
    this.measure();
    theme.listeners.push(() => this.request());
    playback.onChange(() => this.request());
    new ResizeObserver(() => { this.resize(); this.request(); }).observe(canvas);
    this.resize();
  }

  /** Bounds of all paths; the longer horizontal axis goes from left to right. */
  measure() {
    const low = [Infinity, Infinity, 0], high = [-Infinity, -Infinity, 0];
    for (const { position } of this.flights) {
      for (let at = 0; at < position.length; at++) {
        const axis = at % 3;
        low[axis] = Math.min(low[axis], position[at]);
        high[axis] = Math.max(high[axis], position[at]);
      }
    }
    Object.assign(this, { low, high, alongY: high[1] - low[1] > high[0] - low[0] });
  }

  resize() {
    const { width, height } = this.canvas.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    Object.assign(this, { width, height, ratio });
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    // From above with y to the right, x points down.
    const [across, away] = this.alongY ? [1, 0] : [0, 1], pad = 0.6, { low, high } = this;
    const spans = [across, away, 2].map((axis) => high[axis] - low[axis] + 2 * pad);
    const room = [width - 2 * EDGE - 30, height - 2 * EDGE - GAP - NAME - 18 - LEGEND_ROW * this.legendRows(width)];
    this.scale = Math.max(Math.min(room[0] / spans[0], room[1] / (spans[1] + spans[2])), 1);
    const left = EDGE + 30 + (room[0] - this.scale * spans[0]) / 2;
    const x = (point) => left + this.scale * (point[across] - low[across] + pad);
    const top = EDGE + NAME + LEGEND_ROW * this.legendRows(width) + (room[1] - this.scale * (spans[1] + spans[2])) / 2;
    const bottomOfPlan = top + this.scale * spans[1], bottom = bottomOfPlan + GAP + this.scale * spans[2];
    const box = { left, right: left + this.scale * spans[0] };
    this.views = [
      {
        ...box, top, bottom: bottomOfPlan, axes: [across, away], sign: this.alongY ? -1 : 1, name: "from above",
        place: (point) => [x(point), this.alongY ? top + this.scale * (point[0] - low[0] + pad) : bottomOfPlan - this.scale * (point[1] - low[1] + pad)],
      },
      {
        ...box, top: bottomOfPlan + GAP, bottom, axes: [across, 2], sign: 1, name: "from the side",
        place: (point) => [x(point), bottom - this.scale * (point[2] - low[2] + pad)],
      },
    ];
  }

  legendRows(width) {
    let rows = 1, x = 0;
    for (const { label } of this.flights) {
      const length = 7 * label.length + 46;
      if (x && x + length > width - 2 * EDGE) { rows++; x = 0; }
      x += length;
    }
    return rows;
  }

  request() {
    this.waiting ??= requestAnimationFrame(() => { this.waiting = null; this.draw(); });
  }

  draw() {
    const { context } = this;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.lineJoin = context.lineCap = "round";
    this.drawLegend();
    for (const view of this.views) {
      this.drawGrid(view);
      context.save();
      context.beginPath();
      context.rect(view.left, view.top, view.right - view.left, view.bottom - view.top);
      context.clip();
      for (const flight of this.flights) this.drawFlight(view, flight);
      context.restore();
    }
  }

  drawLegend() {
    const { context } = this;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "left";
    let x = EDGE, y = EDGE + 4;
    for (const { label, colour } of this.flights) {
      const length = 7 * label.length + 46;
      if (x > EDGE && x + length > this.width - EDGE) { x = EDGE; y += LEGEND_ROW; }
      context.strokeStyle = theme.colour(colour);
      context.lineWidth = 3;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 18, y);
      context.stroke();
      context.fillStyle = theme.colour("ink");
      context.fillText(label, x + 25, y + 4);
      x += length;
    }
  }

  drawGrid({ left, right, top, bottom, axes, place, name }) {
    const { context, low, high } = this, names = ["x", "y", "z"];
    context.strokeStyle = theme.colour("ground");
    context.fillStyle = theme.colour("muted");
    context.font = "10.5px system-ui, sans-serif";
    context.lineWidth = 1;
    const line = (from, to) => { context.beginPath(); context.moveTo(...from); context.lineTo(...to); context.stroke(); };
    const step = [1, 2, 5, 10, 20, 50, 100].find((metres) => metres * this.scale >= 42) ?? 200;
    const ticks = (axis) => {
      const first = Math.ceil((low[axis] - 0.6) / step), last = Math.floor((high[axis] + 0.6) / step);
      return Array.from({ length: Math.max(last - first + 1, 0) }, (_, index) => (first + index) * step);
    };
    const at = (axis, value) => { const point = [0, 0, 0]; point[axis] = value; return place(point); };
    for (const value of ticks(axes[0])) {
      const [x] = at(axes[0], value);
      line([x, top], [x, bottom]);
      context.textAlign = "center";
      context.fillText(value, x, bottom + 13);
    }
    for (const value of ticks(axes[1])) {
      const y = at(axes[1], value)[1];
      line([left, y], [right, y]);
      context.textAlign = "right";
      context.fillText(value, left - 6, y + 3.5);
    }
    context.textAlign = "right";
    context.fillText(`${names[axes[0]]} [m]`, right, bottom + 25);
    context.textAlign = "left";
    context.fillText(`${names[axes[1]]} [m], ${name}`, left - 22, top - 7);
  }

  drawFlight({ place }, flight) {
    const { context } = this, { time } = this.playback, colour = theme.colour(flight.colour);
    const now = indexAt(flight.tick, time), last = flight.tick.length - 1;
    const trace = (vehicle, from, to) => {
      context.beginPath();
      for (let tick = from; tick <= to; tick++) context[tick > from ? "lineTo" : "moveTo"](...place(flight.at(vehicle, tick)));
      context.stroke();
    };
    context.strokeStyle = context.fillStyle = colour;
    for (let vehicle = 0; vehicle < flight.count; vehicle++) {
      context.lineWidth = vehicle === flight.leader ? 2 : 1;
      context.globalAlpha = 0.3;
      trace(vehicle, now, last);
      context.globalAlpha = 0.9;
      trace(vehicle, 0, now);
    }
    context.globalAlpha = 1;
    const positions = flight.positions(time);
    if (!positions) return;
    positions.forEach((position, vehicle) => {
      const [x, y] = place(position);
      context.beginPath();
      context.arc(x, y, vehicle === flight.leader ? 5 : 3.5, 0, 2 * Math.PI);
      context.fill();
    });
  }
}
