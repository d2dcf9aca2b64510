#!/usr/bin/env python3
"""What the flight library may ask for, and that it keeps no writable data of its own.

usage: symbols.py [TOOLS] [--needs 'NAME...'] LIBRARY
       symbols.py [TOOLS] --self-test

The library stands alone but for the names in NEEDS and --needs (FLIGHT_NEEDS of toolchain.mk): everything else that it leaves
undefined is a fault (heap, exceptions, stdio, floating-point environment, libm, ...).
"""
import re
import subprocess
import sys

import planted

# What GCC may call in any code, as its manual has it: which of them it does call differs from change to change.
C_FUNCTIONS = ("memcpy", "memmove", "memset", "memcmp")
# By which PowerPC code that is compiled for size keeps registers, in libgcc; which of them differs as well.
REGISTERS = r"_(save|rest)[fg]pr_\d+(_x|_l)?"
# Undefined names that flight code may have, on every target.
NEEDS = (REGISTERS, r"cairn::assert_failed\(char const\*, int\)", r"cairn::hal::\w+\(.*\)", *C_FUNCTIONS)
# Names that may not even be defined.
NEVER = re.compile(r"guard variable for |vtable for |typeinfo (name )?for |operator (new|delete)|_GLOBAL__(sub_)?[ID]_")
# Writable sections; .data.rel.ro is constant once linked.
WRITABLE = re.compile(r"\.(data|bss|tdata|tbss|sdata|sbss)(?!\.rel\.ro)|\*COM\*")
# Floor 5 owns the one static root: file-scope data that is meant to be, and the code that constructs it.
ROOTS = re.compile(r"cairn::app::root|_GLOBAL__sub_I__ZN5cairn3app4rootE")

WHY = (
    (re.compile(r"operator (new|delete)|\b(malloc|calloc|realloc|free|aligned_alloc|posix_memalign)\b"), "heap"),
    (re.compile(r"__cxa_guard"), "guarded static"),
    (re.compile(r"__dynamic_cast|typeinfo|vtable"), "virtuals or RTTI"),
    (re.compile(r"__cxa_|__gxx_|_Unwind_|std::__throw|std::terminate"), "exceptions"),
    (re.compile(r"guard variable"), "guarded static"),
    (re.compile(r"_GLOBAL__"), "code that runs before main"),
    (re.compile(r"printf|scanf|^put|^f(open|write|read|close|flush|gets)$|stdout|stderr|_impure_ptr|std::.*stream"), "stdio"),
    (re.compile(r"^fe(\w*except\w*|[gs]etround|[gs]etenv|updateenv|holdexcept|[gs]etexceptflag)$|^fp[gs]et"),
     "floating-point environment"),
    (re.compile(r"^(a?(sin|cos|tan)h?|sincos|atan2|exp|exp2|expm1|log\w*|pow|hypot|cbrt)f?$"), "libm: use core/trig.hpp"),
    (re.compile(r"^(sqrt|floor|ceil|trunc|l?l?round|l?l?rint|nearbyint|fmod|remainder|fma|ldexp|frexp)f?$"),
     "libm: not in FLIGHT_NEEDS"),
    (re.compile(r"^__\w+(si|di|ti|sf|df|tf)\w*\d*$|^_Q_"), "arithmetic helper of the compiler: not in FLIGHT_NEEDS"),
)


def reason(name):
    return next((why for pattern, why in WHY if pattern.search(name)), "not in symbols.py: NEEDS")


def read(nm, library):
    """(member, name, type letter, section) of each symbol."""
    text = subprocess.run([nm, "--demangle", "--format=sysv", library], check=True, capture_output=True, text=True).stdout
    member = library
    for line in text.splitlines():
        heading = re.match(r".*(?:\[|from )(\S+\.o)\]?:", line)
        if heading:
            member = heading.group(1)
        # The demangled name may hold a bar (operator|): the six columns after it are counted from the right.
        columns = [c.strip() for c in line.rsplit("|", 6)]
        if len(columns) == 7 and columns[0] != "Name":
            yield member, columns[0], columns[2], columns[6]


def check(nm, library, more):
    """Faults, number of symbols, and what the library asks for."""
    needs = re.compile("|".join([*NEEDS, *map(re.escape, more)]))
    symbols = list(read(nm, library))
    defined = {name for _, name, kind, _ in symbols if kind not in "Uw"}
    faults, asked = set(), set()
    for member, name, kind, section in symbols:
        if NEVER.match(name) and not ROOTS.fullmatch(name):
            faults.add(f"{member}: {name} ({reason(name)})")
        elif kind in "Uw" and name not in defined:
            asked.add(re.sub(r"\(.*", "", name))
            if not needs.fullmatch(name):
                faults.add(f"{member}: needs {name} ({reason(name)})")
        elif WRITABLE.match(section) and not ROOTS.fullmatch(name) and kind not in "Nr":
            faults.add(f"{member}: {name} is writable data at file scope ({section})")
    return sorted(faults), len(symbols), sorted(asked)


def self_test(given):
    wide = "#if __SIZEOF_POINTER__ == 8\nusing A = __int128;\n#else\nusing A = long long;\n#endif\n"
    cases = (  # source, what the fault names (None: no fault), flags that flight code does not have
        (planted.CLEAN, None),
        ("extern const char* const kNames[]; const char* const kNames[] = {\"a\", \"b\"};", None),
        ("namespace cairn { void assert_failed(const char*, int); void f() { assert_failed(\"a\", 1); } }", None),
        ("int counter; int next() { return ++counter; }", "counter is writable"),
        ("int counter = 7; int next() { return ++counter; }", "counter is writable"),
        ("namespace { int counter; } int next() { return ++counter; } int get() { return counter; }", "counter is writable"),
        ("int next() { static int counter = 3; return ++counter; }", "counter is writable"),
        ("thread_local int counter; int next() { return ++counter; }", "counter is writable"),
        ("int* make() { return new int; }", "operator new(unsigned"),
        ("void drop(int* p) { delete p; }", "operator delete"),
        ("extern \"C\" void* malloc(__SIZE_TYPE__); void* make() { return malloc(8); }", "needs malloc (heap)"),
        ("void fail() { throw 1; }", "__cxa_throw (exceptions)", "-fexceptions"),
        ("struct A { virtual void f(); }; void A::f() {}", "vtable for A (virtuals or RTTI)"),
        ("struct A { virtual ~A(); }; struct B : A {}; B* f(A* a) { return dynamic_cast<B*>(a); }",
         "__dynamic_cast (virtuals or RTTI)", "-frtti"),
        ("int make(); int once() { static const int x = make(); return x; }", "guarded static"),
        ("int make(); extern const int x; const int x = make();", "before main"),
        ("#include <cstdio>\nvoid say(int x) { std::printf(\"%d\", x); }", "needs printf (stdio)"),
        ("extern \"C\" int puts(const char*); void say() { puts(\"x\"); }", "needs puts (stdio)"),
        ("extern \"C\" int fesetround(int); int up() { return fesetround(2); }", "needs fesetround (floating-point environment)"),
        ("extern \"C\" int feclearexcept(int); int f() { return feclearexcept(1); }", "floating-point environment"),
        ("extern \"C\" double sin(double); double s(double x) { return sin(x); }", "needs sin (libm"),
        ("extern \"C\" double fmod(double, double); double f(double x) { return fmod(x, 3.0); }", "needs fmod (libm"),
        (wide + "A f(A a, A b) { return a / b; }", "needs __div"),
        ("double f(double x) { return __builtin_floor(x) + 1; }", None),  # allowed below
        ("void other(); void f() { other(); }", "needs other() (not in"),
        ("extern \"C\" void* bsearch(const void*); void* f(const void* p) { return bsearch(p); }", "needs bsearch (not in"),
    )
    with planted.Workshop(given["--cxx"], given["--ar"]) as workshop:
        for source, expected, *flags in cases:
            faults, _, _ = check(given["--nm"], workshop.library("p", source, flags), ("floor",))
            named = [f for f in faults if f.startswith("planted.o: ") and expected and expected in f]
            assert named if expected else not faults, (source, expected, faults)
            assert not any(f.startswith("clean.o") for f in faults), faults
    print(f"symbols: self-test passed ({sum(1 for c in cases if c[1])} planted faults seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--needs": ""})
    if rest == ["--self-test"]:
        return self_test(given)
    if len(rest) != 1:
        sys.exit(__doc__)
    faults, count, asked = check(given["--nm"], rest[0], given["--needs"].split())
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"symbols: {count} symbols in {rest[0]}, {len(faults)} faults; it asks for {', '.join(asked)}")
    return 1 if faults or not count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
