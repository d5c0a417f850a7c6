"""Materials of a dump as shaders, each with the mean of the renderer's own BSDF.

In all of them wo points to the viewer, wi to where the light comes from; the shading normal ns
and the geometric normal ng are on wo's side. As in the renderer, an interpolated normal that looks
away from the viewer gives way to the geometric one, and directions that the two disagree about
carry no light.
"""
import math

import bpy

from cycles_blender import V, Nodes, Vector, choose
from cycles_texture import textured

# Largest 32-bit number below 1.
ALMOST_1 = 1 - 2.0 ** -24


def frame(nodes):
    wo, ns, ng = (nodes.geometry(name) for name in ("Incoming", "Normal", "True Normal"))
    towards = wo.dot(ns) > 0.0
    return wo, ng + (ns - ng) * towards, ng


def tinted(nodes, color, factor):
    return nodes.combine(*(c * factor for c in color))


def glossy(nodes, color, normal, roughness=0.0):
    node = nodes.node("BsdfGlossy" if V < (4, 0, 0) else "BsdfAnisotropic")
    node.distribution = "SHARP" if roughness == 0 and V < (4, 0, 0) else "GGX"
    for name, value in (("Color", color), ("Roughness", roughness), ("Normal", normal)):
        nodes.feed(node.inputs[name], value)
    return node.outputs[0]


def mirror(nodes, m):
    wo, ns, ng = frame(nodes)
    wi = ns * (2.0 * wo.dot(ns)) - wo
    return glossy(nodes, tinted(nodes, m["reflectance"], wi.dot(ng) > 0.0), ns)


def fresnel_dielectric(c, eta, schlick):
    """Reflectance and cosine behind (0: total reflection), as fresnel.h has them."""
    d = (eta - 1.0) * (eta + 1.0) + c * c
    some = d > 0.0
    ct = d.max(0.0).sqrt() / eta
    if schlick:
        r0 = (1.0 - eta) / (1.0 + eta)
        r0 = r0 * r0
        r = r0 + (1.0 - r0) * (1.0 - c).max(0.0) ** 5.0
    else:
        parallel = (eta * c - ct) / (eta * c + ct)
        perpendicular = (c - eta * ct) / (c + eta * ct)
        r = 0.5 * (parallel * parallel + perpendicular * perpendicular)
    return choose(some, r, 1.0), ct


def dielectric(nodes, m):
    """Cycles does not divide refracted radiance by the square of the relative index; the colour
    does it here, so that lights inside glass come out right too."""
    wo, ns, ng = frame(nodes)
    back = nodes.geometry("Backfacing")
    eta = choose(back, 1 / m["ior"], m["ior"])
    c = wo.dot(ns).max(0.0).min(1.0)
    reflected, ct = fresnel_dielectric(c, eta, m["schlick"])
    wt = ns * (c / eta - ct) - wo * (1.0 / eta)
    through = (wt.dot(ng) < 0.0) * (ct > 0.0) / (eta * eta)
    if m["kind"] == "glass":
        through = through * (1.0 - reflected)
    node = nodes.node("BsdfRefraction")
    node.distribution = "SHARP" if V < (4, 0, 0) else "GGX"
    for name, value in (("Color", tinted(nodes, m["transmittance"], through)), ("Roughness", 0.0),
                        ("IOR", m["ior"]), ("Normal", ns)):
        nodes.feed(node.inputs[name], value)
    if m["kind"] == "refraction":
        return node.outputs[0]
    wi = ns * (2.0 * c) - wo
    above = wi.dot(ng) > 0.0
    return nodes.add_shaders(
        node.outputs[0], glossy(nodes, tinted(nodes, m["reflectance"], above * reflected), ns))


def fresnel_conductor(c, eta, k):
    """As fresnel.h has it."""
    if eta == 0 and k == 0:
        return 1.0
    c2 = c * c
    s2 = 1.0 - c2
    t0 = (eta - 1) * (eta + 1) - k * k + c2
    a2b2 = (t0 * t0 + 4 * eta * eta * k * k).sqrt()
    a = (0.5 * (a2b2 + t0)).max(0.0).sqrt()
    perpendicular = (a2b2 + c2 - 2.0 * a * c) / (a2b2 + c2 + 2.0 * a * c)
    parallel = (c2 * a2b2 + s2 * s2 - 2.0 * a * c * s2) / (c2 * a2b2 + s2 * s2 + 2.0 * a * c * s2)
    return 0.5 * perpendicular * (1.0 + parallel)


def smith_lambda(m, c):
    """Of a direction at cosine c; erfc by [Abramowitz64 7.1.26], good to 1.5e-7."""
    tan2 = ((1.0 - c * c) / (c * c)).max(1e-12)
    if m["distribution"] == "ggx":
        return 0.5 * ((1.0 + m["alpha"] ** 2 * tan2).sqrt() - 1.0)
    a = 1.0 / (m["alpha"] * tan2.sqrt())
    t = 1.0 / (1.0 + 0.3275911 * a)
    p = 1.061405429 * t - 1.453152027
    p = (((p * t + 1.421413741) * t - 0.284496736) * t + 0.254829592) * t
    return 0.5 * (-1.0 * a * a).exp() * (1.0 / (math.sqrt(math.pi) * a) - p)


def visible_ggx(alpha, c, u, v):
    """A normal seen from the direction of cosine c in the x-z plane, and the factor of a mirror along
    it but for F G2: 1 / G1 [Heitz18]."""
    x, z = alpha * (1.0 - c * c).max(0.0).sqrt(), c
    length = (x * x + z * z).sqrt()
    x, z = x / length, z / length
    r, phi = u.sqrt(), 2 * math.pi * v
    across, along = r * phi.cos(), r * phi.sin()
    half = 0.5 + 0.5 * z
    along = (1.0 - half) * (1.0 - across * across).max(0.0).sqrt() + half * along
    up = (1.0 - across * across - along * along).max(0.0).sqrt()
    return alpha * (x * up - z * along), alpha * across, (z * up + x * along).max(1e-7)


def any_beckmann(alpha, u, v):
    """A normal with density D(m) cos(m)."""
    tan = (-alpha ** 2 * (1.0 - u.min(ALMOST_1)).log()).max(0.0).sqrt()
    phi = 2 * math.pi * v
    return tan * phi.cos(), tan * phi.sin(), 1.0


def facets(nodes, m):
    """A mirror along one normal of the distribution, another at every place, with the factor that makes
    the mean over the normals the microfacet BRDF: F G2 / G1 for visible ones, F G2 (wo.m) / (cos(wo)
    cos(m)) for ones of density D(m) cos(m). The random numbers are a hash of the place: no two
    samples meet the same place."""
    wo, ns, ng = frame(nodes)
    noise = nodes.node("TexWhiteNoise", nodes.geometry("Position"), noise_dimensions="3D")
    u, v, _ = Vector(nodes, noise.outputs["Color"]).parts()
    cos_o = wo.dot(ns)
    if m["distribution"] == "ggx":
        x, y, z = visible_ggx(m["alpha"], cos_o, u, v)
    else:
        x, y, z = any_beckmann(m["alpha"], u, v)
    t = ns.cross(wo).normalize()
    normal = (t.cross(ns) * x + t * y + ns * z).normalize()
    om = wo.dot(normal)
    wi = normal * (2.0 * om) - wo
    cos_i = wi.dot(ns)
    lo, li = smith_lambda(m, cos_o), smith_lambda(m, cos_i)
    factor = (om > 0.0) * (cos_i > 0.0) * (wi.dot(ng) > 0.0)
    factor = factor / ((1.0 + lo) * (1.0 + li) if m["separable"] else 1.0 + lo + li)
    factor = factor * (1.0 + lo if m["distribution"] == "ggx" else om / (cos_o * normal.dot(ns)))
    if m["eta"] is None:
        color = tinted(nodes, m["reflectance"], factor)
    else:
        color = nodes.combine(*(factor * fresnel_conductor(om.max(0.0), eta, k)
                                for eta, k in zip(m["eta"], m["k"])))
    return glossy(nodes, color, normal)


def microfacet(nodes, m):
    """Glossy of Blender 3.4 has the separable shadowing that the dump asks for, of 3.5 and later another: there facets are exact, but
    only light of some area finds them."""
    if m["facets"] or V >= (3, 5, 0):
        return facets(nodes, m)
    _, ns, _ = frame(nodes)
    return glossy(nodes, (*m["reflectance"], 1), ns, math.sqrt(m["alpha"]))


def diffuse(nodes, m):
    return nodes.node("BsdfDiffuse", textured(nodes, m["reflectance"], m.get("reflectance_map")),
                      0.0).outputs[0]


def plastic(nodes, m):
    surface = diffuse(nodes, m)
    for lobe, color in ((microfacet, m["specular"]), (mirror, m["mirror"])):
        if any(color):
            surface = nodes.add_shaders(surface, lobe(nodes, {**m, "reflectance": color}))
    return surface


SCATTERING = {"diffuse": diffuse, "mirror": mirror, "refraction": dielectric, "glass": dielectric,
              "microfacet": microfacet, "plastic": plastic}


def add_material(m):
    """What scatters, on both sides; emission on the geometric normal's side or on both."""
    material = bpy.data.materials.new(m["name"])
    nodes = Nodes(material)
    surface = SCATTERING[m["kind"]](nodes, m)
    if any(m["radiance"]):
        strength = 1.0 if m["both_sides"] else 1.0 - nodes.geometry("Backfacing")
        surface = nodes.add_shaders(
            surface, nodes.node("Emission", textured(nodes, m["radiance"], m.get("radiance_map")),
                                strength).outputs[0])
        if V < (3, 5, 0):
            material.cycles.sample_as_light = True
        else:
            material.cycles.emission_sampling = "FRONT_BACK"
    nodes.node("OutputMaterial", surface)
    return material
