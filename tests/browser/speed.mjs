// node speed.mjs MODULES PAGE: how fast a page loads, decodes, switches and zooms; a line of each. It measures and judges nothing:
// what else the machine does is in the numbers.
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, path] = process.argv.slice(2);
const { chromium } = createRequire(resolve(modules) + "/")("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
const cdp = await page.context().newCDPSession(page);
await cdp.send("Performance.enable", { timeDomain: "threadTicks" });
const cpu = async () => (await cdp.send("Performance.getMetrics")).metrics.find((m) => m.name === "ProcessTime").value * 1000;
const idle = await cpu();
await page.goto("file://" + resolve(path));
const loaded = await page.evaluate(() => new Promise((done) => {
  const read = () => {
    const paint = performance.getEntriesByName("first-contentful-paint")[0], t = performance.getEntriesByType("navigation")[0];
    if (paint && t.loadEventEnd > 0) done([paint.startTime, t.domContentLoadedEventEnd, t.loadEventEnd]);
    else setTimeout(read, 10);
  };
  read();
}));
const atLoad = await cpu();
console.log("first paint %d ms, document %d ms, load %d ms; CPU of the page's process %d ms", ...loaded.map(Math.round), Math.round(atLoad - idle));
const decoded = await page.evaluate(async () => {
  await loadAll();
  return performance.now();
});
console.log("all images decoded after %d ms; CPU %d ms", Math.round(decoded), Math.round(await cpu() - idle));
await page.evaluate(() => scenes[0].box.scrollIntoView());

// Frames: the time from one to the next while something changes in each; draws: the script's own part of it.
async function frames(name, step) {
  const begun = await cpu();
  const [gaps, draws] = await page.evaluate(async (body) => {
    const act = new Function("i", body), gaps = [], draws = [];
    const frame = () => new Promise(requestAnimationFrame);
    for (let i = 0; i < 3; i++) { act(i); await frame(); }
    let last = await frame();
    for (let i = 0; i < 90; i++) {
      act(i);
      const begun = performance.now();
      scenes[0].panes.forEach((p) => p.draw());
      draws.push(performance.now() - begun);
      const now = await frame();
      gaps.push(now - last);
      last = now;
    }
    return [gaps, draws].map((v) => v.sort((a, b) => a - b));
  }, step);
  const at = (v, share) => v[Math.floor(share * (v.length - 1))].toFixed(1);
  console.log("%s: median frame %s ms, 9 of 10 below %s ms; drawing %s and %s ms; CPU of the page's process %s ms a frame", name,
    at(gaps, 0.5), at(gaps, 0.9), at(draws, 0.5), at(draws, 0.9), ((await cpu() - begun) / 94).toFixed(1));
}
await frames("switch images", "scenes[0].show(1 + i % scenes[0].shots.length, null)");
await frames("switch maps", "scenes[0].show(1, ['difference', 't', 'flip'][i % 3])");
await frames("zoom", "scenes[0].show(1, null); scenes[0].zoom(1 + 30 * Math.abs(Math.sin(i / 20)))");
await frames("pan", "scenes[0].zoom(4); scenes[0].pan(20 * Math.cos(i / 9), 20 * Math.sin(i / 9))");
await frames("expose", "scenes[0].zoom(1); scenes[0].expose((i % 17) / 4 - 2)");
await browser.close();
