// Pointer control of the cameras of a scene: drag turns, shift and drag moves, ctrl and wheel zooms, a click on the small view
// exchanges the two.

function attachGrip(scene) {
  const { canvas } = scene;
  let grip = null;
  canvas.addEventListener("pointerdown", (event) => {
    const inset = scene.inInset(event);
    grip = { inset, view: inset ? scene.other() : scene.main, moved: 0, x: event.clientX, y: event.clientY };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    canvas.style.cursor = grip ? "grabbing" : scene.inInset(event) ? "pointer" : "grab";
    if (!grip) return;
    const dx = event.clientX - grip.x, dy = event.clientY - grip.y, camera = scene.cameras[grip.view];
    Object.assign(grip, { x: event.clientX, y: event.clientY, moved: grip.moved + Math.abs(dx) + Math.abs(dy) });
    if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
      if (grip.view === "overview") camera.move(dx, dy);
    } else {
      camera.turn(dx, dy);
    }
    scene.free.add(grip.view);
    scene.request();
  });
  canvas.addEventListener("pointerup", () => {
    if (grip?.inset && grip.moved < 4) scene.onShow(scene.other());
    grip = null;
  });
  canvas.addEventListener("pointercancel", () => { grip = null; });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return; // the wheel alone scrolls the page
    event.preventDefault();
    scene.zoom(Math.exp(0.0015 * event.deltaY), scene.inInset(event) ? scene.other() : scene.main);
  }, { passive: false });
}
