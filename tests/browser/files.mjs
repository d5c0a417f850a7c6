// What the page must show, read from the EXR files by oiiotool.
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

// oiiotool prints 9 decimals, so everything is multiplied by 2^30 first, which is exact.
const SCALE = 2 ** 30;

// {width, height, at(channel, x, y)}; channels by name.
export function readExr(path) {
  const directory = mkdtempSync(join(tmpdir(), "exr-")), scaled = join(directory, "scaled.exr");
  const run = (...args) => execFileSync("oiiotool", args, { encoding: "utf8", maxBuffer: 1 << 28 });
  const info = run("--info", "-v", path, "--mulc", String(SCALE), "-o", scaled), [, width, height] = /:\s+(\d+) x\s+(\d+),/.exec(info).map(Number);
  const names = /channel list: (.*)/.exec(info)[1].split(",").map((n) => n.trim().split(" ")[0]);
  const pixels = new Map();
  for (const m of run("--dumpdata", scaled).matchAll(/Pixel \((\d+), (\d+)\):([^\n]*)/g))
    pixels.set(m[1] + "," + m[2], m[3].trim().split(/\s+/).map((v) => +v / SCALE));
  rmSync(directory, { recursive: true });
  return { width, height, at: (channel, x, y) => pixels.get(x + "," + y)[names.indexOf(channel)] };
}

// {value: [r, g, b], error: [..], n} of a pixel of a moments EXR; the error of one observation is 0.
export function pixelOf(exr, x, y) {
  const n = exr.at("n", x, y), rgb = ["R", "G", "B"];
  return { n, value: rgb.map((c) => exr.at(c, x, y)),
    error: rgb.map((c) => (n > 1 ? Math.sqrt(exr.at("M2." + c, x, y) / (n * (n - 1))) : 0)) };
}

export const grey = (v) => 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
export const srgb = (v) => Math.round(255 * Math.min(1, v <= 0.0031308 ? 12.92 * Math.max(v, 0) : 1.055 * v ** (1 / 2.4) - 0.055));
