"use strict";
// Adds to a page that is complete without it: images in place (keys 1 to 9, 0 for side by side),
// exposure, and the values of the pixel under the pointer or the arrow keys.
(function () {
  const decoded = new Map();

  function half(h) {
    const sign = h >> 15 ? -1 : 1, exponent = (h >> 10) & 31, mantissa = h & 1023;
    if (exponent === 31) return mantissa ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 25) * (1024 + mantissa) : 2 ** -24 * mantissa);
  }

  // The numbers behind a frame, or null where the page left them out.
  function layerOf(frame) {
    const id = frame.dataset.layer;
    if (!decoded.has(id)) {
      const element = document.getElementById("layer-" + id);
      let layer = null;
      if (element) {
        const bytes = atob(element.textContent);
        const value = new Float32Array(bytes.length / 2);
        for (let i = 0; i < value.length; i++)
          value[i] = half(bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8));
        layer = { width: +element.dataset.width, height: +element.dataset.height,
                  channels: +element.dataset.channels, value: value };
      }
      decoded.set(id, layer);
    }
    return decoded.get(id);
  }

  function srgb(v) {
    if (!(v > 0)) return 0;
    if (v >= 1) return 255;
    return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
  }

  function expose(frame, gain) {
    const layer = layerOf(frame);
    if (!layer) return;
    let canvas = frame.querySelector("canvas");
    if (!canvas) {
      const image = frame.querySelector("img");
      canvas = document.createElement("canvas");
      canvas.width = layer.width;
      canvas.height = layer.height;
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", image.alt);
      image.after(canvas);
      frame.classList.add("live");
    }
    const context = canvas.getContext("2d");
    const picture = context.createImageData(layer.width, layer.height);
    for (let i = 0, n = layer.width * layer.height; i < n; i++) {
      for (let c = 0; c < 3; c++) picture.data[4 * i + c] = srgb(layer.value[3 * i + c] * gain);
      picture.data[4 * i + 3] = 255;
    }
    context.putImageData(picture, 0, 0);
  }

  function make(tag, properties, children) {
    const element = Object.assign(document.createElement(tag), properties || {});
    element.append(...(children || []));
    return element;
  }

  function digits(v) {
    return Number.isFinite(v) ? String(+v.toPrecision(3)).replace("-", "\u2212") : "none";
  }

  function setUp(scene) {
    const shots = scene.querySelector(".shots");
    if (!shots) return null;
    const figures = [...shots.querySelectorAll(".shot")];
    const frames = [...scene.querySelectorAll(".frame")];
    const white = +scene.dataset.white;
    const hasLayer = (frame) => document.getElementById("layer-" + frame.dataset.layer) !== null;

    // Tabs: 0 is side by side, k shows image k alone, larger, in the same place.
    let shown = 0;
    const tabs = make("div", { className: "tabs" });
    tabs.setAttribute("role", "group");
    tabs.setAttribute("aria-label", "Which image is shown");
    function show(k) {
      shown = k;
      shots.classList.toggle("alone", k > 0);
      figures.forEach((f, i) => f.classList.toggle("shown", i === k - 1));
      [...tabs.children].forEach((b, i) => b.setAttribute("aria-pressed", String(i === k)));
    }
    ["Side by side", ...figures.map((f) => f.dataset.name)].forEach((name, k) => {
      const button = make("button", { type: "button" }, [make("kbd", {}, [String(k)]), name]);
      button.addEventListener("click", () => show(k));
      // Sweeping over the tabs swaps the images, but never changes the layout by surprise.
      button.addEventListener("pointerenter", (e) => {
        if (e.pointerType === "mouse" && shown > 0 && k > 0) show(k);
      });
      tabs.append(button);
    });
    const tools = make("div", { className: "tools" }, [tabs]);

    const adjustable = figures.map((f) => f.querySelector(".frame")).filter(hasLayer);
    if (adjustable.length > 0) {
      const slider = make("input", { type: "range", min: "-6", max: "6", step: "0.25", value: "0" });
      const reading = make("output", {}, ["0 stops"]);
      slider.addEventListener("input", () => {
        const stops = +slider.value;
        reading.textContent = (stops > 0 ? "+" : "") + digits(stops) + " stops";
        adjustable.forEach((frame) => expose(frame, 2 ** stops / white));
      });
      tools.append(make("label", {}, ["Exposure", slider, reading]));
    }
    shots.before(tools);
    show(0);

    // One pixel, marked in every picture of the scene, with its values in each.
    const readable = frames.filter(hasLayer);
    if (readable.length > 0) {
      const probe = make("p", { className: "probe" },
        ["Point at a pixel, or focus a picture and use the arrow keys, to read its values (3 digits)."]);
      shots.after(probe);
      let at = null;
      function point(x, y) {
        const first = layerOf(readable[0]);
        at = { x: Math.min(Math.max(x, 0), first.width - 1), y: Math.min(Math.max(y, 0), first.height - 1) };
        const parts = [make("span", {}, ["pixel ", make("b", {}, [at.x + ", " + at.y])])];
        for (const frame of readable) {
          const layer = layerOf(frame), figure = frame.closest("figure");
          let mark = frame.querySelector(".pixel");
          if (!mark) frame.append(mark = make("span", { className: "pixel" }));
          Object.assign(mark.style, {
            left: 100 * at.x / layer.width + "%", top: 100 * at.y / layer.height + "%",
            width: 100 / layer.width + "%", height: 100 / layer.height + "%" });
          const i = layer.channels * (at.y * layer.width + at.x);
          if (layer.channels === 3) {
            const text = [0, 1, 2].map((c) => digits(layer.value[i + c])).join("  ");
            parts.push(make("span", {}, [figure.dataset.name + " ", make("b", {}, [text])]));
          }
        }
        for (const claim of scene.querySelectorAll(".claim")) {
          const value = [...claim.querySelectorAll(".frame")].map((frame) => {
            const layer = layerOf(frame);
            return layer ? layer.value[at.y * layer.width + at.x] : NaN;
          });
          if (value.length < 2) continue;
          const [relative, z] = value, error = Math.abs(relative / z);
          const text = digits(100 * relative) + " %" +
            (Number.isFinite(error) ? " \u00b1 " + digits(100 * error) + " %, z " + digits(z) : "");
          parts.push(make("span", {}, [claim.dataset.name + " ", make("b", {}, [text])]));
        }
        probe.replaceChildren(...parts);
      }
      for (const frame of readable) {
        frame.tabIndex = 0;
        frame.addEventListener("pointermove", (e) => {
          const box = frame.getBoundingClientRect(), layer = layerOf(frame);
          point(Math.floor((e.clientX - box.left) / box.width * layer.width),
                Math.floor((e.clientY - box.top) / box.height * layer.height));
        });
        frame.addEventListener("keydown", (e) => {
          const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
          if (!step) return;
          e.preventDefault();
          point(at ? at.x + step[0] : 0, at ? at.y + step[1] : 0);
        });
      }
    }
    return { shots: shots, show: show, count: figures.length };
  }

  const viewers = [...document.querySelectorAll("section.scene")].map(setUp).filter(Boolean);

  // A digit goes to the scene whose images are nearest to the middle of the window.
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || !/^[0-9]$/.test(e.key) || viewers.length === 0) return;
    const middle = window.innerHeight / 2;
    const distance = (v) => {
      const box = v.shots.getBoundingClientRect();
      return Math.max(box.top - middle, middle - box.bottom, 0);
    };
    const nearest = viewers.reduce((a, b) => (distance(b) < distance(a) ? b : a));
    if (+e.key <= nearest.count) nearest.show(+e.key);
  });
})();
