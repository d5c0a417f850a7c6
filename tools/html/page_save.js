// Beside the numbers of a plot, the plot as a file.

const SVG_STYLES = ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "font-size", "font-family", "font-weight"];

// A plot that stands alone, in the page's light colours, for programs that know neither style sheets nor variables.
function standAlone(svg) {
  const light = [...document.styleSheets[0].cssRules].find((rule) => rule.selectorText === ":root").style;
  for (const name of light) svg.style.setProperty(name, light.getPropertyValue(name));
  const copy = svg.cloneNode(true), copies = [copy, ...copy.querySelectorAll("*")];
  [svg, ...svg.querySelectorAll("*")].forEach((element, i) => {
    const style = getComputedStyle(element);
    copies[i].removeAttribute("class");
    if (element.localName !== "title") SVG_STYLES.forEach((name) => copies[i].setAttribute(name, style.getPropertyValue(name)));
  });
  svg.removeAttribute("style");
  copy.removeAttribute("style");
  return new XMLSerializer().serializeToString(copy);
}

for (const csv of document.querySelectorAll("figcaption a.csv")) {
  const svg = csv.closest("figure").querySelector("svg.plot");
  if (!svg) continue;
  const link = make("a", { className: "csv", download: csv.download.replace(/csv$/, "svg"), href: "#" }, "SVG");
  link.setAttribute("aria-label", link.download);
  link.addEventListener("click", () => { link.href = URL.createObjectURL(new Blob([standAlone(svg)], { type: "image/svg+xml" })); });
  csv.after(" ", link);
}
