"use strict";
// The numbers behind an image, unpacked from the page (format: pixel_codec.h).

// 2^n for whole n from -1022 to 1023, exact.
const POWER = (() => {
  const table = new Float64Array(2046);
  table[1022] = 1;
  for (let i = 1023; i < 2046; i++) table[i] = 2 * table[i - 1];
  for (let i = 1021; i >= 0; i--) table[i] = table[i + 1] / 2;
  return table;
})();
const pow2 = (n) => POWER[n + 1022];
const OCTAVE = Array.from({ length: 12 }, (_, i) => Math.round(4096 * 2 ** (i / 12)) / 4096);
// For each stored noise code S: its standard error, and the exponent of values stored with it.
const NOISE = Float64Array.from({ length: 8192 }, (_, s) => (s ? 2 ** ((s - 4096) / 12) : 0));
const EXPONENT = Int16Array.from({ length: 8192 }, (_, s) => (s ? Math.floor((s - 4096) / 12) - 3 : -128));
const Q_LIMIT = (1 << 20) - 1;

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer().then((b) => new Uint8Array(b));
}

// The factor by which a difference in the channel before carries over into this one.
function carry(noise, noiseBefore, s, sBefore) {
  if (noise && noiseBefore) {
    const k = noise - noiseBefore, octaves = Math.floor(k / 12);
    return OCTAVE[k - 12 * octaves] * pow2(octaves);
  }
  return sBefore !== 0 ? s / sBefore : 0;
}

// Returns {width, height, value: [R, G, B], error: [R, G, B] (0: no noise), n: one number, or one for each pixel}.
function unpackLayer(raw, width, height, uniformN) {
  const pixels = width * height, slope = raw[0] === 1;
  let at = 1;
  const plane = () => raw.subarray(at, at += pixels);
  const signed = (u) => (u & 1 ? -((u + 1) >> 1) : u >> 1);

  const noise = [], error = [];
  for (let k = 0; k < 3; k++) {
    const low = plane(), high = plane(), s = new Int16Array(pixels), before = noise[k - 1], e = new Float32Array(pixels);
    for (let i = 0, x = 0; i < pixels; i++, x = x + 1 === width ? 0 : x + 1) {
      let p = 0;
      if (k > 0) p = before[i] + (x > 0 ? s[i - 1] - before[i - 1] : 0);
      else if (x > 0) p = i >= width ? (s[i - 1] + s[i - width]) >> 1 : s[i - 1];
      else if (i > 0) p = s[i - width];
      s[i] = p + signed(low[i] | high[i] << 8);
      e[i] = NOISE[s[i]];
    }
    noise.push(s);
    error.push(e);
  }

  // Values are multiples q 2^e with |q| <= 2^20, which single precision holds exactly.
  const value = [], shift = [plane(), plane(), plane()];
  let spatialBefore = null;
  for (let k = 0; k < 3; k++) {
    const low = plane(), middle = plane(), high = plane();
    const v = new Float32Array(pixels), spatial = new Float64Array(pixels);
    const before = value[k - 1], noiseHere = noise[k], noiseBefore = noise[k - 1], shiftHere = shift[k];
    for (let i = 0, x = 0, d = 0; i < pixels; i++, x = x + 1 === width ? 0 : x + 1) {
      d = (x > 0 ? d : 0) + shiftHere[i] & 255;
      const s = noiseHere[i], e = EXPONENT[s] + d;
      let p = 0;
      if (i < width) p = i > 0 ? v[i - 1] : 0;
      else if (x === 0) p = v[i - width];
      else if (slope) p = (v[i - 1] + v[i - width]) - v[i - width - 1];
      else if (x + 1 === width) p = ((v[i - 1] + v[i - width - 1]) + v[i - width]) / 3;
      else p = ((v[i - 1] + v[i - width - 1]) + (v[i - width] + v[i - width + 1])) / 4;
      spatial[i] = p;
      if (k > 0) p = p + (before[i] - spatialBefore[i]) * carry(s, noiseBefore[i], p, spatialBefore[i]);
      const predicted = Math.min(Math.max(Math.floor(p * pow2(-e) + 0.5), -Q_LIMIT), Q_LIMIT);
      v[i] = (predicted + signed(low[i] | middle[i] << 8 | high[i] << 16)) * pow2(e);
    }
    value.push(v);
    spatialBefore = spatial;
  }

  let n = uniformN;
  if (!(n > 0)) {
    const bytes = [plane(), plane(), plane(), plane()];
    n = new Float32Array(pixels);
    for (let i = 0, left = 0; i < pixels; i++) {
      left = left + (bytes[0][i] | bytes[1][i] << 8 | bytes[2][i] << 16 | bytes[3][i] << 24) >>> 0;
      n[i] = left;
    }
  }
  return { width, height, value, error, n };
}

const layers = new Map();

// A promise of the layer with that number, or of null where the page had no room for it.
function loadLayer(id) {
  if (!layers.has(id)) {
    const element = document.getElementById("layer-" + id);
    const d = element ? element.dataset : null;
    layers.set(id, !d ? Promise.resolve(null) :
      inflate(bytesOf(element.textContent)).then((raw) => {
        element.textContent = "";
        return Object.assign(unpackLayer(raw, +d.width, +d.height, +d.n), { unit: d.unit, spp: +d.spp });
      }));
  }
  return layers.get(id);
}

// What a byte of a FLIP map stands for.
const FLIP_VALUE = Float32Array.from({ length: 256 }, (_, i) => (i / 128) ** 2);

// A promise of a claim's FLIP map, or of null where there is none (format: pixel_codec.h).
function loadFlip(index) {
  const element = document.getElementById("flip-" + index);
  if (!element) return Promise.resolve(null);
  const width = +element.dataset.width;
  return inflate(bytesOf(element.textContent)).then((raw) => {
    element.textContent = "";
    const map = new Float32Array(raw.length);
    for (let i = 0, x = 0, left = 0; i < raw.length; i++, x = x + 1 === width ? 0 : x + 1) {
      left = (x > 0 ? left : 0) + raw[i] & 255;
      map[i] = FLIP_VALUE[left];
    }
    return map;
  });
}
