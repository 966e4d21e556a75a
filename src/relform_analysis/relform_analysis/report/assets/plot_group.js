// A group of plots over one axis: they share its zoom, a shown instant, and what is marked behind their lines.

class PlotGroup {
  /**
   * @param axis common axis: `from`, `to`, its `unit`, and the `narrowest` window of a zoom
   * @param phases `{ name, start, steady, end }`, shaded behind the lines
   * @param marks `{ start, end, kind }`, spans and instants to show behind the lines; of an instant, `end` is null
   */
  constructor({ from, to, unit = "", narrowest = 0 }, phases = [], marks = []) {
    Object.assign(this, { from, to, unit, narrowest, phases, marks, window: [from, to], plots: [], shown: null, hovered: false });
    this.zoomListeners = [];
    this.pick = () => {}; // called with the x of a click
    this.key = `group ${PlotGroup.count = (PlotGroup.count ?? 0) + 1}`;
    theme.listeners.push(() => this.charts((chart) => chart.redraw(false)));
  }

  add(parent, panel) {
    this.plots.push(new Plot(parent, panel, this));
    return this.plots.at(-1);
  }

  charts(action) {
    for (const { chart } of this.plots) if (chart) action(chart);
  }

  zoom(from, to) {
    const whole = this.to - this.from, width = clamp(to - from, Math.min(this.narrowest, whole), whole);
    const start = clamp((from + to - width) / 2, this.from, this.to - width);
    this.window = [start, start + width];
    this.charts((chart) => {
      chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      chart.setScale("x", { min: start, max: start + width });
    });
    this.zoomListeners.forEach((listener) => listener());
  }

  zoomOut() {
    this.zoom(this.from, this.to);
  }

  get zoomed() {
    return this.window[1] - this.window[0] < (this.to - this.from) * (1 - 1e-9);
  }

  /** Put a line at `x` in all plots, and its values into the legends while the pointer is elsewhere. */
  show(x) {
    this.shown = x;
    for (const plot of this.plots) plot.show();
  }
}
