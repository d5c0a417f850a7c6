// node page.mjs MODULES PAGE RESULTS SHOTS GOING SUITE EXCHANGED: the page of one scene of four images, in Debian's chromium,
// GOING, one of a run that has not ended, SUITE, one of three scenes, and EXCHANGED, PAGE with its first two images exchanged.
// Prints "ok NAME" or "not ok NAME: why". What it must show comes from the EXR files.
import { createRequire } from "node:module";
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, resolve } from "node:path";
import { readExr, pixelOf, grey, srgb } from "./files.mjs";

const [modules, pagePath, resultsPath, shots, goingPath, suitePath, exchangedPath] = process.argv.slice(2);
const require = createRequire(resolve(modules) + "/");
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const results = JSON.parse(readFileSync(resultsPath, "utf8"));
const directory = dirname(resultsPath) + "/", claims = results.claims.filter((c) => c.files);
const fileOf = {};
for (const c of claims) Object.assign(fileOf, { [c.a]: c.files.a, [c.b]: c.files.b });
const images = Object.fromEntries(Object.entries(fileOf).map(([name, f]) => [name, readExr(directory + f)]));
const size = images[claims[0].a];

function check(name, good, why = "") {
  console.log(good ? "ok page: " + name : "not ok page: " + name + ": " + why);
}

const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const complaints = [], requests = [];
async function open(path, width, height, options = {}) {
  const context = await browser.newContext({ viewport: { width, height }, ...options });
  const page = await context.newPage();
  // This test itself reads canvases back.
  page.on("console", (m) => ["error", "warning"].includes(m.type()) && !/willReadFrequently/.test(m.text()) && complaints.push(m.text()));
  page.on("pageerror", (e) => complaints.push(e.message));
  page.on("dialog", (d) => { complaints.push("dialog " + d.message()); d.dismiss(); });
  page.on("request", (r) => requests.push(r.url()));
  await page.goto("file://" + resolve(path));
  await page.evaluate("loadAll()");
  return page;
}
// What follows an event comes when the browser finds time: whether locator gets into state within ten seconds.
const becomes = (locator, state) => locator.waitFor({ state, timeout: 10000 }).then(() => true, () => false);
const frames = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

const page = await open(pagePath, 1280, 900);
check("its images are all there", await page.evaluate("scenes.length === 1 && scenes[0].ready"));
const names = await page.evaluate("scenes[0].shots.map((s) => s.name)");
check("keys 1 to 4 are ours, Cycles, POV-Ray, truth", names.slice(0, 4).join() === "pathtracer,cycles,povray,truth", names.join());

// The table of the pixel under the pointer against the files: every number is right to its last digit but one
// unit, which is how exact the page says it is (1/16 of the error, two digits of which are shown).
const rows = (page) => page.evaluate(`[...document.querySelectorAll(".probe tbody tr")].map((r) => [...r.cells].map((c) => c.textContent))`);
const number = (text) => +text.replace(/\u2212/g, "-").replace("%", "");
function agrees(text, value, error, unitOfError = 1) {
  const [v, e] = text.split("\u00b1").map(number);
  if (e === undefined) return !(error > 0) && Math.abs(v - value) <= Math.abs(value) * 5.1e-4 + 1e-12;
  return Math.abs(v - value) <= (error / 16 * 1.03 + 0.05 * error) * unitOfError && Math.abs(e / error - 1) < 0.09;
}
const map = (name) => claims.map((c) => readExr(directory + c.files[name]));
const zMaps = map("z"), relativeMaps = map("relative");
async function valuesWrong(page) {
  const wrong = [];
  for (const [x, y] of [[0, 0], [size.width - 1, size.height - 1], [20, 33], [40, 9], [size.width >> 1, 1]]) {
    await page.evaluate(`scenes[0].show(1, null)`);
    await frames(page);
    const frame = page.locator(".stage .frame"), pixel = (await frame.boundingBox()).width / size.width;
    await frame.hover({ position: { x: (x + 0.5) * pixel, y: (y + 0.5) * pixel } });
    await frames(page);
    const table = await rows(page);
    for (const row of table.filter((r) => r.length === 5)) {
      const p = pixelOf(images[row[0]], x, y), exact = results.claims.some((c) => c.b === row[0] && c.unit_b === "exact");
      for (let k = 0; k < 3; k++)
        if (!agrees(row[k + 1], p.value[k], exact ? 0 : p.error[k])) wrong.push(row[0] + " " + x + "," + y + ": " + row[k + 1] + " is " + p.value[k] + " ± " + p.error[k]);
      if (row[4] !== "exact" && number(row[4]) !== p.n) wrong.push(row[0] + ": n " + row[4] + " is " + p.n);
    }
    table.filter((r) => r.length === 3).forEach((row, i) => {
      const [d] = row[1].split("\u00b1").map(number), z = zMaps[i].at("z", x, y), relative = relativeMaps[i].at("rel", x, y);
      const a = pixelOf(images[claims[i].a], x, y), b = pixelOf(images[claims[i].b], x, y);
      const unit = (grey(a.value) - grey(b.value)) / relative, noise = Math.hypot(grey(a.error), grey(b.error)) / unit;
      // Both sides are off by 1/16 of their error or 2^-20 of themselves.
      const off = 0.2 * noise + 2 * 2 ** -20 * grey(b.value) / unit + 5e-4 * Math.abs(relative);
      if (Number.isFinite(unit) && Math.abs(d / 100 - relative) > off) wrong.push(row[0] + ": difference " + row[1] + " is " + 100 * relative);
      if (noise > 1e-3 && Math.abs(number(row[2]) - z) > off / noise + 0.01) wrong.push(row[0] + ": t " + row[2] + " is " + z);
    });
  }
  return wrong.slice(0, 5).join("; ");
}
const wrong = await valuesWrong(page);
check("values, errors, n, differences and t are those of the files", wrong === "", wrong);
const exchanged = await open(exchangedPath, 1280, 900);
check("control: exchanged images are found", await valuesWrong(exchanged) !== "");
await exchanged.context().close();

// What is painted: the buffer that the stage shows (its second image, if over), pixel by pixel.
const painted = (over, x, y) => page.evaluate(([o, px, py]) => {
  const pane = scenes[0].stagePane, source = pane.source();
  return [...pane.buffer(o ? source.over : source).getContext("2d").getImageData(px, py, 1, 1).data.slice(0, 3)];
}, [over, x, y]);
async function paintsRadiance(name, over, gain, points) {
  const bad = [], white = +(await page.getAttribute("section.scene", "data-white"));
  for (const [x, y] of points) {
    const p = pixelOf(images[name], x, y), c = await painted(over, x, y);
    for (let k = 0; k < 3; k++) {
      const lowest = srgb((p.value[k] - p.error[k] / 8) * gain / white) - 1, highest = srgb((p.value[k] + p.error[k] / 8) * gain / white) + 1;
      if (c[k] < lowest || c[k] > highest) bad.push(x + "," + y + ": " + c[k] + " not " + lowest + ".." + highest);
    }
  }
  return bad;
}
const points = [[3, 5], [31, 31], [50, 20], [10, 60]];
for (let i = 0; i < 4; i++) {
  await page.keyboard.press(String(i + 1));
  await frames(page);
  const bad = await paintsRadiance(names[i], 0, 1, points);
  check("key " + (i + 1) + " shows " + names[i] + " as the sRGB curve has it", bad.length === 0, bad.join("; "));
}
for (let i = 0; i < 4; i++) await page.keyboard.press("]");
await frames(page);
check("exposure of one stop doubles radiance", (await paintsRadiance(names[3], 0, 2, points)).length === 0);
for (let i = 0; i < 4; i++) await page.keyboard.press("[");
await page.getByLabel("Curve").selectOption({ label: "linear" });
await frames(page);
const white = +(await page.getAttribute("section.scene", "data-white"));
const linear = await painted(0, 31, 31), wanted = pixelOf(images[names[3]], 31, 31).value.map((v) => Math.min(255, 255 * v / white));
check("the linear curve is linear", linear.every((v, k) => Math.abs(v - wanted[k]) <= 1), linear + " not " + wanted);
await page.getByLabel("Curve").selectOption({ label: "gamma 2.2" });
await frames(page);
const gamma = await painted(0, 31, 31), bent = pixelOf(images[names[3]], 31, 31).value.map((v) => Math.min(255, 255 * (v / white) ** (1 / 2.2)));
check("gamma 2.2 is that", gamma.every((v, k) => Math.abs(v - bent[k]) <= 1), gamma + " not " + bent);
await page.getByLabel("Curve").selectOption({ label: "log, 4 decades" });
await frames(page);
const logarithmic = await painted(0, 31, 31), decades = pixelOf(images[names[3]], 31, 31).value.map((v) => Math.min(255, 255 * (1 + Math.log10(v / white) / 4)));
check("the logarithmic curve is that", logarithmic.every((v, k) => Math.abs(v - decades[k]) <= 1), logarithmic + " not " + decades);
await page.getByLabel("Curve").selectOption({ label: "sRGB" });
await page.getByLabel("Exposure").fill("-2");
await frames(page);
check("the slider exposes too", (await paintsRadiance(names[3], 0, 0.25, points)).length === 0);
await page.getByLabel("Exposure").fill("0");

// Wipe: the shown image left of the line, another one right of it; the line follows a drag.
await page.keyboard.press("1");
await page.keyboard.press("w");
await frames(page);
check("wipe shows two images", (await paintsRadiance(names[0], 0, 1, points)).length === 0 && (await paintsRadiance(names[1], 1, 1, points)).length === 0);
await page.locator(".stage .frame").scrollIntoViewIfNeeded();
let box = await page.locator(".stage .frame").boundingBox();
await page.mouse.move(box.x + box.width / 2, box.y + 40);
await page.mouse.down();
await page.mouse.move(box.x + box.width / 4, box.y + 60, { steps: 3 });
await page.mouse.up();
check("the wipe is dragged", Math.abs(await page.evaluate("scenes[0].wipe") - 0.25) < 0.01);
await page.getByLabel("Image that is wiped in").selectOption({ label: names[3] });
check("the wiped image is chosen", await page.evaluate("scenes[0].shots[scenes[0].against].name") === names[3]);
await page.keyboard.press("w");

// Maps, each with its sentence, legend and colours.
const maps = { d: "Difference", t: "t map", e: "Error", v: "Variance ratio", n: "Samples", p: "FLIP" };
for (const [key, name] of Object.entries(maps)) {
  await page.keyboard.press(key);
  await frames(page);
  const caption = await page.textContent(".stage figcaption"), legend = await page.textContent(".stage .legend");
  check("key " + key + " shows: " + name, caption.startsWith(name) && caption.length > name.length + 60 && /\d/.test(legend), caption);
}
const flips = await page.evaluate(`scenes[0].claims.map((c) => {
  const m = makeMap.flip(c.a.layer, c.b.layer, c);
  return [m.length, Math.min(...m), Math.max(...m), m.reduce((s, v) => s + v, 0) / m.length];
})`), means = (await page.locator("#alike tbody tr td:nth-child(5)").allTextContents()).map(Number);
check("FLIP maps have the means of the table", flips.length === means.length && flips.every(([length, low, high, mean], i) =>
  length === size.width * size.height && low >= 0 && high <= 1 && Math.abs(mean - means[i]) <= 0.0002 + 0.02 * means[i]) && means.some((m) => m > 0),
  JSON.stringify([flips, means]));
await page.keyboard.press("t");
await frames(page);
const red = [];
for (let y = 0; y < size.height; y += 7)
  for (let x = 0; x < size.width; x += 5) {
    const z = zMaps[0].at("z", x, y), c = await painted(0, x, y);
    if (z > 1 && !(c[0] > c[2]) || z < -1 && !(c[2] > c[0])) red.push(x + "," + y + ": z " + z + " is " + c);
  }
check("the t map is red above and blue below", red.length === 0, red.join("; "));

await page.getByLabel("Images of the map").selectOption({ index: 1 });
await frames(page);
check("the pair of a map is chosen", (await page.textContent(".stage figcaption")).startsWith("t map, " + claims[1].a + " against " + claims[1].b));
await page.getByLabel("Images of the map").selectOption({ index: 0 });

// Zoom to single pixels and pan, linked between all frames; then the whole image.
await page.keyboard.press("0");
for (let i = 0; i < 8; i++) await page.keyboard.press("+");
check("zoom ends at 4 pixels", await page.evaluate("scenes[0].width / scenes[0].view.zoom") === 4);
await page.locator(".side .frame").first().scrollIntoViewIfNeeded();
box = await page.locator(".side .frame").first().boundingBox();
const before = await page.evaluate("scenes[0].view.x");
await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
await page.mouse.down();
await page.mouse.move(box.x + box.width / 4, box.y + box.height / 2, { steps: 4 });
await page.mouse.up();
check("a drag pans by what it is long", Math.abs(await page.evaluate("scenes[0].view.x") - before - 1) < 0.05);
await frames(page);
const middles = await page.evaluate(`[...document.querySelectorAll(".side .frame canvas")].map((c) =>
  [...c.getContext("2d").getImageData(c.width / 8, c.height / 8, 1, 1).data.slice(0, 3)])`);
const corner = await page.evaluate("[Math.floor(scenes[0].view.x + 0.5), Math.floor(scenes[0].view.y + 0.5)]");
check("all frames show the same pixels", middles.length === names.length && middles.every((c, i) =>
  srgb(pixelOf(images[names[i]], ...corner).value[1] / white) - c[1] <= 2 && c[1] - srgb(pixelOf(images[names[i]], ...corner).value[1] / white) <= 2), JSON.stringify(middles));
await page.keyboard.press("f");
await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
await page.mouse.dblclick(box.x + box.width / 2, box.y + box.height / 2);
check("a double click zooms", await page.evaluate("scenes[0].view.zoom") === 2);
await page.getByRole("button", { name: "Fit" }).click();
await page.getByTitle("Zoom in").click();
await page.getByTitle("Zoom out").click();
check("the zoom's buttons", await page.evaluate("scenes[0].view.zoom") === 1);
await page.locator(".side .frame").first().focus();
await page.keyboard.press("ArrowRight");
const at = await page.evaluate("({...scenes[0].pixel})");
await page.keyboard.press("Shift+ArrowDown");
const after = await page.evaluate("({...scenes[0].pixel})");
check("arrow keys move the pixel", after.x === at.x && after.y === Math.min(at.y + 8, size.height - 1));

// A frame smaller than the image: each of its pixels shows the mean radiance of what it covers, here 40 of 64.
const SMALL = 40;
await page.evaluate((width) => {
  scenes[0].show(4, null);
  scenes[0].stagePane.frame.style.cssText += "; flex: none; width: " + width + "px";
}, SMALL);
await frames(page);
await frames(page);
const covered = (x, y, k) => {
  let sum = 0;
  const share = (i, n, at) => Math.max(0, Math.min(i + 1, (at + 1) * n / SMALL) - Math.max(i, at * n / SMALL)) * SMALL / n;
  for (let j = 0; j < size.height; j++)
    for (let i = 0; i < size.width; i++) {
      const weight = share(i, size.width, x) * share(j, size.height, y);
      if (weight > 0) sum += weight * pixelOf(images[names[3]], i, j).value[k];
    }
  return sum;
};
const reduced = await page.evaluate(() => {
  const c = scenes[0].stagePane.canvas;
  return { size: [c.width, c.height], at: [[5, 7], [19, 30], [31, 12], [36, 38]].map((p) => [p, [...c.getContext("2d").getImageData(...p, 1, 1).data]]) };
});
const far = reduced.at.filter(([[x, y], rgb]) => [0, 1, 2].some((k) => Math.abs(rgb[k] - srgb(covered(x, y, k) / white)) > 1));
check("an image larger than its frame is averaged", reduced.size.join() === SMALL + "," + SMALL && far.length === 0, JSON.stringify(reduced));
await page.evaluate(`scenes[0].stagePane.frame.style.cssText = "aspect-ratio: 1"; scenes[0].show(0, null)`);

// Tiles: sorted by p, one press marks and reads.
const article = page.locator("article.claim").first(), tiles = claims[0].tile_log10_p;
const first = tiles.indexOf(Math.min(...tiles.filter((p) => p !== null))), columns = claims[0].tiles_x, side = claims[0].tile;
await article.locator(".tiles button").first().click();
const tile = await page.evaluate("({...scenes[0].tile})"), reading = await article.locator(".tile-reading").textContent();
check("the tile of smallest p is first and is marked", tile.x === first % columns * side && tile.y === Math.floor(first / columns) * side, JSON.stringify(tile));
check("its p is read", Math.abs(number(/p ([^ ]+)\.$/.exec(reading)[1]) / 10 ** tiles[first] - 1) < 0.01, reading);
await page.keyboard.press("f");
await page.keyboard.press("g");
check("all tiles are outlined", await page.evaluate("scenes[0].grid") === side);
await page.keyboard.press("g");

// Figures' numbers as files.
const [download] = await Promise.all([page.waitForEvent("download"), article.locator('a.csv[download="tiles.csv"]').first().click()]);
const csv = readFileSync(await download.path(), "utf8").split("\r\n");
check("a figure's numbers are saved as CSV", download.suggestedFilename() === "tiles.csv" && csv[0] === "x,y,t,log10_p" &&
  csv.length === tiles.length + 2 && Math.abs(csv[1].split(",")[3] - tiles[0]) < 1e-5, csv.slice(0, 2).join(" | "));
const [plotFile] = await Promise.all([page.waitForEvent("download"), article.locator('a.csv[download="tiles.svg"]').first().click()]);
const plot = readFileSync(await plotFile.path(), "utf8");
// In the whole window: looked at closer by the wheel, all of it again, and closed.
const seen = () => page.evaluate(`document.querySelector("dialog.large svg")?.getAttribute("viewBox")`);
await article.locator("button.larger").first().click();
const whole = await seen(), large = await page.locator("dialog.large svg").boundingBox();
await page.mouse.move(large.x + large.width / 4, large.y + large.height / 4);
await page.mouse.wheel(0, -100);
await page.waitForFunction((was) => document.querySelector("dialog.large svg").getAttribute("viewBox") !== was, whole);
const [x0, y0, w0] = whole.split(/[ ,]+/).map(Number), [x1, , w1] = (await seen()).split(" ").map(Number);
check("a plot grows to the window, and the wheel looks closer", large.width > 900 && Math.abs(w1 - w0 / 1.2) < 1e-6 * w0 && x1 > x0, whole + " to " + await seen());
await page.keyboard.press("0");
check("and shows all again", (await seen()) === [x0, y0, ...whole.split(/[ ,]+/).slice(2).map(Number)].join(" "), await seen());
await page.keyboard.press("Escape");
check("and closes", await becomes(page.locator("dialog.large"), "detached"));
check("a plot is saved as an SVG that stands alone", plot.startsWith("<svg") && !/var\(|class=|style=/.test(plot) && /<circle[^>]*fill="rgb/.test(plot) &&
  await page.evaluate((text) => new DOMParser().parseFromString(text, "image/svg+xml").querySelector("parsererror") === null, plot), plot.slice(0, 300));
const bare = await page.evaluate(`[...document.querySelectorAll("figure")].filter((f) => f.querySelector("svg.plot") &&
  !(f.querySelector("figcaption a.csv") && f.querySelector("figcaption b") && f.querySelectorAll("svg text").length > 3)).length`);
check("every plot has a caption, labels and its numbers", bare === 0, bare + " have not");
await article.getByText("Everything needed to doubt it").click();
check("the facts unfold", await article.locator("dl.facts").isVisible());

// The table: found, sorted by each kind of column, and its links unfold what is folded.
const rowsShown = () => page.locator("#claims tbody tr:visible").count(), total = await rowsShown();
const find = page.getByRole("searchbox", { name: "Find" });
await find.fill("pathtracer CYCLES");
const found = await page.locator("#claims tbody tr:visible td:nth-child(4)").allTextContents();
check("rows are found by their words", found.length > 0 && found.length < total && found.every((t) => t === "cycles"), found.join());
await find.fill("");
check("all rows are back", await rowsShown() === total);
await page.evaluate("scenes[0].show(1, null)");
await find.press("2");
check("what is typed there shows no image", await page.evaluate("scenes[0].shown") === 1);
await find.fill("");
await page.evaluate("scenes[0].show(0, null)");
const column = async (name, n, read, order) => {
  const values = () => page.locator("#claims tbody tr td:nth-child(" + n + ")").allTextContents();
  const before = await values(), sorted = [...before].sort((a, b) => order(read(a), read(b))), got = [];
  for (let i = 0; i < 3; i++) {
    await page.locator("#claims").getByRole("button", { name, exact: true }).click();
    got.push((await values()).map(read).join());
  }
  check("rows are sorted by " + name, got[0] === sorted.map(read).join() && got[1] === sorted.reverse().map(read).join() &&
    got[2] === before.map(read).join(), got.join(" | "));
};
await column("Difference %", 7, number, (a, b) => a - b);
await column("Against", 4, String, (a, b) => (a < b ? -1 : a > b ? 1 : 0));
await page.getByRole("button", { name: "Fold all", exact: true }).click();
check("evidence is folded", !await article.locator(".maps").isVisible());
await page.locator("#claims a[href='#" + await article.getAttribute("id") + "']").click();
check("a row's link unfolds its evidence", await becomes(article.locator(".maps"), "visible"));
await page.getByRole("button", { name: "Unfold all evidence" }).click();
check("all evidence is unfolded", await page.locator(".evidence:not([open])").count() === 0);

// Widths, colours, paper.
for (const [width, height] of [[1280, 900], [820, 1100], [390, 844]]) {
  for (const scheme of ["light", "dark"]) {
    const other = await open(pagePath, width, height, { colorScheme: scheme, hasTouch: width < 500 });
    await frames(other);
    const wide = await other.evaluate("document.scrollingElement.scrollWidth - window.innerWidth");
    check(scheme + ", " + width + " px: nothing sticks out", wide <= 0, wide + " px");
    await other.screenshot({ path: shots + "/" + width + "-" + scheme + "-top.png" });
    await other.evaluate(`document.querySelector("section.scene").scrollIntoView()`);
    await frames(other);
    await other.screenshot({ path: shots + "/" + width + "-" + scheme + "-scene.png" });
    if (width < 500 && scheme === "light") {
      const frame = other.locator(".side .frame").first();
      await frame.tap({ position: { x: 3, y: 3 } });
      check("a tap reads a pixel", await other.evaluate("scenes[0].pixel.x === 0 && scenes[0].pixel.y === 0"));
    }
    await other.context().close();
  }
}
// So far out of sight that chromium does not lay the scene out.
writeFileSync(shots + "/far.html", readFileSync(pagePath, "utf8").replace('<section class="scene"', '<div style="height: 20000px"></div>$&'));
const paper = await open(shots + "/far.html", 1280, 300);
const blank = () => paper.evaluate(() => [...document.querySelectorAll(".side canvas, .maps .frame canvas")].filter((c) =>
  c.getContext("2d").getImageData(c.width >> 1, c.height >> 1, 1, 1).data[3] !== 255).length);
const unseen = await blank();
await paper.evaluate(`window.dispatchEvent(new Event("beforeprint"))`);
const printed = await blank();
check("images out of sight are drawn for paper, and only then", unseen > 0 && printed === 0, unseen + " and " + printed + " are blank");
await paper.context().close();
// The page of a run that goes on gives way to the next one where it was scrolled to, up to the last one, which stays.
const reloads = /<meta http-equiv="refresh" content="1">/, goes = readFileSync(goingPath, "utf8");
writeFileSync(shots + "/going.html", goes);
const going = await open(shots + "/going.html", 1280, 300);
await going.evaluate("window.scrollTo(0, 250)");
writeFileSync(shots + "/going.html", goes.replace(reloads, "").replace("The run goes on", "The run is over"));
const replaced = going.waitForFunction(() => /The run is over/.test(document.querySelector("header").textContent), null, { timeout: 30000 });
check("a page of a run that goes on reloads itself", reloads.test(goes) && await replaced.then(() => true, () => false));
await going.evaluate("loadAll()");
check("it stays where it was scrolled to", await going.evaluate("window.scrollY") === 250, await going.evaluate("window.scrollY"));
await going.evaluate("window.stays = true");
await going.waitForTimeout(2500);
check("the last page does not reload", await going.evaluate("window.stays === true"));
await going.context().close();
// The table of a suite has a row for each scene, until its button, a search or a sort unfolds the others.
const suite = await open(suitePath, 1280, 900, { bypassCSP: true }), rowsOf = suite.locator("#claims tbody tr");
const visible = () => suite.locator("#claims tbody tr:visible").count();
await suite.getByText(/^All \d+, row by row$/).click();
const one = await suite.locator("#claims tbody tr").filter({ hasText: "12_point_plane" }).count();
check("rows of one scene fold", await visible() === 3 && await rowsOf.count() > 8, await visible() + " of " + await rowsOf.count());
await suite.getByRole("button", { name: "more of 12_point_plane" }).click();
check("a button unfolds them", await visible() === 2 + one, await visible() + ", not " + (2 + one));
await suite.getByRole("searchbox", { name: "Find" }).fill("povray");
check("a search unfolds what it finds", await visible() === await rowsOf.filter({ hasText: "povray" }).count() && await visible() > 3, await visible());
await suite.getByRole("searchbox", { name: "Find" }).fill("");
check("they are folded again", await visible() === 3, await visible());
for (const [path, scheme] of [[pagePath, "light"], [suitePath, "dark"]]) {
  const looked = await open(path, 1280, 900, { bypassCSP: true, colorScheme: scheme });
  await looked.evaluate(`document.querySelectorAll("details").forEach((d) => (d.open = true))`);
  await looked.evaluate(axe);
  const { violations } = await looked.evaluate('axe.run({ resultTypes: ["violations"] })');
  check("axe finds nothing, " + scheme, violations.length === 0, violations.map((v) => v.id + " " + v.nodes[0].html.slice(0, 120)).join("; "));
  await looked.context().close();
}
await suite.context().close();
const pdf = await page.pdf({ path: shots + "/page.pdf", preferCSSPageSize: true });
check("it prints", pdf.length > 20000, pdf.length + " bytes");
const unnamed = await page.evaluate(`[...document.querySelectorAll("canvas, svg, button, select, input")].filter((e) =>
  e.offsetParent !== null && !e.closest("[hidden]") && !(e.getAttribute("aria-label") || e.textContent.trim() || e.labels && e.labels.length)).length`);
check("every image and control has a name", unnamed === 0, unnamed + " have none");
check("no console message", complaints.length === 0, complaints.join("; "));
check("nothing is loaded from outside", requests.every((u) => u.startsWith("data:text/csv") || u.startsWith("file://") && u.endsWith(".html") || u.startsWith("blob:")), requests.join(" "));
await browser.close();
