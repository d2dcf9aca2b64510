#!/usr/bin/env python3
"""Pages of the ground tools (.js, .css, .html beside the C++ that fills them), as a browser gets them.

usage: pages.py FILE...
       pages.py --self-test

Scripts are as clang-format has them, and without faults that eslint sees (.eslintrc.json). The palette is page.css's alone,
so that a thing has one colour on all pages: no other file names a colour by six digits, or a variable that page.css does
not have. Lines have COLUMNS at most.
"""
import os
import re
import subprocess
import sys
import tempfile

COLUMNS = 120
PALETTE = "page.css"
ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
DEFINED = re.compile(r"^\s*--([\w-]+):", re.MULTILINE)
USED = re.compile(r"var\(--([\w-]+)(?=\))")  # a name that a script puts together ends otherwise
# Where Debian's node looks; another one must be told.
NODE = {**os.environ, "NODE_PATH": "/usr/share/nodejs:/usr/lib/nodejs"}


def run(command, **more):
    """What a tool says, where it is not content."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    return [] if done.returncode == 0 else (done.stdout + done.stderr).splitlines()


def lint(scripts, folder):
    rules = os.path.join(ROOT, ".eslintrc.json")
    said = run(["eslint", "--no-eslintrc", "-c", rules, "-f", "unix", *scripts], cwd=folder, env=NODE)
    return [line for line in said if line.strip() and not re.fullmatch(r"\d+ problems?", line)]


def check(paths, folder="."):
    """Faults of the files, named from the folder on."""
    text = {}
    for path in paths:
        with open(os.path.join(folder, path), encoding="utf-8") as file:
            text[path] = file.read()
    scripts = [path for path in paths if path.endswith(".js")]
    faults = lint(scripts, folder)
    style = "file:" + os.path.join(ROOT, ".clang-format")
    faults += [line for line in run(["clang-format", "--dry-run", "-Werror", "--style=" + style, *scripts], cwd=folder)
               if "error:" in line]
    known = {name for path in paths if path.endswith(PALETTE) for name in DEFINED.findall(text[path])}
    for path in paths:
        for number, line in enumerate(text[path].splitlines(), 1):
            if len(line) > COLUMNS:
                faults.append(f"{path}:{number}: beyond column {COLUMNS}")
            if not path.endswith(PALETTE) and COLOUR.search(line):
                faults.append(f"{path}:{number}: colour {COLOUR.search(line).group()} outside {PALETTE}")
            faults += [f"{path}:{number}: {PALETTE} has no --{name}" for name in USED.findall(line) if name not in known]
    return faults


def self_test():
    palette = ":root { color: black; }\n:root {\n  --vo: #D55E00;\n}\n"
    script = "'use strict';\n\n/* exported sum */\nconst sum = (a, b) => a + b;\n"
    cases = (  # file, its text, what the fault says (None: no fault)
        ("a.js", script, None),
        ("a.css", "p { color: var(--vo); }\n", None),
        ("a.js", script + "/* exported style */\nconst style = (name) => `color:var(--${name})`;\n", None),
        ("a.js", script.replace("a + b", "a + c"), "'c' is not defined"),
        ("a.js", script.replace("/* exported sum */\n", ""), "'sum' is assigned a value but never used"),
        ("a.js", script.replace("const", "var"), "Unexpected var"),
        ("a.js", script.replace("'use strict';\n", ""), "Use the global form of 'use strict'"),
        ("a.js", script.replace("a + b", "a == b"), "Expected '==='"),
        ("a.js", script.replace("a + b;", "a +;"), "Parsing error"),
        ("a.js", script.replace("a + b", "a+b"), "code should be clang-formatted"),
        ("a.js", script.replace("a + b", "'" + 120 * "x" + "'"), "beyond column"),
        ("a.js", script.replace("a + b", "'#d55e00'"), "colour #d55e00 outside"),
        ("a.css", "p { color: #D55E00; }\n", "colour #D55E00 outside"),
        ("a.css", "p { color: var(--vi); }\n", "page.css has no --vi"),
        ("a.html", "<p>" + 120 * "x" + "</p>\n", "beyond column"),
    )
    for name, text, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            for path, content in ((PALETTE, palette), (name, text), ("b.js", script)):
                with open(os.path.join(folder, path), "w", encoding="utf-8") as file:
                    file.write(content)
            faults = check([PALETTE, name, "b.js"], folder)
            seen = any(expected in fault and name in fault for fault in faults) if expected else not faults
            assert seen, (text, expected, faults)
    print(f"pages: self-test passed ({sum(1 for c in cases if c[2])} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults = check(arguments)
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"pages: {len(arguments)} files, {len(faults)} faults")
    return 1 if faults or not arguments else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
