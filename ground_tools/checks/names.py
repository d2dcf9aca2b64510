#!/usr/bin/env python3
"""Names that only make sense on one machine have no place in the project: absolute paths of somebody's folders, and
hosts that packages come from.

usage: names.py [ROOT]
       names.py --self-test
"""
import os
import re
import subprocess
import sys
import tempfile

FORBIDDEN = (
    (re.compile(r"(?<![\w.$})/~-])/(work|workspace|root|home|Users|tmp|mnt|media)/[\w.-]+"), "absolute path of one machine"),
    (re.compile(r"(?<![\w.])~/[\w.-]+"), "path in somebody's home"),
    (re.compile(r"\b([\w-]+\.)*(pypi\.(org|python\.org)|pythonhosted\.org|npmjs\.(org|com)|crates\.io|rubygems\.org|"
                r"proxy\.golang\.org|docker\.(io|com)|ghcr\.io|quay\.io|conda\.anaconda\.org|"
                r"(deb|security|snapshot|archive|ftp)\.(debian|ubuntu)\.(org|com))\b"), "host of a package registry"),
    (re.compile(r"\b(127\.0\.0\.1|10\.\d+\.\d+\.\d+|192\.168\.\d+\.\d+)\b"), "address of one network"),
)
SKIPPED = {"ground_tools/checks/names.py"}  # it names them


def tracked(root):
    """The files that git keeps; without git, all but build/."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z"], capture_output=True, check=False)
    if listed.returncode == 0 and listed.stdout:
        return sorted(listed.stdout.decode().rstrip("\0").split("\0"))
    found = []
    for where, folders, names in os.walk(root):
        folders[:] = [f for f in folders if f not in ("build", ".git")]
        found.extend(os.path.relpath(os.path.join(where, name), root) for name in names)
    return sorted(found)


def check(root):
    faults, files = [], 0
    for path in tracked(root):
        full = os.path.join(root, path)
        if path in SKIPPED or not os.path.isfile(full):
            continue
        with open(full, "rb") as file:
            data = file.read()
        if b"\0" in data:
            continue  # not text
        files += 1
        for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
            for pattern, why in FORBIDDEN:
                found = pattern.search(line)
                if found:
                    faults.append(f"{path}:{number}: {why}: {found.group(0)}")
    return faults, files


def self_test():
    planted = {
        "see /home/ann/cairn": True,
        "path=/root/x": True,
        '"/tmp/out.svg"': True,
        "cd ~/cairn": True,
        "from https://pypi.org/simple": True,
        "http://deb.debian.org/debian": True,
        "at 192.168.1.7": True,
        "$HOME/home/x and build/root/y, ../tmp/z": False,
        "-isystem /usr/include/eigen3": False,
        "a debian machine, 5 m/s, version 10.2.1": False,
        "github.com/x/y is a citation": False,
    }
    with tempfile.TemporaryDirectory() as root:
        for i, text in enumerate(planted):
            with open(os.path.join(root, f"{i:02d}.txt"), "w", encoding="utf-8") as file:
                file.write(text)
        with open(os.path.join(root, "picture.bin"), "wb") as file:
            file.write(b"\0/home/ann/x")
        faults, files = check(root)
    assert files == len(planted), files
    for i, (text, is_fault) in enumerate(planted.items()):
        assert any(f.startswith(f"{i:02d}.txt:") for f in faults) == is_fault, (text, faults)
    print(f"names: self-test passed ({sum(planted.values())} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults, files = check(arguments[0] if arguments else ".")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"names: {files} text files, {len(faults)} faults")
    return 1 if faults or not files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
