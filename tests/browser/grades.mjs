// node grades.mjs MODULES SHOTS GRADES: the pages of a class, in Debian's chromium: nothing sticks out, axe finds nothing, nothing is
// loaded, links lead to files, light and dark. Prints "ok NAME" or "not ok NAME: why".
import { createRequire } from "node:module";
import { existsSync, readFileSync } from "node:fs";
import { dirname, resolve } from "node:path";

const [modules, shots, grades] = process.argv.slice(2);
const require = createRequire(resolve(modules) + "/");
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const all = JSON.parse(readFileSync(grades + "/grades.json", "utf8"));

function check(name, good, why = "") {
  console.log(good ? "ok grades: " + name : "not ok grades: " + name + ": " + why);
}

const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
const complaints = [], requests = [];
async function tab(width, colorScheme) {
  // axe runs in the page, whose policy lets no script in.
  const context = await browser.newContext({ viewport: { width, height: 844 }, colorScheme, bypassCSP: true });
  const page = await context.newPage();
  page.on("console", (m) => ["error", "warning"].includes(m.type()) && complaints.push(page.url() + ": " + m.text()));
  page.on("pageerror", (e) => complaints.push(page.url() + ": " + e.message));
  page.on("dialog", (d) => { complaints.push(page.url() + ": dialog " + d.message()); d.dismiss(); });
  page.on("request", (r) => requests.push(r.url()));
  return page;
}
async function open(path, width, colorScheme) {
  const page = await tab(width, colorScheme);
  await page.goto("file://" + resolve(grades, path));
  return page;
}

const wide = [], found = [], dead = [], grounds = new Set();
for (const [width, scheme] of [[1280, "light"], [390, "dark"]]) {
  const page = await tab(width, scheme); // one for all, since each takes a process of its own
  for (const path of ["index.html", ...all.flatMap((g) => [g.id + "/index.html", g.id + "/staff.html"])]) {
    await page.goto("file://" + resolve(grades, path));
    await page.evaluate(`document.querySelectorAll("details").forEach((d) => (d.open = true))`);
    const over = await page.evaluate("document.scrollingElement.scrollWidth - window.innerWidth");
    if (over > 0) wide.push(path + " at " + width + ": " + over + " px");
    grounds.add(scheme + await page.evaluate("getComputedStyle(document.body).backgroundColor"));
    await page.evaluate(axe);
    const { violations } = await page.evaluate('axe.run({ resultTypes: ["violations"] })');
    for (const v of violations) found.push(path + " " + width + " " + scheme + ": " + v.id + " " + v.nodes[0].html.slice(0, 120));
    for (const href of await page.locator("a").evaluateAll((links) => links.map((a) => a.getAttribute("href")))) {
      const there = href.startsWith("#") ? await page.evaluate(`document.getElementById(${JSON.stringify(href.slice(1))}) !== null`)
        : existsSync(resolve(grades, dirname(path), decodeURIComponent(href)));
      if (!there) dead.push(path + ": " + href);
    }
    await page.screenshot({ path: shots + "/grades-" + path.replace(/[^a-z0-9]+/gi, "-") + "-" + width + "-" + scheme + ".png", fullPage: true });
  }
  await page.context().close();
}
check("nothing sticks out", wide.length === 0, wide.join("; "));
check("axe finds nothing", found.length === 0, found.join("; "));
check("links lead somewhere", dead.length === 0, dead.join("; "));
check("light and dark are two", grounds.size === 2, [...grounds].join());
const bad = await open("index.html", 1280, "light");
await bad.evaluate(axe);
await bad.evaluate(`document.querySelector("th").style.color = "#eee"`);
check("axe finds what is pale (control)", (await bad.evaluate('axe.run({ resultTypes: ["violations"] })')).violations.some((v) => v.id === "color-contrast"));
await bad.context().close();

// Who needs staff comes first and is named on top; of each what is wrong with it.
const text = async (path, what) => {
  const page = await open(path, 1280, "light");
  const texts = await page.locator(what).allTextContents();
  await page.context().close();
  return texts;
};
const [top] = await text("index.html", ".error-line"), rows = await text("index.html", "tbody th a:first-child");
const needy = { cyd: "not built", dan: "no image", eve: "printed its usage", fay: "provisional", gus: "look" };
check("the line on top", top.startsWith("5 of 7 need you") && Object.entries(needy).every(([id, why]) => top.includes(`${id} (${why})`)), top);
check("they come first", rows.filter((t) => t.length === 3).slice(0, 5).sort().join() === Object.keys(needy).join(), rows.join());
check("what changed", (await text("index.html", "li")).some((t) => t === "gus: 1.50 of 10, 4.00 of 10 before; point 4.00, now 1.50"));
check("a log of what was not built", (await text("cyd/index.html", "details[open] pre")).some((t) => t.includes("<b>&return")));
check("points by part", (await text("bob/staff.html", ".parts .num")).join("|") === "Points|4.00 of 4|0.00 of 6", (await text("bob/staff.html", ".parts .num")).join("|"));
check("the student's are those of what is shown", (await text("bob/index.html", ".parts .num")).join("|") === "Points|4.00 of 4", (await text("bob/index.html", ".parts .num")).join("|"));
check("two mistakes are named", (await text("gus/index.html", ".finding li"))[0].includes("and with it light falls as 1/r (Part 3)"));
check("the image where it shows is there", (await text("gus/index.html", "figcaption")).includes("cornell, yours"));
check("provisional is said to the student", (await text("fay/index.html", ".error-line"))[0].includes("kept until staff have looked"));
// Hidden checks, flags and references are staff's.
const student = (await text("gus/index.html", "body"))[0], staff = (await text("gus/staff.html", "body"))[0];
check("what is staff's", ["A plane under a point light", "copy of the reference", "the reference", "light_pdf"].every((t) => staff.includes(t)));
check("is not the student's", ["A plane under a point light", "copy of the reference", "point, the reference"].every((t) => !student.includes(t)), student);
check("no console message", complaints.length === 0, complaints.join("; "));
check("nothing is loaded", requests.every((u) => u.startsWith("file://") && u.endsWith(".html") || u.startsWith("data:image/png")), requests.find((u) => !u.startsWith("data:")));
await browser.close();
