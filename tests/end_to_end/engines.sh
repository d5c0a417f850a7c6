#!/bin/bash
# tests/end_to_end/engines.sh BUILD: compares what the drivers of reference/engines write for other renderers with
# another of our exports; if there is libc-ray.so (LIBC_RAY or the loader's) c-ray renders, too. Prints "ok NAME", "not
# ok NAME: why" or "skip NAME".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/engines.sh BUILD}")
tmp=$(mktemp -d) top=$PWD
trap 'rm -rf "$tmp"' EXIT
failures=0
what="engines"
export PYTHONDONTWRITEBYTECODE=1 # what is imported lies in the checkout, which may be installed
. tests/end_to_end/expect.sh
PATH=$build:/usr/bin:$PATH
driver=$top/reference/engines/c-ray.py
if ! python3 -c 'import numpy' 2>/dev/null; then
    echo "skip engines: c-ray (no python3-numpy)"
    exit 0
fi

# Scenes with lamps, a mirror, a ball; and a lens. c-ray's camera stays at the origin and looks along +Z with +X to the
# left, so a point has the coordinates (-right, up, -backward) of its offset from the eye, all of which are in the dump
# for Cycles. A lamp's black back lies 1/10000 of its size behind it. The lens is checked by c-ray's own formulas
# (cam_recompute_optics), the window by its angle.
# translate NAME DAE OPTIONS: "$tmp/NAME" has what c-ray reads, "$tmp/NAME.json" the dump
translate() {
    mkdir "$tmp/$1"
    assay export --engine mitsuba -o "$tmp/$1.xml" "${@:2}" && assay export --engine cycles -o "$tmp/$1.json" "${@:2}" && python3 "$driver" "$tmp/$1.xml" DIR 1 "$tmp/$1"
}
tell "c-ray: scenes are translated" "$({ translate box -r 24 16 -m 3 reference/scenes/21_mirror.dae && translate cornell -r 24 16 -m 5 reference/scenes/41_cornell.dae &&
    translate lens -r 24 16 -m 0 -b 0.25 -d 3 reference/scenes/17_lens_step.dae; } 2>&1 >/dev/null)"
cat >"$tmp/held.py" <<'END'
import json, math, sys
import numpy as np
dump, got = (json.load(open(p)) for p in (sys.argv[1] + ".json", sys.argv[1] + "/scene.json"))
near = lambda what, a, b: np.allclose(a, b, rtol=1e-6, atol=2e-6) or sys.exit(f"{what}: {a}, expected {b}")
view, scene, camera = dump["camera"], got["scene"], got["camera"]
axes = np.array([view["right"], view["up"], view["backward"]]).T * [-1, 1, -1]
place = lambda p: (np.reshape(p, (-1, 3)) - view["eye"]) @ axes
near("size and bounces", [got["renderer"][k] for k in ("width", "height", "bounces")], [24, 16, dump["depth"]])
near("angle", math.tan(math.radians(camera["FOV"] / 2)), view["tan_h"])
if view["lens_radius"]:
    near("lens", 0.5 * (0.5 * 0.036 / math.radians(0.5 * camera["FOV"])) / camera["fstops"], view["lens_radius"])
    near("focus", camera["focalDistance"], view["focal_distance"])
def shader(node, of):
    glows = max(of["radiance"]) > 0
    if glows and max(of["reflectance"]) > 0:  # by chance: the means are the material's
        assert node["type"] == "mix" and max(node["B"]["color"]) <= 1
        near("light", np.array(node["A"]["color"]) * node["A"]["strength"] * (1 - node["factor"]), of["radiance"])
        near("reflectance", np.array(node["B"]["color"]) * node["factor"], of["reflectance"])
        return
    assert node["type"] == ("emissive" if glows else {"diffuse": "diffuse", "mirror": "metal"}[of["kind"]]), node
    near("colour", node["color"], of["radiance" if glows else "reflectance"])
meshes = iter(scene["meshes"])
for mesh in dump["meshes"]:
    for back in range(2 if max(dump["materials"][mesh["material"]]["radiance"]) > 0 else 1):
        entry = next(meshes)
        lines = [x.split() for x in open(f"{sys.argv[1]}/{entry['fileName']}")]
        points, want = np.array([x[1:] for x in lines if x[0] == "v"], float), place(mesh["positions"])
        assert [x[1:] for x in lines if x[0] == "f"] == [[str(3 * i + k) for k in (1, 2, 3)] for i in range(len(want) // 3)]
        if not back:
            near("points", points, want)
            shader(entry["materials"][0], dump["materials"][mesh["material"]])
            continue
        a, b, c = want[0::3], want[1::3], want[2::3]
        n = np.cross(b - a, c - a)
        moved = 1e-4 * math.dist(want.max(0), want.min(0))
        near("back", ((points - want)[0::3] * n).sum(1), -moved * np.linalg.norm(n, axis=1))
        assert entry["materials"][0]["type"] == "diffuse" and not any(entry["materials"][0]["color"])
assert next(meshes, None) is None and len(scene["primitives"]) == len(dump["spheres"])
for ball, of in zip(scene["primitives"], dump["spheres"]):
    near("centre", [[ball["instances"][0]["transforms"][0][k] for k in "xyz"]], place(of["centre"]))
    near("radius", ball["radius"], of["radius"])
    shader(ball["material"], dump["materials"][of["material"]])
END
for scene in box cornell lens; do
    tell "c-ray: $scene is what the dump says" "$(python3 "$tmp/held.py" "$tmp/$scene" 2>&1 | tail -n 1)"
done
sed -i 's/"FOV": /"FOV": 1/' "$tmp/lens/scene.json"
tell "control: another angle is seen" "$(python3 "$tmp/held.py" "$tmp/lens" 2>&1 | grep -q '^angle' || echo "it is not")"
assay export --engine mitsuba -o "$tmp/point.xml" reference/scenes/12_point_plane.dae >"$tmp/out"
expect "c-ray: a library that is not there is said" 1 "^c-ray.py: /nowhere.*LIBC_RAY says where it is" env LIBC_RAY=/nowhere python3 "$driver" "$tmp/box.xml" 1 1 "$tmp/x.exr"
expect "c-ray: what it has not is said" 1 "^c-ray.py: c-ray has no light of the kind 'point'$" python3 "$driver" "$tmp/point.xml" DIR 1 "$tmp/box"

# Images of 1, 2 and 6 times x, where x is a pixel's number plus a quarter for each channel: the mean is 3 x, the sum of
# squared deviations 14 x^2, of cubed ones (-8 - 1 + 27) x^3; looked at in pixel 4.
tell "c-ray: moments" "$(python3 - "$driver" "$tmp/m.exr" 2>&1 <<'END'
import importlib.util, sys
import numpy as np
spec = importlib.util.spec_from_file_location("driver", sys.argv[1])
driver = importlib.util.module_from_spec(spec)
spec.loader.exec_module(driver)
x = np.arange(6).reshape(2, 3, 1) + np.arange(3) / 4
driver.write_moments(sys.argv[2], np.array([x, 2 * x, 6 * x]), 7)
END
)$(oiiotool --dumpdata "$tmp/m.exr" 2>&1 | sed -n 's/.*Pixel (1, 1)[^:]*: //p' |
    diff - <(python3 -c 'x = [4, 4.25, 4.5]; print(*("%.9f" % y for y in [3 * a for a in x] + [3] + [14 * a**2 for a in x] + [18 * a**3 for a in x]))'))"

# The programs themselves. H0 in each: the images are the same within the margins; alpha 1e-3, fixed seeds.
judge() { assay validate -q --out "$tmp/report" --engine "reference/engines/$1.json" --engine-spp "$2" --only "$3"; }
if python3 -c 'import ctypes, os; ctypes.CDLL("libm.so.6", ctypes.RTLD_GLOBAL); ctypes.CDLL(os.environ.get("LIBC_RAY") or "libc-ray.so")' 2>/dev/null; then
    expect "c-ray: a lens is EQUIVALENT" 0 "result: all as it should be, 1 the same" judge c-ray 256 17_lens_step/c-ray:pathtracer
else echo "skip engines: c-ray renders (no libc-ray.so; LIBC_RAY says where it is)"; fi
if [ -n "$(command -v pbrt)" ]; then
    expect "pbrt: a point light is EQUIVALENT" 0 "result: all as it should be, 1 the same" judge pbrt 64 12_point_plane/pbrt:truth
else echo "skip engines: pbrt renders (no pbrt in PATH)"; fi
exit $((failures > 0))
