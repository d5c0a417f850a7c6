// node pictures.mjs MODULES PAGE RENDER.png OUT: the two images that README shows, OUT/report.jpg, the first screen of PAGE and the
// images of its first scene, and OUT/render.jpg.
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, pagePath, render, out] = process.argv.slice(2);
const { chromium } = createRequire(resolve(modules) + "/")("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1180, height: 1180 } });
await page.goto("file://" + resolve(pagePath));
await page.evaluate("loadAll()");
await page.waitForTimeout(500);
await page.screenshot({ path: out + "/report.jpg", type: "jpeg", quality: 72 });
await page.goto("file://" + resolve(render));
await page.locator("img").screenshot({ path: out + "/render.jpg", type: "jpeg", quality: 85 });
await browser.close();
