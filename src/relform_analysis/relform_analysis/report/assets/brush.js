// Draws lines and texts in space through a camera.

class Brush {
  constructor(context) {
    this.context = context;
  }

  /** Camera of everything drawn after this. */
  use(camera) {
    this.camera = camera;
  }

  /** A line between two points, clipped at the camera. */
  segment(from, to) {
    let a = this.camera.see(...from), b = this.camera.see(...to);
    if (a[2] < NEAR && b[2] < NEAR) return;
    const cut = (behind, ahead) => {
      const part = (NEAR - behind[2]) / (ahead[2] - behind[2]);
      return behind.map((value, axis) => value + part * (ahead[axis] - value));
    };
    if (a[2] < NEAR) a = cut(a, b);
    if (b[2] < NEAR) b = cut(b, a);
    this.context.moveTo(...this.camera.place(a));
    this.context.lineTo(...this.camera.place(b));
  }

  polyline(point, from, to) {
    const { context, camera } = this;
    context.beginPath();
    let drawing = false;
    for (let index = from; index <= to; index++) {
      const seen = camera.see(...point(index));
      if (!(seen[2] > NEAR)) { drawing = false; continue; }
      const place = camera.place(seen);
      if (drawing) context.lineTo(...place); else context.moveTo(...place);
      drawing = true;
    }
  }

  stroke(colour, width, dash = []) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = width;
    this.context.setLineDash(dash);
    this.context.stroke();
  }

  text(text, x, y, { colour, size, bold = false, halo = false, align = "center" }) {
    const { context } = this;
    context.font = `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;
    context.textAlign = align;
    if (halo) {
      context.setLineDash([]);
      context.lineWidth = 4;
      context.strokeStyle = this.halo;
      context.strokeText(text, x, y);
    }
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }
}
