#!/usr/bin/env python3
"""The schedule's rows as times: in no minor frame do they take longer than the frame lasts, on any target.

usage: schedule.py BUDGET.toml ROWS...     ROWS: what schedule.cpp prints, one file a mission
       schedule.py --self-test

A row's time is its operations, times what an operation of its task weighs, times the model cycles of a weighted operation
(cycles_per_op of its job in BUDGET.toml, which `make profile` measures), at the clock of platform/<target>/timing.toml. How long a
mission's minor frame lasts is frame_s of BUDGET.toml.
"""
import os
import sys
import tomllib

TASKS = ("vo", "boulders", "fix")

def read_rows(text):
    """(mission, minor frames, rows as (task, first, last, weighted operations))."""
    mission, minors, rows = "", 0, []
    for line in text.splitlines():
        kind, *fields = line.split("\t")
        if kind == "mission":
            mission = fields[0]
        elif kind == "minor frames":
            minors = int(fields[0])
        elif kind == "row":
            first, last, ops, weight = map(int, fields[1:])
            rows.append((fields[0], first, last, ops * weight))
    return mission, minors, rows


def check(budget, clocks, missions):
    """Faults, and the lines of the table. `clocks`: target -> MHz."""
    faults, lines = [], []
    each = {job["task"]: job.get("cycles_per_op", {}) for job in budget.get("job", ()) if "task" in job}
    known = {target for target in clocks if all(target in each.get(task, {}) for task in TASKS)}
    faults += [f"cycles_per_op has no {target} for each of {', '.join(TASKS)}: `make profile TARGET={target}` measures it"
               for target in sorted(set(clocks) - known)]
    for mission, minors, rows in missions:
        for target in sorted(known):
            lasts = budget.get("frame_s", {}).get(mission, {}).get(target)
            if lasts is None:
                faults.append(f"frame_s has no {mission}.{target}: say how long the mission's minor frame lasts there")
                continue
            # What begins and applies a fix is the fix's.
            seconds = [ops * each[task.split()[0]][target] / (1e6 * clocks[target]) for task, _, _, ops in rows]
            # The fullest minor frame, and its longest row.
            active = [[i for i, (_, first, last, _) in enumerate(rows) if first <= minor <= last] for minor in range(minors)]
            minor = max(range(minors), key=lambda m: sum(seconds[i] for i in active[m]))
            total = sum(seconds[i] for i in active[minor])
            lines.append(f"  {mission:<8}{target:<10}" +
                         "".join(f"{rows[i][0]} {seconds[i]:.3f}   " for i in active[minor]) + f"in all {total:.2f} of {lasts:g} s")
            if total > lasts:
                longest = max(active[minor], key=lambda i: seconds[i])
                faults.append(f"mission {mission} on {target}: the rows of minor frame {minor} take {total:.2f} s of {lasts:g}; the "
                              f"longest is '{rows[longest][0]}', {seconds[longest]:.2f} s (mission_cfg/schedule.hpp)")
    return faults, lines


def self_test():
    rows = "mission\tone\nminor frames\t3\nslice\t1\nrow\tvo\t0\t2\t1000000\t1\nrow\tfix\t2\t2\t500000\t4\n"
    def jobs(each):
        return [{"task": task, "cycles_per_op": each} for task in TASKS]
    sound = {"job": jobs({"a": 2.0}), "frame_s": {"one": {"a": 6.0}}}
    cases = (  # what differs, what the fault says (None: no fault)
        ({}, {"a": 1.0}, None),
        ({"frame_s": {"one": {"a": 0.61}}}, {"a": 10.0}, None),
        ({"frame_s": {"one": {"a": 5.9}}}, {"a": 1.0}, "minor frame 2 take 6.00 s of 5.9; the longest is 'fix', 4.00 s"),
        ({}, {"a": 1.0, "b": 1.0}, "cycles_per_op has no b"),
        ({"frame_s": {}}, {"a": 1.0}, "frame_s has no one.a"),
        ({"job": jobs({"a": 2.1})}, {"a": 1.0}, "take 6.30 s of 6"),
    )
    for differs, clocks, expected in cases:
        faults, _ = check({**sound, **differs}, clocks, [read_rows(rows)])
        seen = any(expected in fault for fault in faults) if expected else not faults
        assert seen, (differs, expected, faults)
    print(f"schedule: self-test passed ({sum(1 for c in cases if c[2])} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if len(arguments) < 2:
        sys.exit(__doc__)
    with open(arguments[0], "rb") as file:
        budget = tomllib.load(file)
    clocks = {}
    for target in sorted(os.listdir("platform")):
        path = os.path.join("platform", target, "timing.toml")
        if os.path.exists(path):
            with open(path, "rb") as file:
                clocks[target] = tomllib.load(file)["clock_mhz"]
    missions = []
    for path in arguments[1:]:
        with open(path, encoding="utf-8") as file:
            missions.append(read_rows(file.read()))
    faults, lines = check(budget, clocks, missions)
    print("schedule: seconds of the fullest minor frame\n" + "\n".join(lines))
    for fault in faults:
        print(f"{arguments[0]}: {fault}", file=sys.stderr)
    print(f"schedule: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
