"""Renders that decide whether a mutant changes an image: the assignment's scenes (ASSAY_CS184) and variants of them."""
import os
import re

AREA = re.compile(r"<extra>\s*<technique profile=\"CGL\">\s*<area>.*?</extra>", re.S)
POINT = re.compile(r"<point>.*?</point>", re.S)
EXTRA = re.compile(r"<extra>\s*<technique profile=\"CGL\">.*?</extra>", re.S)
SHINE = re.compile(r"(<color sid=\"specular\">)[^<]*")
BODY = re.compile(r"<(mirror|glass)>.*?</\1>", re.S)


BECKMANN = "<microfacet><alpha>0.3</alpha><eta>0.2 0.9 1.1</eta><k>3.9 2.4 2.1</k></microfacet>"


def lamp(text, new):
    return POINT.sub(new, AREA.sub("", text))


def made(sources):
    """Name and text of scenes made from CBspheres.dae."""
    text = sources["CBspheres.dae"]
    yield "metals.dae", BODY.sub(BECKMANN, text)
    yield "point.dae", lamp(text, "<point><color>3 2 1</color><constant_attenuation>0.5</constant_attenuation>"
                            "<linear_attenuation>0.3</linear_attenuation><quadratic_attenuation>0.4</quadratic_attenuation></point>")
    plain = EXTRA.sub("", sources["CBgems.dae"]).replace("-1 0 0 0 0 0 1 3 0 0 0 0 0 0 1", "-1 0 0 0 0 0 1 3 0 1 0 0 0 0 0 1")
    plain = SHINE.sub(r"\g<1>0 0 0 1", plain)
    yield "spot.dae", lamp(plain, "<spot><color>4 5 6</color><constant_attenuation>0</constant_attenuation><linear_attenuation>0"
                           "</linear_attenuation><quadratic_attenuation>1</quadratic_attenuation><falloff_angle>80</falloff_angle>"
                           "<falloff_exponent>0</falloff_exponent></spot>")
    yield "ambient.dae", lamp(text, "<ambient><color>0.2 0.3 0.4</color></ambient>")


def pool(folder, into):
    """(name, arguments) of each render, without -f; an empty list where the files are not there."""
    course = {f: os.path.join(d, f) for d, _, fs in os.walk(folder) for f in fs if f.endswith(".dae")} if folder else {}
    if "CBspheres.dae" not in course:
        return []
    os.makedirs(into, exist_ok=True)
    sources = {}
    for name in ("CBspheres.dae", "CBgems.dae"):
        with open(course[name]) as f:
            sources[name] = f.read()
    for name, text in made(sources):
        course[name] = os.path.join(into, name)
        with open(course[name], "w") as f:
            f.write(text)
    sky = os.path.join(into, "sky.exr")  # the box seen from outside, as a map of the surroundings
    size = ["-r", "80", "60"]
    runs = [
        ("box", "CBempty.dae", ["-m", "5"]),
        ("spheres", "CBspheres.dae", ["-m", "8"]),
        ("lambertian", "CBspheres_lambertian.dae", ["-m", "4", "-l", "4"]),
        ("gems", "CBgems.dae", ["-m", "6", "--roulette", "0.7"]),
        ("metals", "metals.dae", ["-m", "4"]),
        ("point", "point.dae", ["-m", "4"]),
        ("spot", "spot.dae", ["-m", "4"]),
        ("sun", "cow.dae", ["-m", "2", "--dialect", "cgl"]),
        ("ambient", "ambient.dae", ["-m", "4"]),
        ("hemisphere", "CBspheres_lambertian.dae", ["-m", "2", "--direct", "hemisphere"]),
        ("bsdf", "CBspheres_lambertian.dae", ["-m", "2", "--direct", "bsdf"]),
        ("sobol", "CBspheres.dae", ["-m", "5", "--sampler", "sobol"]),
        ("lens", "CBspheres.dae", ["-m", "3", "-b", "0.1", "-d", "4"]),
        ("adaptive", "CBspheres_lambertian.dae", ["-m", "3", "-a", "8", "0.2"]),
        ("cell", "CBspheres.dae", ["-m", "3", "-p", "16", "16", "40", "30"]),
        ("sky", "CBspheres.dae", ["-m", "4", "-e", sky]),
        ("skycow", "cow.dae", ["-m", "3", "-e", sky, "--dialect", "cgl"]),
        ("banana", "banana.dae", ["-m", "3", "--dialect", "cgl"]),
        ("bunny", "CBbunny.dae", ["-m", "3"]),
        ("planck", "maxplanck.dae", ["-m", "2", "--dialect", "cgl"]),
    ]
    found = [(n, options + ([] if "-r" in options else size) + [course[f]]) for n, f, options in runs if f in course]
    return [("make sky", ["-s", "64", "-r", "64", "32", "-m", "3", course["CBspheres.dae"], "-f", sky])] + found
