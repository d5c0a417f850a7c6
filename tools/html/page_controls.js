// The controls of a scene.

// Makes the buttons, frames and captions of a scene, and puts them in place of its list of images.
function buildControls(scene) {
  const group = (label, ...children) => make("div", { className: "tabs", role: "group", "aria-label": label }, ...children);
  const button = (key, text, action, title) => {
    const b = make("button", { type: "button", title: title || "" }, ...(key ? [make("kbd", {}, key)] : []), text);
    b.addEventListener("click", action);
    return b;
  };
  scene.shotButtons = ["Side by side", ...scene.shots.map((s) => s.name)].map((name, i) => {
    const b = button(String(i), name, () => scene.show(i, null));
    // Moving the pointer over the tabs swaps images, but only while a single one is shown: the layout never changes.
    b.addEventListener("pointerenter", (e) => {
      if (e.pointerType === "mouse" && scene.shown > 0 && !scene.kind && i > 0) scene.show(i, null);
    });
    return b;
  });
  scene.kindButtons = Object.entries(mapKinds).map(([kind, k]) =>
    Object.assign(button(k.key, k.name, () => scene.show(scene.shown, kind)), { kind }));
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
  [exposure, scene.stopsInput, scene.stopsOutput] = slider("Exposure", "-8", "8", "0.25", 0, stopsText, (v) => scene.expose(v));
  [curve] = select("Curve", "Curve", Object.keys(curves), 0, (i) => { scene.curve = Object.keys(curves)[i]; scene.redraw(); });
  [pair, scene.pairSelect] = select("of", "Images of the map", scene.claims.map((c) => c.name), 0, (i) => {
    scene.claim = scene.claims[i];
    scene.show(scene.shown, scene.kind);
  });
  [against, scene.againstSelect] = select("over", "Image that is wiped in", scene.shots.map((s) => s.name), scene.against, (i) => {
    scene.against = i;
    scene.show(scene.shown, null);
  });
  [scene.wipeLabel, scene.wipeInput] = slider("at", "0", "1", "0.005", 0.5,
    (v) => Math.round(100 * v) + " %", (v) => scene.setWipe(v));
  scene.wipeButton = button("w", "Wipe", () => scene.toggleWipe(), "The shown image left of a line, another one right of it");
  scene.gridButton = button("g", "Tiles", () => scene.toggleGrid(), "Outlines the tiles that are judged");
  scene.zoomOutput = make("output", {}, "1 \u00d7");

  const row = (what, ...children) =>
    make("div", { className: "tools" }, make("span", { className: "what", "aria-hidden": "true" }, what), ...children);
  const rows = [row("Image", group("Which image is shown", ...scene.shotButtons))];
  if (scene.claims.length > 0) rows.push(row("Map", group("Which map of two images is shown", ...scene.kindButtons), pair));
  scene.wipeRow = row("Wipe", against, scene.wipeLabel);
  rows.push(row("View",
    group("Zoom", button("\u2212", "", () => scene.zoom(scene.view.zoom / 2), "Zoom out"),
      button("+", "", () => scene.zoom(scene.view.zoom * 2), "Zoom in"),
      button("f", "Fit", () => scene.zoom(1), "The whole image"), scene.zoomOutput),
    group("Overlays", ...(scene.shots.length > 1 ? [scene.wipeButton] : []), scene.gridButton), exposure, curve), scene.wipeRow);

  scene.side = make("div", { className: "side" });
  for (const shot of scene.shots) {
    const pane = new Pane(scene, () => (scene.shown === 0 && !scene.kind ? scene.shotSource(shot) : null));
    scene.side.append(make("figure", {}, pane.frame,
      make("figcaption", {}, make("b", {}, shot.name), " " + shot.about)));
  }
  scene.stagePane = new Pane(scene, () => scene.stageSource());
  scene.stageLegend = make("div", {});
  scene.stageCaption = make("figcaption", {});
  scene.stageText = make("div", { className: "beside" }, scene.stageLegend, scene.stageCaption);
  scene.stage = make("figure", { className: "stage" }, scene.stagePane.frame, scene.stageText);
  scene.probe = make("div", { className: "probe", tabIndex: 0 });
  scene.box.style.setProperty("--aspect", String(scene.width / scene.height));
  scene.box.replaceChildren(...rows, scene.side, scene.stage, scene.probe);
}

// The two maps beside a claim's numbers, and its list of tiles.
function buildMaps(scene, claim) {
  const maps = claim.article.querySelector(".maps");
  claim.figures = ["difference", "t"].map((kind) => {
    const pane = new Pane(scene, () => {
      const source = scene.mapSource(kind, claim);
      return source && Object.assign(source, { prepare: () => captionMap(scene, claim, kind, figure) });
    });
    pane.tile = claim.worst;
    const figure = make("figure", { className: "map", "data-kind": kind }, pane.frame);
    return figure;
  });
  maps.prepend(...claim.figures);
  claim.tileReading = claim.article.querySelector(".tile-reading");
  for (const b of claim.article.querySelectorAll("button[data-x]"))
    b.addEventListener("click", () => {
      scene.setTile({ x: +b.dataset.x, y: +b.dataset.y, side: claim.tile }, claim);
      scene.zoomTo(scene.tile);
    });
}

// Adds a map's legend and caption when it is first drawn.
function captionMap(scene, claim, kind, figure) {
  if (figure.querySelector("figcaption")) return;
  const k = mapKinds[kind], m = scene.map(kind, claim);
  figure.append(legend(m.range, k), make("figcaption", {}, make("b", {}, k.name + ". "),
    scene.sentence(kind, claim)));
}
