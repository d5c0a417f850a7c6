// The table of claims: searching, sorting, and unfolding of each row's evidence.

// What a cell is sorted by: seconds of "1 min 31 s", the number it begins with, or its text.
function sortKey(cell) {
  const text = cell.textContent.trim().replace(/\u2212/g, "-");
  if (/^[\d.]+ (s|min|h)\b/.test(text))
    return [...text.matchAll(/([\d.]+) (s|min|h)/g)].reduce((sum, m) => sum + m[1] * { s: 1, min: 60, h: 3600 }[m[2]], 0);
  const number = parseFloat(text);
  return Number.isNaN(number) || /^\d+_/.test(text) ? text : number;
}

function sortRows(body, column, order) {
  const rows = [...body.rows], key = new Map(rows.map((r) => [r, r.cells[column] ? sortKey(r.cells[column]) : ""]));
  const compare = (x, y) => (typeof x === typeof y ? (x < y ? -1 : x > y ? 1 : 0) : typeof x === "number" ? -1 : 1);
  body.append(...rows.sort((a, b) => order * compare(key.get(a), key.get(b))));
}

// Each heading sorts: up, down, then as it was.
function makeSortable(table, before = () => {}) {
  const body = table.tBodies[0], original = [...body.rows], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = make("button", { type: "button" }, ...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const next = { none: "ascending", ascending: "descending", descending: "none" }[head.getAttribute("aria-sort") || "none"];
      before();
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      body.append(...original);
      if (next === "none") return;
      head.setAttribute("aria-sort", next);
      sortRows(body, column, next === "ascending" ? 1 : -1);
    });
  });
}

// Hides the rows that lack any of the words; returns how many are left.
function filterRows(table, words) {
  let left = 0;
  for (const r of table.tBodies[0].rows) {
    const text = r.textContent.toLowerCase();
    r.hidden = !words.toLowerCase().split(/\s+/).every((w) => text.includes(w));
    left += !r.hidden;
  }
  return left;
}

// Folds adjacent rows of one scene that are as expected into the first, with a button that says how many more there
// are. Returns a function that opens or folds all of them.
function foldScenes(table) {
  const groups = [];
  for (const row of table.tBodies[0].rows) {
    const scene = row.querySelector("th").textContent, last = groups[groups.length - 1];
    if (last && last.scene === scene && !row.classList.contains("bad") && !last.rows[0].classList.contains("bad")) last.rows.push(row);
    else groups.push({ scene, rows: [row] });
  }
  const show = (group, open) => {
    group.rows.slice(1).forEach((row) => row.classList.toggle("folded", !open));
    group.button.setAttribute("aria-expanded", open);
  };
  const foldable = groups.filter((g) => g.rows.length > 1);
  for (const group of foldable) {
    group.button = make("button", { type: "button", className: "more" }, "+" + (group.rows.length - 1));
    group.button.setAttribute("aria-label", group.rows.length - 1 + " more of " + group.scene);
    group.button.addEventListener("click", () => show(group, group.button.getAttribute("aria-expanded") === "false"));
    group.rows[0].querySelector("th").append(group.button);
    show(group, false);
  }
  return (open) => foldable.forEach((group) => show(group, open));
}

const evidence = [...document.querySelectorAll("details.evidence")];
const claims = document.getElementById("claims");
if (claims && claims.tBodies[0].rows.length > 1) {
  // Sorted or searched, rows of a scene no longer stand together.
  const foldAll = claims.closest("details.rows") ? foldScenes(claims) : () => {};
  makeSortable(claims, () => foldAll(true));
  const count = make("output", {}), find = make("input", { type: "search", placeholder: "cornell cycles" });
  find.addEventListener("input", () => {
    foldAll(find.value.trim() !== "");
    const left = filterRows(claims, find.value);
    count.textContent = find.value.trim() ? left + " of " + claims.tBodies[0].rows.length : "";
  });
  const fold = (open, text) => {
    const b = make("button", { type: "button" }, text);
    b.addEventListener("click", () => evidence.forEach((d) => { d.open = open; }));
    return b;
  };
  claims.parentElement.before(make("div", { className: "tools" }, make("label", {}, "Find", find),
    make("div", { className: "tabs", role: "group", "aria-label": "Evidence of all claims" },
      fold(true, "Unfold all evidence"), fold(false, "Fold all")), count));
}

// Unfolds the evidence that a row's link leads to.
function unfoldTarget() {
  const target = /^#claim-\d+$/.test(location.hash) ? document.getElementById(location.hash.slice(1)) : null;
  const details = target && target.querySelector("details.evidence");
  if (!details) return;
  details.open = true;
  target.scrollIntoView();
}
window.addEventListener("hashchange", unfoldTarget);
document.addEventListener("click", (e) => {
  const link = e.target.closest && e.target.closest("a[href^='#claim-']");
  if (link && link.hash === location.hash) unfoldTarget();
});
unfoldTarget();
