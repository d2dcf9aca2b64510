#!/usr/bin/env python3
"""The include rule, of fsw and of ground_tools: a file includes its own module or a lower floor, nothing else.

usage: floors.py [ROOT]      check the tree at ROOT (default: the working folder)
       floors.py --self-test
"""
import os
import re
import sys
import tempfile

# fsw module -> floor. Modules of one floor never include each other.
FLOORS = {
    "core": 1,
    "geometry": 2, "image": 2,
    "features": 3, "vo": 3, "segmentation": 3, "labeling": 3, "registration": 3, "orbital_map": 3,
    "localizer": 4,
    "app": 5,
}
# ground_tools room -> floor: runs and maps become products, products become comparisons, commands call them all.
GROUND_FLOORS = {
    "base": 1,
    "ortho": 2, "dataset": 2, "plot": 2,
    "sim": 3, "detect": 3, "cmap": 3, "map": 3,
    "report": 4, "profile": 4, "forecast": 4, "replay": 4,
    "campaign": 5,     # sets replays against forecasts
    "commands": 6,
}
GROUND_ALONE = "checks"  # linked with nothing, seen by nobody
HAL_SEES_FLOOR = 2     # plain structs
HAL_USERS = {"app"}    # of fsw, alone
MISSION_HEADERS = {"mission_cfg.hpp", "schedule.hpp", "mission.hpp", "mission_values.hpp"}
# What flight code takes of the standard library: nothing that allocates, throws, prints or locks.
STANDARD = {
    "algorithm", "array", "cmath", "cstddef", "cstdint", "cstring", "initializer_list", "limits", "new", "tuple",
    "type_traits", "utility",
}
EIGEN_HEADER = "fsw/core/eigen.hpp"  # the one place that includes Eigen
OPENCV_USERS = ("unit_tests/opencv/",)
FOLDERS = ("fsw", "hal", "mission_cfg", "platform", "ground_tools", "unit_tests")

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def flight_fault(path, target):
    """What is wrong with `#include "target"` in flight code, hal or mission_cfg; None where nothing is."""
    parts = path.split("/")
    folder, first = parts[0], target.split("/")[0]
    if target in MISSION_HEADERS:
        return None
    if folder == "mission_cfg":
        return "mission_cfg includes mission_cfg and the standard library alone"
    if first == "hal":
        if folder == "hal" or parts[1] in HAL_USERS:
            return None
        return "only " + ", ".join(sorted(HAL_USERS)) + " may include hal"
    if first not in FLOORS or "/" not in target:
        return "flight code includes `module/file.hpp` of fsw, hal or mission_cfg alone"
    own_floor = HAL_SEES_FLOOR + 1 if folder == "hal" else FLOORS[parts[1]]
    if FLOORS[first] < own_floor or first == parts[1]:
        return None
    own = "hal" if folder == "hal" else f"{parts[1]} (floor {own_floor})"
    return f"{own} may not include {first} (floor {FLOORS[first]})"


def ground_fault(path, target):
    """The same for a file of ground_tools."""
    room, first = path.split("/")[1], target.split("/")[0]
    if target in MISSION_HEADERS:
        return None
    if "/" not in target or first not in {*GROUND_FLOORS, *FLOORS, GROUND_ALONE, "hal", "platform"}:
        return "ground tools include `room/file.hpp` of ground_tools, fsw, hal, platform or mission_cfg alone"
    if first == room or first not in {*GROUND_FLOORS, GROUND_ALONE}:
        return None
    if GROUND_ALONE in (room, first):
        return f"{GROUND_ALONE} stands by itself"
    if GROUND_FLOORS[first] < GROUND_FLOORS[room]:
        return None
    return f"{room} (floor {GROUND_FLOORS[room]}) may not include {first} (floor {GROUND_FLOORS[first]})"


def standard_fault(path, target):
    """What is wrong with `#include <target>` there."""
    if target in STANDARD or (path == EIGEN_HEADER and target.startswith("Eigen/")):
        return None
    return f"flight code does not use <{target}>"


def faults_of(path, text):
    for number, line in enumerate(text.splitlines(), 1):
        found = INCLUDE.match(line)
        if not found:
            continue
        quote, target = found.groups()
        fault = None
        if path.split("/")[0] in ("fsw", "hal", "mission_cfg"):
            fault = flight_fault(path, target) if quote == '"' else standard_fault(path, target)
        elif target.startswith("opencv") and not path.startswith(OPENCV_USERS):
            fault = "OpenCV is for the oracles of unit_tests/opencv alone"
        elif path.startswith("ground_tools/") and quote == '"':
            fault = ground_fault(path, target)
        if fault:
            yield f"{path}:{number}: {fault}: {line.strip()}"


def check(root):
    faults, files = [], 0
    for folder in FOLDERS:
        for where, _, names in os.walk(os.path.join(root, folder)):
            for name in sorted(names):
                if not name.endswith((".hpp", ".cpp", ".h", ".c")):
                    continue
                full = os.path.join(where, name)
                path = os.path.relpath(full, root).replace(os.sep, "/")
                files += 1
                parts = path.split("/")
                if parts[0] == "fsw" and (len(parts) != 3 or parts[1] not in FLOORS):
                    faults.append(f"{path}: not in a module that has a floor (floors.py: FLOORS)")
                    continue
                if parts[0] == "ground_tools" and (len(parts) < 3 or parts[1] not in {*GROUND_FLOORS, GROUND_ALONE}):
                    faults.append(f"{path}: not in a room that has a floor (floors.py: GROUND_FLOORS)")
                    continue
                with open(full, encoding="utf-8") as file:
                    faults.extend(faults_of(path, file.read()))
    return faults, files


def self_test():
    planted = {  # path, text -> is it a fault?
        ("fsw/core/a.hpp", '#include "geometry/pose3.hpp"'): True,
        ("fsw/geometry/a.hpp", '#include "core/a.hpp"'): False,
        ("fsw/geometry/b.hpp", '#include "image/image_view.hpp"'): True,
        ("fsw/vo/a.cpp", '  #  include "features/match.hpp"'): True,
        ("fsw/vo/b.cpp", '#include "vo/a.hpp"\n#include "mission_cfg.hpp", "schedule.hpp"\n#include <cmath>'): False,
        ("fsw/vo/c.cpp", '#include "c.hpp"'): True,
        ("fsw/localizer/a.cpp", '#include "vo/a.hpp"'): False,
        ("fsw/localizer/b.cpp", '#include "hal/watchdog.hpp"'): True,
        ("fsw/app/a.cpp", '#include "hal/watchdog.hpp"'): False,
        ("fsw/app/b.cpp", '#include "ground_tools/base/tool_error.hpp"'): True,
        ("fsw/image/a.cpp", "#include <vector>"): True,
        ("fsw/image/b.cpp", "#include <opencv2/core.hpp>"): True,
        ("fsw/image/c.cpp", "#include <gdal_priv.h>"): True,
        ("fsw/image/d.cpp", "#include <Eigen/Core>"): True,
        ("fsw/core/eigen.hpp", "#include <Eigen/Core>"): False,
        ("fsw/radio/a.cpp", "int x;"): True,
        ("hal/camera.hpp", '#include "image/image_view.hpp"\n#include "hal/watchdog.hpp"'): False,
        ("hal/watchdog.hpp", '#include "vo/motion.hpp"'): True,
        ("mission_cfg/paper/mission_values.hpp", '#include "mission.hpp"'): False,
        ("mission_cfg/mission.hpp", '#include "core/assert.hpp"'): True,
        ("ground_tools/replay/a.cpp", '#include "localizer/a.hpp"\n#include "hal/watchdog.hpp"\n#include <vector>'): False,
        ("ground_tools/replay/b.cpp", '#include "base/a.hpp"\n#include "replay/a.hpp"\n#include "mission_cfg.hpp"'): False,
        ("ground_tools/replay/c.cpp", '#include "campaign/a.hpp"'): True,
        ("ground_tools/replay/d.cpp", '#include "forecast/a.hpp"'): True,
        ("ground_tools/replay/e.cpp", '#include "e.hpp"'): True,
        ("ground_tools/campaign/a.cpp", '#include "forecast/a.hpp"\n#include "replay/a.hpp"'): False,
        ("ground_tools/base/a.cpp", '#include "ortho/a.hpp"'): True,
        ("ground_tools/ortho/a.cpp", '#include "detect/a.hpp"'): True,
        ("ground_tools/detect/a.cpp", '#include "cmap/a.hpp"'): True,
        ("ground_tools/cmap/a.cpp", '#include "commands/a.hpp"'): True,
        ("ground_tools/commands/a.cpp", '#include "campaign/a.hpp"\n#include "base/a.hpp"'): False,
        ("ground_tools/commands/b.cpp", '#include "checks/a.hpp"'): True,
        ("ground_tools/checks/a.cpp", '#include "base/a.hpp"'): True,
        ("ground_tools/checks/b.cpp", '#include "app/flight_app.hpp"'): False,
        ("ground_tools/profile/plugin/a.cpp", '#include "profile/a.hpp"'): False,
        ("ground_tools/profile/plugin/b.cpp", '#include "report/a.hpp"'): True,
        ("ground_tools/radio/a.cpp", "int x;"): True,
        ("ground_tools/a.cpp", "int x;"): True,
        ("ground_tools/detect/b.cpp", "#include <opencv2/core.hpp>"): True,
        ("unit_tests/opencv/test_a.cpp", "#include <opencv2/core.hpp>"): False,
    }
    with tempfile.TemporaryDirectory() as root:
        for path, text in planted:
            os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
            with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                file.write(text)
        faults, files = check(root)
    assert files == len(planted), files
    for (path, _), is_fault in planted.items():
        assert any(f.startswith(path + ":") for f in faults) == is_fault, (path, faults)
    print(f"floors: self-test passed ({sum(planted.values())} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults, files = check(arguments[0] if arguments else ".")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"floors: {files} files, {len(faults)} faults")
    return 1 if faults or not files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
