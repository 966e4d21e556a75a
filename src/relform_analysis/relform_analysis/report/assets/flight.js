// The page of one flight: connects playback, scene, plots, what happened, and keys.

const flight = new Flight(page);
const playback = new Playback(flight.tick[0], Math.max(flight.tick.at(-1), flight.tick[0] + page.period), page.period);
const axis = { from: playback.begin, to: playback.end, unit: "s", narrowest: 0.25 };
const plots = new PlotGroup(axis, page.phases, page.happenings);
for (const { title, closed, panels } of page.sections) {
  const parent = closed ? make(byId("plots"), "details", { class: "more-plots" }) : byId("plots");
  if (title) make(parent, closed ? "summary" : "h2", {}, title);
  for (const { lines, ...panel } of panels) plots.add(parent, { ...panel, sets: [{ x: flight.step, lines }] });
}
plots.pick = (time) => playback.seek(time);
playback.onChange(() => plots.show(playback.time));
const timeline = new Timeline(byId("timeline"), flight, playback, plots);

// Below the scene: the colours of the vehicles, the scale of the links, and the pair with the largest error at the shown time.
page.vehicles.forEach((name, vehicle) => {
  const row = make(byId("vehicles"), "span", { class: "vehicle" });
  const { colour, dash } = page.styles[vehicle];
  make(row, "i", { style: `border-top: 3px ${dashName(dash)} var(--${colour})` });
  make(row, "span", {}, name);
});
byId("scale-end").textContent = `${2 * page.claim} m`;

const scene = new Scene(byId("scene"), flight, playback);
const showWorstLink = () => {
  const { error, pair } = flight.worst(flight.stepAt(playback.time));
  byId("worst").textContent = pair === null ? "" : `${page.pairs[pair].name} ${error.toFixed(3)} m`;
};
playback.onChange(showWorstLink);

// The table of what happened: a click moves the time.
for (const row of document.querySelectorAll("#happenings [data-time]")) {
  row.addEventListener("click", () => playback.seek(Number(row.dataset.time)));
}

// ---- transport

for (const speed of SPEEDS) make(byId("speed"), "option", { value: speed }, `${speed}×`);
byId("speed").addEventListener("change", (event) => { playback.setSpeed(Number(event.target.value)); event.target.blur(); });
byId("play").addEventListener("click", () => playback.toggle());
byId("unzoom").addEventListener("click", () => plots.zoomOut());
plots.zoomListeners.push(() => { byId("unzoom").hidden = !plots.zoomed; });


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

actOnKeys({
  ...playbackKeys(playback, plots),
  "[": () => playback.faster(-1),
  "]": () => playback.faster(1),
  f: () => show(scene.other()),
  r: () => scene.home(),
  "+": () => scene.zoom(0.85),
  "=": () => scene.zoom(0.85),
  "-": () => scene.zoom(1 / 0.85),
  "?": () => byId("keys").showModal(),
  ...Object.fromEntries(page.phases.slice(0, 9).map((phase, index) => [index + 1, () => playback.seek(phase.start)])),
});

show("overview");
playback.changed();

// For tests and for the console of the browser.
window.relform = { flight, playback, plots, scene };
