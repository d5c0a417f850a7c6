// The values of the marked pixel and of the marked tile, as tables and text.

// One row for each image, then one for each pair.
function readPixel(scene) {
  if (!scene.ready) return;
  const { x, y } = scene.pixel, i = y * scene.width + x;
  const row = (head, cells, tag = "td") => make("tr", {}, make("th", { scope: tag === "th" ? "col" : "row" }, head),
    ...cells.map((c) => make(tag, { className: "num" }, c)));
  const images = scene.shots.map(({ name, layer }) => row(name, [
    ...[0, 1, 2].map((k) => withError(layer.value[k][i], layer.error[k][i])),
    layer.unit === "exact" ? "exact" : digits(countAt(layer, i), 7)]));
  const pairs = scene.claims.map((c) => {
    const p = greyOf(c.a.layer), q = greyOf(c.b.layer), unit = Math.max(q.value[i], q.floor);
    const d = p.value[i] - q.value[i], e = Math.hypot(p.error[i], q.error[i]);
    return row(c.name, [withError(100 * d / unit, 100 * e / unit) + " %", digits(studentT(d, e))]);
  });
  const table = (...rows) => make("table", {}, make("thead", {}, rows[0]), make("tbody", {}, ...rows[1]));
  scene.probe.replaceChildren(
    table(row("Pixel " + x + ", " + y, ["red", "green", "blue", "n"], "th"), images),
    ...(pairs.length ? [table(row("Luminance", ["difference", "t"], "th"), pairs)] : []));
}

// The number of tiles along `size` pixels, and the length of the one at `at`: a rest below half a tile goes to the
// last.
const tilesAlong = (size, side) => Math.max(1, Math.floor((size + (side >> 1)) / side));
const tileLength = (at, size, side) => size - at < 1.5 * side ? size - at : side;

// Writes a tile's difference, t and p below the claim's list of tiles.
function readTile(scene, tile, claim) {
  if (!claim.tileReading) return;
  const columns = tilesAlong(scene.width, tile.side), i = tile.y / tile.side * columns + tile.x / tile.side;
  const p = claim.p[i], t = claim.t[i];
  claim.tileReading.textContent = "Tile at x " + tile.x + ", y " + tile.y + ": " + tileDifference(scene, tile, claim) +
    (p === null || p === undefined ? "; it has no noise." : ", t " + digits(t) + ", p " + digits(10 ** p) + ".");
}

function tileDifference(scene, tile, claim) {
  if (!scene.ready) return "";
  const a = greyOf(claim.a.layer), b = greyOf(claim.b.layer);
  const right = tile.x + tileLength(tile.x, scene.width, tile.side), bottom = tile.y + tileLength(tile.y, scene.height, tile.side);
  let sa = 0, sb = 0;
  for (let y = tile.y; y < bottom; y++)
    for (let x = tile.x; x < right; x++) {
      sa += a.value[y * scene.width + x];
      sb += b.value[y * scene.width + x];
    }
  const pixels = (right - tile.x) * (bottom - tile.y), d = (sa - sb) / pixels / Math.max(sb / pixels, b.floor);
  return "difference " + (d > 0 ? "+" : "") + percent(d);
}
