// The whole flight under the slider: its phases, their steady windows, and the largest error over time.

class Timeline {
  constructor(parent, flight, playback, plots) {
    Object.assign(this, { flight, playback, plots, svg: parent.querySelector("svg"), slider: parent.querySelector("input") });
    Object.assign(this.slider, { min: playback.begin, max: playback.end, step: "any" });
    this.slider.addEventListener("input", () => playback.seek(this.slider.valueAsNumber));
    // The page handles the arrow keys, because the slider's own step differs from a control step.
    this.slider.addEventListener("keydown", (event) => { if (!["Tab"].includes(event.key)) event.preventDefault(); });
    playback.onChange(() => this.showTime());
    plots.listeners.push(() => this.draw());
    new ResizeObserver(() => this.draw()).observe(parent);
    this.draw();
  }

  draw() {
    const { svg, flight, playback, plots } = this, { width, height } = svg.getBoundingClientRect();
    const x = (time) => (time - playback.begin) / (playback.end - playback.begin) * width;
    svg.replaceChildren();
    flight.data.phases.forEach(({ name, title, start, steady, end }, index) => {
      make(svg, "rect", { class: index % 2 ? "phase odd" : "phase", x: x(start), y: 0, width: x(end) - x(start), height });
      if (end > steady) make(svg, "rect", { class: "steady", x: x(steady), y: 0, width: x(end) - x(steady), height: 3 });
    });
    if (plots.zoomed) {
      const [from, to] = plots.window;
      make(svg, "rect", { class: "window", x: x(from), y: 1, width: x(to) - x(from), height: height - 2 });
    }
    flight.data.phases.forEach(({ name, title, start, end }) => {
      const label = make(svg, "text", { class: "phase-name", x: x(start) + 6, y: 16 }, name);
      if (x(end) - x(start) > 8 * title.length + 24) make(label, "tspan", { class: "phase-title", dx: 6 }, title);
    });
    const pairs = flight.data.pairs.length, largest = Array.from(flight.step, (_, step) => {
      const errors = flight.error.subarray(pairs * step, pairs * (step + 1)).filter(Number.isFinite);
      return errors.length ? Math.max(...errors) : 0;
    });
    const top = Math.max(...largest, 2 * flight.data.claim);
    const y = (error) => height - 1 - error / top * (height - 22);
    const points = largest.map((error, step) => `${x(flight.step[step]).toFixed(1)} ${y(error).toFixed(1)}`);
    make(svg, "path", { class: "spark", d: `M0 ${height}L${points.join("L")}L${width} ${height}Z` });
    this.cursor = make(svg, "line", { class: "cursor", y1: 0, y2: height });
    this.place = x;
    this.showTime();
  }

  showTime() {
    this.slider.value = this.playback.time;
    this.slider.setAttribute("aria-valuetext", `${this.playback.time.toFixed(2)} seconds`);
    this.cursor.setAttribute("transform", `translate(${this.place(this.playback.time).toFixed(1)} 0)`);
  }
}
