// The whole flight under the slider: its phases, their steady windows, and the largest error over time.

class Timeline {
  constructor(parent, flight, playback, plots) {
    Object.assign(this, { flight, playback, plots, svg: parent.querySelector("svg"), slider: parent.querySelector("input") });
    Object.assign(this.slider, { min: playback.begin, max: playback.end, step: "any" });
    this.slider.addEventListener("input", () => playback.seek(this.slider.valueAsNumber));
    // The page handles the arrow keys, because the slider's own step differs from a control step.
    this.slider.addEventListener("keydown", (event) => { if (!["Tab"].includes(event.key)) event.preventDefault(); });
    playback.onChange(() => this.showTime());
    plots.zoomListeners.push(() => this.draw());
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
    for (const { start, end, kind } of flight.data.happenings) {
      const length = (end ?? start) - start, shown = length < LONG * (playback.end - playback.begin) ? length : 0;
      make(svg, "rect", { class: `mark ${kind}`, x: x(start), y: 0, width: Math.max(x(start + shown) - x(start), 1.5), height });
    }
    let free = 0;
    flight.data.phases.forEach(({ name, title, start, end }) => {
      if (x(start) + 6 < free) return;
      const label = make(svg, "text", { class: "phase-name", x: x(start) + 6, y: 16 }, name);
      const room = x(end) - x(start) - 12, short = label.getComputedTextLength();
      const words = make(label, "tspan", { class: "phase-title", dx: 6 }, title);
      if (label.getComputedTextLength() > room) words.remove();
      free = x(start) + 6 + short + 4;
    });
    const largest = Array.from(flight.step, (_, step) => Math.max(flight.worst(step).error, 0));
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
