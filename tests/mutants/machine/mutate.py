#!/usr/bin/python3
"""Mutants of the C files that decide a pixel: one small mistake each, made at a token.

    tests/mutants/machine/mutate.py [FILE...]        counts by file and operator
    tests/mutants/machine/mutate.py --list [FILE...] one line each: id, file, line, operator, before, after
    tests/mutants/machine/mutate.py --show ID        the changed line

A mutant's id is a hash of its file, its line's text, the line's number among equal lines, the token within it, the
operator and the replacement: it survives changes elsewhere in the file. Sources have to be formatted by clang-format:
a binary operator has a space on both sides, a unary one or a pointer's star has none behind it. Only the bodies of
functions and the initial values of tables are changed, never declarations, which other files are compiled with.
"""
import glob
import hashlib
import os
import re
import sys
from collections import Counter, defaultdict, namedtuple

FOLDERS = ("math", "image", "scene", "collada", "shading", "bvh", "transport")
MORE = ("renderer/pathtracer/output.c",)

Token = namedtuple("Token", "kind text at end line")
Mutant = namedtuple("Mutant", "id file line operator before after at end")

SCANNER = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/|^[ \t]*\#(?:\\\n|[^\n])*)
      |(?P<text>"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*')
      |(?P<number>0[xX][0-9a-fA-F]+[uUlL]*|(?:\d+\.\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?[uUlLfF]*)
      |(?P<name>[A-Za-z_]\w*)
      |(?P<sign><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%&|^~!<>=?:;,.(){}\[\]])
      |(?P<odd>.)""",
    re.X | re.S | re.M)

WORDS = {"if", "else", "for", "while", "do", "switch", "case", "default", "return", "break", "continue", "goto", "sizeof",
         "struct", "union", "enum", "static", "const", "void", "typedef", "extern", "__attribute__", "_Static_assert",
         "offsetof", "_Alignof", "volatile", "inline", "_Alignas", "__typeof__"}
ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "<<": ">>", ">>": "<<", "&": "|", "|": "&", "^": "&",
              "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "<<=": ">>=", ">>=": "<<=", "&=": "|=", "|=": "&=", "^=": "&="}
RELATIONAL = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
LOGICAL = {"&&": "||", "||": "&&"}
MEMBERS = {"x": "y", "y": "z", "z": "x", "r": "g", "g": "b", "b": "r", "u": "v", "v": "u", "lo": "hi", "hi": "lo",
           "width": "height", "height": "width", "min": "max", "max": "min"}
CALLS = {"vf_min": "vf_max", "vf_max": "vf_min", "vf_lt": "vf_le", "vf_le": "vf_lt", "fminf": "fmaxf", "fmaxf": "fminf",
         "fmin": "fmax", "fmax": "fmin", "cosf": "sinf", "sinf": "cosf", "cos": "sin", "sin": "cos", "mul_add": "mul_sub",
         "mul_sub": "mul_add", "ceilf": "floorf", "floorf": "ceilf", "ceil": "floor", "floor": "ceil"}
# What decides no pixel: messages, and memory and files given back.
IDLE = re.compile(r"(err_\w*|v?f?printf|perror|free|\w+_free|fclose|unlink|remove|element_fail\w*)$")
# Calls whose arguments may stand in either order.
EITHER = re.compile(r"((vf|vi|rgb|d3)_)?(min|max|eq|add|dot|mul)[vf]?$|v(min|max)$|f(min|max)f?$|_mm\w*_mul_epu32$")
SETS = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="}
OPENING, CLOSING = {"(": ")", "[": "]", "{": "}"}, {")", "]", "}"}


def files():
    found = [f for d in FOLDERS for f in glob.glob("renderer/%s/*.[ch]" % d)]
    return sorted(found) + list(MORE)


def scan(source):
    tokens, at, line = [], 0, 1
    while at < len(source):
        m = SCANNER.match(source, at)
        if m.lastgroup != "skip":
            tokens.append(Token(m.lastgroup, m.group(), at, m.end(), line))
        line += source.count("\n", at, m.end())
        at = m.end()
    return tokens


def partners(tokens):
    """For each bracket's index that of its partner."""
    pair, stack = {}, []
    for i, t in enumerate(tokens):
        if t.kind == "sign" and t.text in OPENING:
            stack.append(i)
        elif t.kind == "sign" and t.text in CLOSING and stack:
            j = stack.pop()
            pair[i], pair[j] = j, i
    return pair


def changeable(tokens, pair, header):
    """True for each token in a function's body or, in a .c file, in the initial value of a table."""
    inside = [False] * len(tokens)
    i = 0
    while i < len(tokens):
        if tokens[i].text == "{" and i in pair:
            before = tokens[i - 1].text if i > 0 else ""
            if before == ")" or (before == "=" and not header):
                for j in range(i, pair[i] + 1):
                    inside[j] = True
            i = pair[i]
        i += 1
    # Types that a function declares for itself, and attributes.
    for i, t in enumerate(tokens):
        if t.text in ("struct", "union", "enum"):
            j = i + 1
            while j < len(tokens) and tokens[j].kind == "name":
                j += 1
            if j < len(tokens) and tokens[j].text == "{" and j in pair:
                for k in range(i, pair[j] + 1):
                    inside[k] = False
        elif (t.kind == "name" and t.text not in WORDS and i + 1 < len(tokens) and tokens[i + 1].text == "[" and i + 1 in pair and i > 0
              and (tokens[i - 1].kind == "name" and tokens[i - 1].text not in ("return", "case", "else")
                   or tokens[i - 1].text == "*" and tokens[i - 1].end == t.at and tokens[i - 2].kind == "name")):
            j = i + 1  # the sizes of an array that is declared
            while j in pair and tokens[j].text == "[":
                for k in range(j, pair[j] + 1):
                    inside[k] = False
                j = pair[j] + 1
        elif (t.text in ("__attribute__", "sizeof", "_Static_assert", "_Alignas", "__builtin_expect") or IDLE.match(t.text)) and i + 1 in pair:
            for k in range(i, pair[i + 1] + 1):
                inside[k] = False
    return inside


def within(tokens, pair):
    """The bracket around each token, as the index of its opening."""
    around, stack = [], [-1]
    for i, t in enumerate(tokens):
        if i in pair and pair[i] < i:
            stack.pop()
        around.append(stack[-1])
        if i in pair and pair[i] > i:
            stack.append(i)
    return around


def raise_number(text):
    """What a wrong constant looks like: whole numbers one more and one less, others a tenth more and half; 0 and 1 for each other."""
    body = re.sub(r"[uUlLfF]+$", "", text) if not text.lower().startswith("0x") else re.sub(r"[uUlL]+$", "", text)
    tail = text[len(body):]
    if text.lower().startswith("0x"):
        return ["0x%X%s" % (int(body, 16) ^ 1, tail)]
    if "." in body or "e" in body.lower():
        value = float(body)
        values = [1.0] if value == 0 else [value * 1.1, value / 2]
        return [repr(v) + tail for v in values]
    if "f" in tail.lower():
        return [text]
    value = int(body, 8) if body.startswith("0") and len(body) > 1 else int(body)
    return ["%d%s" % (v, tail) for v in ([1] if value == 0 else [value + 1, value - 1])]


def arguments(tokens, pair, i):
    """First and last token of each argument of the call whose opening bracket is token i."""
    parts, start, j = [], i + 1, i + 1
    while j < pair[i]:
        if tokens[j].text == "," and tokens[j].kind == "sign":
            parts.append((start, j - 1))
            start = j + 1
        j = pair[j] + 1 if tokens[j].text in OPENING and j in pair else j + 1
    if start < pair[i]:
        parts.append((start, pair[i] - 1))
    return [p for p in parts if p[0] <= p[1]]


def condition_start(tokens, pair, i):
    """First token of the condition before the question mark i."""
    j = i - 1
    while j >= 0:
        t = tokens[j]
        if t.text in CLOSING and j in pair:
            j = pair[j] - 1
            continue
        if t.text in OPENING or t.text in SETS or t.text in (",", ";", "?", ":", "return"):
            break
        j -= 1
    return j + 1


def proposals(source, tokens, pair, inside):
    """(operator, first token, last token, replacement)"""

    def text(a, b):
        return source[tokens[a].at:tokens[b].end]

    around = within(tokens, pair)

    for i, t in enumerate(tokens):
        if not inside[i] or i == 0 or i + 1 >= len(tokens):
            continue
        before, after = tokens[i - 1], tokens[i + 1]
        binary = (t.kind == "sign" and before.end < t.at and t.end < after.at and before.text not in WORDS
                  and (before.kind in ("name", "number") or before.text in (")", "]")))
        if binary and t.text in ARITHMETIC:
            yield "arithmetic", i, i, ARITHMETIC[t.text]
        if binary and t.text in RELATIONAL:
            yield "relational", i, i, RELATIONAL[t.text]
        if binary and t.text in LOGICAL:
            yield "logical", i, i, LOGICAL[t.text]
        if t.text in ("-", "!", "~") and t.kind == "sign" and t.end == after.at and not binary:
            yield "unary", i, i, ""
        if t.kind == "number":
            for n in raise_number(t.text):
                if n != t.text:
                    yield "constant", i, i, n
        if t.text in ("if", "while") and after.text == "(" and i + 1 in pair:
            a, b = i + 2, pair[i + 1] - 1
            yield "negated", a, b, "!(" + text(a, b) + ")"
        if t.text == "?" and t.kind == "sign":
            a = condition_start(tokens, pair, i)
            if a < i and inside[a]:
                yield "negated", a, i - 1, "!(" + text(a, i - 1) + ")"
        if t.kind == "name" and before.text in (".", "->") and t.text in MEMBERS and after.text != "(":
            yield "axis", i, i, MEMBERS[t.text]
        if t.kind == "name" and after.text == "(" and t.text in CALLS:
            yield "call", i, i, CALLS[t.text]
        if (t.kind == "name" and after.text == "(" and i + 1 in pair and t.text not in WORDS
                and not EITHER.match(t.text) and before.text not in ("struct", "union", "enum")
                and (before.kind != "name" or before.text in ("return", "else", "case"))):
            args = arguments(tokens, pair, i + 1)
            for p, q in zip(args, args[1:]):
                if text(*p) != text(*q) and not (t.text in ("mul_add", "mul_sub") and p == args[0]):
                    yield "swapped", p[0], q[1], text(*q) + source[tokens[p[1]].end:tokens[q[0]].at] + text(*p)
        starts = before.text in (";", "{", "}", "else", "do") or (
            before.text == ")" and i - 1 in pair and tokens[pair[i - 1] - 1].text in ("if", "for", "while", "switch"))
        starts = starts and tokens[around[i]].text == "{"
        if starts and t.text not in WORDS and (t.kind == "name" or t.text in ("*", "++", "--")) or starts and t.text in ("break", "continue"):
            j = i
            while j < len(tokens) and tokens[j].text != ";":
                if tokens[j].text == "{" or j > i and tokens[j].text in ("}", ")"):
                    break
                j = pair[j] + 1 if tokens[j].text in OPENING and j in pair else j + 1
            ends = j < len(tokens) and tokens[j].text == ";"
            declares = t.kind == "name" and t.text not in ("break", "continue") and (
                after.kind == "name" or after.text == "*" and after.end == tokens[i + 2].at)
            if ends and not declares and before.text != "else" or ends and before.text == "else":
                yield "dropped", i, j, ";" + "\n" * source.count("\n", t.at, tokens[j].at)


def mutants_of(file, source=None):
    """In the order of the file; each is another text."""
    if source is None:
        with open(file) as f:
            source = f.read()
    tokens = scan(source)
    pair = partners(tokens)
    inside = changeable(tokens, pair, file.endswith(".h"))
    lines = source.split("\n")
    first = {}  # of each line: its first token
    for i, t in enumerate(tokens):
        first.setdefault(t.line, i)
    seen, nth = Counter(), {}
    for n, l in enumerate(lines, 1):
        key = l.strip()
        seen[key] += 1
        nth[n] = seen[key]
    found, texts = [], set()
    for operator, a, b, new in proposals(source, tokens, pair, inside):
        at, end, line = tokens[a].at, tokens[b].end, tokens[a].line
        old = source[at:end]
        if old == new or (at, end, new) in texts:
            continue
        texts.add((at, end, new))
        key = "\0".join([file, lines[line - 1].strip(), str(nth[line]), str(a - first[line]), operator, new])
        found.append(Mutant(hashlib.sha256(key.encode()).hexdigest()[:12], file, line, operator, old, new, at, end))
    return found


def all_mutants(names=None):
    return [m for f in names or files() for m in mutants_of(f)]


def apply(m, source):
    return source[:m.at] + m.after + source[m.end:]


def sample(mutants, number):
    """Sample 1 or 2 of all mutants: a hash puts each into one or the other. Ordered so that every beginning holds the
    same share of each file, to within one mutant; the order within a file is random."""
    def hashed(what, m):
        return hashlib.sha256((what + m.id).encode()).hexdigest()

    by_file = defaultdict(list)
    for m in mutants:
        if int(hashed("sample ", m), 16) % 2 + 1 == number:
            by_file[m.file].append(m)
    order = []
    for file, ms in by_file.items():
        start = int(hashlib.sha256(("start %d " % number + file).encode()).hexdigest(), 16) / 2.0**256
        for rank, m in enumerate(sorted(ms, key=lambda m: hashed("order ", m))):
            order.append(((rank + start) / len(ms), m.id, m))
    return [m for _, _, m in sorted(order)]


def one_line(text):
    return re.sub(r"\s+", " ", text)


def main(argv):
    names = [a for a in argv if not a.startswith("--")]
    if argv[:1] == ["--show"]:
        for m in all_mutants():
            if m.id in names:
                with open(m.file) as f:
                    new = apply(m, f.read())
                print("%s:%d: %s" % (m.file, m.line, m.operator))
                print("- %s\n+ %s" % (one_line(m.before), one_line(m.after)))
                print(new.split("\n")[m.line - 1].strip())
        return
    ms = all_mutants(names or None)
    if argv[:1] == ["--list"]:
        for m in ms:
            print("\t".join([m.id, m.file, str(m.line), m.operator, one_line(m.before), one_line(m.after)]))
        return
    by_file = defaultdict(Counter)
    for m in ms:
        by_file[m.file][m.operator] += 1
    for f, c in by_file.items():
        print("%5d %s  %s" % (sum(c.values()), f, ", ".join("%s %d" % x for x in sorted(c.items()))))
    print(len(ms))


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except BrokenPipeError:
        os._exit(0)
