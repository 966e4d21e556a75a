// One number against a parameter: a line of means with intervals, one for each value of a second parameter.

const CURVE = { height: 190, left: 46, right: 14, top: 10, bottom: 34 };

function drawCurves(plot, grid) {
  const width = plot.clientWidth;
  if (!width) return;
  plot.replaceChildren();
  const data = page.numbers[plot.dataset.plot], parameter = page.parameters[grid.across];
  const known = data.variants.filter(Boolean);
  const y = new Scale(known.map(({ mean }) => mean), { near: data.claim, bounds: known.flatMap(({ ci95 }) => ci95 ?? []) });
  const bottom = CURVE.height - CURVE.bottom, inner = width - CURVE.left - CURVE.right;
  const frame = {
    x: parameterScale(parameter, CURVE.left, inner),
    y: (value) => bottom - y.part(value) * (bottom - CURVE.top),
    bottom, right: width - CURVE.right,
  };
  const svg = make(plot, "svg", { class: "curves", width, height: CURVE.height, role: "img", "aria-label": `${data.label} against ${parameter.word}` });
  drawFrame(svg, frame, y, data, parameter);
  const aside = grid.series.length > 1 ? Math.min(5, inner / parameter.texts.length / grid.series.length / 2) : 0;
  grid.series.forEach((down, index) => {
    const shift = aside * (index - (grid.series.length - 1) / 2);
    drawLine(svg, frame, data, parameter.texts.map((_, across) => grid.variantAt(across, down)), seriesColour(index, grid.series.length), shift);
  });
  if (data.claim !== null && y.has(data.claim)) {
    make(svg, "text", { class: "claim", x: frame.right, y: frame.y(data.claim) - 4, "text-anchor": "end" }, "the paper");
  }
}

/** Where a value of a parameter is: numbers to scale, logarithmic where they are far apart; others side by side. */
function parameterScale({ numbers, texts }, left, inner) {
  if (numbers === null || texts.length < 2) return (index) => left + ((index + 0.5) / texts.length) * inner;
  const low = numbers[0], high = numbers.at(-1), pad = 0.05 * inner;
  const logarithmic = low > 0 && high > FAR_APART * low;
  const part = (value) => (logarithmic ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
  return (index) => left + pad + part(numbers[index]) * (inner - 2 * pad);
}

function drawFrame(svg, { x, y, bottom, right }, scale, data, parameter) {
  for (const tick of scale.ticks(6)) {
    make(svg, "line", { class: "grid", x1: CURVE.left, x2: right, y1: y(tick), y2: y(tick) });
    make(svg, "text", { x: CURVE.left - 6, y: y(tick) + 3.5, "text-anchor": "end" }, tickText(tick));
  }
  if (data.claim !== null && scale.has(data.claim)) make(svg, "line", { class: "guide", x1: CURVE.left, x2: right, y1: y(data.claim), y2: y(data.claim) });
  make(svg, "line", { class: "axis-line", x1: CURVE.left, x2: right, y1: bottom, y2: bottom });
  let free = -Infinity;
  parameter.texts.forEach((text, index) => {
    make(svg, "line", { class: "axis-line", x1: x(index), x2: x(index), y1: bottom, y2: bottom + 4 });
    const label = make(svg, "text", { x: x(index), y: bottom + 15, "text-anchor": "middle" }, text);
    const half = label.getComputedTextLength() / 2;
    if (x(index) - half < free) label.remove();
    else free = x(index) + half + 6;
  });
  make(svg, "text", { x: (CURVE.left + right) / 2, y: CURVE.height - 4, "text-anchor": "middle" }, parameter.word);
}

function drawLine(svg, { x, y, bottom }, data, variants, colour, shift) {
  const group = make(svg, "g", { style: `color: ${colour}` });
  const at = (index) => x(index) + shift;
  let path = "", pen = "M";
  variants.forEach((variant, index) => {
    const distribution = data.variants[variant];
    path += distribution ? `${pen}${at(index)} ${y(distribution.mean)}` : "";
    pen = distribution ? "L" : "M";
  });
  make(group, "path", { class: "curve", d: path });
  variants.forEach((variant, index) => {
    const distribution = data.variants[variant];
    if (distribution?.ci95) {
      const [low, high] = distribution.ci95;
      make(group, "line", { class: "whisker", x1: at(index), x2: at(index), y1: y(low), y2: y(high) });
    }
    const { runs, completed } = page.variants[variant] ?? { runs: 0, completed: 0 };
    if (distribution) explain(make(group, "circle", { class: "point", cx: at(index), cy: y(distribution.mean), r: 4 }), () => variantText(variant, data));
    if (completed < runs) {
      const mark = make(svg, "text", { class: "lost", x: at(index), y: bottom - 3, "text-anchor": "middle" }, "▲");
      explain(mark, () => variantText(variant, data));
    }
  });
}
