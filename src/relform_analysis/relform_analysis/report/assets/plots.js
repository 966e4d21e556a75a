// Plots over time with a common cursor and a common window: a zoom into one zooms all.

const PLOT_HEIGHT = 126, LEFT = 46, RIGHT = 10, TOP = 18, BOTTOM = 18;
const WINDOW_MIN = 0.25; // [s]

class Plots {
  constructor(parent, flight, playback) {
    Object.assign(this, { flight, playback, phases: flight.data.phases, hover: null, listeners: [] });
    this.window = [playback.begin, playback.end];
    this.panels = flight.data.panels.map((panel) => new Plot(parent, panel, this));
    playback.onChange(() => this.showCursor());
    new ResizeObserver(() => this.draw()).observe(parent);
    this.draw();
  }

  zoom(from, to) {
    const { begin, end } = this.playback, width = clamp(to - from, Math.min(WINDOW_MIN, end - begin), end - begin);
    const start = clamp((from + to - width) / 2, begin, end - width);
    this.window = [start, start + width];
    this.draw();
    this.listeners.forEach((listener) => listener());
  }

  zoomOut() {
    this.zoom(this.playback.begin, this.playback.end);
  }

  get zoomed() {
    return this.window[1] - this.window[0] < this.playback.end - this.playback.begin - 1e-6;
  }

  setHover(time) {
    this.hover = time;
    this.showCursor();
  }

  draw() {
    this.panels.forEach((panel) => panel.draw());
    this.showCursor();
  }

  showCursor() {
    const { time } = this.playback, step = this.flight.stepAt(this.hover ?? time);
    this.panels.forEach((panel) => panel.showCursor(time, this.hover, step));
  }
}

class Plot {
  constructor(parent, data, plots) {
    Object.assign(this, { data, plots });
    this.figure = make(parent, "figure", { class: "plot" });
    const caption = make(this.figure, "figcaption");
    const title = make(caption, "h3", {}, data.title);
    if (data.unit) make(title, "small", {}, ` ${data.unit}`);
    const legend = make(caption, "div", { class: "legend" });
    this.lines = data.lines.map(({ name, colour, dash, values, band }) => {
      const line = { name, colour, dash, values: unpack(values), band: band && unpack(band), shown: true };
      const button = make(legend, "button", { type: "button", "aria-pressed": "true", title: `Show or hide ${name}` });
      make(button, "i", { style: `background: var(--${colour})` });
      if (data.lines.length > 1) make(button, "span", {}, name);
      line.output = make(button, "output");
      button.addEventListener("click", () => {
        line.shown = !line.shown;
        button.setAttribute("aria-pressed", line.shown);
        this.draw();
        plots.showCursor();
      });
      return line;
    });
    for (const { label } of data.guides) {
      const item = make(legend, "span", { class: "guide-name" });
      make(item, "i");
      make(item, "span", {}, label);
    }
    this.svg = make(this.figure, "svg", { height: PLOT_HEIGHT, role: "img", "aria-label": `${data.title} over time` });
    this.listen();
  }

  // ---- geometry

  x(time) {
    const [from, to] = this.plots.window;
    return LEFT + (time - from) / (to - from) * (this.width - LEFT - RIGHT);
  }

  time(clientX) {
    const [from, to] = this.plots.window, part = (clientX - this.svg.getBoundingClientRect().left - LEFT) / (this.width - LEFT - RIGHT);
    return clamp(from + part * (to - from), from, to);
  }

  y(value) {
    const [low, high] = this.range;
    const part = this.data.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return PLOT_HEIGHT - BOTTOM - part * (PLOT_HEIGHT - TOP - BOTTOM);
  }

  /** Smallest and largest value of the lines in this window and of near guides. */
  findRange(first, last) {
    let low = Infinity, high = -Infinity;
    const log = this.data.log;
    const take = (value) => {
      if (!Number.isFinite(value) || (log && value <= 0)) return;
      low = Math.min(low, value);
      high = Math.max(high, value);
    };
    for (const { values, band, shown } of this.lines) {
      if (!shown) continue;
      for (let step = first; step <= last; step++) {
        take(values[step]);
        if (band) [band[step], -band[step]].forEach(take);
      }
    }
    if (low > high) [low, high] = log ? [0.1, 10] : [0, 1];
    const reach = high;
    for (const value of this.data.guides.flatMap(({ values }) => values)) if (log || value < 3 * reach) take(value);
    if (log) {
      this.range = [low / 1.3, high * 1.3];
    } else {
      this.range = [low < 0 ? 1.06 * low : 0, high > 0 ? 1.06 * high : 1];
    }
  }

  // ---- drawing

  draw() {
    this.width = this.svg.getBoundingClientRect().width;
    if (!this.width) return;
    const { svg, data, plots, width } = this, [from, to] = plots.window, { step } = plots.flight;
    const first = indexAt(step, from), last = Math.min(indexAt(step, to) + 1, step.length - 1);
    this.findRange(first, last);
    svg.replaceChildren();
    const bottom = PLOT_HEIGHT - BOTTOM;

    plots.phases.forEach((phase, index) => {
      const x0 = Math.max(this.x(phase.start), LEFT), x1 = Math.min(this.x(phase.end), width - RIGHT);
      if (x1 <= x0) return;
      make(svg, "rect", { class: index % 2 ? "phase odd" : "phase", x: x0, y: TOP, width: x1 - x0, height: bottom - TOP });
      const steady = Math.max(this.x(phase.steady), x0);
      if (x1 > steady) make(svg, "rect", { class: "steady", x: steady, y: TOP - 3, width: x1 - steady, height: 3 });
      if (x1 - x0 > 12) make(svg, "text", { class: "phase-name", x: (x0 + x1) / 2, y: TOP - 6, "text-anchor": "middle" }, phase.name);
    });

    const ticks = data.log ? logTicks(...this.range, 4) : linearTicks(...this.range, this.range[0] < 0 ? 5 : 3);
    for (const tick of ticks) {
      const y = this.y(tick);
      make(svg, "line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y, y2: y });
      make(svg, "text", { class: "tick", x: LEFT - 6, y: y + 3.5, "text-anchor": "end" }, tickText(tick));
    }
    for (const tick of linearTicks(from, to, width / 70)) {
      const x = this.x(tick), anchor = x > width - RIGHT - 12 ? "end" : "middle"; // the last one is not cut off
      make(svg, "text", { class: "tick", x, y: PLOT_HEIGHT - 4, "text-anchor": anchor }, `${tickText(tick)}${tick === 0 ? " s" : ""}`);
    }

    // A nested svg clips what is in it.
    const inside = make(make(svg, "svg", {
      x: LEFT, y: TOP - 2, width: width - LEFT - RIGHT, height: bottom - TOP + 4,
      viewBox: `${LEFT} ${TOP - 2} ${width - LEFT - RIGHT} ${bottom - TOP + 4}`,
    }), "g");
    for (const value of data.guides.flatMap(({ values }) => values)) {
      const y = this.y(value);
      make(inside, "line", { class: "guide", x1: LEFT, x2: width - RIGHT, y1: y, y2: y });
    }
    for (const { band, colour, shown } of this.lines) {
      if (shown && band) make(inside, "path", { class: "band", d: this.bandPath(band, first, last), style: `fill: var(--${colour}); stroke: var(--${colour})` });
    }
    for (const line of this.lines) {
      if (line.shown) make(inside, "path", { class: this.lines.length > 3 ? "line dense" : "line", d: this.path(line.values, first, last), style: `stroke: var(--${line.colour}); stroke-dasharray: ${line.dash.map((length) => 1.4 * length).join(" ") || "none"}` });
    }
    this.hoverLine = make(svg, "line", { class: "hover", y1: TOP, y2: bottom, visibility: "hidden" });
    this.cursor = make(svg, "line", { class: "cursor", y1: TOP - 3, y2: bottom });
    this.brush = make(svg, "rect", { class: "brush", y: TOP, height: bottom - TOP, visibility: "hidden" });
  }

  path(values, first, last) {
    const { step } = this.plots.flight, parts = [];
    let pen = "M";
    for (let index = first; index <= last; index++) {
      const value = values[index];
      if (!Number.isFinite(value) || (this.data.log && value <= 0)) { pen = "M"; continue; }
      const x = this.x(step[index]).toFixed(1), y = this.y(value).toFixed(1);
      parts.push(`${pen}${x} ${y}`);
      if (this.data.steps) parts.push(`H${this.x(index + 1 < step.length ? step[index + 1] : this.plots.playback.end).toFixed(1)}`);
      pen = "L";
    }
    return parts.join("");
  }

  /** The area between minus and plus a half-height, step by step; gaps where it is unknown. */
  bandPath(band, first, last) {
    const { step } = this.plots.flight, parts = [];
    for (let begin = first; begin <= last; begin++) {
      if (!Number.isFinite(band[begin])) continue;
      let end = begin;
      while (end < last && Number.isFinite(band[end + 1])) end++;
      const steps = Array.from({ length: end - begin + 1 }, (_, index) => begin + index);
      const at = (index, sign) => `${this.x(step[index]).toFixed(1)} ${this.y(sign * band[index]).toFixed(1)}`;
      parts.push(`M${[...steps.map((index) => at(index, 1)), ...steps.reverse().map((index) => at(index, -1))].join("L")}Z`);
      begin = end;
    }
    return parts.join("");
  }

  showCursor(time, hover, step) {
    if (!this.width || !this.cursor) return;
    const [from, to] = this.plots.window;
    const put = (line, at) => {
      const visible = at !== null && at >= from - 1e-9 && at <= to + 1e-9;
      line.setAttribute("visibility", visible ? "visible" : "hidden");
      if (visible) line.setAttribute("transform", `translate(${this.x(at).toFixed(1)} 0)`);
    };
    put(this.cursor, time);
    put(this.hoverLine, hover);
    for (const { output, values } of this.lines) {
      const value = values[step];
      output.textContent = Number.isFinite(value) ? value.toFixed(this.data.digits) : "–";
    }
  }

  // ---- pointer control

  listen() {
    const { svg, plots } = this, { playback } = plots;
    let from = null;
    svg.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      svg.setPointerCapture(event.pointerId);
      const scrub = Math.abs(event.clientX - svg.getBoundingClientRect().left - this.x(playback.time)) < 5;
      from = { x: event.clientX, time: this.time(event.clientX), scrub };
    });
    svg.addEventListener("pointermove", (event) => {
      const time = this.time(event.clientX);
      if (from?.scrub) playback.seek(time);
      else if (from) this.showBrush(from, event.clientX);
      plots.setHover(time);
    });
    svg.addEventListener("pointerup", (event) => {
      if (!from) return;
      const { x, time, scrub } = from;
      from = null;
      this.brush.setAttribute("visibility", "hidden");
      if (scrub) return;
      if (Math.abs(event.clientX - x) < 5) playback.seek(time);
      else plots.zoom(...[time, this.time(event.clientX)].sort((a, b) => a - b));
    });
    svg.addEventListener("pointercancel", () => { from = null; });
    svg.addEventListener("pointerleave", () => plots.setHover(null));
    svg.addEventListener("dblclick", () => plots.zoomOut());
    svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // the wheel alone scrolls the page
      event.preventDefault();
      const middle = this.time(event.clientX), factor = Math.exp(0.002 * event.deltaY);
      plots.zoom(middle + factor * (plots.window[0] - middle), middle + factor * (plots.window[1] - middle));
    }, { passive: false });
  }

  showBrush({ x }, clientX) {
    const left = this.svg.getBoundingClientRect().left;
    const [a, b] = [x, clientX].map((value) => clamp(value - left, LEFT, this.width - RIGHT)).sort((p, q) => p - q);
    this.brush.setAttribute("visibility", "visible");
    this.brush.setAttribute("x", a);
    this.brush.setAttribute("width", b - a);
  }
}
