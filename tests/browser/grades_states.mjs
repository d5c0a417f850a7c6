// node grades_states.mjs GRADES: gives five submissions of a class, graded as bob's, states that their programs did not make. `assay
// grade` finds them done and writes their pages.
import { readFileSync, writeFileSync } from "node:fs";

const grades = process.argv[2];
const edit = (id, change) => {
  const path = `${grades}/${id}/grade.json`, grade = JSON.parse(readFileSync(path, "utf8"));
  change(grade);
  writeFileSync(path, JSON.stringify(grade));
};
const lose = (state, wrong) => (g) => {
  Object.assign(g, { state, wrong, points: 0, diagnosis: null });
  for (const c of g.checks) Object.assign(c, { points: 0, share: 0, seen: wrong });
  for (const p of g.parts) p.points = 0;
  for (const p of g.pictures) Object.assign(p, { sha256: null, file: null, why: wrong, end: "failed" });
};

edit("cyd", (g) => { lose("not_built", "building it failed: exit status 2")(g); g.build_log = "build.log"; });
writeFileSync(`${grades}/cyd/build.log`, "[1%] Building CXX object src/CMakeFiles/pathtracer.dir/a/path/that/does/not/fit/into/390/pixels.cpp.o\n".repeat(200) +
  "pathtracer.cpp:120:5: error: expected ';' before '<b>&return' token\n");
edit("dan", lose("not_started", "it does not start: libGLEW.so.2.2: cannot open shared object file"));
edit("eve", lose("usage", "it printed its usage text for each image"));
edit("fay", (g) => {
  Object.assign(g.checks[1], { points: 6, share: 1, provisional: true, visibility: "visible" });
  Object.assign(g, { points: 10, provisional: true, diagnosis: null });
  Object.assign(g.pictures[1], { runs: 12 });
  g.parts[1].points = 6;
});
edit("gus", (g) => {
  Object.assign(g.checks[0], { points: 1.5, share: 0.375, carried: "the lamp is half as bright", flag: "point is a copy of the reference", visibility: "hidden" });
  Object.assign(g, { points: 1.5, accepted: "light_pdf", located: "only in light that bounced off a wall first", located_picture: "cornell",
    before: { points: 4, of: 10, checks: [{ name: "point", was: 4, is: 1.5 }] },
    diagnosis: { finding: "bug", gate: "the box is too dark", with: "", parts: [], named: [
      { name: "no_bounces", bug: "indirect light is not added", where: "Part 4", explained: 0.93, and: "inverse_r", and_bug: "light falls as 1/r", and_where: "Part 3" },
      { name: "one_bounce", bug: "only one bounce is traced", where: "Part 4", explained: 0.91 }] } });
  g.parts[0].points = 1.5;
  g.checks[1].visibility = "visible";
  g.for_student = { diagnosis: g.diagnosis, located: g.located, located_picture: g.located_picture };
});
