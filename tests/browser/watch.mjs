// node watch.mjs MODULES ASSAY DIR PAGE1 PAGE2: `assay watch` shows what comes into DIR and nothing else.
import { spawn } from "node:child_process";
import { copyFileSync, mkdirSync } from "node:fs";
import { request } from "node:http";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, assay, directory, page1, page2] = process.argv.slice(2);
const { chromium } = createRequire(resolve(modules) + "/")("playwright-core");
const check = (name, good, why = "") => console.log((good ? "ok" : "not ok") + " watch: " + name + (good ? "" : ": " + why));

const server = spawn(assay, ["watch", directory]);
const address = await new Promise((done) => server.stdout.once("data", (d) => done(String(d).trim())));
const port = +/^http:\/\/127\.0\.0\.1:(\d+)\/$/.exec(address)[1];
const ask = (path, options = {}) => new Promise((done, fail) => {
  const r = request({ host: "127.0.0.1", port, path, ...options }, (answer) => {
    let text = "";
    answer.on("data", (d) => (text += d));
    answer.on("end", () => done({ status: answer.statusCode, text, headers: answer.headers }));
  });
  r.on("error", fail);
  r.end();
});

check("no report yet", (await ask("/report")).status === 404 && (await ask("/state")).text === "");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage(), complaints = [];
page.on("pageerror", (e) => complaints.push(e.message));
page.on("console", (m) => m.type() === "error" && complaints.push(m.text()));
await page.goto(address);
copyFileSync(page1, directory + "/index.html");
const heading = page.frameLocator("iframe").locator("h1");
await heading.waitFor({ timeout: 30000 });
const first = await heading.textContent();
check("a first report appears", /claim/.test(first), first);
mkdirSync(directory + "/run2");
copyFileSync(page2, directory + "/run2/index.html");
await page.waitForFunction((old) => document.querySelector("iframe").contentDocument?.querySelector("h1")?.textContent !== old, first, { timeout: 30000 })
  .then(() => check("a newer one takes its place", true), (e) => check("a newer one takes its place", false, e.message));
check("no console message", complaints.length === 0, complaints.join("; "));
await browser.close();

for (const path of ["/../secret", "/run2/index.html", "/results.json", "/%2e%2e/secret", "//etc/passwd"])
  check("nothing at " + path, (await ask(path)).status === 404);
check("another host's name is refused", (await ask("/report", { headers: { Host: "evil.example:" + port } })).status === 403);
check("GET only", (await ask("/", { method: "POST" })).status === 405);
const ended = new Promise((done) => server.once("exit", (code) => done(code)));
server.kill("SIGTERM");
check("it ends with SIGTERM", await ended === 0);
