// The flight in 3D: two views, of the whole flight and close to the team; one fills the scene, the other is in its corner.

const FOLLOW_FROM = [-2.5, 0.4]; // azimuth and elevation [rad]

class Scene {
  constructor(canvas, flight, playback) {
    Object.assign(this, { canvas, flight, playback, context: canvas.getContext("2d"), main: "overview" });
    this.onShow = (view) => this.show(view);
    this.overview = new Overview(flight);
    this.cameras = { overview: new Camera(FIRST_SIDE, OVERVIEW_ELEVATION), follow: new Camera(...FOLLOW_FROM) };
    this.free = new Set(); // cameras that the user has moved: they are not fitted again
    this.drawing = new Drawing(flight, playback, this.context);
    theme.listeners.push(() => { this.drawing.readColours(); this.request(); });
    playback.onChange(() => this.request());
    new ResizeObserver(() => { this.resize(); this.request(); }).observe(canvas);
    attachGrip(this);
    this.resize();
  }

  // ---- layout

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
    const [above, below] = this.corners(), { overview, follow } = this.cameras;
    const whole = { x: 0, y: 0, width: this.width, height: this.height };
    this.inset = above;
    this.cameras[this.main].rectangle = whole;
    this.cameras[this.other()].rectangle = this.inset;
    if (!this.free.has("follow")) this.fitFollow();
    if (!this.free.has("overview")) {
      const margin = this.main === "overview" ? 1.12 : 1.05;
      overview.azimuth = this.azimuth ??= this.overview.bestAzimuth(overview, margin, [above, below]);
      overview.elevation = OVERVIEW_ELEVATION;
      this.overview.fit(overview, margin);
    }
    if (this.main === "overview" && this.overview.hidden(overview, above) > this.overview.hidden(overview, below)) {
      this.inset = follow.rectangle = below;
    }
  }

  /** Candidate places of the small view. */
  corners() {
    const width = Math.round(clamp(0.3 * this.width, 130, 230)), height = Math.round(clamp(0.36 * this.height, 100, 190));
    const x = this.width - width - 10;
    return [{ x, y: 10, width, height }, { x, y: this.height - height - 10, width, height }];
  }

  fitFollow() {
    const poses = this.flight.poses(this.playback.begin);
    const leader = poses[this.flight.data.leader].position;
    const reach = Math.max(...poses.map(({ position }) => Math.hypot(...position.map((value, axis) => value - leader[axis]))));
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
    [this.cameras.follow.azimuth, this.cameras.follow.elevation] = FOLLOW_FROM;
    this.arrange();
    this.request();
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
    context.fillStyle = this.drawing.colours.panel;
    context.strokeStyle = this.drawing.colours.line;
    context.lineWidth = 2;
    context.fill();
    context.stroke();
    context.clip();
    this.drawView(this.other(), poses, true);
    context.restore();
    this.drawing.brush.text(this.other(), x + 9, y + height - 8, { colour: this.drawing.colours.muted, size: 11, align: "left" });
  }

  drawView(view, poses, small) {
    const camera = this.cameras[view];
    if (view === "follow") {
      camera.target = [0, 1, 2].map((axis) => poses.reduce((sum, pose) => sum + pose.position[axis], 0) / poses.length);
    }
    camera.update();
    this.drawing.view(camera, poses, view === "overview", small);
  }
}
