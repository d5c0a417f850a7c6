// node page_images.mjs MODULES PAGE COMPARED RENDER.png OUT: the images that pages show: OUT/report.jpg, the first screen of PAGE,
// OUT/difference.jpg, the map of COMPARED, and OUT/render.jpg.
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, pagePath, compared, render, out] = process.argv.slice(2);
const { chromium } = createRequire(resolve(modules) + "/")("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1180, height: 1000 } });
await page.goto("file://" + resolve(pagePath));
await page.evaluate("loadAll()");
await page.waitForTimeout(500);
await page.screenshot({ path: out + "/report.jpg", type: "jpeg", quality: 72 });
await page.goto("file://" + resolve(compared));
await page.evaluate("loadAll()");
await page.evaluate("document.querySelector('.viewer').scrollIntoView()");
await page.keyboard.press("d");
await page.waitForTimeout(500);
await page.locator(".stage .frame").screenshot({ path: out + "/difference.jpg", type: "jpeg", quality: 60 });
await page.goto("file://" + resolve(render));
await page.locator("img").screenshot({ path: out + "/render.jpg", type: "jpeg", quality: 85 });
await browser.close();
