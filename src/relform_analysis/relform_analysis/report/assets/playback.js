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
