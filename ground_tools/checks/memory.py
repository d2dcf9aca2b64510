#!/usr/bin/env python3
"""Static memory, and code and constants, of the flight library by module, from the linker's map, against mission_cfg.

usage: memory.py [TOOLS] --figures FIGURES.o [--image IMAGE.map] LIBRARY.map SOURCE...
       memory.py [TOOLS] [--link COMMAND] --self-test

LIBRARY.map is of a link that takes the whole of libcairn.a: no image of flight code is larger. IMAGE.map is of an image,
shown beside it. Writable memory that is not the one static root is a fault, and so is a part of the root, the root,
or code and constants over their budgets. SOURCE... says which module an object of the library belongs to.
"""
import os
import re
import subprocess
import sys

import figures
import planted

KINDS = (  # sections that stand in the image; all else (debugging, notes) does not
    ("code", re.compile(r"\.(text|init|fini|plt)\b")),
    ("constants", re.compile(r"\.(rodata|data\.rel\.ro|eh_frame|gcc_except_table|init_array|fini_array|ctors|dtors|sdata2|got|got2)\b")),
    ("initialised", re.compile(r"\.(data|sdata|tdata)\b")),
    ("zeroed", re.compile(r"\.(bss|sbss|tbss)\b|COMMON$")),
)
ROOT = re.compile(r"\.bss\._ZN5cairn3app4rootE$")
ROOT_PART = "root, all static memory"

PLACE = r"\s+0x[0-9a-f]+\s+0x([0-9a-f]+)\s+(\S.*)"
WHOLE = re.compile(r" (\.\S+|COMMON)" + PLACE)
NAME = re.compile(r" (\.\S+|COMMON)$")  # a long name: the rest is on the next line
REST = re.compile(PLACE)
MEMBER = re.compile(r"(.*)\((.*)\)$")


def kind_of(section):
    return next((kind for kind, pattern in KINDS if pattern.match(section)), None)


def pieces(path):
    """(section, bytes, archive or None, object) of each input section that the link kept."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().partition("Linker script and memory map")[2].splitlines()
    name, kept = None, False
    for line in lines:
        if line and line[0] not in " *":
            kept = not line.startswith("/DISCARD/")
        found, rest = WHOLE.match(line), REST.match(line) if name else None
        section = found.group(1) if found else name
        size, origin = found.groups()[1:] if found else rest.groups() if rest else (None, None)
        if size and kept and int(size, 16):
            member = MEMBER.match(origin)
            yield section, int(size, 16), *(member.groups() if member else (None, origin))
        short = NAME.match(line)
        name = short.group(1) if short else None


def modules_of(sources):
    """object name -> module."""
    modules = {}
    for source in sources:
        name = os.path.splitext(os.path.basename(source))[0] + ".o"
        if name in modules:
            raise SystemExit(f"memory: two sources named {name[:-2]}: the archive's members cannot be told apart")
        modules[name] = "(platform)" if source.startswith("platform/") else os.path.basename(os.path.dirname(source))
    return modules


def place_of(archive, member, modules):
    """The row of the table that a piece belongs to, and whether it is flight code."""
    base = os.path.basename(archive or "")
    if base.startswith("libcairn"):
        return modules.get(member, f"? {member}"), True
    if base in ("libc.a", "libm.a", "libgcc.a", "libstdc++.a"):
        return "C library and compiler", False
    return "platform and program", False


def sums(path, modules):
    """row -> kind -> bytes, the flight rows, faults, and the bytes of the root."""
    rows, flight, faults, root = {}, set(), set(), 0
    for section, size, archive, member in pieces(path):
        kind = kind_of(section)
        if kind is None:
            continue
        place, is_flight = place_of(archive, member, modules)
        row = rows.setdefault(place, dict.fromkeys((k for k, _ in KINDS), 0))
        row[kind] += size
        if not is_flight:
            continue
        flight.add(place)
        if place.startswith("?"):
            faults.add(f"{member}: no source of flight code has it")
        if kind in ("initialised", "zeroed"):
            if ROOT.match(section):
                root += size
            else:
                faults.add(f"{member}: {size} bytes of writable memory in {section}: only the root has any")
    return rows, flight, faults, root


def of_library(rows, flight):
    return sum(rows[place]["code"] + rows[place]["constants"] for place in flight)


def table(rows, flight, image):
    columns = [k for k, _ in KINDS]
    lines = [f"  {'bytes':<24}" + "".join(f"{c:>12}" for c in columns) + ("   in the image:" + "".join(f"{c:>12}" for c in columns) if image else "")]

    def line(title, row, beside):
        text = f"  {title:<24}" + ("".join(f"{row[c]:>12}" for c in columns) if row else " " * 12 * len(columns))
        return text + (" " * 16 + "".join(f"{beside[c]:>12}" for c in columns) if beside else "")

    def total(of, places):
        return {c: sum(of[p][c] for p in places) for c in columns}

    for place in sorted(flight):
        lines.append(line(place, rows[place], image.get(place)))
    lines.append(line("flight, in all", total(rows, flight), total(image, flight & set(image)) if image else None))
    lines += [line(place, None, image[place]) for place in sorted(set(image) - flight)]
    return lines


def check(library, image, budget, sources):
    """Faults, and the lines of the report."""
    modules = modules_of(sources)
    rows, flight, faults, root = sums(library, modules)
    faults = sorted(faults)
    beside = {}
    if image:
        beside, _, image_faults, image_root = sums(image, modules)
        faults += sorted(f"{image}: {fault}" for fault in image_faults)
        if image_root != root:
            faults.append(f"{image}: the root has {image_root} bytes there")
    if not flight:
        return [*faults, f"{library}: nothing of libcairn.a"], []
    if root != budget[ROOT_PART][0]:
        faults.append(f"{library}: the root has {root} bytes, the compiler says {budget[ROOT_PART][0]}")
    for part, (size, most) in budget.items():
        if size > most:
            faults.append(f"{part.strip()}: {size} bytes, more than {most}")
    size, most = of_library(rows, flight), budget["code and constants"][1]
    if size > most:
        largest = max(sorted(flight), key=lambda p: rows[p]["code"] + rows[p]["constants"])
        faults.append(f"code and constants: {size} bytes, more than {most}; the largest module is {largest}")
    lines = table(rows, flight, beside)
    lines += [f"  {part:<32}{size:>10} of {most:>9}" for part, (size, most) in budget.items() if size]
    lines.append(f"  {'code and constants':<32}{size:>10} of {most:>9}")
    return faults, lines


def self_test(given):
    ample = {ROOT_PART: (4, 8), "  a part": (2, 2), "code and constants": (0, 4096)}
    root = "namespace cairn { namespace app { struct Root { int a; } root; } int get() { return app::root.a; } } "
    table_of = "extern const int kTable[3000]; const int kTable[3000] = {1, 2, 3}; "
    cases = (  # source, budget, what the fault names (None: no fault)
        (root, ample, None),
        (root + "extern const int kTable[3]; const int kTable[3] = {1, 2, 3};", ample, None),
        (root + "int counter; int next() { return ++counter; }", ample, "planted.o: 4 bytes of writable memory in .bss.counter"),
        (root + "char rows[500] = {1}; char* row() { return rows; }", ample, "planted.o: 500 bytes of writable memory in .data.rows"),
        (root + "int next() { static int n = 3; return ++n; }", ample, "planted.o: 4 bytes of writable memory in .data"),
        (root, {**ample, "  a part": (3, 2)}, "a part: 3 bytes, more than 2"),
        (root, {**ample, ROOT_PART: (4, 3)}, "root, all static memory: 4 bytes, more than 3"),
        (root.replace("int a;", "int a, b;"), ample, "the root has 8 bytes, the compiler says 4"),
        (root + table_of, ample, "code and constants: 12"),
    )
    with planted.Workshop(given["--cxx"], given["--ar"]) as workshop:
        def link(source):
            library, out = workshop.library("cairn", source), workshop.path("cairn.map")
            subprocess.run([*given["--link"].split(), "-nostdlib", "-r", "-Wl,--whole-archive", library,
                            f"-Wl,-Map={out}", "-o", workshop.path("cairn.o")], check=True)
            return out

        for source, budget, expected in cases:
            faults, _ = check(link(source), None, budget, ("fsw/app/planted.cpp", "fsw/core/clean.cpp"))
            seen = any(expected in fault for fault in faults) if expected else not faults
            assert seen, (source, expected, faults)
        assert "planted.o: no source" in check(link(root), None, ample, ("fsw/core/clean.cpp",))[0][0]
        # The budgets themselves, as they come out of an object.
        text = ("struct A; namespace cairn { template <int t, int r, unsigned long b, unsigned long m, char... n> void figure() {} "
                "void all() { figure<0, 1, 5, 6, 'b'>(); figure<0, 0, 70000, 80000, ' ', 'a'>(); } }")
        read = figures.read(given["--nm"], workshop.compile("figures", text, ("-O0",)))
        assert list(read.items()) == [(" a", (70000, 80000)), ("b", (5, 6))], read
    print(f"memory: self-test passed ({sum(1 for c in cases if c[2]) + 1} planted faults seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--figures": None, "--image": None, "--link": "g++"})
    if rest == ["--self-test"]:
        return self_test(given)
    if len(rest) < 2 or not given["--figures"]:
        sys.exit(__doc__)
    faults, lines = check(rest[0], given["--image"], figures.read(given["--nm"], given["--figures"]), rest[1:])
    print("\n".join(["memory:", *lines]))
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"memory: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
