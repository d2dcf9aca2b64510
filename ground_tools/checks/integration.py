#!/usr/bin/env python3
"""What the page on integration promises of the example, against the example as built and run on one board.

usage: integration.py [TOOLS] --target NAME --needs 'NAME...' --size PROGRAM PAGE LIBRARY EXAMPLE
       integration.py --self-test

EXAMPLE is the folder with image.elf, freestanding.o, and run.log, which the image printed. Faults:
- the table under '### Symbols' names other symbols than the library may ask of its surroundings and does ask;
- freestanding.c defines other functions than those that a compiler may call;
- main.cpp holds another main loop than the one under '### In a task of an RTOS';
- a figure of the table that has a column for the board is more than 3 % off;
- the first of these boards prints other lines than the block that begins with 'frame 0', numbers within 3 % aside.
"""
import re
import subprocess
import sys

import planted
import symbols

TOLERANCE = 0.03
NUMBER = re.compile(r"-?\d+")


def section(page, title):
    """The text from a heading to the next one."""
    found = re.search(rf"^#+ {re.escape(title)}$(.*?)(?=^#+ |\Z)", page, re.MULTILINE | re.DOTALL)
    return found.group(1) if found else ""


def rows(text):
    """The cells of each line of the tables in a text."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]


def is_near(promised, measured):
    return abs(promised - measured) <= TOLERANCE * abs(measured)


def is_same_line(promised, printed):
    return NUMBER.sub("#", promised) == NUMBER.sub("#", printed) and all(
        is_near(int(a), int(b)) for a, b in zip(NUMBER.findall(promised), NUMBER.findall(printed)))


def loop_of(text):
    """From root.init to the end of the loop, without comments, blanks and the example's namespace."""
    found = re.search(r"if \(root\.init.*?for \(;;\) \{.*?\}", re.sub(r"//.*", "", text), re.DOTALL)
    return re.sub(r"\s+", "", found.group(0).replace("my::", "")) if found else None


def check_symbols(page, asked, needs):
    """`asked`: by the library of this board; `needs`: FLIGHT_NEEDS."""
    named = {name.rsplit("::", 1)[-1] for cells in rows(section(page, "Symbols"))
             for name in re.findall(r"`([\w:]+)`", cells[0])}
    expected = {*symbols.C_FUNCTIONS, *needs, *(name.rsplit("::", 1)[-1] for name in asked)}
    expected, named = ({name for name in names if not re.fullmatch(symbols.REGISTERS, name)} for names in (expected, named))
    if not needs:  # a machine of 64 bits does without the compiler's helpers
        named = {name for name in named if not name.startswith("__")}
    return [f"Symbols: {name} is missing in the table" for name in sorted(expected - named)] + \
           [f"Symbols: nothing asks for {name}" for name in sorted(named - expected)]


def figures_of(page, target):
    """The table with a column for the board: name -> figure, and whether the board is its first; None without one."""
    for table in re.findall(r"(?:^\|.*\n)+", page, re.MULTILINE):
        heads, _, *lines = rows(table)
        if target in heads:
            at = heads.index(target)
            return {cells[0].split(",")[0]: int(re.sub(r"\D", "", cells[at])) for cells in lines}, at == 1
    return None, False


def check_console(page, log):
    block = re.search(r"^```\n(frame 0.*?)^```$", page, re.MULTILINE | re.DOTALL)
    if not block:
        return ["no block begins with 'frame 0'"]
    return [f"not printed: {line}" for line in block.group(1).splitlines()
            if line != "..." and not any(is_same_line(line, printed) for printed in log.splitlines())]


def check(page, main_cpp, target, asked, needs, provided, measured, log):
    faults = check_symbols(page, asked, needs)
    if sorted(provided) != sorted(symbols.C_FUNCTIONS):
        faults.append(f"freestanding.c defines {', '.join(provided)}, not {', '.join(symbols.C_FUNCTIONS)}")
    loop = loop_of(section(page, "In a task of an RTOS"))
    if loop is None or loop != loop_of(main_cpp):
        faults.append("In a task of an RTOS: main.cpp has another loop")
    promised, is_first = figures_of(page, target)
    if promised is None:
        return [*faults, f"no table has a column {target}"]
    faults += [f"{name}: the page says {promised.get(name)}, it is {value}" for name, value in measured.items()
               if name not in promised or not is_near(promised[name], value)]
    return faults + (check_console(page, log) if is_first else [])


def text_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read().replace("\r", "")


def measure(size, example, log):
    sizes = subprocess.run([size, example + "/image.elf"], check=True, capture_output=True, text=True).stdout
    text, data, bss = map(int, sizes.splitlines()[1].split()[:3])
    found = re.search(r"cycles (\d+).*stack (\d+) bytes", log)
    if not found:
        raise SystemExit("integration: the example did not print its figures")
    return {"code and constants": text, "static memory": data + bss, "stack": int(found.group(2)), "cycles": int(found.group(1))}


def self_test():
    loop = ("  if (root.init(1) != kReady) my::safe_state();\n  for (;;) {\n    // words\n"
            "    if (root.cycle() == kIdle) my::wait_for_work();\n  }\n")
    page = ("```\nframe 0: VO status 2\n...\ncycles 200, stack 5000 bytes\n```\n### Symbols\n| symbol | from |\n|---|---|\n"
            "| `memcpy`, `memmove`, `memset`, `memcmp` | you, as `freestanding.c` has them |\n| `__udivdi3` | libgcc |\n"
            "| `cairn::hal::camera_take` | you |\n### Memory\n| figure | one | two |\n|---|---|---|\n| stack, bytes | 5 000 | 5400 |\n"
            "### In a task of an RTOS\n```cpp\nvoid task() {\n" + loop.replace("my::", "") + "}\n```\n")
    sound = {"page": page, "main_cpp": "int main() {\n" + loop + "}", "target": "one",
             "asked": ["memcpy", "cairn::hal::camera_take"], "needs": ["__udivdi3"], "provided": list(symbols.C_FUNCTIONS),
             "measured": {"stack": 5100}, "log": "frame 0: VO status 2\nframe 1\ncycles 201, stack 5100 bytes\n"}
    cases = (  # what differs, what the fault says (None: no fault)
        ({}, None),
        ({"target": "two", "measured": {"stack": 5300}, "log": ""}, None),
        ({"asked": ["memcpy", "cairn::hal::camera_take", "_restfpr_28_x", "_savegpr_14"]}, None),
        ({"asked": ["memcpy", "cairn::hal::camera_take", "cairn::hal::clock_us"]}, "clock_us is missing"),
        ({"asked": ["memcpy"]}, "nothing asks for camera_take"),
        ({"needs": []}, None),
        ({"needs": ["__muldi3"]}, "nothing asks for __udivdi3"),
        ({"page": page.replace("`memmove`, ", "")}, "memmove is missing"),
        ({"provided": ["memcpy", "memset", "memcmp"]}, "freestanding.c defines"),
        ({"main_cpp": sound["main_cpp"].replace("wait_for_work()", "wait_for_ever()")}, "another loop"),
        ({"main_cpp": ""}, "another loop"),
        ({"measured": {"stack": 5200}}, "stack: the page says 5000, it is 5200"),
        ({"measured": {"cycles": 200}}, "cycles: the page says None"),
        ({"target": "three"}, "no table has a column three"),
        ({"log": "frame 0: VO status 3\ncycles 201, stack 5100 bytes\n"}, "not printed: frame 0: VO status 2"),
        ({"log": "frame 0: VO state 2\ncycles 201, stack 5100 bytes\n"}, "not printed: frame 0: VO status 2"),
    )
    for differs, expected in cases:
        faults = check(**{**sound, **differs})
        seen = any(expected in fault for fault in faults) if expected else not faults
        assert seen, (differs, expected, faults)
    print(f"integration: self-test passed ({sum(1 for c in cases if c[1])} planted faults seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--target": None, "--needs": "", "--size": "size"})
    if rest == ["--self-test"]:
        return self_test()
    if len(rest) != 3 or not given["--target"]:
        sys.exit(__doc__)
    page, library, example = rest
    needs, log = given["--needs"].split(), text_of(example + "/run.log")
    asked = symbols.check(given["--nm"], library, needs)[2]
    provided = [name for _, name, kind, _ in symbols.read(given["--nm"], example + "/freestanding.o") if kind == "T"]
    measured = measure(given["--size"], example, log)
    faults = check(text_of(page), text_of(example + "/main.cpp"), given["--target"], asked, needs, provided, measured, log)
    print(f"integration, {given['--target']}: " + ", ".join(f"{name} {value}" for name, value in measured.items()))
    for fault in faults:
        print(f"{page}: {fault}", file=sys.stderr)
    print(f"integration: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
