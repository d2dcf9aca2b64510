#!/usr/bin/env python3
"""Bounds in time of each task in one minor frame, and of one cycle(), beside the longest seen.

usage: wcet.py BUDGET.toml --target T ROWS UNITS LOGS...
       wcet.py --self-test

ROWS: what schedule.cpp prints. UNITS: what units.cpp prints. LOGS: consoles of replays, which tell the operations of each frame.

A task does no more in a minor frame than its row of the schedule grants, and one unit: the executive sees to that. A call of cycle()
does no more than its slice and one unit, beside what no job counts. Operations become seconds by cycles_per_op, those of a slice by
slice_cycles_per_op, of one unit by unit_cycles_per_op, at the clock of platform/<target>/timing.toml. Fails where more was seen than the bound.
"""
import os
import re
import sys
import tomllib

from schedule import TASKS, read_rows

SEEN = re.compile(r"ops of frame (\d+): vo (\d+), boulders (\d+), fix (\d+)")


def read_units(text):
    """(task, what, weighted operations)."""
    fields = [line.split("\t") for line in text.splitlines()]
    return [(task, what, int(ops) * int(weight)) for kind, task, what, ops, weight in fields if kind == "unit"]


def longest_seen(logs):
    """task -> (operations, drive, frame); `logs`: drive -> text."""
    seen = {}
    for drive, text in logs.items():
        for frame, *ops in SEEN.findall(text):
            for task, count in zip(TASKS, map(int, ops)):
                if task not in seen or count > seen[task][0]:
                    seen[task] = (count, drive, int(frame))
    return seen


def check(budget, clock_mhz, target, rows, slice_ops, units, logs, weights):
    """Faults, and the lines of the table."""
    each = {job["task"]: job["cycles_per_op"][target] for job in budget["job"] if "task" in job}
    of_slice, of_unit = (max(job[kind][target] for job in budget["job"] if kind in job) for kind in ("slice_cycles_per_op", "unit_cycles_per_op"))
    seen = longest_seen(logs)
    faults, lines = [], []

    def seconds(task, ops):
        return ops * each[task.split()[0]] / (1e6 * clock_mhz)

    lines.append(f"  {'a minor frame':<16}{'bound, s':>10}{'seen, s':>10}{'ratio':>7}   where")
    for task, _, _, ops in rows:
        unit = max(length for of, _, length in units if of == task)
        bound = seconds(task, ops + unit)
        line = f"  {task:<16}{bound:>10.3f}"
        if task in seen:
            count, drive, frame = seen[task]
            took = seconds(task, count * weights[task])
            line += f"{took:>10.3f}{bound / took:>7.2f}   {drive}, frame {frame}" if count else f"{'-':>10}"
            if took > bound:
                faults.append(f"{task}: {took:.3f} s in frame {frame} of {drive}, the bound is {bound:.3f} s")
        lines.append(line.rstrip())
    lines.append(f"  {'cycle()':<16}{'bound, ms':>10}   slice, and the longest unit")
    task, what, unit = max(units, key=lambda of: of[2])
    for name, ops in (("usual slice", slice_ops), ("smallest slice", 0)):
        bound = 1e3 * (ops * of_slice + unit * of_unit) / (1e6 * clock_mhz)
        lines.append(f"  {name:<16}{bound:>10.2f}   {ops}, {task} {what}: {unit} weighted operations")
    return faults, lines


def self_test():
    budget = {"job": [{"name": task, "task": task, "cycles_per_op": {"a": 2.0}} for task in TASKS] + [{"name": "cycle", "slice_cycles_per_op": {"a": 3.0}, "unit_cycles_per_op": {"a": 5.0}}]}
    rows = [("vo", 0, 2, 1000000), ("fix", 2, 2, 2000000)]
    units = [("vo", "row", 20000), ("fix", "look", 4000)]
    weights = {"vo": 1, "boulders": 4, "fix": 4}
    log = "ops of frame 7: vo {}, boulders 0, fix 500001"
    for ops, expected in ((1020000, 0), (1020001, 1)):
        faults, lines = check(budget, 1.0, "a", rows, 100, units, {"d": log.format(ops)}, weights)
        assert len(faults) == expected, (ops, faults)
    assert "vo: 2.040 s in frame 7 of d, the bound is 2.040 s" in faults[0], faults
    assert any(line.split()[:3] == ["vo", "2.040", "2.040"] for line in lines), lines
    assert any(line.split()[:3] == ["usual", "slice", "100.30"] for line in lines), lines
    print("wcet: self-test passed (1 planted fault seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if len(arguments) < 5 or arguments[1] != "--target":
        sys.exit(__doc__)
    target = arguments[2]
    with open(arguments[0], "rb") as file:
        budget = tomllib.load(file)
    with open(os.path.join("platform", target, "timing.toml"), "rb") as file:
        clock = tomllib.load(file)["clock_mhz"]
    texts = []
    for path in arguments[3:]:
        with open(path, encoding="utf-8") as file:
            texts.append(file.read())
    mission, _, rows = read_rows(texts[0])
    slice_ops = next(int(line.split("\t")[1]) for line in texts[0].splitlines() if line.startswith("slice\t"))
    weights = {line.split("\t")[1]: int(line.split("\t")[5]) for line in texts[0].splitlines() if line.startswith("row\t")}
    logs = {os.path.splitext(os.path.basename(path))[0]: text for path, text in zip(arguments[5:], texts[2:])}
    faults, lines = check(budget, clock, target, rows, slice_ops, read_units(texts[1]), logs, weights)
    print(f"wcet: {target} at {clock:g} MHz, mission {mission}\n" + "\n".join(lines))
    for fault in faults:
        print(f"wcet: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
