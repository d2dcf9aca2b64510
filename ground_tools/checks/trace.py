#!/usr/bin/env python3
"""Traceability: every requirement has a test, and every test that is named exists and runs.

usage: trace.py [ROOT]       reads ROOT/doc/requirements.csv (columns id, requirement, source, tests)
       trace.py --self-test

`tests` holds names `unit_tests/<module>/test_<file>.cpp:test_<function>`, or `check-<name>` for one of `make check` that has
violations planted for it, separated by blanks.
"""
import csv
import os
import re
import sys
import tempfile

COLUMNS = ["id", "requirement", "source", "tests"]


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
    good = 'R1,"x, y",METHOD,unit_tests/a/test_a.cpp:test_one\n'
    planted = {
        head + good: None,
        head + good + "R2,x,s,unit_tests/a/test_a.cpp:test_one unit_tests/a/test_a.cpp:test_one\n": None,
        head: "no requirement",
        "id,tests\n": "first line",
        head + good + good: "taken",
        head + "R1,x,s,\n": "no test",
        head + "R1,x,,unit_tests/a/test_a.cpp:test_one\n": "no source",
        head + "R1,x,s\n": "columns",
        head + "R1,x,s,t,u\n": "columns",
        head + "R1,x,s,unit_tests/a/test_b.cpp:test_one\n": "no file",
        head + "R1,x,s,unit_tests/a/test_a.cpp:test_two\n": "no function",
        head + "R1,x,s,unit_tests/a/test_a.cpp:test_idle\n": "never runs",
        head + "R1,x,s,unit_tests/a/test_a.cpp\n": "is not unit_tests",
        head + "R1,x,s,check-one check-two\n": None,
        head + "R1,x,s,check-three\n": "no ground_tools/checks/three.py",
        head + "R1,x,s,check-idle\n": "never runs",
        head + "R1,x,s,check-blind\n": "no --self-test",
    }
    with tempfile.TemporaryDirectory() as root:
        assert check(root)[0], "no table is a fault"
        os.makedirs(os.path.join(root, "doc"))
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
