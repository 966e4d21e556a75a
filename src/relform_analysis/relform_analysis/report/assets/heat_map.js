// One number over two parameters: a table whose cells are coloured by their value.

function drawHeatMap(plot, grid) {
  const data = page.numbers[plot.dataset.plot], { across, down } = grid;
  plot.replaceChildren();
  const means = data.variants.filter(Boolean).map(({ mean }) => mean);
  const scale = new Scale(means), [low, high] = [scale.part(Math.min(...means)), scale.part(Math.max(...means))];
  const digits = digitsOf(means, data.digits);
  const table = make(plot, "table", { class: "heat-map", style: `--columns: ${page.parameters[across].texts.length + 1}` }), head = make(table, "thead");
  const names = make(head, "tr");
  make(names, "th", { class: "corner" }, `${page.parameters[down].word} ↓`);
  make(names, "th", { colspan: page.parameters[across].texts.length }, `${page.parameters[across].word} →`);
  const row = make(head, "tr");
  make(row, "td");
  for (const text of page.parameters[across].texts) make(row, "th", {}, text);
  const body = make(table, "tbody");
  page.parameters[down].texts.forEach((text, downIndex) => {
    const row = make(body, "tr");
    make(row, "th", {}, text);
    page.parameters[across].texts.forEach((_, acrossIndex) => {
      drawCell(make(row, "td"), grid.variantAt(acrossIndex, downIndex), data, digits, (value) => (scale.part(value) - low) / (high - low || 1));
    });
  });
}

/** Digits after the point with which the smallest value has two that say something; `usual` at least, two more at most. */
function digitsOf(values, usual) {
  const smallest = Math.min(...values.map(Math.abs).filter((value) => value > 0));
  return smallest < Infinity ? clamp(1 - Math.floor(Math.log10(smallest)), usual, usual + 2) : usual;
}

/** Black or white text, whichever has more contrast; by the relative luminance of WCAG. */
function readableOn(colour) {
  const linear = colour.match(/\d+/g).slice(0, 3).map((channel) => (channel / 255) ** 2.2);
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] > 0.18 ? "#111" : "#fff";
}

function drawCell(cell, variant, data, digits, part) {
  if (variant < 0) return;
  const { runs, completed } = page.variants[variant], distribution = data.variants[variant];
  if (distribution) {
    cell.style.background = mix(theme.colour("heat-low"), theme.colour("heat-high"), part(distribution.mean));
    cell.style.color = readableOn(cell.style.background);
    cell.textContent = distribution.mean.toFixed(digits);
  } else {
    cell.className = "empty";
    cell.textContent = "-";
  }
  if (completed < runs) make(cell, "small", { class: "lost" }, `▲ ${runs - completed} of ${runs} lost`);
  cell.tabIndex = 0;
  explain(cell, () => variantText(variant, data));
}
