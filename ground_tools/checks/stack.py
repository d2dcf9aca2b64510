#!/usr/bin/env python3
"""No recursion, and the worst-case stack of each entry point, from GCC's call graphs (-fcallgraph-info=su).

usage: stack.py [TOOLS] --figures FIGURES.o FILE.ci...     each FILE.o beside its FILE.ci
       stack.py [TOOLS] --self-test

Cycles, frames of unknown size and calls through pointers are faults: the worst case is only known without them. So is a
call in an object that its graph does not have: the disassembly tells them. The limit is the budget of mission_cfg,
and holds for the jobs, and for every function that no other calls.
"""
import os
import re
import subprocess
import sys

import figures
import planted
import symbols

# What is called but not built here: bytes of stack, generously. assert_failed never comes back: the drive ends there.
EXTERNAL = (
    (re.compile(r"_ZN5cairn13assert_failedEPKci"), 0),
    (re.compile(r"_ZN5cairn3hal\w+"), 1024),  # the platform's: it may take this much
    (re.compile(r"(__builtin_)?(memcpy|memmove|memset|memcmp)"), 128),
    (re.compile(r"(sqrt|floor|ceil|trunc|round|rint|nearbyint|fmod|fabs|lround|llround)f?"), 128),
    (re.compile(r"__\w+(si|di|ti|sf|df)\w*\d*"), 256),  # arithmetic helpers of the compiler
)
# Functions that may call through a pointer, with what they may reach (patterns on the mangled name).
INDIRECT = {}
# What a caller of the library starts and steps: `class::method` of each gets a figure. These must be there.
ENTRY = re.compile(r"\bcairn::(?:\w+::)*(\w+)::(init|start|step|step_vo|step_boulders|step_fix|begin_\w*frame|run|cycle)\(")
REQUIRED = (("FlightApp", "init"), ("FlightApp", "cycle"))

NODE = re.compile(r'node: \{ title: "([^"]*)" label: "((?:[^"\\]|\\.)*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"')
FRAME = re.compile(r"\\n(\d+) bytes \(([^)]*)\)")
POINTER = "__indirect_call"
HEAD = re.compile(r"[0-9a-f]+ <(?!\.L)(.+?)(\.cold)?>:$")  # RISC-V objects keep their local labels
CALL = re.compile(r"R_(?:X86_64_PLT32|PPC_(?:PLT)?REL24|PPC_LOCAL24PC|SPARC_WDISP30|SPARC_WPLT30|RISCV_CALL(?:_PLT)?)\s+([^\s+-]+)")
CALL_BY_POINTER = re.compile(r"\t(call\s+(\*|%)|bctrl|blrl|jmpl\s.*%o7|jalr\s+(?!ra\b))")


def plain(name):
    """Without the file of a local copy; a complete constructor (C1) is the base one (C2) where nothing is virtual."""
    return re.sub(r"C1(?=[EI])", "C2", name.rsplit(":", 1)[-1])  # I: of a template


class Graph:
    def __init__(self, paths):
        self.own = {}       # function -> bytes of its frame (the largest of its copies)
        self.dynamic = set()
        self.label = {}
        self.calls = {}
        for path in paths:
            with open(path, encoding="utf-8") as file:
                for line in file:
                    self.read(line)
        for caller, patterns in INDIRECT.items():
            if POINTER in self.calls.get(caller, ()):
                self.calls[caller].remove(POINTER)
                self.calls[caller] |= {f for f in self.own if any(re.search(p, f) for p in patterns)}

    def read(self, line):
        node, edge = NODE.match(line), EDGE.match(line)
        if edge:
            self.calls.setdefault(plain(edge.group(1)), set()).add(plain(edge.group(2)))
        if not node:
            return
        name, label = node.groups()
        name = plain(name)
        if name.startswith("_GLOBAL__"):
            label = "static initialisation " + name
        self.label.setdefault(name, label.split("\\n")[0])
        frame = FRAME.search(label)
        if frame:
            self.own[name] = max(self.own.get(name, 0), int(frame.group(1)))
            if "dynamic" in frame.group(2) and "bounded" not in frame.group(2):
                self.dynamic.add(name)

    def title(self, name):
        return self.label.get(name, name)

    def cycles(self):
        """Strongly connected groups of more than one function, and functions that call themselves (Tarjan)."""
        index, low, on_stack, stack, groups = {}, {}, set(), [], []
        for root in sorted(self.own):
            work = [] if root in index else [(root, iter(sorted(self.calls.get(root, ()))))]
            if work:
                index[root] = low[root] = len(index)
                stack.append(root)
                on_stack.add(root)
            while work:
                at, rest = work[-1]
                following = next(rest, None)
                if following is None:
                    work.pop()
                    if work:
                        low[work[-1][0]] = min(low[work[-1][0]], low[at])
                    if low[at] == index[at]:
                        group = []
                        while not group or group[-1] != at:
                            group.append(stack.pop())
                            on_stack.remove(group[-1])
                        if len(group) > 1 or at in self.calls.get(at, ()):
                            groups.append(sorted(group))
                elif following not in index:
                    index[following] = low[following] = len(index)
                    stack.append(following)
                    on_stack.add(following)
                    work.append((following, iter(sorted(self.calls.get(following, ())))))
                elif following in on_stack:
                    low[at] = min(low[at], index[following])
        return groups

    def worst(self, name, known):
        """(bytes, path) of the deepest chain of calls from `name`. The graph has no cycle here."""
        if name not in known:
            deepest = max((self.worst(c, known) for c in sorted(self.calls.get(name, ()))), default=(0, ()),
                          key=lambda found: found[0])
            own = self.own.get(name)
            if own is None:
                own = next((size for pattern, size in EXTERNAL if pattern.fullmatch(name)), 0)
            known[name] = (own + deepest[0], (name,) + deepest[1])
        return known[name]


def unseen_calls(objdump, objects, calls):
    """Calls in the objects that are not in the graph, and how many calls there are."""
    text = subprocess.run([objdump, "--disassemble", "--reloc", "--no-show-raw-insn", *objects],
                          check=True, capture_output=True, text=True).stdout
    caller, found, seen = "", set(), 0
    for line in text.splitlines():
        head, call = HEAD.match(line), CALL.search(line)
        if head:
            caller = plain(head.group(1))
        callee = plain(re.sub(r"^\.text\.((unlikely|hot|startup|exit)\.)?", "", call.group(1))) if call else None
        if callee and re.fullmatch(symbols.REGISTERS, callee):  # into the caller's own frame, and no call of its source's
            continue
        callee = POINTER if CALL_BY_POINTER.search(line) and caller not in INDIRECT else callee
        seen += callee is not None
        if callee and callee != caller and callee not in calls.get(caller, ()):
            found.add((caller, callee))
    return sorted(found), seen


def short(title):
    """A function's title without return type, namespace and arguments."""
    return re.sub(r"cairn::(app::)?", "", re.sub(r"[(].*", "", title)).split(" ")[-1]


def entry_table(graph, known):
    """One line a class: the bytes of what is started and stepped."""
    rows = {}
    for name, label in graph.label.items():
        entry = ENTRY.search(label) if name in graph.own else None
        if entry:
            size = graph.worst(name, known)[0]
            row = rows.setdefault(entry.group(1), {})
            row[entry.group(2)] = max(row.get(entry.group(2), 0), size)
    lines = []
    for name, row in sorted(rows.items(), key=lambda item: (-max(item[1].values()), item[0])):
        lines.append(f"  {name:<24}" + "   ".join(f"{method} {size}" for method, size in sorted(row.items())))
    return rows, lines


def check(graphs, limit, objdump, required=REQUIRED):
    """Faults, and the lines of the report."""
    graph = Graph(graphs)
    faults = [f"no function in {len(graphs)} call graphs"] if not graph.own else []
    faults += ["recursion: " + " -> ".join(graph.title(f) for f in group) for group in graph.cycles()]
    faults += [f"frame of unknown size: {graph.title(f)}" for f in sorted(graph.dynamic)]
    for caller, callees in sorted(graph.calls.items()):
        for callee in sorted(callees):
            if callee == POINTER:
                faults.append(f"call through a pointer in {graph.title(caller)} (stack.py: INDIRECT)")
            elif callee not in graph.own and not any(p.fullmatch(callee) for p, _ in EXTERNAL):
                faults.append(f"no stack figure for {graph.title(callee)}, called by {graph.title(caller)} (stack.py: EXTERNAL)")
    unseen, seen = unseen_calls(objdump, [os.path.splitext(p)[0] + ".o" for p in graphs], graph.calls) if graphs else ((), 0)
    faults += [f"call that the graph does not have: {graph.title(caller)} -> {graph.title(callee)}" for caller, callee in unseen]
    if any(f.startswith("recursion") for f in faults):
        return faults, []
    sys.setrecursionlimit(10000)
    called = {callee for callees in graph.calls.values() for callee in callees}
    known = {}
    everywhere = sorted(((graph.worst(f, known), f) for f in graph.own), key=lambda e: (-e[0][0], e[1]))
    rows, lines = entry_table(graph, known)
    for (size, path), name in everywhere:
        if size > limit and name not in called:
            chain = " > ".join(f"{graph.title(f)} [{graph.own.get(f, 0)}]" for f in path)
            faults.append(f"{size} bytes of stack, more than {limit}: {chain}")
    faults += [f"no entry point {name}::{method}" for name, method in required if method not in rows.get(name, {})]
    others = [(size, graph.title(f)) for (size, _), f in everywhere if f not in called and not ENTRY.search(graph.title(f))]
    lines.insert(0, f"stack: {len(graph.own)} functions, {seen} calls in the objects, worst case "
                    f"{everywhere[0][0][0] if everywhere else 0} of {limit} bytes; bytes by entry point:")
    if everywhere:
        lines.append("  deepest: " + " > ".join(f"{short(graph.title(f))} {graph.own.get(f, '')}".strip() for f in everywhere[0][0][1]))
    if others:
        lines.append(f"  {len(others)} more that nothing here calls, at most {others[0][0]}: {others[0][1]}")
    return faults, lines


def self_test(given):
    memcpy = 'extern "C" void* memcpy(void*, const void*, __SIZE_TYPE__); '
    app = "namespace cairn { struct FlightApp { int init(); int cycle(); }; %s int FlightApp::cycle() { return 2; } }"
    cases = (  # source, what the fault names (None: no fault)
        ("int leaf(int x) { return x + 1; }", None),
        (memcpy + "void f(void* a, void* b, int n) { memcpy(a, b, n); }", None),
        ("int f(int n) { return n < 2 ? 1 : f(n - 1) * f(n - 2) + 3; }", "recursion: int f(int)"),
        ("__attribute__((noinline)) int f(int); __attribute__((noinline)) int g(int x) { return x < 2 ? 1 : f(x - 1) * f(x - 2) + 3; } "
         "int f(int x) { return g(x) * 2; }",
         "recursion: int f(int) -> int g(int)"),
        ("using F = int (*)(int, void*); int f(int n, void* p) { return n ? reinterpret_cast<F>(p)(n - 1, p) + 1 : 0; }",
         "call through a pointer in int f(int, void*)"),
        ("int f(int (*g)(int)) { return g(1); }", "call through a pointer in int f(int (*)(int))"),  # a jump, not a call
        ("struct A { int (A::*step)(int); int f(int x); }; int A::f(int x) { return (this->*step)(x) + 1; }",
         "call through a pointer in int A::f(int)"),
        ("void big() { char a[20000]; asm(\"\" :: \"r\"(a) : \"memory\"); }", "bytes of stack, more than 16384: void big()"),
        ("void low() { char a[9000]; asm(\"\" :: \"r\"(a) : \"memory\"); } void __attribute__((noinline)) mid() { low(); asm(\"\"); } "
         "void top() { char a[9000]; asm(\"\" :: \"r\"(a) : \"memory\"); mid(); asm(\"\"); }", "more than 16384: void top()"),
        ("void f(int n) { char a[n]; asm(\"\" :: \"r\"(a) : \"memory\"); }", "unknown size: void f(int)"),
        ("void f(int n) { asm(\"\" :: \"r\"(__builtin_alloca(n)) : \"memory\"); }", "unknown size: void f(int)"),
        ("int other(); int f() { return other() + 1; }", "no stack figure for int other(), called by int f()"),
        (app % "int FlightApp::init() { return 1; }", None, True),
        (app % "", "no entry point FlightApp::init", True),
    )
    with planted.Workshop(given["--cxx"], given["--ar"]) as workshop:
        for source, expected, *asked in cases:
            name = workshop.compile("planted", source)[:-2]
            faults, _ = check([name + ".ci"], 16384, given["--objdump"], REQUIRED if asked else ())
            seen = any(expected in fault for fault in faults) if expected else not faults
            assert seen, (source, expected, faults)
        # A graph that lost an edge: the object still has the call.
        name = workshop.compile("planted", "__attribute__((noinline)) int g(int x) { asm(\"\"); return x; } int f() { return g(1) + 1; }")[:-2]
        with open(name + ".ci", encoding="utf-8") as file:
            lines = [line for line in file if not line.startswith("edge")]
        with open(name + ".ci", "w", encoding="utf-8") as file:
            file.writelines(lines)
        faults, _ = check([name + ".ci"], 16384, given["--objdump"], ())
        assert any("graph does not have: int f() -> int g(int)" in fault for fault in faults), faults
    assert check([], 1, given["--objdump"], ())[0], "nothing to read is a fault"
    print(f"stack: self-test passed ({sum(1 for c in cases if c[1]) + 1} planted faults seen)")


def main(arguments):
    given, rest = planted.options(arguments, {"--figures": None})
    if rest == ["--self-test"]:
        return self_test(given)
    if not rest or not given["--figures"]:
        sys.exit(__doc__)
    limit = figures.read(given["--nm"], given["--figures"])["stack"][1]
    faults, lines = check(rest, limit, given["--objdump"])
    print("\n".join(lines))
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"stack: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
