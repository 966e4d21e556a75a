// The page of one flight: connects playback, scene, plots and keys.

const flight = new Flight(page);
const playback = new Playback(flight.tick[0], Math.max(flight.tick.at(-1), flight.tick[0] + page.period), page.period);
const plots = new Plots(byId("plots"), flight, playback);
const timeline = new Timeline(byId("timeline"), flight, playback, plots);

// The legend of the scene, with the numbers at the shown time.
page.vehicles.forEach((name, vehicle) => {
  const row = make(byId("key"), "div");
  make(row, "i", { style: `background: var(--${page.styles[vehicle].colour})` });
  make(row, "span", {}, name);
});
const linkRows = page.pairs.map(({ name }) => {
  const row = make(byId("key"), "div", { class: "link" });
  const swatch = make(row, "i");
  make(row, "span", {}, name);
  return { swatch, output: make(row, "output") };
});
const scale = make(byId("key"), "div", { class: "scale", title: "Colour of a link: twice the error that the paper claims, and beyond, is the strongest" });
make(scale, "span", {}, "0");
make(scale, "i");
make(scale, "span", {}, `${2 * page.claim} m`);

const scene = new Scene(byId("scene"), byId("key"), flight, playback);
const showLinks = () => linkRows.forEach(({ swatch, output }, pair) => {
  const error = flight.error[flight.stepAt(playback.time) * page.pairs.length + pair];
  swatch.style.background = scene.drawing.linkColour(error);
  output.textContent = Number.isFinite(error) ? `${error.toFixed(3)} m` : "–";
});
playback.onChange(showLinks);
theme.listeners.push(showLinks);

// ---- transport

for (const speed of SPEEDS) make(byId("speed"), "option", { value: speed }, `${speed}×`);
byId("speed").addEventListener("change", (event) => { playback.setSpeed(Number(event.target.value)); event.target.blur(); });
byId("play").addEventListener("click", () => playback.toggle());
byId("unzoom").addEventListener("click", () => plots.zoomOut());
plots.listeners.push(() => { byId("unzoom").hidden = !plots.zoomed; });

const phaseAt = (time) => page.phases.findLast(({ start }) => time >= start - 1e-6);

playback.onChange(() => {
  const phase = phaseAt(playback.time);
  byId("now").textContent = `${playback.time.toFixed(2)} s`;
  byId("phase").textContent = phase ? `${phase.name}  ${phase.title}` : "";
  byId("play").textContent = playback.playing ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", playback.playing ? "Pause" : "Play");
  byId("speed").value = String(playback.speed);
});

// ---- views

const show = (view) => {
  scene.show(view);
  for (const name of ["overview", "follow"]) byId(name).setAttribute("aria-pressed", scene.main === name);
};
scene.onShow = show;
byId("overview").addEventListener("click", () => show("overview"));
byId("follow").addEventListener("click", () => show("follow"));
byId("home").addEventListener("click", () => scene.home());
byId("keys-button").addEventListener("click", () => byId("keys").showModal());

// ---- keys

const KEYS = {
  " ": () => playback.toggle(),
  ArrowLeft: (event) => (event.shiftKey ? playback.seek(playback.time - 1) : playback.step(-1)),
  ArrowRight: (event) => (event.shiftKey ? playback.seek(playback.time + 1) : playback.step(1)),
  Home: () => playback.seek(playback.begin),
  End: () => playback.seek(playback.end),
  "[": () => playback.faster(-1),
  "]": () => playback.faster(1),
  f: () => show(scene.other()),
  r: () => scene.home(),
  "+": () => scene.zoom(0.85),
  "=": () => scene.zoom(0.85),
  "-": () => scene.zoom(1 / 0.85),
  z: () => plots.zoomOut(),
  t: () => theme.toggle(),
  "?": () => byId("keys").showModal(),
};

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || byId("keys").open) return;
  if (event.target.closest("select, pre, summary")) return;
  const phase = /^[1-9]$/.test(event.key) ? page.phases[Number(event.key) - 1] : null;
  const action = phase ? () => playback.seek(phase.start) : KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action) return;
  event.preventDefault();
  action(event);
});

show("overview");
playback.changed();

// For tests and for the console of the browser.
window.relform = { flight, playback, plots, scene };
