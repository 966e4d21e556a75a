// The table of variants: sorted by a click on a heading, with a small plot of mean and interval in each cell.

const SMALL = { width: 104, height: 15, pad: 5 };

class VariantTable {
  constructor(table) {
    this.body = table.tBodies[0];
    for (const heading of table.querySelectorAll("th[data-number]")) this.drawColumn(heading);
    for (const button of table.querySelectorAll("thead button")) button.addEventListener("click", () => this.sort(button.parentElement));
  }

  /** Sort by a column; by the same one again, the other way round. Rows without a value come last. */
  sort(heading) {
    const rising = heading.ariaSort !== "ascending", column = heading.cellIndex;
    for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const value = (row) => row.cells[column].dataset.value ?? "";
    const rows = [...this.body.rows].sort((a, b) => {
      const [left, right] = [value(a), value(b)];
      if (left === "" || right === "") return (left === "") - (right === "");
      const order = Number.isNaN(+left) || Number.isNaN(+right) ? left.localeCompare(right) : left - right;
      return rising ? order : -order;
    });
    this.body.append(...rows);
  }

  drawColumn(heading) {
    const data = page.numbers[heading.dataset.number], known = data.variants.filter(Boolean);
    const scale = new Scale(known.map(({ mean }) => mean), { near: data.claim, bounds: known.flatMap(({ ci95 }) => ci95 ?? []) });
    const x = (value) => SMALL.pad + scale.part(value) * (SMALL.width - 2 * SMALL.pad);
    const axis = make(heading, "svg", { width: SMALL.width, height: 14 });
    const ticks = scale.ticks(4), shown = [ticks[0], ticks.at(-1)], texts = shown.map(tickText);
    // Away from each other, where there is room on that side.
    const anchors = [x(shown[0]) > 6 * texts[0].length ? "end" : "start", SMALL.width - x(shown[1]) > 6 * texts[1].length ? "start" : "end"];
    shown.forEach((tick, index) => make(axis, "text", { x: x(tick), y: 11, "text-anchor": anchors[index] }, texts[index]));
    for (const row of this.body.rows) {
      const svg = make(row.cells[heading.cellIndex], "svg", { width: SMALL.width, height: SMALL.height });
      for (const tick of shown) make(svg, "line", { class: "grid", x1: x(tick), x2: x(tick), y1: 0, y2: SMALL.height });
      if (data.claim !== null && scale.has(data.claim)) make(svg, "line", { class: "guide", x1: x(data.claim), x2: x(data.claim), y1: 0, y2: SMALL.height });
      const distribution = data.variants[row.dataset.variant], middle = SMALL.height / 2;
      if (!distribution) continue;
      const { mean, ci95 } = distribution;
      if (ci95) make(svg, "line", { class: "interval", x1: x(ci95[0]), x2: x(ci95[1]), y1: middle, y2: middle });
      make(svg, "circle", { class: "mean-dot", cx: x(mean), cy: middle, r: 3 });
    }
  }
}
