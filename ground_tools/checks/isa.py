#!/usr/bin/env python3
"""What processor the objects are for, and instructions that flight code must not have: those that the processor lacks, those
that touch the floating-point environment, and those that round differently from one target to another.

usage: isa.py [TOOLS] --machine MACHINE LIBRARY [IMAGE...]
       isa.py [TOOLS] --machine MACHINE --self-test

MACHINE as readelf has it; one object of another fails (a SPARC V8+ member of libgcc makes a whole image V8+). Images hold the
platform's code too, which may set the floating-point environment up: of them the machine and its instructions alone are checked.
"""
import re
import subprocess
import sys

import planted

LACKS, ENVIRONMENT, ROUNDS = "the processor does not have it", "floating-point environment", "rounds as no other target does"
# machine -> options of the disassembler, and (instruction with its operands, fault).
RULES = {
    "Advanced Micro Devices X86-64": ((), (
        (re.compile(r"v?(ldmxcsr|stmxcsr)\b|f?xrstor|fldcw|fn?stcw|fldenv|frstor"), ENVIRONMENT),
        (re.compile(r"vfn?m(add|sub)|f\w+|v?(rsqrt|rcp)[ps]s"), ROUNDS),  # fused, x87, estimates
        (re.compile(r"v\w+"), "not baseline x86-64"),
    )),
    # What a 32-bit PowerPC lacks is disassembled as data.
    "PowerPC": (("-M", "ppc"), (
        (re.compile(r"mtfs(f|fi|b0|b1)\b|mffs\b|mcrfs"), ENVIRONMENT),
        (re.compile(r"fn?m(add|sub)s?\b"), ROUNDS),
        (re.compile(r"\.long|fsqrts?\b"), LACKS),
    )),
    # What the baseline lacks is disassembled as data. Compilers put frflags and fsflags around comparisons that must not signal:
    # they leave the flags as they were, and nothing reads them.
    "RISC-V": ((), (
        (re.compile(r"f[rs](csr|rm)\b|fsrmi\b|fsflagsi\b|csr\w+ .*\b(fflags|frm|fcsr)\b"), ENVIRONMENT),
        (re.compile(r"fn?m(add|sub)\."), ROUNDS),
        (re.compile(r"\.(word|short|byte|[248]byte|insn)\b|v\w+\.|f\w+\.[qh]\b"), LACKS),
    )),
    "Sparc": ((), (
        (re.compile(r"(ld|st)x? .*%fsr"), ENVIRONMENT),
        (re.compile(r"f(add|sub|mul|div|sqrt|cmpe?)q\b|f[dsi]toq\b|fqto[dsi]\b|fdmulq\b|unknown"), LACKS),
    )),
}
# Functions whose result is rounded as IEEE 754 says, whatever they take to get there (platform/<target>/flight/; tests hold them
# to it).
EXACT = {"sqrt"}


def machine_faults(readelf, path, machine):
    """Faults, and the number of objects."""
    text = subprocess.run([readelf, "--file-header", path], check=True, capture_output=True, text=True).stdout
    member, faults, objects = path, [], 0
    for line in text.splitlines():
        if line.startswith("File:"):
            member = line[5:].strip()
        found = re.match(r"\s+Machine:\s+(.*)", line)
        if found:
            objects += 1
            if found.group(1).strip() != machine:
                faults.append(f"{member}: for {found.group(1).strip()}, not {machine}")
    return faults, objects


def instruction_faults(objdump, path, machine, reasons):
    """Faults, and the number of instructions."""
    options, rules = RULES[machine]
    text = subprocess.run([objdump, *options, "--disassemble", "--demangle", "--no-show-raw-insn", path],
                          check=True, capture_output=True, text=True).stdout
    where, faults, count = "", set(), 0
    for line in text.splitlines():
        head = re.match(r"[0-9a-f]+ <((?!\.L).*)>:$|(\S+\.o):\s+file format", line)
        if head:
            where = head.group(1) or head.group(2)
        _, tab, instruction = line.partition(":\t")
        if not tab:
            continue
        count += 1
        instruction = " ".join(instruction.split())
        for pattern, why in rules:
            if pattern.match(instruction) and why in reasons and not (why == ROUNDS and where in EXACT):
                faults.add(f"{path}: {where}: {instruction} ({why})")
    return sorted(faults), count


def check(given, library, images=()):
    faults, lines, machine = [], [], given["--machine"]
    for path in (library, *images):
        wrong, objects = machine_faults(given["--readelf"], path, machine)
        reasons = {why for _, why in RULES[machine][1]} if path == library else {LACKS}
        bad, count = ([], 0) if wrong else instruction_faults(given["--objdump"], path, machine, reasons)
        faults += wrong + bad
        if not objects or not (count or wrong):
            faults.append(f"{path}: nothing in it")
        lines.append(f"isa: {path}: {machine}, {objects} objects, {count} instructions")
    return faults, lines


def self_test(given):
    cases = [("double f(double x) { return 2.0 * x; }", None)]
    fused = "double f(double a, double b, double c) { return a * b + c; }"
    cases += {
        "Advanced Micro Devices X86-64": [
            ("void f(int* x) { asm volatile(\"ldmxcsr %0\" : : \"m\"(*x)); }", "f(int*): ldmxcsr"),
            ("void f(short* x) { asm volatile(\"fldcw %0\" : : \"m\"(*x)); }", "f(short*): fldcw"),
            (fused, "f(double, double, double): vfmadd", "-mfma", "-ffp-contract=fast"),
            ("double f(long double a) { return a * 3; }", "f(long double): fld"),
            ("float f(float a) { return 1.0f / __builtin_sqrtf(a); }", "f(float): rsqrtss", "-ffast-math"),
            ("double f(double a, double b) { return a + b; }", "f(double, double): vaddsd", "-mavx"),
            ("int f() { return 1; }", "not Advanced Micro", "-m32"),
        ],
        "PowerPC": [
            ("void f() { asm volatile(\"mtfsfi 7,1\"); }", "f(): mtfsfi"),
            ("void f() { asm volatile(\"mtfsb0 30\"); }", "f(): mtfsb0"),
            ("double f() { double x; asm volatile(\"mffs %0\" : \"=f\"(x)); return x; }", "f(): mffs"),
            (fused, "f(double, double, double): fmadd", "-ffp-contract=fast"),
            ("extern \"C\" double sqrt(double a) { return __builtin_fma(a, a, 1.0); }", None),
            ("extern \"C\" double sqrt(double a) { asm volatile(\"mtfsfi 7,1\"); return a; }", "sqrt: mtfsfi"),
            ("double f(double x) { return __builtin_sqrt(x); }", "f(double): fsqrt", "-mcpu=power7", "-mno-vsx", "-mno-altivec"),
            ("int f(int a, int b, int c) { return c ? a : b; }", "f(int, int, int): .long", "-mcpu=8540", "-misel"),
            ("void f() { asm volatile(\".long 0xfc16048e\"); }", "f(): .long 0xfc16048e"),  # mffscrni, as in Debian's libm
        ],
        "RISC-V": [
            ("void f(int x) { asm volatile(\"fscsr %0\" : : \"r\"(x)); }", "f(int): fscsr"),
            ("void f() { asm volatile(\"fsrmi 1\"); }", "f(): fsrm"),
            ("int f(double a, double b) { return __builtin_isless(a, b); }", None),
            (fused, "f(double, double, double): fmadd.d", "-ffp-contract=fast"),
            ("double f(double x) { return __builtin_sqrt(x); }", None, "-fno-math-errno"),
            ("void f() { asm volatile(\".4byte 0x02107057\"); }", "f(): .word"),  # vadd.vv
        ],
        "Sparc": [
            ("void f(int* x) { asm volatile(\"ld [%0], %%fsr\" : : \"r\"(x)); }", "f(int*): ld [ %o0 ], %fsr"),
            ("void f() { asm volatile(\"faddq %f0, %f4, %f8\"); }", "f(): faddq"),
            ("int f(int a, int b) { return a ? b : 3; }", "for Sparc v8+, not Sparc", "-mcpu=v9"),
        ],
    }[given["--machine"]]
    with planted.Workshop(given["--cxx"], given["--ar"]) as workshop:
        for source, expected, *flags in cases:
            faults, _ = check(given, workshop.library("p", source, flags))
            seen = any(expected in fault for fault in faults) if expected else not faults
            assert seen, (source, expected, faults)
    print(f"isa: self-test passed ({sum(1 for c in cases if c[1])} planted faults seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--machine": None})
    if given["--machine"] not in RULES:
        sys.exit(f"isa: nothing is known of machine '{given['--machine']}' (ELF_MACHINE of toolchain.mk; isa.py: RULES)")
    if rest == ["--self-test"]:
        return self_test(given)
    if not rest:
        sys.exit(__doc__)
    faults, lines = check(given, rest[0], rest[1:])
    print("\n".join(lines))
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"isa: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
