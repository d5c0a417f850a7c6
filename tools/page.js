// The viewer of each scene: pictures in place (keys 1 to 9, 0 side by side) and maps of two of them, one
// zoom, exposure and pixel for all frames of the scene. Verdicts and numbers are in the page without it.

class Scene {
  constructor(section) {
    this.section = section;
    this.box = section.querySelector(".viewer");
    this.white = +section.dataset.white;
    this.shots = [...this.box.querySelectorAll("li")].map((li) =>
      ({ id: li.dataset.layer, name: li.dataset.name, about: li.querySelector("span").textContent }));
    this.width = +this.box.dataset.width;
    this.height = +this.box.dataset.height;
    const nameOf = (id) => this.shots.find((s) => s.id === id);
    this.claims = [...section.querySelectorAll(".claim[data-a]")].map((article) => {
      const claim = { article, a: nameOf(article.dataset.a), b: nameOf(article.dataset.b), tile: +article.dataset.tile };
      claim.name = article.dataset.name;
      claim.p = JSON.parse(article.dataset.tileP || "[]");
      claim.t = JSON.parse(article.dataset.tileT || "[]");
      const worst = article.querySelector("button[data-x]");
      claim.worst = worst ? { x: +worst.dataset.x, y: +worst.dataset.y, side: claim.tile } : null;
      return claim;
    });
    Object.assign(this, { panes: new Set(), view: { zoom: 1, x: 0, y: 0 }, stops: 0, curve: "sRGB", shown: 0,
      kind: null, claim: this.claims[0], wiping: false, wipe: 0.5, against: Math.min(1, this.shots.length - 1),
      pixel: { x: this.width >> 1, y: this.height >> 1 }, tile: null, grid: 0, ready: false });
    this.maps = new Map();
    this.buffers = new Map();
    this.build();
  }

  load() {
    if (this.loading) return this.loading;
    const flips = this.claims.map((c) => loadFlip(c.article.id.slice("claim-".length)).then((map) => { c.flip = map; }));
    this.loading = Promise.all([...this.shots.map((s) => loadLayer(s.id)), ...flips]).then((loaded) => {
      const all = loaded.slice(0, this.shots.length);
      this.ready = all.every((layer) => layer !== null);
      if (!this.ready) {
        this.box.replaceChildren(make("p", { className: "caption" },
          "To stay below 5 MB this page has no room for the numbers behind these pictures."));
        this.section.querySelectorAll(".maps .map[data-kind]").forEach((f) => f.remove());
        return;
      }
      this.shots.forEach((s, i) => (s.layer = all[i]));
      this.show(this.shown, this.kind);
      this.readPixel();
    });
    return this.loading;
  }

  map(kind, claim) {
    const key = kind + " " + claim.a.id + " " + claim.b.id;
    if (!this.maps.has(key)) {
      const value = makeMap[kind](claim.a.layer, claim.b.layer, claim);
      this.maps.set(key, { value, range: mapKinds[kind].range(value) });
    }
    return this.maps.get(key);
  }

  // The map's sentence, made once: it may count pixels.
  sentence(kind, claim) {
    const m = this.map(kind, claim);
    if (m.sentence === undefined) m.sentence = mapKinds[kind].says(claim.a.name, claim.b.name, m.value);
    return m.sentence;
  }

  // What a pane is to show.
  mapSource(kind, claim) {
    if (!this.ready) return null;
    const m = this.map(kind, claim), k = mapKinds[kind];
    const id = kind + " " + claim.a.id + " " + claim.b.id;
    return { id, key: id, label: k.name + ": " + claim.name,
             paint: (rgba) => paintMap(rgba, m.value, m.range, k.diverging) };
  }

  shotSource(shot) {
    if (!this.ready) return null;
    return { id: "picture " + shot.id, key: this.stops + " " + this.curve, label: this.section.dataset.scene + " by " + shot.name,
             paint: (rgba) => paintPicture(rgba, shot.layer, 2 ** this.stops / this.white, this.curve) };
  }

  stageSource() {
    if (this.kind) return this.mapSource(this.kind, this.claim);
    if (this.shown === 0) return null;
    const source = this.shotSource(this.shots[this.shown - 1]);
    if (source && this.wiping) {
      source.over = this.shotSource(this.shots[this.against]);
      source.label += ", wiped over " + this.shots[this.against].name;
    }
    return source;
  }

  redraw() {
    this.panes.forEach(redraw);
  }

  build() {
    const group = (label, ...children) => make("div", { className: "tabs", role: "group", "aria-label": label }, ...children);
    const button = (key, text, action, title) => {
      const b = make("button", { type: "button", title: title || "" }, ...(key ? [make("kbd", {}, key)] : []), text);
      b.addEventListener("click", action);
      return b;
    };
    this.shotButtons = ["Side by side", ...this.shots.map((s) => s.name)].map((name, i) => {
      const b = button(String(i), name, () => this.show(i, null));
      // Sweeping over the tabs swaps the pictures, but never changes the layout by surprise.
      b.addEventListener("pointerenter", (e) => {
        if (e.pointerType === "mouse" && this.shown > 0 && !this.kind && i > 0) this.show(i, null);
      });
      return b;
    });
    this.kindButtons = Object.entries(mapKinds).map(([kind, k]) =>
      Object.assign(button(k.key, k.name, () => this.show(this.shown, kind)), { kind }));
    const select = (label, name, names, index, action) => {
      const s = make("select", { "aria-label": name }, ...names.map((n, i) => make("option", { value: String(i), selected: i === index }, n)));
      s.addEventListener("change", () => action(+s.value));
      return [make("label", {}, label, s), s];
    };
    const slider = (label, min, max, step, value, text, action) => {
      const input = make("input", { type: "range", min, max, step, value });
      const output = make("output", {}, text(value));
      input.addEventListener("input", () => {
        output.textContent = text(+input.value);
        action(+input.value);
      });
      return [make("label", {}, label, input, output), input, output];
    };

    const stopsText = (v) => (v > 0 ? "+" : "") + digits(v) + " stops";
    let exposure, curve, pair, against;
    [exposure, this.stopsInput, this.stopsOutput] = slider("Exposure", "-8", "8", "0.25", 0, stopsText, (v) => this.expose(v));
    [curve] = select("Curve", "Curve", Object.keys(curves), 0, (i) => { this.curve = Object.keys(curves)[i]; this.redraw(); });
    [pair, this.pairSelect] = select("of", "Pictures of the map", this.claims.map((c) => c.name), 0, (i) => {
      this.claim = this.claims[i];
      this.show(this.shown, this.kind);
    });
    [against, this.againstSelect] = select("over", "Picture that is wiped in", this.shots.map((s) => s.name), this.against, (i) => {
      this.against = i;
      this.show(this.shown, null);
    });
    [this.wipeLabel, this.wipeInput] = slider("at", "0", "1", "0.005", 0.5,
      (v) => Math.round(100 * v) + " %", (v) => this.setWipe(v));
    this.wipeButton = button("w", "Wipe", () => this.toggleWipe(), "The shown picture left of a line, another one right of it");
    this.gridButton = button("g", "Tiles", () => this.toggleGrid(), "Outlines the tiles that are judged");
    this.zoomOutput = make("output", {}, "1 \u00d7");

    const pictures = group("Which picture is shown", ...this.shotButtons);
    const rows = [make("div", { className: "tools" }, pictures)];
    if (this.claims.length > 0)
      rows.push(make("div", { className: "tools" }, group("Which map of two pictures is shown", ...this.kindButtons), pair));
    this.wipeRow = make("div", { className: "tools" }, against, this.wipeLabel);
    rows.push(make("div", { className: "tools" }, exposure, curve,
      group("Zoom", button("\u2212", "", () => this.zoom(this.view.zoom / 2), "Zoom out"),
        button("+", "", () => this.zoom(this.view.zoom * 2), "Zoom in"),
        button("f", "Fit", () => this.zoom(1), "The whole picture"), this.zoomOutput),
      group("Overlays", ...(this.shots.length > 1 ? [this.wipeButton] : []), this.gridButton)), this.wipeRow);

    this.side = make("div", { className: "side" });
    for (const shot of this.shots) {
      const pane = new Pane(this, () => (this.shown === 0 && !this.kind ? this.shotSource(shot) : null));
      this.side.append(make("figure", {}, pane.frame,
        make("figcaption", {}, make("b", {}, shot.name), " " + shot.about)));
    }
    this.stagePane = new Pane(this, () => this.stageSource());
    this.stageLegend = make("div", {});
    this.stageCaption = make("figcaption", {});
    this.stage = make("figure", { className: "stage" }, this.stagePane.frame, this.stageLegend, this.stageCaption);
    this.probe = make("div", { className: "probe" });
    this.box.replaceChildren(...rows, this.side, this.stage, this.probe);
    this.claims.forEach((c) => this.buildMaps(c));
    this.show(0, null);
  }

  // The two maps beside a claim's numbers, and its list of tiles.
  buildMaps(claim) {
    const maps = claim.article.querySelector(".maps");
    claim.figures = ["difference", "t"].map((kind) => {
      const pane = new Pane(this, () => {
        const source = this.mapSource(kind, claim);
        return source && Object.assign(source, { prepare: () => this.captionMap(claim, kind, figure) });
      });
      pane.tile = claim.worst;
      const figure = make("figure", { className: "map", "data-kind": kind }, pane.frame);
      return figure;
    });
    maps.prepend(...claim.figures);
    claim.tileReading = claim.article.querySelector(".tile-reading");
    for (const b of claim.article.querySelectorAll("button[data-x]"))
      b.addEventListener("click", () => {
        this.setTile({ x: +b.dataset.x, y: +b.dataset.y, side: claim.tile }, claim);
        this.zoomTo(this.tile);
      });
  }

  // Legend and sentence, when the map is first drawn.
  captionMap(claim, kind, figure) {
    if (figure.querySelector("figcaption")) return;
    const k = mapKinds[kind], m = this.map(kind, claim);
    figure.append(legend(m.range, k), make("figcaption", {}, make("b", {}, k.name + ". "),
      this.sentence(kind, claim)));
  }

  show(shown, kind) {
    this.shown = shown;
    this.kind = kind;
    const alone = shown > 0 || kind !== null;
    this.side.hidden = alone;
    this.stage.hidden = !alone;
    this.wipeRow.hidden = !(this.wiping && shown > 0 && !kind);
    const press = (b, on) => b.setAttribute("aria-pressed", String(on));
    this.shotButtons.forEach((b, i) => press(b, !kind && i === shown));
    this.kindButtons.forEach((b) => press(b, b.kind === kind));
    press(this.wipeButton, this.wiping);
    press(this.gridButton, this.grid > 0);
    if (alone && this.ready) this.captionStage();
    this.redraw();
  }

  captionStage() {
    const kind = mapKinds[this.kind];
    if (kind) {
      const m = this.map(this.kind, this.claim);
      this.stageLegend.replaceChildren(legend(m.range, kind));
      this.stageCaption.replaceChildren(make("b", {}, kind.name + ", " + this.claim.name + ". "),
        this.sentence(this.kind, this.claim));
      return;
    }
    const shot = this.shots[this.shown - 1], other = this.shots[this.against];
    this.stageLegend.replaceChildren();
    this.stageCaption.replaceChildren(make("b", {}, shot.name), " " + shot.about + (this.wiping ?
      ", left of the line; right of it " + other.name + ". Where both agree, no edge shows at the line." :
      ". Swap pictures by their keys: what jumps is a difference, what flickers is noise."));
  }

  toggleWipe() {
    this.wiping = !this.wiping;
    if (this.wiping && this.against === this.shown - 1) this.against = (this.against + 1) % this.shots.length;
    this.againstSelect.value = String(this.against);
    this.show(this.wiping ? this.shown || 1 : this.shown, this.wiping ? null : this.kind);
  }

  setWipe(share) {
    this.wipe = Math.min(Math.max(share, 0), 1);
    this.wipeInput.value = String(this.wipe);
    this.wipeLabel.querySelector("output").textContent = Math.round(100 * this.wipe) + " %";
    redraw(this.stagePane);
  }

  toggleGrid() {
    this.grid = this.grid ? 0 : this.claim ? this.claim.tile : 16;
    this.show(this.shown, this.kind);
  }

  expose(stops) {
    this.stops = Math.min(Math.max(stops, -8), 8);
    this.stopsInput.value = String(this.stops);
    this.stopsOutput.textContent = (this.stops > 0 ? "+" : "") + digits(this.stops) + " stops";
    this.redraw();
  }

  // To that factor, the picture's point (x, y) staying where it is; up to single pixels.
  zoom(factor, x = this.view.x + this.width / this.view.zoom / 2, y = this.view.y + this.height / this.view.zoom / 2) {
    const most = Math.max(this.width, this.height) / 4, v = this.view;
    const next = Math.min(Math.max(factor, 1), most), keep = v.zoom / next;
    Object.assign(v, { zoom: next, x: x - (x - v.x) * keep, y: y - (y - v.y) * keep });
    this.pan(0, 0);
  }

  pan(dx, dy) {
    const v = this.view;
    v.x = Math.min(Math.max(v.x + dx, 0), this.width - this.width / v.zoom);
    v.y = Math.min(Math.max(v.y + dy, 0), this.height - this.height / v.zoom);
    this.zoomOutput.textContent = digits(v.zoom) + " \u00d7";
    this.panes.forEach((p) => p.frame.classList.toggle("zoomed", v.zoom > 1));
    this.redraw();
  }

  zoomTo(tile) {
    this.zoom(Math.min(this.width, this.height) / (3 * tile.side));
    const v = this.view;
    this.pan(tile.x + tile.side / 2 - this.width / v.zoom / 2 - v.x, tile.y + tile.side / 2 - this.height / v.zoom / 2 - v.y);
  }

  // Keeps the marked pixel in sight.
  follow() {
    const v = this.view, w = this.width / v.zoom, h = this.height / v.zoom, p = this.pixel;
    this.pan(Math.min(0, p.x - v.x) + Math.max(0, p.x + 1 - v.x - w), Math.min(0, p.y - v.y) + Math.max(0, p.y + 1 - v.y - h));
  }

  point(x, y) {
    const at = { x: Math.min(Math.max(x, 0), this.width - 1), y: Math.min(Math.max(y, 0), this.height - 1) };
    if (this.pixel && at.x === this.pixel.x && at.y === this.pixel.y) return;
    this.pixel = at;
    this.readPixel();
    this.redraw();
  }

  // One row for each picture, then one for each pair.
  readPixel() {
    if (!this.ready) return;
    const { x, y } = this.pixel, i = y * this.width + x;
    const row = (head, cells, tag = "td") => make("tr", {}, make("th", { scope: tag === "th" ? "col" : "row" }, head),
      ...cells.map((c) => make(tag, { className: "num" }, c)));
    const pictures = this.shots.map(({ name, layer }) => row(name, [
      ...[0, 1, 2].map((k) => withError(layer.value[k][i], layer.error[k][i])),
      layer.unit === "exact" ? "exact" : digits(countAt(layer, i), 7)]));
    const pairs = this.claims.map((c) => {
      const p = greyOf(c.a.layer), q = greyOf(c.b.layer), unit = Math.max(q.value[i], 0.05 * q.mean);
      const d = p.value[i] - q.value[i], e = Math.hypot(p.error[i], q.error[i]);
      return row(c.name, [withError(100 * d / unit, 100 * e / unit) + " %", digits(studentT(d, e))]);
    });
    const table = (...rows) => make("table", {}, make("thead", {}, rows[0]), make("tbody", {}, ...rows[1]));
    this.probe.replaceChildren(
      table(row("Pixel " + x + ", " + y, ["red", "green", "blue", "n"], "th"), pictures),
      ...(pairs.length ? [table(row("Luminance", ["difference", "t"], "th"), pairs)] : []));
  }

  setTile(tile, claim) {
    this.tile = tile;
    if (claim.tileReading) {
      const columns = this.width / tile.side, i = tile.y / tile.side * columns + tile.x / tile.side;
      const p = claim.p[i], t = claim.t[i];
      claim.tileReading.textContent = "Tile at x " + tile.x + ", y " + tile.y + ": " + this.tileDifference(tile, claim) +
        (p === null || p === undefined ? "; it has no noise." : ", t " + digits(t) + ", p " + digits(10 ** p) + ".");
    }
    this.redraw();
  }

  tileDifference(tile, claim) {
    if (!this.ready) return "";
    const a = greyOf(claim.a.layer), b = greyOf(claim.b.layer);
    let sa = 0, sb = 0;
    for (let y = tile.y; y < tile.y + tile.side; y++)
      for (let x = tile.x; x < tile.x + tile.side; x++) {
        sa += a.value[y * this.width + x];
        sb += b.value[y * this.width + x];
      }
    const pixels = tile.side * tile.side, d = (sa - sb) / pixels / Math.max(sb / pixels, 0.05 * b.mean);
    return "difference " + (d > 0 ? "+" : "") + percent(d);
  }

  // The tile around a pixel becomes the marked one in all frames; the same again unmarks it.
  pickTile(x, y) {
    const side = this.claim ? this.claim.tile : 0;
    if (!(side > 0)) return;
    const tile = { x: x - x % side, y: y - y % side, side };
    if (this.tile && this.tile.x === tile.x && this.tile.y === tile.y) {
      this.tile = null;
      this.redraw();
    } else {
      this.claims.forEach((c) => this.setTile(tile, c));
    }
  }
}

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
  if (/^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName) && !/^[a-z0-9]$/.test(e.key)) return;
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

// Everything is on paper, also what has not been scrolled to.
const loadAll = () => Promise.all(scenes.map((s) => s.load()));
window.addEventListener("beforeprint", () => {
  document.querySelectorAll("details").forEach((d) => { d.open = true; });
  scenes.forEach((s) => s.panes.forEach((p) => p.draw(true)));
});
window.addEventListener("load", () => (window.requestIdleCallback || setTimeout)(loadAll));
