// One number of all variants: a row for each, with its flights as dots on a common scale.

const ROW = 24, PAD = 12;
const HEADINGS = ["mean", "95 % interval", "min", "p95", "max", "flights"];

class Strips {
  /** Fill a table with the number that its `data-number` names. */
  constructor(table) {
    this.table = table;
    new ResizeObserver(() => this.draw()).observe(table);
    this.show(table.dataset.number);
  }

  show(number) {
    this.table.dataset.number = number;
    this.table.replaceChildren();
    this.data = page.numbers[number];
    const { claim, variants } = this.data, known = variants.filter(Boolean);
    this.scale = new Scale(known.flatMap(({ values }) => values), { near: claim, bounds: known.flatMap(({ ci95 }) => ci95 ?? []) });
    const head = make(make(this.table, "thead"), "tr");
    make(head, "th");
    this.axis = make(head, "td", { class: "strip axis" });
    for (const heading of HEADINGS) make(head, "th", {}, heading);
    const body = make(this.table, "tbody");
    this.cells = page.variants.map((variant, index) => this.row(body, variant, variants[index]));
    this.width = 0;
    this.draw();
  }

  row(body, variant, distribution) {
    const row = make(body, "tr"), bare = (value) => value.toFixed(this.data.digits);
    make(row, "th", { title: variant.name }, variant.title);
    const cell = make(row, "td", { class: "strip" });
    if (!distribution) {
      for (const text of ["-", "", "-", "-", "-", "0"]) make(row, "td", {}, text);
      return cell;
    }
    const { mean, ci95, min, p95, max, values, holds } = distribution;
    make(row, "td", { class: holds === false ? "mean missed" : "mean" }, withUnit(mean, this.data));
    const texts = [ci95 ? rangeText(ci95, this.data) : "", bare(min), bare(p95), bare(max), String(values.length)];
    for (const text of texts) make(row, "td", {}, text);
    return cell;
  }

  draw() {
    const width = this.axis.clientWidth;
    if (!width || width === this.width) return;
    this.width = width;
    const x = (value) => PAD + this.scale.part(value) * (width - 2 * PAD), { claim } = this.data;
    const ticks = this.scale.ticks(width / 90);
    this.drawAxis(width, x, ticks);
    this.cells.forEach((cell, variant) => {
      cell.replaceChildren();
      const svg = make(cell, "svg", { height: ROW, width });
      for (const tick of ticks) make(svg, "line", { class: "grid", x1: x(tick), x2: x(tick), y1: 0, y2: ROW });
      if (claim !== null && this.scale.has(claim)) make(svg, "line", { class: "guide", x1: x(claim), x2: x(claim), y1: 0, y2: ROW });
      const distribution = this.data.variants[variant];
      if (distribution) this.drawVariant(svg, distribution, x, variant);
    });
  }

  drawAxis(width, x, ticks) {
    this.axis.replaceChildren();
    this.axis.previousElementSibling.replaceChildren();
    const svg = make(this.axis, "svg", { height: 16, width });
    for (const tick of ticks) make(svg, "text", { x: x(tick), y: 12, "text-anchor": "middle" }, tickText(tick));
    if (this.scale.log) make(this.axis.previousElementSibling, "small", {}, "log scale");
  }

  drawVariant(svg, { values, seeds, quartiles, mean, ci95 }, x, variant) {
    const middle = ROW / 2, [lower, median, upper] = quartiles;
    make(svg, "rect", { class: "box", x: x(lower), y: 4, width: Math.max(x(upper) - x(lower), 1), height: ROW - 8, rx: 3 });
    make(svg, "line", { class: "median", x1: x(median), x2: x(median), y1: 4, y2: ROW - 4 });
    values.forEach((value, index) => {
      // The golden ratio spreads any number of dots evenly, the same way each time.
      const aside = ((seeds[index] * 0.618034) % 1 - 0.5) * (ROW - 11);
      const dot = make(svg, "circle", { class: "dot", cx: x(value), cy: middle + aside, r: 2.6, "data-seed": seeds[index] });
      this.markSeed(dot, seeds[index], `seed ${seeds[index]}, ${page.variants[variant].title}: ${withUnit(value, this.data)}`);
    });
    if (ci95) make(svg, "line", { class: "interval", x1: x(ci95[0]), x2: x(ci95[1]), y1: middle, y2: middle });
    make(svg, "path", { class: "mean-mark", d: diamond(x(mean), middle, 4.5) });
  }

  /** Pointing at a flight shows the flights with the same seed in all rows. */
  markSeed(dot, seed, text) {
    explain(dot, () => text);
    dot.addEventListener("pointerenter", () => document.querySelectorAll(`.dot[data-seed="${seed}"]`).forEach((same) => same.classList.add("same")));
    dot.addEventListener("pointerleave", () => document.querySelectorAll(".dot.same").forEach((same) => same.classList.remove("same")));
  }
}

const diamond = (x, y, size) => `M${x - size} ${y}L${x} ${y - size}L${x + size} ${y}L${x} ${y + size}Z`;
