// A sweep over a grid: which parameter is drawn in which direction, and one plot for each number.

class GridPlots {
  constructor(section) {
    this.plots = [...section.querySelectorAll("[data-plot]")];
    this.controls = section.querySelector(".controls");
    this.heading = section.querySelector(".series");
    // The first parameter varies most slowly: it is drawn down, the last one across.
    const parameters = page.parameters.map((_, index) => index);
    this.across = parameters.at(-1);
    this.down = parameters.length > 1 ? parameters.at(-2) : null;
    this.fixed = page.parameters.map(({ texts }) => Math.floor((texts.length - 1) / 2));
    this.kind = this.down === null ? "curves" : "map";
    this.buildControls();
    this.draw();
    new ResizeObserver(() => this.drawCurves()).observe(section);
    for (const details of section.querySelectorAll("details")) details.addEventListener("toggle", () => this.drawCurves());
    theme.listeners.push(() => this.draw());
  }

  buildControls() {
    this.controls.replaceChildren();
    if (this.down === null) return;
    const kinds = make(this.controls, "span", { class: "kinds", role: "group", "aria-label": "Kind of plot" });
    for (const [kind, text] of [["map", "heat maps"], ["curves", "curves"]]) {
      const button = make(kinds, "button", { type: "button", "aria-pressed": String(this.kind === kind) }, text);
      button.addEventListener("click", () => this.set({ kind }));
    }
    const names = page.parameters.map(({ word }, index) => [index, word]);
    this.select("across", names, this.across, (across) => this.set({ across, down: across === this.down ? this.across : this.down }));
    this.select(this.kind === "map" ? "down" : "a line for each", names, this.down, (down) => this.set({ down, across: down === this.across ? this.down : this.across }));
    page.parameters.forEach(({ word, texts }, index) => {
      if (index === this.across || index === this.down) return;
      this.select(word, [...texts.entries()], this.fixed[index], (value) => { this.fixed[index] = value; this.draw(); });
    });
  }

  select(label, options, chosen, choose) {
    const select = make(make(this.controls, "label", {}, `${label} `), "select");
    for (const [value, text] of options) make(select, "option", value === chosen ? { value, selected: "" } : { value }, text);
    select.addEventListener("change", () => choose(Number(select.value)));
  }

  set(changes) {
    Object.assign(this, changes);
    this.buildControls();
    this.draw();
  }

  /** The variant at a place of the plots; -1 if there is none. */
  variantAt(across, down) {
    return page.places.findIndex((place) => place.every((value, parameter) =>
      value === (parameter === this.across ? across : parameter === this.down ? down : this.fixed[parameter])));
  }

  draw() {
    this.series = this.down === null ? [0] : [...page.parameters[this.down].texts.keys()];
    this.drawSeries();
    if (this.kind === "map") for (const plot of this.plots) drawHeatMap(plot, this);
    else this.drawCurves();
  }

  drawCurves() {
    if (this.kind === "curves") for (const plot of this.plots) drawCurves(plot, this);
  }

  /** Which line has which colour, once for all plots. */
  drawSeries() {
    this.heading.replaceChildren();
    if (this.kind === "map" || this.down === null) return;
    const { word, texts } = page.parameters[this.down];
    make(this.heading, "b", {}, word);
    texts.forEach((text, index) => {
      const item = make(this.heading, "span");
      make(item, "i", { style: `background: ${seriesColour(index, texts.length)}` });
      item.append(text);
    });
  }
}

/** Of the lines for a parameter: from one colour to another, by the position of its value. */
const seriesColour = (index, count) =>
  (count > 1 ? mix(theme.colour("series-low"), theme.colour("series-high"), index / (count - 1)) : theme.colour("accent"));

/** What a plot says about one variant. */
function variantText(variant, data) {
  const { title, runs, completed } = page.variants[variant], distribution = data.variants[variant];
  const mean = distribution ? withUnit(distribution.mean, data) : "no value";
  const interval = distribution?.ci95 ? ` (95 %: ${rangeText(distribution.ci95, data)})` : "";
  return `${title}: ${mean}${interval}, ${completed} of ${runs} flights completed`;
}
