#!/usr/bin/env python3
"""No recursion, and the worst-case stack of each entry point, from GCC's call graphs (-fcallgraph-info=su).

usage: stack.py [--limit BYTES] [--top N] FILE.ci...     default: 16384 bytes, 15 entry points shown
       stack.py --self-test [--cxx CXX]

An entry point is a function that no other calls. Cycles, frames of unknown size and calls through pointers are faults:
the worst case is only known without them.
"""
import re
import subprocess
import sys
import tempfile

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

NODE = re.compile(r'node: \{ title: "([^"]*)" label: "((?:[^"\\]|\\.)*)"')
EDGE = re.compile(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"')
FRAME = re.compile(r"\\n(\d+) bytes \(([^)]*)\)")
POINTER = "__indirect_call"


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

    @staticmethod
    def plain(name):
        """Without the file of a local copy; a complete constructor (C1) is the base one (C2) where nothing is virtual."""
        return re.sub(r"C1E", "C2E", name.rsplit(":", 1)[-1])

    def read(self, line):
        node, edge = NODE.match(line), EDGE.match(line)
        if edge:
            self.calls.setdefault(self.plain(edge.group(1)), set()).add(self.plain(edge.group(2)))
        if not node:
            return
        name, label = node.groups()
        name = self.plain(name)
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


def check(paths, limit, top):
    """Faults, and the lines of the report."""
    graph = Graph(paths)
    faults = [f"no function in {len(paths)} call graphs"] if not graph.own else []
    faults += ["recursion: " + " -> ".join(graph.title(f) for f in group) for group in graph.cycles()]
    faults += [f"frame of unknown size: {graph.title(f)}" for f in sorted(graph.dynamic)]
    for caller, callees in sorted(graph.calls.items()):
        for callee in sorted(callees):
            if callee == POINTER:
                faults.append(f"call through a pointer in {graph.title(caller)} (stack.py: INDIRECT)")
            elif callee not in graph.own and not any(p.fullmatch(callee) for p, _ in EXTERNAL):
                faults.append(f"no stack figure for {graph.title(callee)}, called by {graph.title(caller)} (stack.py: EXTERNAL)")
    lines = []
    if not any(f.startswith("recursion") for f in faults):
        sys.setrecursionlimit(10000)
        called = {callee for callees in graph.calls.values() for callee in callees}
        known = {}
        entries = sorted(((graph.worst(f, known), f) for f in graph.own if f not in called), key=lambda e: (-e[0][0], e[1]))
        for (size, path), name in entries:
            if size > limit:
                chain = " > ".join(f"{graph.title(f)} [{graph.own.get(f, 0)}]" for f in path)
                faults.append(f"{size} bytes of stack, more than {limit}: {chain}")
        lines = [f"  {size:6d} bytes  {graph.title(name)}" for (size, _), name in entries[:top]]
        lines.insert(0, f"stack: {len(graph.own)} functions, {len(entries)} entry points, worst "
                        f"{entries[0][0][0] if entries else 0} of {limit} bytes")
    return faults, lines


def self_test(compiler):
    planted = {
        "int leaf(int x) { return x + 1; }": None,
        "extern \"C\" void* memcpy(void*, const void*, unsigned long); void f(void* a, void* b, unsigned long n) { memcpy(a, b, n); }": None,
        "int f(int); __attribute__((noinline)) int g(int x) { return x ? f(x - 1) + 1 : 0; } int f(int x) { return g(x) * 2; }": "recursion",
        "int f(int n) { return n < 2 ? 1 : f(n - 1) * f(n - 2) + 3; }": "recursion",
        "void use(char*); __attribute__((noinline)) void use(char* p) { *p = 1; asm(\"\" ::: \"memory\"); } "
        "void big() { char a[20000]; use(a); asm(\"\" :: \"r\"(a) : \"memory\"); }": "bytes of stack",
        "void f(int n) { char a[n]; asm(\"\" :: \"r\"(a) : \"memory\"); }": "unknown size",
        "int f(int (*g)(int)) { return g(1) + 1; }": "pointer",
        "int other(); int f() { return other() + 1; }": "no stack figure",
    }
    with tempfile.TemporaryDirectory() as folder:
        for i, (source, expected) in enumerate(planted.items()):
            name = f"{folder}/{i}"
            with open(name + ".cpp", "w", encoding="utf-8") as file:
                file.write(source)
            subprocess.run([compiler, "-O1", "-fstack-usage", "-fcallgraph-info=su", "-c", name + ".cpp", "-o", name + ".o"],
                           check=True)
            faults, _ = check([name + ".ci"], 16384, 1)
            seen = any(expected in fault for fault in faults) if expected else not faults
            assert seen, (source, expected, faults)
    assert check([], 1, 1)[0], "nothing to read is a fault"
    print(f"stack: self-test passed ({sum(1 for e in planted.values() if e)} planted faults seen)")


def main(arguments):
    options = {"--limit": "16384", "--top": "15", "--cxx": "g++"}
    for option in options:
        if option in arguments:
            at = arguments.index(option)
            options[option] = arguments[at + 1]
            del arguments[at:at + 2]
    if arguments == ["--self-test"]:
        return self_test(options["--cxx"])
    faults, lines = check(arguments, int(options["--limit"]), int(options["--top"]))
    print("\n".join(lines))
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"stack: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
