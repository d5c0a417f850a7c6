// node names.mjs MODULES PAGE: a page made of files and texts that look like markup shows them as text.
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, pagePath] = process.argv.slice(2);
const { chromium } = createRequire(resolve(modules) + "/")("playwright-core");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await (await browser.newContext()).newPage();
const events = [];
page.on("dialog", (d) => { events.push("dialog"); d.dismiss(); });
page.on("pageerror", (e) => events.push(e.message));
page.on("console", (m) => m.type() === "error" && events.push(m.text()));
await page.goto("file://" + resolve(pagePath));
await page.evaluate("loadAll()");
for (const key of ["1", "w", "d", "t", "e", "v", "n", "p", "0"]) await page.keyboard.press(key);
await page.locator(".tiles button").first().click();
const made = await page.evaluate(`document.querySelectorAll("img, iframe, [onerror]").length`);
const shown = await page.evaluate(`document.body.innerText.includes("<img src=x onerror=alert(1)>")`);
const pixels = await page.evaluate("scenes[0].ready && scenes[0].shots.length === 2");
const good = made === 0 && shown && pixels && events.length === 0;
console.log(good ? "ok page: names cannot inject markup" :
  "not ok page: names cannot inject markup: " + [made, shown, pixels, ...events].join("; "));
await page.setViewportSize({ width: 390, height: 844 });
const wide = await page.evaluate("document.scrollingElement.scrollWidth - window.innerWidth");
console.log(wide <= 0 ? "ok page: long names fit on a phone" : "not ok page: long names fit on a phone: " + wide + " px");
await browser.close();
