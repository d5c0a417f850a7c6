// The scenes of the page, its keys, and when images are unpacked.

const scenes = [...document.querySelectorAll("section.scene")].filter((s) => s.querySelector(".viewer")).map((s) => new Scene(s));

// A key goes to the scene nearest to the middle of the window.
function nearestScene() {
  const middle = window.innerHeight / 2;
  const distance = (s) => {
    const r = s.section.getBoundingClientRect();
    return Math.max(r.top - middle, middle - r.bottom, 0);
  };
  return scenes.reduce((a, b) => (distance(b) < distance(a) ? b : a));
}

document.addEventListener("keydown", (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || scenes.length === 0) return;
  if (e.target.type === "search" || /^(INPUT|SELECT)$/.test(e.target.tagName) && !/^[a-z0-9]$/.test(e.key)) return;
  const s = nearestScene(), kind = Object.keys(mapKinds).find((k) => mapKinds[k].key === e.key);
  if (/^[0-9]$/.test(e.key) && +e.key <= s.shots.length) s.show(+e.key, null);
  else if (kind && s.claims.length > 0) s.show(s.shown, kind);
  else if (e.key === "w" && s.shots.length > 1) s.toggleWipe();
  else if (e.key === "g") s.toggleGrid();
  else if (e.key === "+" || e.key === "=") s.zoom(s.view.zoom * 2);
  else if (e.key === "-") s.zoom(s.view.zoom / 2);
  else if (e.key === "f") s.zoom(1);
  else if (e.key === "[") s.expose(s.stops - 0.25);
  else if (e.key === "]") s.expose(s.stops + 0.25);
});

const loadAll = () => Promise.all(scenes.map((s) => s.load()));

// Unpacks one scene after the other while the browser is idle; one that comes into view before its turn, at once.
const idle = (work) => (window.requestIdleCallback || setTimeout)(work);
function loadNext(i) {
  if (i < scenes.length) scenes[i].load().then(() => idle(() => loadNext(i + 1)));
}
window.addEventListener("load", () => idle(() => loadNext(0)));

// For printing, opens folded details other than evidence, and draws all frames, even those never scrolled to.
const unfolded = new Set();
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details:not(.evidence, [open])").forEach((d) => {
    d.open = true;
    unfolded.add(d);
  });
  scenes.forEach((s) => s.panes.forEach((p) => p.draw(true)));
});
window.addEventListener("afterprint", () => {
  unfolded.forEach((d) => { d.open = false; });
  unfolded.clear();
});
