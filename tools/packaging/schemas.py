#!/usr/bin/env python3
"""schemas.py PAGE: the JSON Schema of what a page of tools/docs/formats describes, from the page's own tables, to standard output.

The page is what people read and change; a type that is not in TYPES is an error here, so that a new one gets its meaning. What
programs write has exactly the keys of the page (tests/end_to_end/docs.sh), and is valid by these schemas.
"""

import json
import re
import sys

VERDICTS = ["EQUIVALENT", "DIFFERENT", "NO DIFFERENCE FOUND", "INCONCLUSIVE"]
NUMBER, TEXT = {"type": "number"}, {"type": "string"}
PAIR = {"type": "array", "items": {"type": ["number", "null"]}, "minItems": 2, "maxItems": 2}
TYPES = {
    "text": TEXT, "file": TEXT, "number": NUMBER, "boolean": {"type": "boolean"}, "array": {"type": "array"}, "object": {"type": "object"},
    "verdict": {"enum": VERDICTS}, "verdict or MEASURED": {"enum": VERDICTS + ["MEASURED"]}, ", ".join(VERDICTS): {"enum": VERDICTS},
    "relative": NUMBER, "relative RMS": NUMBER, "radiance": NUMBER, "relative, squared": NUMBER, "ratio": NUMBER, "probability": {"type": "number", "minimum": 0, "maximum": 1},
    "0 to 1": {"type": "number", "minimum": 0, "maximum": 1},
    "s": {"type": "number", "minimum": 0}, "CPU s": {"type": "number", "minimum": 0}, "1/s": {"type": "number", "minimum": 0},
    "pixels": {"type": "integer", "minimum": 0}, "points": {"type": "number", "minimum": 0},
    "two numbers, relative": {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2},
    "three numbers": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
    "a number for each tile": {"type": "array", "items": {"type": ["number", "null"]}},
    "array of texts": {"type": "array", "items": TEXT},
    "1": {"const": 1}, "1 or 2": {"enum": [1, 2]},
    "pixels [x, y]": {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2},
    "SHA-256": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
}
WITHOUT_UNIT = {"text", "file", "array of texts", "number", "boolean", "array", "object", "verdict", "1", "1 or 2"}
INTERVAL = re.compile(r"(^|_)(ci|range)$")


def schema_of(key, kind, meaning):
    """The schema of one key, whose type is given in words."""
    may_be_null = kind.endswith(" or null") or re.search(r"\bnull\b", meaning) is not None
    kind = kind.removesuffix(" or null")
    if kind.startswith(("object", "array of `")):
        kind_schema = TYPES[kind.split()[0].rstrip(":")]
    elif re.fullmatch(r"(`[^`]+`(, )?)+", kind):
        kind_schema = {"enum": re.findall(r"`([^`]+)`", kind)}
    elif INTERVAL.search(key) and kind in ("relative", "relative, squared", "ratio", "number", "s, 1/s", "1/s"):
        kind_schema = PAIR
    elif kind in TYPES:
        kind_schema = TYPES[kind]
    elif found := re.fullmatch(r"whole number (\d+) to (\d+)", kind):
        kind_schema = {"type": "integer", "minimum": int(found[1]), "maximum": int(found[2])}
    elif found := re.fullmatch(r"number above (\d+) below (\d+)", kind):
        kind_schema = {"type": "number", "exclusiveMinimum": int(found[1]), "exclusiveMaximum": int(found[2])}
    else:
        sys.exit(f"schemas.py: type '{kind}' of '{key}' is not known")
    if may_be_null:
        kind_schema = {"anyOf": [kind_schema, {"type": "null"}]}
    unit = "" if kind in WITHOUT_UNIT or kind.startswith(("`", "object", "array", "whole number", "number above")) else f"[{kind}] "
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", meaning).replace("`", "")
    return dict(kind_schema, description=(unit + text).strip()) if unit + text else dict(kind_schema)


def tables(page):
    """(heading, header, rows) of each table."""
    heading, rows, header = "", [], None
    for line in open(page, encoding="utf-8"):
        if line.startswith("#") or re.match(r"\S.*:$", line):
            heading = line.strip("#: \n")
        cells = [c.strip() for c in re.split(r"(?<!\\)\|", line.strip())[1:-1]] if line.startswith("|") else []
        if cells and header is None:
            header = cells
        elif cells and not set(cells[0]) <= {"-"}:
            rows.append(cells)
        elif not cells and header is not None:
            yield heading, header, rows
            rows, header = [], None


def properties(header, rows):
    """{key: schema}, and a list of the required keys."""
    out, needed = {}, []
    for row in rows:
        keys, cell = re.findall(r"`([^`]+)`", row[0]), dict(zip(header, row))
        kinds = [cell["type"]] * len(keys)
        parts = cell["type"].split(", ")
        if len(keys) > 1 and len(parts) == len(keys) and cell["type"] not in TYPES and "`" not in cell["type"]:
            kinds = parts
        for key, kind in zip(keys, kinds):
            out[key] = schema_of(key, kind, cell["meaning"])
            if cell.get("needed", "").startswith("yes") or cell.get("default") == "needed":
                needed.append(key)
    return out, needed


def results(page):
    root, claim, rows_of = {}, {}, {"Consistency": {}, "Noise": {}}
    root_needed, claim_needed = [], []
    for heading, header, rows in tables(page):
        if "type" not in header and header[1:2] == ["in"]:
            for row in rows:
                if row[1] == "claim":
                    claim.update({k: {"description": row[2]} for k in re.findall(r"`([^`]+)`", row[0])})
            continue
        if "type" not in header or heading not in {"The whole", "A claim", *rows_of}:
            continue
        found, needed = properties(header, rows)
        if heading == "The whole":
            for key, value in found.items():
                text = value.get("description", "")
                (claim if text.startswith(("of a claim", "of --same-program", "of --exchangeable")) else root)[key] = value
            root_needed += needed
        elif heading == "A claim":
            claim.update(found)
            claim_needed += needed
        elif heading in rows_of:
            rows_of[heading].update(found)
    judged = ["scene", "a", "b", "expected", "passed"]
    for heading, rows in rows_of.items():
        root[heading.lower()]["items"] = {"type": "object", "properties": rows}
    root["claims"]["items"] = {
        "type": "object", "properties": claim, "additionalProperties": False,
        "if": {"required": ["error"]}, "then": {"required": judged}, "else": {"required": claim_needed},
    }
    return root, root_needed


def grades(page):
    parts = {"grade.json": {}, "A check": {}, "An image": {}}
    for heading, header, rows in tables(page):
        if heading in parts and "type" in header:
            rows = [r for r in rows if not r[1].startswith("in `")]
            parts[heading].update(properties(header, rows)[0])
    root = parts["grade.json"]
    for name, key in (("A check", "checks"), ("An image", "pictures")):
        root[key]["items"] = {"type": "object", "properties": parts[name]}
    return root, [k for k in root if k in ("assay_grade", "id", "state", "points", "of", "parts", "checks", "pictures")]


def suite(page):
    parts = {}
    for heading, header, rows in tables(page):
        if "type" in header:
            parts[heading.split(",")[0]] = properties(header, rows)
    (root, needed), (scene, scene_needed), (reference, _) = (parts[k] for k in ("The suite", "A scene", "A reference"))
    root["references"], scene["references"] = {"type": "object"}, {"type": "object"}
    name, closed = {"pattern": "^[A-Za-z0-9_-][A-Za-z0-9_.-]*$", "maxLength": 63}, {"type": "object", "additionalProperties": False}
    reference = dict(closed, properties=reference)
    root["references"] |= {"propertyNames": dict(name, maxLength=31), "additionalProperties": {"$ref": "#/$defs/reference"}}
    scene["references"] |= {"propertyNames": dict(name, maxLength=31),
                            "additionalProperties": {"anyOf": [{"$ref": "#/$defs/reference"}, {"type": "null"}]}}
    root["scenes"] |= {"propertyNames": name, "minProperties": 1, "additionalProperties": {"$ref": "#/$defs/scene"}}
    return root, needed, {"scene": dict(closed, properties=scene, required=scene_needed), "reference": reference}


def main():
    page = sys.argv[1]
    name = re.search(r"(\w+)\.md$", page)[1]
    root, needed, *defs = {"results": results, "grades": grades, "suite": suite}[name](page)
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": {"results": "results.json", "grades": "grade.json", "suite": "suite.json"}[name] + " of assay",
        "description": f"Made by tools/packaging/schemas.py from tools/docs/formats/{name}.md. Units are in brackets.",
        "type": "object", "properties": root, "required": needed,
    }
    if name != "grades":
        schema["additionalProperties"] = False
    if defs:
        schema["$defs"] = defs[0]
    print(json.dumps(schema, indent=1, ensure_ascii=False))


main()
