// Computes the pixels of the maps of two images (difference, t, error, variance ratio, samples) and
// their colours; page_view.js draws them.

const lutElement = document.getElementById("colours");
// Red, green, blue of 257 steps of the diverging map, then of 256 of the sequential one.
const LUT = lutElement ? bytesOf(lutElement.textContent) : new Uint8Array(1539);
const SEQUENTIAL = 3 * 257;

const LUMINANCE = [0.2126, 0.7152, 0.0722];
const luminance = (three, i) =>
  LUMINANCE[0] * three[0][i] + LUMINANCE[1] * three[1][i] + LUMINANCE[2] * three[2][i];

// The mean, in which no value counts as more than ten times it: a lamp in view is no unit of what it shines upon. As
// mean_without_lamps() in input_checks.c.
function meanWithoutLamps(value) {
  const sorted = Float64Array.from(value).sort();
  let sum = value.reduce((all, v) => all + v, 0), dimmer = sorted.length, last = Infinity;
  const mean = sum / sorted.length;
  let lit = mean;
  while (lit > 0 && lit < 0.99 * last) {
    const limit = 10 * lit;
    while (dimmer > 0 && sorted[dimmer - 1] > limit) sum -= sorted[--dimmer];
    if (dimmer === 0 || !(sorted[dimmer - 1] > 0)) return mean;
    last = lit;
    lit = (sum + limit * (sorted.length - dimmer)) / sorted.length;
  }
  return lit > 0 ? lit : Math.max(0, Math.min(last, mean));
}

// The image's luminance, its standard error (channels taken as fully correlated), and the least unit of differences.
function greyOf(layer) {
  if (!layer.grey) {
    const pixels = layer.width * layer.height, value = new Float64Array(pixels), error = new Float64Array(pixels);
    for (let i = 0; i < pixels; i++) {
      value[i] = luminance(layer.value, i);
      error[i] = luminance(layer.error, i);
    }
    layer.grey = { value, error, floor: 0.05 * meanWithoutLamps(value) };
  }
  return layer.grey;
}

const studentT = (d, error) => (d === 0 ? 0 : Math.min(1e4, Math.max(-1e4, d / error)));

const countAt = (layer, i) => (typeof layer.n === "number" ? layer.n : layer.n[i]);

// Sums over the square of side 2 r + 1 around each pixel, cut at the image's border.
function boxSum(value, width, height, r) {
  const rows = new Float64Array(value.length), out = new Float64Array(value.length);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      let s = 0;
      for (let k = Math.max(0, x - r); k <= Math.min(width - 1, x + r); k++) s += value[y * width + k];
      rows[y * width + x] = s;
    }
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      let s = 0;
      for (let k = Math.max(0, y - r); k <= Math.min(height - 1, y + r); k++) s += rows[k * width + x];
      out[y * width + x] = s;
    }
  return out;
}

// Weights that resample `from` pixels to `to` by area: for each target [first source pixel, weights that sum to 1].
function shares(from, to) {
  return Array.from({ length: to }, (_, i) => {
    const begin = i * from / to, end = (i + 1) * from / to, first = Math.floor(begin);
    const weights = [];
    for (let k = first; k < Math.min(Math.ceil(end), from); k++)
      weights.push((Math.min(k + 1, end) - Math.max(k, begin)) * to / from);
    return [first, weights];
  });
}

// A layer's radiance averaged down to width x height pixels, as {value}; cached for a few sizes.
function reduceLayer(layer, width, height) {
  layer.reduced = layer.reduced || new Map();
  const known = layer.reduced.get(width);
  if (known) return known;
  const across = shares(layer.width, width), down = shares(layer.height, height);
  const value = layer.value.map((v) => {
    const rows = new Float32Array(width * layer.height), out = new Float32Array(width * height);
    for (let y = 0; y < layer.height; y++)
      for (let x = 0; x < width; x++) {
        const [first, weights] = across[x], at = y * layer.width + first;
        let sum = 0;
        for (let k = 0; k < weights.length; k++) sum += weights[k] * v[at + k];
        rows[y * width + x] = sum;
      }
    for (let y = 0; y < height; y++) {
      const [first, weights] = down[y];
      for (let k = 0; k < weights.length; k++)
        for (let x = 0; x < width; x++) out[y * width + x] += weights[k] * rows[(first + k) * width + x];
    }
    return out;
  });
  if (layer.reduced.size > 3) layer.reduced.clear();
  layer.reduced.set(width, { value });
  return layer.reduced.get(width);
}

// Differences are in units of B, or of 5 % of its mean where it is darker than that.
const makeMap = {
  difference(a, b) {
    const p = greyOf(a), q = greyOf(b), floor = q.floor;
    return p.value.map((v, i) => (v - q.value[i]) / Math.max(q.value[i], floor));
  },
  t(a, b) {
    const p = greyOf(a), q = greyOf(b);
    return p.value.map((v, i) => studentT(v - q.value[i], Math.hypot(p.error[i], q.error[i])));
  },
  // RMS difference over 5 x 5 pixels, less the mean square that noise alone explains; relative as above.
  error(a, b) {
    const p = greyOf(a), q = greyOf(b), floor = q.floor;
    const left = p.value.map((v, i) => (v - q.value[i]) ** 2 - p.error[i] ** 2 - q.error[i] ** 2);
    const sum = boxSum(left, a.width, a.height, 2), unit = boxSum(q.value, a.width, a.height, 2);
    const count = boxSum(new Float64Array(left.length).fill(1), a.width, a.height, 2);
    return sum.map((s, i) => Math.sqrt(Math.max(0, s / count[i])) / Math.max(unit[i] / count[i], floor));
  },
  // log2 of the variance of one path of A over that of B, over squares of 8 x 8 pixels.
  variance(a, b) {
    const p = greyOf(a), q = greyOf(b), width = a.width, out = new Float64Array(p.value.length).fill(NaN);
    const paths = (layer, i) => countAt(layer, i) * (layer.spp > 0 ? layer.spp : 1);
    for (let y0 = 0; y0 < a.height; y0 += 8)
      for (let x0 = 0; x0 < width; x0 += 8) {
        let va = 0, vb = 0;
        const inside = [];
        for (let y = y0; y < Math.min(y0 + 8, a.height); y++)
          for (let x = x0; x < Math.min(x0 + 8, width); x++) inside.push(y * width + x);
        for (const i of inside) {
          va += p.error[i] ** 2 * paths(a, i);
          vb += q.error[i] ** 2 * paths(b, i);
        }
        if (va > 0 && vb > 0) for (const i of inside) out[i] = Math.log2(va / vb);
      }
    return out;
  },
  // Computed by the harness; all NaN if the page has no such map.
  flip(a, b, claim) {
    return claim.flip || new Float64Array(a.width * a.height).fill(NaN);
  },
  samples(a) {
    return Float64Array.from({ length: a.width * a.height }, (_, i) => countAt(a, i));
  },
};

const percent = (v) => digits(100 * v) + "\u00a0%";

// How each map is shown and read. range(values): [low, high]; a diverging map is symmetric.
const mapKinds = {
  difference: {
    key: "d", name: "Difference", diverging: true, range: (v) => symmetric(v, 0.001, 1),
    label: (v) => (v > 0 ? "+" : "") + percent(v),
    says: (a, b) => "Red: " + a + " is brighter than " + b + "; blue: darker; white: equal. In per cent of " + b +
      ", or of 5 % of its mean where it is darker. Single pixels are noisy: only a patch of one colour matters.",
  },
  t: {
    key: "t", name: "t map", diverging: true, range: () => [-4, 4], label: (v) => (v > 0 ? "+" : "") + digits(v),
    says: (a, b, v, equal) => "The same difference in units of its noise: one unit is what chance alone does. If both agree " +
      "this is an even mix of pale red and blue, and about 5 of 100 pixels are beyond \u00b12" + beyondTwo(v) +
      ". A shape that you recognise is a real difference" + (equal ? ", here one inside the margin." : "."),
  },
  error: {
    key: "e", name: "Error", diverging: false, range: (v) => [0, symmetric(v, 0.001, 1)[1]], label: percent,
    says: () => "How far off the image is around each pixel (5 \u00d7 5) once the error that noise alone " +
      "explains is taken out. Noise leaves scattered blotches on about half of a right image; what follows " +
      "the shapes of the scene is error.",
  },
  variance: {
    key: "v", name: "Variance ratio", diverging: true, range: () => [-3, 3],
    label: (v) => (v < 0 ? "1/" + digits(2 ** -v) : digits(2 ** v)) + "\u00a0\u00d7",
    says: (a, b) => "How noisy one path of " + a + " is against one of " + b + ", in squares of 8 \u00d7 8 pixels. Red: " +
      a + " is the noisier one; grey: one of them has no noise. It need not be equal, but should be smooth.",
  },
  flip: {
    key: "p", name: "FLIP", diverging: false, range: (v) => [0, symmetric(v, 0.02, 1)[1]], label: digits,
    says: (a, b, v) => (v[0] === v[0] ? "How much the eye sees when " + a + " and " + b + " are swapped in place, at any exposure: " +
      "0 nothing, 1 as green against blue. It knows nothing of noise: a right but noisy image lights up too. Mean " +
      digits(v.reduce((s, x) => s + x, 0) / v.length) + "." : "There is no such map of this pair on this page."),
  },
  samples: {
    key: "n", name: "Samples", diverging: false, range: (v) => [0, v.reduce((m, x) => Math.max(m, x), 1)],
    label: (v) => digits(v, 6),
    says: (a, b, v) => "How often each pixel of " + a + " was observed" +
      (v.every((x) => x === v[0]) ? ": " + v[0] + " times, all of them." : "; adaptive sampling spends more where noise is."),
  },
};

// [-r, r], r the 98th percentile of |v| rounded up to `least` times 1, 2 or 5 times a power of ten, at least `least`.
function symmetric(values, least, most) {
  const sorted = Float64Array.from(values, Math.abs).filter(Number.isFinite).sort();
  const p98 = sorted.length ? sorted[Math.ceil(0.98 * sorted.length) - 1] : 0;
  let r = least;
  for (let i = 1; r < p98 && r < most; i++) r = least * [1, 2, 5][i % 3] * 10 ** Math.floor(i / 3);
  return [-r, r];
}

function beyondTwo(t) {
  const noisy = t.filter((v) => v !== 0);
  return noisy.length ? " (here " + (100 * noisy.filter((v) => Math.abs(v) > 2).length / noisy.length).toFixed(1) + ")" : "";
}

function digits(v, n = 3) {
  return Number.isFinite(v) ? String(+v.toPrecision(n)).replace("-", "\u2212") : "none";
}

// "0.2513 \u00b1 0.0021": as many decimals as two digits of the error need; without an error, 4 digits.
function withError(v, error) {
  if (!(error > 0)) return digits(v, 4);
  const decimals = Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 12);
  return (v.toFixed(decimals) + " \u00b1 " + error.toFixed(decimals)).replace(/-/g, "\u2212");
}

// Fills RGBA bytes with a map's colours; grey where there is no number.
function paintMap(rgba, values, range, diverging) {
  const base = diverging ? 0 : SEQUENTIAL, last = diverging ? 256 : 255;
  for (let i = 0; i < values.length; i++) {
    const u = (values[i] - range[0]) / (range[1] - range[0]);
    const at = base + 3 * Math.round(last * Math.min(Math.max(u, 0), 1)), known = u === u;
    rgba[4 * i] = known ? LUT[at] : 128;
    rgba[4 * i + 1] = known ? LUT[at + 1] : 128;
    rgba[4 * i + 2] = known ? LUT[at + 2] : 128;
    rgba[4 * i + 3] = 255;
  }
}

const curves = {
  sRGB: (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055),
  linear: (v) => v,
  "gamma 2.2": (v) => v ** (1 / 2.2),
  "log, 4 decades": (v) => (v > 0 ? 1 + Math.log10(v) / 4 : 0),
};
const CURVE_STEPS = 16384;
const curveTables = {};
function curveTable(name) {
  if (!curveTables[name])
    curveTables[name] = Uint8Array.from({ length: CURVE_STEPS + 1 },
      (_, i) => Math.round(255 * Math.min(1, Math.max(0, curves[name](i / CURVE_STEPS)))));
  return curveTables[name];
}

// Fills RGBA bytes with radiance times gain through a tone curve, by table: a million pixels in less than a frame's
// time. A pixel is a 32-bit word, red its lowest byte: little-endian, as all machines that run browsers.
function paintImage(rgba, layer, gain, curve) {
  const table = curveTable(curve), [r, g, b] = layer.value, scale = gain * CURVE_STEPS;
  const words = new Uint32Array(rgba.buffer);
  for (let i = 0; i < words.length; i++) {
    const x = r[i] * scale + 0.5, y = g[i] * scale + 0.5, z = b[i] * scale + 0.5;
    words[i] = table[x <= 0 ? 0 : x >= CURVE_STEPS ? CURVE_STEPS : x | 0] |
      table[y <= 0 ? 0 : y >= CURVE_STEPS ? CURVE_STEPS : y | 0] << 8 |
      table[z <= 0 ? 0 : z >= CURVE_STEPS ? CURVE_STEPS : z | 0] << 16 | 0xff000000;
  }
}
