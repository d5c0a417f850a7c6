// Adds to a plot's CSV link one that saves the plot as SVG, and a button that enlarges it.

const SVG_STYLES = ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "font-size", "font-family", "font-weight"];

// A plot as SVG of its own in the page's light colours, for programs that support neither style sheets nor variables.
function standAlone(svg) {
  const light = [...document.styleSheets[0].cssRules].find((rule) => rule.selectorText === ":root").style;
  for (const name of light) svg.style.setProperty(name, light.getPropertyValue(name));
  const copy = svg.cloneNode(true), copies = [copy, ...copy.querySelectorAll("*")];
  [svg, ...svg.querySelectorAll("*")].forEach((element, i) => {
    const style = getComputedStyle(element);
    copies[i].removeAttribute("class");
    if (element.localName !== "title") SVG_STYLES.forEach((name) => copies[i].setAttribute(name, style.getPropertyValue(name)));
  });
  svg.removeAttribute("style");
  copy.removeAttribute("style");
  return new XMLSerializer().serializeToString(copy);
}

// Opens a plot in a dialog: the wheel, + and - zoom, dragging and the arrow keys pan, 0 shows all again.
function enlarge(svg) {
  const big = svg.cloneNode(true), close = make("button", { type: "button" }, "Close"), box = make("dialog", { className: "large" }, big, close);
  const [x0, y0, w, h] = svg.getAttribute("viewBox").split(/[ ,]+/).map(Number), view = { x: x0, y: y0, zoom: 1 };
  const show = () => {
    view.x = Math.min(Math.max(view.x, x0), x0 + w - w / view.zoom);
    view.y = Math.min(Math.max(view.y, y0), y0 + h - h / view.zoom);
    big.setAttribute("viewBox", [view.x, view.y, w / view.zoom, h / view.zoom].join(" "));
  };
  const look = (factor, u = 0.5, v = 0.5) => {
    const next = Math.min(Math.max(view.zoom * factor, 1), 32), less = 1 / view.zoom - 1 / next;
    Object.assign(view, { x: view.x + u * w * less, y: view.y + v * h * less, zoom: next });
    show();
  };
  const move = (dx, dy) => { view.x += dx * w / view.zoom; view.y += dy * h / view.zoom; show(); };
  const keys = { "+": () => look(1.5), "=": () => look(1.5), "-": () => look(1 / 1.5), 0: () => look(0), ArrowLeft: () => move(-0.1, 0),
    ArrowRight: () => move(0.1, 0), ArrowUp: () => move(0, -0.1), ArrowDown: () => move(0, 0.1) };
  big.addEventListener("wheel", (e) => {
    const r = big.getBoundingClientRect();
    e.preventDefault();
    look(e.deltaY < 0 ? 1.2 : 1 / 1.2, (e.clientX - r.left) / r.width, (e.clientY - r.top) / r.height);
  }, { passive: false });
  big.addEventListener("pointermove", (e) => {
    const r = big.getBoundingClientRect();
    if (e.buttons & 1) move(-e.movementX / r.width, -e.movementY / r.height);
  });
  box.addEventListener("keydown", (e) => { if (keys[e.key]) { e.preventDefault(); e.stopPropagation(); keys[e.key](); } });
  box.addEventListener("close", () => box.remove());
  box.setAttribute("aria-label", "Plot");
  close.addEventListener("click", () => box.close());
  document.body.append(box);
  box.showModal();
}

for (const csv of document.querySelectorAll("figcaption a.csv")) {
  const svg = csv.closest("figure").querySelector("svg.plot");
  if (!svg) continue;
  const link = make("a", { className: "csv", download: csv.download.replace(/csv$/, "svg"), href: "#" }, "SVG");
  link.setAttribute("aria-label", link.download);
  link.addEventListener("click", () => { link.href = URL.createObjectURL(new Blob([standAlone(svg)], { type: "image/svg+xml" })); });
  const larger = make("button", { type: "button", className: "larger" }, "larger");
  larger.setAttribute("aria-label", link.download.replace(/\.svg$/, "") + ", larger");
  larger.addEventListener("click", () => enlarge(svg));
  csv.after(" ", link, " ", larger);
}
