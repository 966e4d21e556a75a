// What a plot shows behind and above its lines: phases, events, bands, levels to compare with, and where lines leave it.

const LONG = 0.5; // what lasts longer than this part of the axis is marked at its start alone

class PlotMarks {
  constructor(plot) {
    this.plot = plot;
  }

  /** Hooks of uPlot. */
  get hooks() {
    return {
      drawClear: [(chart) => { this.drawPhases(chart); this.drawMarks(chart); }],
      drawAxes: [(chart) => this.inside(chart, () => { this.drawBands(chart); this.drawGuides(chart); })],
      draw: [(chart) => this.drawBeyond(chart)],
    };
  }

  /** Draw with nothing outside of the axes. */
  inside({ ctx, bbox }, draw) {
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    draw();
    ctx.restore();
  }

  /** Fill a stretch of the common axis. */
  fill({ ctx, bbox, valToPos }, name, from, to, top = bbox.top, height = bbox.height) {
    const place = (x) => clamp(valToPos(x, "x", true), bbox.left, bbox.left + bbox.width);
    ctx.fillStyle = theme.colour(name);
    ctx.fillRect(place(from), top, place(to) - place(from), height);
    return [place(from), place(to)];
  }

  drawPhases(chart) {
    const { ctx, bbox } = chart, { pxRatio } = uPlot;
    ctx.save();
    ctx.font = `600 ${11 * pxRatio}px system-ui, sans-serif`;
    ctx.textAlign = "center";
    let free = -Infinity;
    this.plot.group.phases.forEach(({ name, start, steady, end }, index) => {
      const [left, right] = this.fill(chart, index % 2 ? "band-odd" : "band", start, end);
      this.fill(chart, "steady", steady, end, bbox.top - 3 * pxRatio, 3 * pxRatio);
      const middle = (left + right) / 2, half = ctx.measureText(name).width / 2 + 2 * pxRatio;
      if (middle - half < free || right - left < half) return;
      free = middle + half;
      ctx.fillStyle = theme.colour("muted");
      ctx.fillText(name, middle, bbox.top - 7 * pxRatio);
    });
    ctx.restore();
  }

  drawMarks(chart) {
    const { ctx, bbox, valToPos } = chart, { pxRatio } = uPlot, [from, to] = this.plot.group.window;
    for (const { start, end, kind } of this.plot.group.marks) {
      if ((end ?? start) < from || start > to) continue;
      ctx.globalAlpha = 0.08;
      if (end !== null && end - start < LONG * (this.plot.group.to - this.plot.group.from)) this.fill(chart, `mark-${kind}`, start, end);
      ctx.globalAlpha = 0.8;
      ctx.fillStyle = theme.colour(`mark-${kind}`);
      if (start >= from) ctx.fillRect(valToPos(start, "x", true), bbox.top, pxRatio, bbox.height);
      ctx.globalAlpha = 1;
    }
  }

  drawBands({ ctx, valToPos, series }) {
    this.plot.lines.forEach(({ x, low, high, colour }, index) => {
      if (!high || !series[index + 1].show) return;
      const corner = (at, edge) => [valToPos(x[at], "x", true), valToPos(edge(at), "y", true)];
      const path = new Path2D();
      for (const [first, last] of runs(x.length, (at) => Number.isFinite(low(at)) && Number.isFinite(high(at)))) {
        path.moveTo(...corner(first, low));
        for (let at = first; at <= last; at++) path.lineTo(...corner(at, high));
        for (let at = last; at >= first; at--) path.lineTo(...corner(at, low));
      }
      ctx.globalAlpha = 0.16;
      ctx.fillStyle = theme.colour(colour);
      ctx.fill(path);
      ctx.globalAlpha = 1;
    });
  }

  drawGuides({ ctx, bbox, valToPos }) {
    const { pxRatio } = uPlot;
    ctx.strokeStyle = theme.colour("muted");
    ctx.lineWidth = pxRatio;
    ctx.setLineDash([5 * pxRatio, 4 * pxRatio]);
    for (const value of this.plot.levels) {
      const y = valToPos(value, "y", true);
      ctx.stroke(new Path2D(`M${bbox.left} ${y}h${bbox.width}`));
    }
  }

  /** A triangle at the top wherever a line leaves the plot. */
  drawBeyond({ ctx, bbox, valToPos, series }) {
    const { plot } = this, [from, to] = plot.group.window, size = 4 * uPlot.pxRatio;
    if (!plot.leavesOut || plot.whole) return;
    plot.lines.forEach(({ x, values, colour }, index) => {
      if (!series[index + 1].show) return;
      ctx.fillStyle = theme.colour(colour);
      for (const [first, last] of runs(x.length, (at) => values[at] > plot.top && x[at] >= from && x[at] <= to)) {
        let peak = first;
        for (let at = first; at <= last; at++) if (values[at] > values[peak]) peak = at;
        const place = valToPos(x[peak], "x", true);
        ctx.fill(new Path2D(`M${place - size} ${bbox.top + 2 * size}L${place} ${bbox.top}L${place + size} ${bbox.top + 2 * size}Z`));
      }
    });
  }
}

/** First and last of each run of numbers below `count` for which a condition holds. */
function runs(count, holds) {
  const found = [];
  for (let at = 0; at < count; at++) {
    if (!holds(at)) continue;
    const first = at;
    while (at + 1 < count && holds(at + 1)) at++;
    found.push([first, at]);
  }
  return found;
}
