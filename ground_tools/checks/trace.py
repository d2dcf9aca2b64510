#!/usr/bin/env python3
"""Traceability: every requirement has a source and a test; sources are there, tests exist and run.

usage: trace.py [ROOT]       reads ROOT/doc/requirements.csv (columns id, requirement, source, tests)
       trace.py --self-test

`source` holds sections of the paper (`METHOD B.2`) and pages of doc/, with a heading where one is meant (`DESIGN.md#memory`),
separated by `; `. `tests` holds names `unit_tests/<module>/test_<file>.cpp:test_<function>`, or `check-<name>` for one of `make check` that has
violations planted for it, separated by blanks.
"""
import csv
import os
import re
import sys
import tempfile

import prose

COLUMNS = ["id", "requirement", "source", "tests"]
PAPER = re.compile(r"METHOD (A|B\.1|B\.2|C|IV)")


def check_fault(root, name):
    """What is wrong with `check-<name>`: it must be a script here with a self-test, and one that `make check` runs."""
    script = os.path.join("ground_tools", "checks", name + ".py")
    if not os.path.isfile(os.path.join(root, script)):
        return f"no {script}"
    with open(os.path.join(root, script), encoding="utf-8") as file:
        if "--self-test" not in file.read():
            return f"{script} has no --self-test"
    with open(os.path.join(root, "Makefile"), encoding="utf-8") as file:
        lists = re.findall(r"^(?:PROOFS|OF_TEXT)\s*:=(.*)$", file.read(), re.MULTILINE)
    if name not in " ".join(lists).split():
        return f"{script} is not among PROOFS or OF_TEXT of the Makefile: it never runs"
    return None


def source_fault(root, source):
    if PAPER.fullmatch(source):
        return None
    path, _, heading = source.partition("#")
    page = os.path.join(root, "doc", path)
    if not re.fullmatch(r"[\w/-]+\.md", path):
        return f"'{source}' is neither a section of the paper nor a page of doc/"
    if not os.path.isfile(page):
        return f"no page doc/{path}"
    with open(page, encoding="utf-8") as file:
        if heading and heading not in prose.anchors(file.read()):
            return f"no heading '{heading}' in doc/{path}"
    return None


def test_fault(root, name):
    if name.startswith("check-"):
        return check_fault(root, name[len("check-"):])
    path, _, function = name.partition(":")
    full = os.path.join(root, path)
    if not path.startswith("unit_tests/") or not function:
        return f"'{name}' is not unit_tests/...cpp:test_function"
    if not os.path.isfile(full):
        return f"no file {path}"
    with open(full, encoding="utf-8") as file:
        text = file.read()
    if not re.search(rf"\bvoid {re.escape(function)}\(", text):
        return f"no function {function} in {path}"
    if not re.search(rf"\bcmocka_unit_test\w*\(\s*{re.escape(function)}\b", text):
        return f"{function} of {path} is not among its cmocka_unit_test entries: it never runs"
    return None


def check(root):
    table = os.path.join(root, "doc", "requirements.csv")
    if not os.path.isfile(table):
        return [f"{table}: no such file"], 0, 0
    faults, seen, tests = [], set(), 0
    with open(table, encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != COLUMNS:
            return [f"{table}: its first line must be {','.join(COLUMNS)}"], 0, 0
        for row in reader:
            where = f"{table}:{reader.line_num}: {row['id']}"
            if None in row or None in row.values():
                faults.append(f"{where}: not {len(COLUMNS)} columns")
                continue
            if not row["id"] or row["id"] in seen:
                faults.append(f"{where}: an id that is empty or taken")
            seen.add(row["id"])
            for column in ("requirement", "source"):
                if not row[column].strip():
                    faults.append(f"{where}: no {column}")
            sources = row["source"].split("; ") if row["source"].strip() else []
            faults.extend(f"{where}: {fault}" for fault in (source_fault(root, s) for s in sources) if fault)
            names = row["tests"].split()
            tests += len(names)
            if not names:
                faults.append(f"{where}: no test")
            faults.extend(f"{where}: {fault}" for fault in (test_fault(root, name) for name in names) if fault)
    if not seen:
        faults.append(f"{table}: no requirement")
    return faults, len(seen), tests


def self_test():
    head = ",".join(COLUMNS) + "\n"
    good = 'R1,"x, y",METHOD B.2,unit_tests/a/test_a.cpp:test_one\n'
    planted = {
        head + good: None,
        head + good + "R2,x,METHOD A,unit_tests/a/test_a.cpp:test_one unit_tests/a/test_a.cpp:test_one\n": None,
        head: "no requirement",
        "id,tests\n": "first line",
        head + good + good: "taken",
        head + "R1,x,METHOD A,\n": "no test",
        head + good.replace("METHOD B.2", "A.md; A.md#one; METHOD IV"): None,
        head + good.replace("METHOD B.2", "METHOD D"): "neither",
        head + good.replace("METHOD B.2", "issue 7"): "neither",
        head + good.replace("METHOD B.2", "METHOD A; B.md"): "no page doc/B.md",
        head + good.replace("METHOD B.2", "A.md#two"): "no heading 'two' in doc/A.md",
        head + "R1,x,,unit_tests/a/test_a.cpp:test_one\n": "no source",
        head + "R1,x,METHOD A\n": "columns",
        head + "R1,x,METHOD A,t,u\n": "columns",
        head + "R1,x,METHOD A,unit_tests/a/test_b.cpp:test_one\n": "no file",
        head + "R1,x,METHOD A,unit_tests/a/test_a.cpp:test_two\n": "no function",
        head + "R1,x,METHOD A,unit_tests/a/test_a.cpp:test_idle\n": "never runs",
        head + "R1,x,METHOD A,unit_tests/a/test_a.cpp\n": "is not unit_tests",
        head + "R1,x,METHOD A,check-one check-two\n": None,
        head + "R1,x,METHOD A,check-three\n": "no ground_tools/checks/three.py",
        head + "R1,x,METHOD A,check-idle\n": "never runs",
        head + "R1,x,METHOD A,check-blind\n": "no --self-test",
    }
    with tempfile.TemporaryDirectory() as root:
        assert check(root)[0], "no table is a fault"
        os.makedirs(os.path.join(root, "doc"))
        with open(os.path.join(root, "doc", "A.md"), "w", encoding="utf-8") as file:
            file.write("# One\n")
        os.makedirs(os.path.join(root, "unit_tests", "a"))
        with open(os.path.join(root, "unit_tests", "a", "test_a.cpp"), "w", encoding="utf-8") as file:
            file.write("void test_one(void**) {}\nvoid test_idle(void**) {}\nx = {cmocka_unit_test(test_one)};\n")
        os.makedirs(os.path.join(root, "ground_tools", "checks"))
        for name in ("one", "two", "idle", "blind"):
            with open(os.path.join(root, "ground_tools", "checks", name + ".py"), "w", encoding="utf-8") as file:
                file.write("" if name == "blind" else "--self-test")
        with open(os.path.join(root, "Makefile"), "w", encoding="utf-8") as file:
            file.write("PROOFS := one blind\nOF_TEXT := two\nOTHER := idle\n")
        for text, expected in planted.items():
            with open(os.path.join(root, "doc", "requirements.csv"), "w", encoding="utf-8") as file:
                file.write(text)
            faults = check(root)[0]
            assert any(expected in f for f in faults) if expected else not faults, (text, expected, faults)
    print(f"trace: self-test passed ({sum(1 for e in planted.values() if e)} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults, requirements, tests = check(arguments[0] if arguments else ".")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"trace: {requirements} requirements, {tests} tests named, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
