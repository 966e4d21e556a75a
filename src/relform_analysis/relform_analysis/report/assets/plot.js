// Plots of lines over a common axis, drawn by uPlot. Plots of a group share this axis, its zoom and the cursor.
//
// A panel:
//   { title, unit, digits,       // of the values
//     log, steps, tall, robust,  // as of Panel in plots/panels.py; all may be missing
//     guides: [{ label, values }],
//     sets: [{ x, lines: [{ name, colour, dash, values, low, high }] }] }
// Each set has its own x: the instants of one of the flights that are compared, or the parameter of a sweep. x, values, low
// and high are arrays or packed arrays of one length, NaN where nothing is known. low and high bound a band; both may be
// missing, and low alone where the band is symmetric about zero. colour is a variable of the style, such as vehicle-3; dash is in widths of the line.

const PLOT_HEIGHT = 150, TALL_PLOT_HEIGHT = 310, TOP = 20;
const AXIS_WIDTH = 48, AXIS_HEIGHT = 24;
const AXIS = { stroke: () => theme.colour("muted"), font: "10.5px system-ui, sans-serif", ticks: { show: false }, gap: 4 };
const DENSE = 3; // more lines than this are thin
const ABOVE_USUAL = 1.5; // upper end of a robust scale, in the largest steady value
const FAR_OUT = 2.5; // it leaves out values only if the largest is this many times the largest steady one,
const RARE = 0.1; // and if they are this rare
const LOG_TICKS = 5; // on a logarithmic scale
const CLICK_PX = 5;

const arrayOf = (values) => (values?.shape ? unpack(values) : values);

class Plot {
  constructor(parent, panel, group) {
    Object.assign(this, { panel, group, whole: false });
    this.sets = panel.sets.map((set) => {
      const x = arrayOf(set.x);
      return { x, lines: set.lines.map((line) => this.line(line, x)) };
    });
    this.lines = this.sets.flatMap(({ lines }) => lines);
    this.figure = make(parent, "figure", { class: panel.tall ? "plot tall" : "plot" });
    this.caption = make(this.figure, "figcaption");
    const title = make(this.caption, "h3", {}, panel.title);
    if (panel.unit) make(title, "small", {}, ` ${panel.unit}`);
    this.beyond = make(title, "button", { type: "button", class: "beyond", hidden: "" });
    this.beyond.addEventListener("click", () => { this.whole = !this.whole; this.rescale(); });
    this.place = make(this.figure, "div", { class: "chart", role: "img", "aria-label": `${panel.title} over ${group.unit}` });
    this.place.style.minHeight = `${this.height}px`;
    this.visible = false;
    new IntersectionObserver((entries) => this.look(entries.at(-1).isIntersecting), { rootMargin: "300px" }).observe(this.figure);
    new ResizeObserver(() => this.chart?.setSize(this.size())).observe(this.place);
  }

  /** A line with its arrays; the bounds of its band as functions of the place in them. */
  line({ low, high, values, ...line }, x) {
    const [lower, upper] = [arrayOf(low), arrayOf(high)];
    const bounds = upper ? { low: (at) => (lower ? lower[at] : -upper[at]), high: (at) => upper[at] } : {};
    return { dash: [], ...line, ...bounds, x, values: arrayOf(values) };
  }

  /** Levels to compare with. */
  get levels() {
    return (this.panel.guides ?? []).flatMap(({ values }) => values);
  }

  get height() {
    return this.panel.tall ? TALL_PLOT_HEIGHT : PLOT_HEIGHT;
  }

  size() {
    return { width: Math.max(this.place.clientWidth, 1), height: this.height };
  }

  /** Plots are drawn when they come into sight, and follow the playback while they are in it. */
  look(visible) {
    this.visible = visible;
    if (visible && !this.chart) this.draw();
    this.show();
  }

  draw() {
    const known = (value) => Number.isFinite(value) && !(this.panel.log && value <= 0);
    const tables = this.sets.map(({ x, lines }) => [x, ...lines.map(({ values }) => Array.from(values, (value) => (known(value) ? value : null)))]);
    this.chart = new uPlot(this.options(), tables.length > 1 ? uPlot.join(tables) : tables[0], this.place);
    this.now = make(this.chart.over, "div", { class: "now" });
    this.listen(this.chart.over);
    this.nameGuides();
  }

  options() {
    const { panel, group, lines } = this;
    const width = lines.length > DENSE ? 1 : 1.5;
    return {
      ...this.size(),
      padding: [TOP, 10, 0, 0],
      series: [{}, ...lines.map(({ name, colour, dash }) => ({
        label: name,
        stroke: () => theme.colour(colour),
        width,
        dash: dash.map((length) => width * length),
        paths: panel.steps ? uPlot.paths.stepped({ align: 1, extend: true }) : undefined,
        points: { size: 4, stroke: () => theme.colour(colour), fill: () => theme.colour(colour) },
        value: (_, value) => (Number.isFinite(value) ? value.toFixed(panel.digits) : "–"),
      }))],
      scales: {
        x: { time: false, min: group.window[0], max: group.window[1], auto: false },
        y: { distr: panel.log ? 3 : 1, range: (chart) => this.range(chart) },
      },
      axes: [this.horizontalAxis(), this.verticalAxis()],
      legend: {
        mount: (_, legend) => this.caption.append(legend),
        markers: {
          width: 2,
          stroke: (_, index) => `var(--${lines[index - 1].colour})`,
          fill: () => "none",
          dash: (_, index) => dashName(lines[index - 1].dash),
        },
      },
      focus: { alpha: 0.2 },
      cursor: {
        y: false,
        points: { size: 5 },
        focus: { prox: -1 },
        drag: { x: true, y: false, setScale: false, dist: CLICK_PX },
        sync: { key: group.key, setSeries: false, filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
        bind: { dblclick: () => () => group.zoomOut() },
      },
      hooks: {
        ...new PlotMarks(this).hooks,
        setCursor: [(chart) => { if (!(chart.cursor.left >= 0)) this.show(); }],
        setSelect: [({ select, posToVal }) => {
          if (select.width > 0) group.zoom(posToVal(select.left, "x"), posToVal(select.left + select.width, "x"));
        }],
      },
    };
  }

  horizontalAxis() {
    const { unit } = this.group, text = (tick) => (tick === 0 && unit ? `0 ${unit}` : tickText(tick));
    return { ...AXIS, size: AXIS_HEIGHT, space: 60, grid: { show: false }, values: (_, ticks) => ticks.map(text) };
  }

  verticalAxis() {
    const axis = { ...AXIS, size: AXIS_WIDTH, space: this.panel.tall ? 32 : 19, values: (_, ticks) => ticks.map(tickText) };
    axis.grid = { stroke: () => theme.colour("line"), width: 1 };
    if (!this.panel.log) return axis;
    return { ...axis, splits: (_, side, low, high) => logTicks(low, high, LOG_TICKS), filter: (_, ticks) => ticks };
  }

  // ---- vertical scale

  /** Bounds of what is shown in the window; a robust scale leaves out what is far above the steady values. */
  range(chart) {
    const { panel, group } = this, [from, to] = group.window, all = [], steady = [];
    const inSteady = (x) => group.phases.some((phase) => x > phase.steady - 1e-4 && x < phase.end - 1e-4);
    let low = Infinity, high = -Infinity;
    this.lines.forEach(({ x, values, low: lower, high: upper }, index) => {
      if (!chart.series[index + 1].show) return;
      for (let at = indexAt(x, from); at < x.length && x[at] <= to; at++) {
        for (const value of [values[at], lower?.(at), upper?.(at)]) {
          if (!Number.isFinite(value) || (panel.log && value <= 0)) continue;
          low = Math.min(low, value);
          high = Math.max(high, value);
        }
        if (panel.robust && Number.isFinite(values[at])) all.push(values[at]);
        if (panel.robust && Number.isFinite(values[at]) && inSteady(x[at])) steady.push(values[at]);
      }
    });
    if (low > high) [low, high] = panel.log ? [0.1, 10] : [0, 1];
    this.highest = high;
    const usual = ABOVE_USUAL * steady.reduce((most, value) => Math.max(most, value), -Infinity);
    const rare = all.filter((value) => value > usual).length < RARE * all.length;
    this.leavesOut = rare && high > FAR_OUT / ABOVE_USUAL * usual;
    if (this.leavesOut && !this.whole) high = usual;
    const reach = high;
    for (const value of this.levels) {
      if (panel.log || value < 3 * reach) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
    this.top = high;
    this.leavesOut &&= this.whole || this.highest > high; // a guide may have made room for it
    this.offerWhole();
    if (panel.log) return [low / 1.3, high * 1.3];
    return [low < 0 ? 1.06 * low : 0, high > 0 ? 1.06 * high : 1];
  }

  offerWhole() {
    this.beyond.hidden = !this.leavesOut;
    const { unit, digits } = this.panel;
    this.beyond.textContent = this.whole ? "usual range" : `▲ up to ${this.highest.toFixed(digits)} ${unit}: show all`;
  }

  rescale() {
    const [min, max] = this.group.window;
    this.chart.setScale("x", { min, max });
  }

  nameGuides() {
    const legend = this.chart.root.querySelector(".u-legend") ?? this.caption.querySelector(".u-legend");
    for (const label of legend.querySelectorAll("th")) {
      Object.assign(label, { tabIndex: 0, role: "button", title: "Show or hide; with ctrl this one alone" });
      label.addEventListener("keydown", (event) => { if (event.key === "Enter") label.click(); });
    }
    for (const { label } of this.panel.guides ?? []) make(this.caption, "span", { class: "guide-name" }, label);
  }

  // ---- the shown instant, and pointer control

  show() {
    const { chart, group, visible } = this, x = group.shown;
    if (!chart || !visible || x === null) return;
    const [from, to] = group.window, place = chart.valToPos(x, "x");
    this.now.hidden = x < from - 1e-9 || x > to + 1e-9;
    this.now.style.transform = `translateX(${place.toFixed(1)}px)`;
    if (chart.cursor.left >= 0) return;
    const idxs = chart.data.map((column) => {
      let at = indexAt(chart.data[0], x + 1e-4);
      while (at > 0 && column[at] === undefined) at--; // an instant of another set
      return at;
    });
    chart.setLegend({ idxs }, false);
  }

  listen(over) {
    const { group } = this;
    over.addEventListener("click", (event) => group.pick(clamp(this.chart.posToVal(event.offsetX, "x"), ...group.window)));
    over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // the wheel alone scrolls the page
      event.preventDefault();
      const middle = this.chart.posToVal(event.offsetX, "x"), factor = Math.exp(0.002 * event.deltaY);
      group.zoom(...group.window.map((end) => middle + factor * (end - middle)));
    }, { passive: false });
    // uPlot knows the mouse only.
    for (const [touch, mouse] of [["pointerdown", "mousedown"], ["pointermove", "mousemove"], ["pointerup", "mouseup"]]) {
      over.addEventListener(touch, (event) => {
        if (event.pointerType === "touch") over.dispatchEvent(new MouseEvent(mouse, event));
      });
    }
  }
}

/** The border that looks like a line. */
function dashName(dash) {
  if (!dash.length) return "solid";
  return dash[0] < 3 ? "dotted" : "dashed";
}
