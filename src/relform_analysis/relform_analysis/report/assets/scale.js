// Scales of the plots of a sweep, and the small window that explains what is pointed at.

const FAR_APART = 4; // largest over smallest value, from which a scale is logarithmic

/** From values to parts of an axis, 0 to 1; logarithmic where the values are positive and far apart. */
class Scale {
  /** `near`: a value that is on the scale if it is near the others; `bounds`: of intervals, which are cut where they are very wide. */
  constructor(values, { near = null, bounds = [] } = {}) {
    let low = Math.min(...values), high = Math.max(...values);
    if (near !== null && near < 2 * high && near > 0.3 * low) [low, high] = [Math.min(low, near), Math.max(high, near)];
    const spread = high - low || Math.abs(high);
    bounds = bounds.map((bound) => clamp(bound, low - spread, high + spread));
    this.log = low > 0 && high > FAR_APART * low;
    if (this.log) {
      high = Math.max(high, ...bounds);
      [this.low, this.high] = [low / 1.1, high * 1.1];
      return;
    }
    for (const bound of bounds) [low, high] = [Math.min(low, bound), Math.max(high, bound)];
    if (low >= 0 && low < 0.6 * high) low = 0;
    const margin = 0.03 * (high - low) || Math.abs(high) * 0.1 || 1;
    [this.low, this.high] = [low === 0 ? 0 : low - margin, high + margin];
  }

  part(value) {
    const part = this.log ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    return clamp(part, 0, 1);
  }

  has(value) {
    return value >= this.low && value <= this.high;
  }

  /** Two round numbers at least, about `count` of them. */
  ticks(count) {
    const wanted = Math.max(2, Math.round(count));
    const ticks = this.log ? logTicks(this.low, this.high, wanted) : linearTicks(this.low, this.high, wanted);
    if (ticks.length > 1) return thinned(ticks, wanted);
    return linearTicks(this.low, this.high, 2 * wanted);
  }
}

/** Every so many of the ticks, so that not many more than `count` are left. */
function thinned(ticks, count) {
  const every = Math.ceil(ticks.length / (1.5 * count + 1));
  return ticks.filter((_, index) => index % every === 0);
}

/** Text beside the pointer while it is over an element. */
function explain(node, text) {
  node.addEventListener("pointerenter", (event) => {
    const tip = byId("tip");
    tip.textContent = text();
    tip.hidden = false;
    const left = Math.min(event.clientX + 12, innerWidth - tip.offsetWidth - 8);
    Object.assign(tip.style, { left: `${Math.max(left, 4)}px`, top: `${event.clientY + 14}px` });
  });
  node.addEventListener("pointerleave", () => { byId("tip").hidden = true; });
}

const withUnit = (value, { digits, unit }) => `${value.toFixed(digits)} ${unit}`.trim();

/** The range of an interval in the digits of its number. */
const rangeText = ([low, high], { digits }) => `${low.toFixed(digits)} … ${high.toFixed(digits)}`;
