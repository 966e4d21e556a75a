// The page of a sweep: beside the numbers of each variant, its flights as dots on a common scale.

const ROW = 24, PAD = 12;
const FAR_APART = 4; // largest over smallest value, from which the scale is logarithmic

class Strips {
  constructor(table) {
    Object.assign(this, { table, data: page.numbers[table.dataset.number] });
    this.cells = [...table.querySelectorAll("tbody .strip")];
    this.axis = table.querySelector(".axis");
    this.range = this.findRange();
    new ResizeObserver(() => this.draw()).observe(this.axis);
  }

  /** The scale: of all values, logarithmic where variants are far apart, with the paper's number if that is near. */
  findRange() {
    const { claim, variants } = this.data;
    const values = variants.flatMap((variant) => variant?.values ?? []);
    let low = Math.min(...values), high = Math.max(...values);
    if (claim !== null && claim < 2 * high && claim > 0.3 * low) [low, high] = [Math.min(low, claim), Math.max(high, claim)];
    this.log = low > 0 && high > FAR_APART * low;
    if (this.log) return [low / 1.1, high * 1.1];
    for (const bound of variants.flatMap((variant) => variant?.ci95 ?? [])) [low, high] = [Math.min(low, bound), Math.max(high, bound)];
    if (low >= 0 && low < 0.6 * high) low = 0;
    const margin = 0.03 * (high - low) || Math.abs(high) * 0.1 || 1;
    return [low === 0 ? 0 : low - margin, high + margin];
  }

  place(value, width) {
    const [low, high] = this.range;
    const part = this.log ? Math.log(Math.max(value, low) / low) / Math.log(high / low) : (value - low) / (high - low);
    return PAD + part * (width - 2 * PAD);
  }

  draw() {
    const width = this.axis.clientWidth;
    if (!width) return;
    const x = (value) => this.place(value, width), { claim } = this.data;
    const ticks = this.log ? logTicks(...this.range, 6) : linearTicks(...this.range, width / 90);
    this.drawAxis(width, x, ticks);
    this.cells.forEach((cell, variant) => {
      cell.replaceChildren();
      const svg = make(cell, "svg", { height: ROW, width });
      for (const tick of ticks) make(svg, "line", { class: "grid", x1: x(tick), x2: x(tick), y1: 0, y2: ROW });
      if (claim !== null && claim >= this.range[0] && claim <= this.range[1]) {
        make(svg, "line", { class: "guide", x1: x(claim), x2: x(claim), y1: 0, y2: ROW });
      }
      const distribution = this.data.variants[variant];
      if (distribution) this.drawVariant(svg, distribution, x, variant);
    });
  }

  drawAxis(width, x, ticks) {
    this.axis.replaceChildren();
    this.axis.previousElementSibling.replaceChildren();
    const svg = make(this.axis, "svg", { height: 16, width });
    for (const tick of ticks) make(svg, "text", { x: x(tick), y: 12, "text-anchor": "middle" }, tickText(tick));
    if (this.log) make(this.axis.previousElementSibling, "small", {}, "log scale");
  }

  drawVariant(svg, { values, seeds, quartiles, mean, ci95 }, x, variant) {
    const middle = ROW / 2, [lower, median, upper] = quartiles;
    make(svg, "rect", { class: "box", x: x(lower), y: 4, width: Math.max(x(upper) - x(lower), 1), height: ROW - 8, rx: 3 });
    make(svg, "line", { class: "median", x1: x(median), x2: x(median), y1: 4, y2: ROW - 4 });
    values.forEach((value, index) => {
      // The golden ratio spreads any number of dots evenly, the same way each time.
      const aside = ((seeds[index] * 0.618034) % 1 - 0.5) * (ROW - 11);
      const dot = make(svg, "circle", { class: "dot", cx: x(value), cy: middle + aside, r: 2.6, "data-seed": seeds[index] });
      dot.addEventListener("pointerenter", (event) => showSeed(event, seeds[index], page.variants[variant], this.data, value));
      dot.addEventListener("pointerleave", hideSeed);
    });
    if (ci95) make(svg, "line", { class: "interval", x1: x(ci95[0]), x2: x(ci95[1]), y1: middle, y2: middle });
    const at = x(mean);
    make(svg, "path", { class: "mean-mark", d: `M${at - 4.5} ${middle}L${at} ${middle - 4.5}L${at + 4.5} ${middle}L${at} ${middle + 4.5}Z` });
  }
}

function showSeed(event, seed, variant, { digits, unit }, value) {
  const tip = byId("tip");
  tip.textContent = `seed ${seed}, ${variant}: ${value.toFixed(digits)} ${unit}`;
  tip.hidden = false;
  const left = Math.min(event.clientX + 12, innerWidth - tip.offsetWidth - 8);
  Object.assign(tip.style, { left: `${left}px`, top: `${event.clientY + 14}px` });
  document.querySelectorAll(`.dot[data-seed="${seed}"]`).forEach((dot) => dot.classList.add("same"));
}

function hideSeed() {
  byId("tip").hidden = true;
  document.querySelectorAll(".dot.same").forEach((dot) => dot.classList.remove("same"));
}

for (const table of document.querySelectorAll(".strips")) new Strips(table);
addEventListener("keydown", (event) => {
  if (event.key.toLowerCase() === "t" && !event.ctrlKey && !event.metaKey && !event.altKey) theme.toggle();
});
