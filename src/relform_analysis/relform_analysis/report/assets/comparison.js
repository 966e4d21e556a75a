// The page of a comparison: connects playback, paths, plots and keys.

const steps = page.flights.map(({ step }) => unpack(step));
const begin = Math.min(...steps.map(([first]) => first)), end = Math.max(...page.flights.map(({ tick }) => unpack(tick).at(-1)));
const playback = new Playback(begin, Math.max(end, begin + page.period), page.period);
const plots = new PlotGroup({ from: playback.begin, to: playback.end, unit: "s", narrowest: 0.25 }, page.phases);
for (const { lines, ...panel } of page.panels) {
  plots.add(byId("plots"), { ...panel, sets: lines.map((line, flight) => ({ x: steps[flight], lines: [line] })) });
}
plots.pick = (time) => playback.seek(time);
playback.onChange(() => plots.show(playback.time));
const paths = new PathViews(byId("paths"), page.flights, playback);

for (const speed of SPEEDS) make(byId("speed"), "option", { value: speed }, `${speed}×`);
byId("speed").addEventListener("change", (event) => { playback.setSpeed(Number(event.target.value)); event.target.blur(); });
byId("play").addEventListener("click", () => playback.toggle());
byId("unzoom").addEventListener("click", () => plots.zoomOut());
plots.zoomListeners.push(() => { byId("unzoom").hidden = !plots.zoomed; });

const slider = byId("time");
Object.assign(slider, { min: playback.begin, max: playback.end, step: "any" });
slider.addEventListener("input", () => playback.seek(slider.valueAsNumber));

playback.onChange(() => {
  const { time } = playback, phase = phaseAt(time);
  byId("now").textContent = `${time.toFixed(2)} s`;
  byId("phase").textContent = phase ? `${phase.name}  ${phase.title}` : "";
  byId("play").textContent = playback.playing ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", playback.playing ? "Pause" : "Play");
  byId("speed").value = String(playback.speed);
  slider.value = time;
});

// Ratios that a reader should see first.
const LARGE = 1.1;
for (const cell of document.querySelectorAll("td.change:last-child, td.change + td.change")) {
  const ratio = Number(cell.textContent);
  if (Number.isFinite(ratio) && (ratio > LARGE || ratio < 1 / LARGE)) cell.classList.add("large");
}

actOnKeys(playbackKeys(playback, plots));

playback.changed();

// For tests and for the console of the browser.
window.relform = { playback, plots, paths };
