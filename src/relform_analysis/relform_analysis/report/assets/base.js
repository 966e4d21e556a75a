// Shared by all scripts: data, elements, ticks of axes, and the theme.

const page = JSON.parse(document.getElementById("data").textContent);

/** The values of a packed array (packing.py); the caller keeps its `shape`. */
function unpack({ float32, int16, middle, step }) {
  const bytes = Uint8Array.from(atob(float32 ?? int16), (character) => character.charCodeAt(0));
  if (float32) return new Float32Array(bytes.buffer);
  return Float32Array.from(new Int16Array(bytes.buffer), (count) => (count === -32768 ? NaN : middle + count * step));
}

const byId = (id) => document.getElementById(id);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

function make(parent, name, attributes = {}, text = null) {
  const vector = parent instanceof SVGElement || name === "svg";
  const node = vector ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== null) node.textContent = text;
  return parent.appendChild(node);
}

/** Index of the last value up to `x` in an increasing array; 0 if there is none. */
function indexAt(values, x) {
  let low = 0, high = values.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (values[middle] <= x) low = middle; else high = middle - 1;
  }
  return low;
}

/** About `count` round numbers between two bounds. */
function linearTicks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const ticks = [];
  for (let index = Math.ceil(low / step - 1e-6); index * step <= high + 1e-6 * step; index++) ticks.push(index * step);
  return ticks;
}

/** Powers of ten between two positive bounds, not more than `count`; with 2 and 5 between if there are few. */
function logTicks(low, high, count) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const every = Math.max(1, Math.ceil((last - first + 1) / count));
  const ticks = [];
  for (let power = first - 1; power <= last; power++) {
    if ((power - first) % every === 0) ticks.push(10 ** power);
    if (last - first < 2) ticks.push(2 * 10 ** power, 5 * 10 ** power);
  }
  return ticks.filter((tick) => tick >= low * 0.999 && tick <= high * 1.001);
}

/** A number on an axis. */
function tickText(value) {
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(0).replace("e+", "e");
  return String(+value.toPrecision(6));
}

const theme = {
  listeners: [],
  colour: (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(),
  set(name) {
    document.documentElement.dataset.theme = name;
    theme.listeners.forEach((listener) => listener());
  },
  toggle: () => theme.set(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
};
const prefersDark = matchMedia("(prefers-color-scheme: dark)");
prefersDark.addEventListener("change", () => theme.set(prefersDark.matches ? "dark" : "light"));
byId("theme").addEventListener("click", theme.toggle);

/** A colour between two, each given as #rrggbb. */
function mix(low, high, part) {
  const channels = [1, 3, 5].map((at) => {
    const [a, b] = [low, high].map((colour) => parseInt(colour.slice(at, at + 2), 16));
    return Math.round(a + part * (b - a));
  });
  return `rgb(${channels.join(" ")})`;
}
