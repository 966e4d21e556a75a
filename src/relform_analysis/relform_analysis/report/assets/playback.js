// The time that all parts of the page show.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

class Playback {
  constructor(begin, end, period) {
    Object.assign(this, { begin, end, period, time: begin, speed: 1, playing: false, listeners: [] });
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  seek(time) {
    this.time = clamp(time, this.begin, this.end);
    this.changed();
  }

  /** Move by a number of control steps, from the nearest one. */
  step(count) {
    this.pause();
    this.seek(this.begin + (Math.round((this.time - this.begin) / this.period) + count) * this.period);
  }

  faster(direction) {
    this.setSpeed(SPEEDS[clamp(SPEEDS.indexOf(this.speed) + direction, 0, SPEEDS.length - 1)]);
  }

  setSpeed(speed) {
    this.speed = speed;
    this.changed();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  pause() {
    this.playing = false;
    this.changed();
  }

  play() {
    if (this.time >= this.end) this.time = this.begin;
    this.playing = true;
    let last = null;
    const frame = (now) => {
      if (!this.playing) return;
      // A page that was in the background continues where it was.
      if (last !== null) this.time += this.speed * Math.min(now - last, 100) / 1000;
      last = now;
      if (this.time >= this.end) this.playing = false;
      this.seek(this.time);
      if (this.playing) requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    this.changed();
  }

  changed() {
    this.listeners.forEach((listener) => listener());
  }
}

const phaseAt = (time) => page.phases.findLast(({ start }) => time >= start - 1e-6);

/** What keys do on every page with a playback, by the name of the key. */
const playbackKeys = (playback, plots) => ({
  " ": () => playback.toggle(),
  ArrowLeft: (event) => (event.shiftKey ? playback.seek(playback.time - 1) : playback.step(-1)),
  ArrowRight: (event) => (event.shiftKey ? playback.seek(playback.time + 1) : playback.step(1)),
  Home: () => playback.seek(playback.begin),
  End: () => playback.seek(playback.end),
  z: () => plots.zoomOut(),
  t: () => theme.toggle(),
});

/** Act on pressed keys, except those of a control or of an open dialog. */
function actOnKeys(actions) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target.closest("select, pre, summary")) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}
