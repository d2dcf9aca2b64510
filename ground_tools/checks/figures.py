"""Sizes and budgets as the target's compiler has them, read from the symbols of figures.cpp's object."""
import re
import subprocess

INSTANCE = re.compile(r"figure<(\d+), (\d+), (\d+)u?l?, (\d+)u?l?, (.*)>\(\)$")


def read(nm, path):
    """name -> (bytes, budget), in the order of the tables."""
    text = subprocess.run([nm, "--demangle", path], check=True, capture_output=True, text=True).stdout
    rows = []
    for line in text.splitlines():
        found = INSTANCE.search(line)
        if found:
            table, row, size, most = map(int, found.groups()[:4])
            name = "".join(chr(int(c)) for c in re.findall(r"\(char\)(\d+)", found.group(5)))
            rows.append((table, row, name, size, most))
    return {name: (size, most) for _, _, name, size, most in sorted(rows)}
