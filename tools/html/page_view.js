// One frame of the page: a canvas that shows an image or a map at its scene's zoom, with the marked tile and
// pixel, and passes pointer and key events to the scene.

function make(tag, properties, ...children) {
  const element = document.createElement(tag);
  for (const [name, v] of Object.entries(properties || {}))
    if (name.includes("-") || name === "role") element.setAttribute(name, v);
    else element[name] = v;
  element.append(...children);
  return element;
}

const waiting = new Set();
function redraw(pane) {
  if (waiting.size === 0) requestAnimationFrame(() => {
    const now = [...waiting];
    waiting.clear();
    now.forEach((p) => p.draw());
  });
  waiting.add(pane);
}

const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    const pane = entry.target.pane;
    pane.visible = entry.isIntersecting;
    if (pane.visible) {
      pane.scene.load();
      redraw(pane);
    }
  }
}, { rootMargin: "300px" });
const resized = new ResizeObserver((entries) => entries.forEach((entry) => redraw(entry.target.pane)));

class Pane {
  // source() says what to show: {id, key, paint(rgba), label}, also {.., over: the source wiped in}; null: nothing.
  constructor(scene, source) {
    this.scene = scene;
    this.source = source;
    this.visible = false;
    this.tile = null; // outlined while the scene has none marked
    this.canvas = make("canvas", { role: "img", "aria-label": "drawn when it comes in sight" });
    this.frame = make("div", { className: "frame", tabIndex: 0 }, this.canvas);
    this.frame.style.aspectRatio = scene.width + " / " + scene.height;
    this.frame.pane = this;
    this.pointers = new Map();
    this.listen();
    scene.panes.add(this);
    seen.observe(this.frame);
    resized.observe(this.frame);
  }

  // The source painted on a canvas of that size, shared by all frames and repainted only when its key has changed.
  // Below full size, an image's radiance is averaged before the tone curve; a map is painted whole and scaled down.
  buffer(source, width = this.scene.width, height = this.scene.height) {
    const { buffers } = this.scene, id = source.id + " " + width, whole = width === this.scene.width;
    let b = buffers.get(id);
    if (!b) buffers.set(id, b = { width, canvas: make("canvas", { width, height }) });
    if (b.key === source.key) return b.canvas;
    const context = b.canvas.getContext("2d");
    if (whole || source.layer) {
      b.image = b.image || context.createImageData(width, height);
      source.paint(b.image.data, whole ? source.layer : reduceLayer(source.layer, width, height));
      context.putImageData(b.image, 0, 0);
    } else {
      context.clearRect(0, 0, width, height);
      context.drawImage(this.buffer(source), 0, 0, width, height);
    }
    b.key = source.key;
    return b.canvas;
  }

  resize(width, height) {
    const { buffers } = this.scene, old = this.canvas.width;
    buffers.forEach((b, id) => { if (b.width === old && old !== this.scene.width) buffers.delete(id); });
    Object.assign(this.canvas, { width, height });
  }

  draw(force) {
    const source = (this.visible || force) && this.scene.ready && this.frame.clientWidth > 0 ? this.source() : null;
    if (!source) return;
    const s = this.scene, v = s.view, ratio = window.devicePixelRatio || 1;
    const width = Math.round(this.frame.clientWidth * ratio), height = Math.round(width * s.height / s.width);
    if (this.canvas.width !== width || this.canvas.height !== height) this.resize(width, height);
    if (source.prepare) source.prepare();
    this.canvas.setAttribute("aria-label", source.label);
    const c = this.canvas.getContext("2d"), scale = width / s.width * v.zoom;
    const fits = v.zoom === 1 && scale < 1; // then a copy of exactly the frame's size is drawn, unscaled
    c.imageSmoothingEnabled = scale < 1;
    const put = (what, x0, x1) => {
      c.save();
      c.beginPath();
      c.rect(x0, 0, x1 - x0, height);
      c.clip();
      if (!fits) c.setTransform(scale, 0, 0, scale, -v.x * scale, -v.y * scale);
      c.drawImage(fits ? this.buffer(what, width, height) : this.buffer(what), 0, 0);
      c.restore();
    };
    const split = source.over ? Math.round(width * s.wipe) : width;
    if (source.over) put(source.over, split, width);
    put(source, 0, split);
    const box = (x, y, w, h, inner) => {
      const r = [(x - v.x) * scale, (y - v.y) * scale, w * scale, h * scale];
      c.lineWidth = 3 * ratio;
      c.strokeStyle = inner ? "#000" : "#fff";
      c.strokeRect(...r);
      c.lineWidth = 1.2 * ratio;
      c.strokeStyle = inner ? "#fff" : "#000";
      c.strokeRect(...r);
    };
    if (source.over) {
      c.fillStyle = "#fff";
      c.fillRect(split - 1.5 * ratio, 0, 3 * ratio, height);
      c.fillStyle = "#000";
      c.fillRect(split - 0.5 * ratio, 0, ratio, height);
    }
    if (s.grid) {
      c.beginPath();
      for (let i = 1; i < tilesAlong(s.width, s.grid); i++) c.rect((i * s.grid - v.x) * scale, 0, 0, height);
      for (let i = 1; i < tilesAlong(s.height, s.grid); i++) c.rect(0, (i * s.grid - v.y) * scale, width, 0);
      c.lineWidth = ratio;
      c.strokeStyle = "rgba(128,128,128,.75)";
      c.stroke();
    }
    const tile = s.tile || this.tile;
    if (tile) box(tile.x, tile.y, tileLength(tile.x, s.width, tile.side), tileLength(tile.y, s.height, tile.side), false);
    if (s.pixel) box(s.pixel.x, s.pixel.y, 1, 1, true);
  }

  // The position of a pointer event: x, y in image pixels (fractional), share of the frame's width, CSS pixels per
  // image pixel.
  place(e) {
    const r = this.frame.getBoundingClientRect(), s = this.scene, scale = r.width / s.width * s.view.zoom;
    return { x: s.view.x + (e.clientX - r.left) / scale, y: s.view.y + (e.clientY - r.top) / scale,
             share: (e.clientX - r.left) / r.width, scale };
  }

  listen() {
    const f = this.frame, s = this.scene;
    f.addEventListener("pointerdown", (e) => {
      this.pointers.set(e.pointerId, e);
      this.moved = false;
      this.wiping = s.wiping && this === s.stagePane && Math.abs(this.place(e).share - s.wipe) < 0.06;
      if (this.wiping || s.view.zoom > 1) f.setPointerCapture(e.pointerId);
    });
    f.addEventListener("pointermove", (e) => {
      const last = this.pointers.get(e.pointerId), at = this.place(e);
      if (last && this.wiping) {
        s.setWipe(at.share);
        this.moved = true;
      } else if (last && this.pointers.size === 2) {
        const other = [...this.pointers.values()].find((p) => p.pointerId !== e.pointerId);
        const before = Math.hypot(last.clientX - other.clientX, last.clientY - other.clientY);
        const now = Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY);
        s.zoom(s.view.zoom * now / Math.max(before, 1), at.x, at.y);
        this.moved = true;
      } else if (last && s.view.zoom > 1) {
        const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY;
        this.moved = this.moved || Math.hypot(dx, dy) > 2;
        s.pan(-dx / at.scale, -dy / at.scale);
      }
      if (last) this.pointers.set(e.pointerId, e);
      else s.point(Math.floor(at.x), Math.floor(at.y));
    });
    const end = (e) => {
      if (e.type === "pointerup" && this.pointers.has(e.pointerId) && !this.moved) {
        const at = this.place(e);
        s.point(Math.floor(at.x), Math.floor(at.y));
        s.pickTile(Math.floor(at.x), Math.floor(at.y));
      }
      this.pointers.delete(e.pointerId);
    };
    f.addEventListener("pointerup", end);
    f.addEventListener("pointercancel", end);
    f.addEventListener("pointerleave", (e) => { if (!f.hasPointerCapture(e.pointerId)) this.pointers.delete(e.pointerId); });
    f.addEventListener("dblclick", (e) => {
      const at = this.place(e);
      s.zoom(s.view.zoom * (e.shiftKey ? 0.5 : 2), at.x, at.y);
    });
    f.addEventListener("wheel", (e) => {
      if (!e.ctrlKey && !e.metaKey) return; // the page still scrolls
      e.preventDefault();
      const at = this.place(e);
      s.zoom(s.view.zoom * 2 ** (-e.deltaY / 100), at.x, at.y);
    }, { passive: false });
    f.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      if (e.key === "Enter" && s.pixel) s.pickTile(s.pixel.x, s.pixel.y);
      if (!step || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      const far = e.shiftKey ? 8 : 1, from = s.pixel || { x: 0, y: 0 };
      s.point(from.x + far * step[0], from.y + far * step[1]);
      s.follow();
    });
  }
}

function legend(range, kind) {
  const canvas = make("canvas", { width: 257, height: 1, role: "img", "aria-label": "colour scale" });
  const context = canvas.getContext("2d"), image = context.createImageData(257, 1);
  paintMap(image.data, Float64Array.from({ length: 257 }, (_, i) => range[0] + (range[1] - range[0]) * i / 256),
           range, kind.diverging);
  context.putImageData(image, 0, 0);
  const middle = (range[0] + range[1]) / 2;
  return make("div", { className: "legend" }, canvas, ...[range[0], middle, range[1]].map((v) =>
    make("span", {}, kind.label(v))));
}
