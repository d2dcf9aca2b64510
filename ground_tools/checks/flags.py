#!/usr/bin/env python3
"""Warnings of flight code: a violation of each is compiled as flight code is, and must be an error. So a flag that is dropped
from the Makefile is noticed.

usage: flags.py [TOOLS] --machine MACHINE --self-test
"""
import subprocess
import sys

import planted

WIDE, STRICT = "Advanced Micro Devices X86-64", "Sparc"
# Flag -> what breaks it, and the one machine on which it can be seen, where it is one.
PLANTED = {
    "parentheses": ("int f(int a, int b) { if (a = b) return 1; return 2; }", None),                 # of -Wall
    "unused-parameter": ("int f(int a) { return 1; }", None),                                        # of -Wextra
    "shadow": ("int f(int a) { if (a > 0) { const int a = 2; return a; } return 1; }", None),
    "vla": ("int f(int n) { int a[n]; a[0] = n; return a[0]; }", None),
    "alloca": ("int f(int n) { return *static_cast<int*>(__builtin_alloca(sizeof(int))) + n; }", None),
    "cast-align": ("const int* f(const char* p) { return reinterpret_cast<const int*>(p); }", STRICT),
    "double-promotion": ("double f(float a) { return a * 2.0; }", None),
    "non-virtual-dtor": ("struct A { virtual int f() = 0; }; int g(A& a) { return a.f(); }", None),
    "pedantic": ("int f(int a) { return ({ a; }); }", None),
    "conversion": ("short f(int a) { return a; }", None),
    "sign-conversion": ("unsigned f(int a) { return a; }", None),
    "old-style-cast": ("char f(int a) { return (char)a; }", None),
    "useless-cast": ("int f(int a) { return static_cast<int>(a); }", WIDE),
    "cast-qual": ("char* f(const char* a) { return (char*)a; }", None),
    "undef": ("#if SOMETHING\n#endif", None),
}


def compiled(compiler, workshop, source):
    path = workshop.path("planted.cpp")
    with open(path, "w", encoding="utf-8") as file:
        file.write(source + "\n")
    return subprocess.run([*compiler.split(), "-c", path, "-o", workshop.path("planted.o")], capture_output=True, text=True,
                          check=False)


def faults_of(compiler, workshop, source, flag):
    """None where `source` is refused for `flag`, else what came of it."""
    done = compiled(compiler, workshop, source)
    return None if done.returncode != 0 and f"[-Werror={flag}]" in done.stderr else done.stderr or "compiled"


def self_test(given):
    compiler, seen = given["--cxx"], 0
    with planted.Workshop(compiler, given["--ar"]) as workshop:
        done = compiled(compiler, workshop, planted.CLEAN)
        assert done.returncode == 0, done.stderr
        for flag, (source, machine) in PLANTED.items():
            if machine in (None, given["--machine"]):
                fault = faults_of(compiler, workshop, source, flag)
                assert fault is None, (flag, fault)
                seen += 1
    print(f"flags: self-test passed ({seen} planted violations seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--machine": None})
    if rest != ["--self-test"]:
        sys.exit(__doc__)
    return self_test(given)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
