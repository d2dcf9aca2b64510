#!/usr/bin/env python3
"""What the flight library may ask for, and that it keeps no writable data of its own.

usage: symbols.py [--nm NM] LIBRARY
       symbols.py --self-test [--nm NM] [--cxx CXX]

The library stands alone but for the names in NEEDS: everything else that it leaves undefined is a fault (heap, exceptions,
stdio, libm beyond the exactly rounded functions, ...).
"""
import re
import subprocess
import sys
import tempfile

# Undefined names that flight code may have. Of libm only what IEEE 754 rounds exactly: the same bits everywhere.
NEEDS = re.compile(
    r"cairn::assert_failed\(.*|cairn::hal::\w+\(.*|memcpy|memmove|memset|memcmp|"
    r"(sqrt|floor|ceil|trunc|round|rint|nearbyint|fmod|fabs|lround|llround)f?|"
    r"__\w+(si|di|ti|sf|df)\w*\d*|_GLOBAL_OFFSET_TABLE_|_(rest|save)(gpr|fpr)_\d+(_x)?")  # helpers of the compiler
# Names that may not even be defined.
NEVER = re.compile(r"guard variable for |vtable for |typeinfo (name )?for |operator (new|delete)")
# Writable sections; .data.rel.ro is constant once linked.
WRITABLE = re.compile(r"\.(data|bss|tdata|tbss|sdata|sbss)(?!\.rel\.ro)|\*COM\*")
# Floor 5 owns the one static root: file-scope data that is meant to be.
ROOTS = re.compile(r"cairn::app::root$")

WHY = (
    (re.compile(r"operator (new|delete)|\b(malloc|calloc|realloc|free|aligned_alloc|posix_memalign)\b"), "heap"),
    (re.compile(r"__cxa_|__gxx_|_Unwind_|std::__throw|std::terminate"), "exceptions or guards"),
    (re.compile(r"typeinfo|vtable|__dynamic_cast"), "virtuals or RTTI"),
    (re.compile(r"guard variable"), "guarded static"),
    (re.compile(r"printf|^put|^f(open|write|read)|stdout|stderr|std::.*stream"), "stdio"),
    (re.compile(r"^(a?(sin|cos|tan)h?|sincos|atan2|exp|exp2|expm1|log\w*|pow|hypot|cbrt)f?$"),
     "libm: use core/trig.hpp"),
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


def check(nm, library):
    symbols = list(read(nm, library))
    defined = {name for _, name, kind, _ in symbols if kind not in "Uw"}
    faults = set()
    for member, name, kind, section in symbols:
        if NEVER.search(name):
            faults.add(f"{member}: {name} ({reason(name)})")
        elif kind in "Uw" and name not in defined and not NEEDS.fullmatch(name):
            faults.add(f"{member}: needs {name} ({reason(name)})")
        elif WRITABLE.match(section) and not ROOTS.search(name) and kind not in "Nr":
            faults.add(f"{member}: {name} is writable data at file scope ({section})")
    return sorted(faults), len(symbols)


def self_test(nm, compiler):
    planted = {
        "int clean(const int* p) { return *p; }": None,
        "const char* const kNames[] = {\"a\", \"b\"}; const char* name(int i) { return kNames[i]; }": None,
        "double root(double x) { return __builtin_sqrt(x); }": None,
        "int counter; int next() { return ++counter; }": "writable",
        "int counter = 7; int next() { return ++counter; }": "writable",
        "int next() { static int counter = 3; return ++counter; }": "writable",
        "int* make() { return new int; }": "heap",
        "extern \"C\" void* malloc(unsigned long); void* make() { return malloc(8); }": "heap",
        "void fail() { throw 1; }": "exceptions",
        "struct A { virtual void f(); }; void A::f() {}": "virtuals",
        "int make(); int once() { static const int x = make(); return x; }": "guard",
        "extern \"C\" int puts(const char*); void say() { puts(\"x\"); }": "stdio",
        "extern \"C\" double sin(double); double s(double x) { return sin(x); }": "libm",
        "void other(); void f() { other(); }": "NEEDS",
    }
    with tempfile.TemporaryDirectory() as folder:
        for i, (source, expected) in enumerate(planted.items()):
            name = f"{folder}/{i}"
            with open(name + ".cpp", "w", encoding="utf-8") as file:
                file.write(source)
            subprocess.run([compiler, "-O1", "-c", name + ".cpp", "-o", name + ".o"], check=True)
            faults, _ = check(nm, name + ".o")
            seen = any(expected in fault for fault in faults) if expected else not faults
            assert seen, (source, expected, faults)
    print(f"symbols: self-test passed ({sum(1 for e in planted.values() if e)} planted faults seen)")


def main(arguments):
    options = {"--nm": "nm", "--cxx": "g++"}
    for option in options:
        if option in arguments:
            at = arguments.index(option)
            options[option] = arguments[at + 1]
            del arguments[at:at + 2]
    if arguments == ["--self-test"]:
        return self_test(options["--nm"], options["--cxx"])
    if len(arguments) != 1:
        sys.exit(__doc__)
    faults, count = check(options["--nm"], arguments[0])
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"symbols: {count} symbols in {arguments[0]}, {len(faults)} faults")
    return 1 if faults or not count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
