// The viewer of a scene: its images in one frame (keys 1 to 9; 0: side by side) and maps of two of them. All
// frames of a scene share zoom, exposure and marked pixel. Verdicts and numbers are on the page without it.

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
      claim.equal = /EQUIVALENT/.test(article.querySelector(".badge").textContent);
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
    buildControls(this);
    this.claims.forEach((c) => buildMaps(this, c));
    this.show(0, null);
  }

  load() {
    if (this.loading) return this.loading;
    const flips = this.claims.map((c) => loadFlip(c.article.id.slice("claim-".length)).then((map) => { c.flip = map; }));
    this.loading = Promise.all([...this.shots.map((s) => loadLayer(s.id)), ...flips]).then((loaded) => {
      const all = loaded.slice(0, this.shots.length);
      this.ready = all.every((layer) => layer !== null);
      if (!this.ready) {
        this.box.replaceChildren(make("p", { className: "caption" },
          "To stay below 3 MB this page has no room for the numbers behind these images."));
        this.section.querySelectorAll(".maps .map[data-kind]").forEach((f) => f.remove());
        return;
      }
      this.shots.forEach((s, i) => (s.layer = all[i]));
      this.show(this.shown, this.kind);
      readPixel(this);
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

  // The map's caption, made once, as it may have to count pixels.
  sentence(kind, claim) {
    const m = this.map(kind, claim);
    if (m.sentence === undefined) m.sentence = mapKinds[kind].says(claim.a.name, claim.b.name, m.value, claim.equal);
    return m.sentence;
  }

  // What a pane draws for a map; null until the numbers are loaded.
  mapSource(kind, claim) {
    if (!this.ready) return null;
    const m = this.map(kind, claim), k = mapKinds[kind];
    const id = kind + " " + claim.a.id + " " + claim.b.id;
    return { id, key: id, label: k.name + ": " + claim.name,
             paint: (rgba) => paintMap(rgba, m.value, m.range, k.diverging) };
  }

  shotSource(shot) {
    if (!this.ready) return null;
    return { id: "image " + shot.id, key: this.stops + " " + this.curve, label: this.section.dataset.scene + " by " + shot.name,
             layer: shot.layer, paint: (rgba, layer) => paintImage(rgba, layer, 2 ** this.stops / this.white, this.curve) };
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

  show(shown, kind) {
    this.shown = shown;
    this.kind = kind;
    const alone = shown > 0 || kind !== null;
    this.side.hidden = alone;
    this.stage.hidden = !alone;
    (alone ? this.stageText : this.box).append(this.probe);
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
      ". Swap images by their keys: what jumps is a difference, what flickers is noise."));
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

  // Zooms to that factor with the image's point (x, y) fixed, at most until 4 pixels fill the longer side.
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

  // Pans so that the marked pixel stays in view.
  follow() {
    const v = this.view, w = this.width / v.zoom, h = this.height / v.zoom, p = this.pixel;
    this.pan(Math.min(0, p.x - v.x) + Math.max(0, p.x + 1 - v.x - w), Math.min(0, p.y - v.y) + Math.max(0, p.y + 1 - v.y - h));
  }

  point(x, y) {
    const at = { x: Math.min(Math.max(x, 0), this.width - 1), y: Math.min(Math.max(y, 0), this.height - 1) };
    if (this.pixel && at.x === this.pixel.x && at.y === this.pixel.y) return;
    this.pixel = at;
    readPixel(this);
    this.redraw();
  }

  setTile(tile, claim) {
    this.tile = tile;
    readTile(this, tile, claim);
    this.redraw();
  }

  // Marks the tile around a pixel in all frames; picking the marked tile again unmarks it.
  pickTile(x, y) {
    const side = this.claim ? this.claim.tile : 0;
    if (!(side > 0)) return;
    const corner = (at, size) => side * Math.min(Math.floor(at / side), tilesAlong(size, side) - 1);
    const tile = { x: corner(x, this.width), y: corner(y, this.height), side };
    if (this.tile && this.tile.x === tile.x && this.tile.y === tile.y) {
      this.tile = null;
      this.redraw();
    } else {
      this.claims.forEach((c) => this.setTile(tile, c));
    }
  }
}
