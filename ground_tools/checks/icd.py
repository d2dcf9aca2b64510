#!/usr/bin/env python3
"""The tables of doc/ICD.md that the code knows: numbers of statuses, fields of telemetry, offsets of telecommands.

usage: icd.py [ROOT]            tells where the ICD differs from the code
       icd.py --write [ROOT]    makes its tables
       icd.py --self-test

Numbers of the statuses: every enumeration of flight code that the ICD names in backticks. Telemetry: each field as the list
in fsw/app/telemetry.cpp sends it, with type and meaning (its comment) from telemetry.hpp and the unit from its name. Telecommands:
offset, type and size from the list in fsw/app/telecommand.cpp; name, unit and meaning are the ICD's own.
"""
import glob
import os
import re
import sys

ICD = "doc/ICD.md"
TELEMETRY, TELECOMMAND = "fsw/app/telemetry", "fsw/app/telecommand"
HEADERS = ("fsw/*/*.hpp", "mission_cfg/*.hpp")
HEAD_BYTES, CRC_BYTES = 8, 4
TYPES = {"std::uint8_t": ("u8", 1), "std::uint16_t": ("u16", 2), "std::uint32_t": ("u32", 4), "std::uint64_t": ("u64", 8),
         "float": ("f32", 4), "double": ("f64", 8), "Pose3": ("pose", 56)}
UNITS = (("_rad_per_m", "rad/m"), ("_rad", "rad"), ("_m", "m"), ("_px", "px"), ("_us", "us"), ("_ops", "operations"),
         ("bytes", "bytes"))


def read(root):
    """path -> text, of all that is looked at."""
    paths = [p for pattern in HEADERS for p in glob.glob(os.path.join(root, pattern))]
    paths += [os.path.join(root, p) for p in (ICD, TELEMETRY + ".cpp", TELECOMMAND + ".cpp")]
    texts = {}
    for path in sorted(paths):
        with open(path, encoding="utf-8") as file:
            texts[os.path.relpath(path, root).replace(os.sep, "/")] = file.read()
    return texts


def bare(text):
    return re.sub(r"//.*", "", text)


def enumerations(texts):
    """name -> its enumerators as (number, name)."""
    found = {}
    for path, text in texts.items():
        if not path.endswith(".hpp"):
            continue
        for name, body in re.findall(r"enum class (?:CAIRN_NODISCARD )?(\w+)[^{;]*{([^}]*)}", bare(text)):
            number, members = -1, []
            for member in filter(None, (m.strip() for m in body.split(","))):
                member, _, value = (part.strip() for part in member.partition("="))
                number = int(value) if value else number + 1
                members.append((number, member))
            found[name] = members
    return found


def constants(texts):
    found = {}
    for path, text in texts.items():
        if path.endswith(".hpp"):
            found.update(re.findall(r"inline constexpr std::size_t (\w+) = (\d+);", bare(text)))
    return found


def members(struct, known):
    """name -> (type as the ICD has it, bytes, meaning) of each member of a struct's text."""
    found = {}
    pattern = re.compile(r"((?:^  /// .*\n)*)^  ((?:std::array<([\w:]+), ([\w:]+)>)|[\w:]+) (\w+)(?: = [^;]*|{})?;(?: *///< ?(.*))?$"
                         r"((?:\n +///< ?.*$)*)", re.M)
    for before, whole, item, count, name, comment, more in pattern.findall(struct):
        words = " ".join(re.findall(r"/// (.*)", before) + [comment] + re.findall(r"///< ?(.*)", more)).strip()
        kind, size = TYPES.get(item or whole, (None, 0))
        if kind and count:
            length = int(known.get(count.split("::")[-1], count))
            kind, size = f"{kind} x {length}", size * length
        if kind:
            found[name] = (kind, size, words)
    return found


def structs(text):
    return dict(re.findall(r"^struct (\w+) {\n(.*?)^};", text, re.M | re.S))


def unit_of(name, kind):
    if kind == "pose":
        return "m"
    return next((unit for suffix, unit in UNITS if name.endswith(suffix)), "")


def telemetry(texts, faults):
    """number -> (rows of the table, bytes of the packet)."""
    known = constants(texts)
    types = {name: number for number, name in enumerations(texts)["TelemetryType"]}
    tables = {}
    all_structs = structs(texts[TELEMETRY + ".hpp"])
    lists = dict(re.findall(r"const (\w+)\*\) {\n(.*?)^}", texts[TELEMETRY + ".cpp"], re.M | re.S))
    for report, struct in all_structs.items():
        kind = re.search(r"kType = TelemetryType::(\w+)", struct)
        if not kind:
            continue
        fields = members(struct, known)
        sent = re.findall(r"w\.field\(r\.(\w+)\);", lists.get(report, ""))
        if sorted(sent) != sorted(fields):
            faults.append(f"{report}: its fields are not those that {TELEMETRY}.cpp sends: "
                          + ", ".join(sorted(set(sent) ^ set(fields)) or sent))
            continue
        offset, rows = HEAD_BYTES, []
        for name in sent:
            type_name, size, words = fields[name]
            rows.append(f"| {offset} | {type_name} | `{name}` | {unit_of(name, type_name)} | {words} |")
            offset += size
        rows.append(f"| {offset} | u32 | CRC | | |")
        tables[types[kind.group(1)]] = (rows, offset + CRC_BYTES)
    return tables


def telecommands(texts):
    """number -> (types of its fields with their bytes), of those that have a fixed size."""
    numbers = {name: number for number, name in enumerations(texts)["CommandType"]}
    known = constants(texts)
    fields = members(structs(texts[TELECOMMAND + ".hpp"])["Command"], known)
    parts = {part: members(next((structs(t)[name] for t in texts.values() if name in structs(t)), ""), known)
             for part, name in (("upload", "UploadPlan"), ("attitude", "MeasuredAttitude"))}
    body = re.search(r"switch \(c\.type\) {\n(.*?)^  }", texts[TELECOMMAND + ".cpp"], re.M | re.S).group(1)
    found, open_cases, sizes = {}, [], []
    for case, path, end in re.findall(r"case CommandType::(\w+):|w\.field\(c\.([\w.]+)\);|(return true|break);", bare(body)):
        if case:
            open_cases.append(case)
        elif path:
            part, _, name = path.rpartition(".")
            kind, size, _ = (parts[part] if part else fields)[name]
            item, _, count = kind.partition(" x ")
            count = int(count or 1)
            sizes += [(item, size // count)] * count
        else:
            if end == "return true":
                found.update({numbers[c]: sizes for c in open_cases})
            open_cases, sizes = [], []
    return found


def section(lines, start):
    """(first row, one past the last) of the table that follows line `start`; None where a heading comes first."""
    at = start + 1
    while at < len(lines) and not lines[at].startswith("|"):
        if lines[at].startswith("#"):
            return None
        at += 1
    end = at
    while end < len(lines) and lines[end].startswith("|"):
        end += 1
    return (at + 2, end) if end > at else None


def status_rows(text, known):
    """A row for each enumeration of flight code that the ICD names, in the order in which it does."""
    outside = re.sub(r"### Numbers of the statuses\n.*?(?=\n#|\Z)", "", text, flags=re.S)
    named = dict.fromkeys(n for n in re.findall(r"`(\w+)`", outside) if n in known)
    return [f"| `{n}` | " + ", ".join(f"{number} `{name}`" for number, name in known[n]) + " |" for n in named]


def made(texts):
    """The ICD as the code has it, and faults that no table can mend."""
    faults = []
    down, up, known = telemetry(texts, faults), telecommands(texts), enumerations(texts)
    lines, at, seen = texts[ICD].split("\n"), 0, set()
    while at < len(lines):
        head = re.match(r"### (Telemetry|Telecommand) (\d+): ([^,]+), \d+ bytes$", lines[at])
        numbers = lines[at] == "### Numbers of the statuses"
        table = section(lines, at) if head or numbers else None
        if (head or numbers) and not table:
            faults.append(f"{ICD}:{at + 1}: no table follows")
        elif numbers:
            seen.add("numbers")
            lines[table[0]:table[1]] = status_rows("\n".join(lines), known)
        elif head:
            way, number, name = head.group(1), int(head.group(2)), head.group(3)
            seen.add((way, number))
            if way == "Telemetry" and number in down:
                rows, size = down[number]
                lines[table[0]:table[1]] = rows
            elif way == "Telecommand" and number in up:
                types = up[number] + [("u32", CRC_BYTES)]
                size = HEAD_BYTES + sum(s for _, s in types)
                if table[1] - table[0] != len(types):
                    faults.append(f"{ICD}:{at + 1}: {len(types) - 1} fields and the CRC, the table has {table[1] - table[0]} rows")
                    types = []
                offset = HEAD_BYTES
                for row, (kind, bytes_) in enumerate(types, table[0]):
                    cells = lines[row].split("|")
                    lines[row] = "|".join(["", f" {offset} ", f" {kind} ", *cells[3:]])
                    offset += bytes_
            else:
                faults.append(f"{ICD}:{at + 1}: no such packet in the code")
                at += 1
                continue
            lines[at] = f"### {way} {number}: {name}, {size} bytes"
        at += 1
    wanted = {("Telemetry", n) for n in down} | {("Telecommand", n) for n in up} | {"numbers"}
    faults += [f"{ICD}: nothing about {' '.join(map(str, w)) if isinstance(w, tuple) else w}"
               for w in sorted(wanted - seen, key=str)]
    return "\n".join(lines), faults


def check(texts):
    text, faults = made(texts)
    old, new = texts[ICD].split("\n"), text.split("\n")
    if old != new:
        at = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)))
        faults.append(f"{ICD}:{at + 1}: the code has it otherwise (make icd): {(new + [''])[at]}")
    return faults


def self_test():
    tree = {
        TELEMETRY + ".hpp": """enum class TelemetryType : std::uint8_t { kState = 1 };
struct StateReport {
  static constexpr TelemetryType kType = TelemetryType::kState;
  std::uint8_t status = 0;  ///< `SomeStatus`, of
                            ///< the state
  /// By status,
  /// each.
  std::array<std::uint32_t, kSomeCount> counts{};
  double range_m = 0.0;
};
""",
        TELEMETRY + ".cpp": """void walk(W& w, R& r, const StateReport*) {
  w.field(r.range_m);
  w.field(r.status);
  w.field(r.counts);
}
""",
        TELECOMMAND + ".hpp": """enum class CommandType : std::uint8_t {
  kGo = 1,    // there
  kSend = 2,
  kUp = 4,
};
struct Command {
  Pose3 pose;
  std::array<double, 2> number{};
};
""",
        TELECOMMAND + ".cpp": """bool walk() {
  switch (c.type) {
    case CommandType::kGo:
      w.field(c.pose);
      w.field(c.number);
      return true;
    case CommandType::kSend: return true;
    case CommandType::kUp: w.field(c.upload.id); return true;
  }
}
""",
        "fsw/core/a.hpp": """enum class CAIRN_NODISCARD SomeStatus : std::uint8_t {
  kFine,  ///< all
  kBad,
};
inline constexpr std::size_t kSomeCount = 2;
struct UploadPlan {
  std::uint32_t id = 0;
};
""",
        ICD: """### Telemetry 1: state, 29 bytes

Words.

| offset | type | field | unit | meaning |
|---|---|---|---|---|
| 8 | f64 | `range_m` | m |  |
| 16 | u8 | `status` |  | `SomeStatus`, of the state |
| 17 | u32 x 2 | `counts` |  | By status, each. |
| 25 | u32 | CRC | | |

### Telecommand 1: go, 84 bytes

| offset | type | field |
|---|---|---|
| 8 | pose | where |
| 64 | f64 | how far |
| 72 | f64 | how fast |
| 80 | u32 | CRC |

### Telecommand 2: send, 12 bytes

| offset | type | field |
|---|---|---|
| 8 | u32 | CRC |

### Telecommand 4: up, 16 bytes

| offset | type | field |
|---|---|---|
| 8 | u32 | id |
| 12 | u32 | CRC |

### Numbers of the statuses

| status | numbers |
|---|---|
| `SomeStatus` | 0 `kFine`, 1 `kBad` |

""",
    }
    assert check(tree) == [], check(tree)
    planted = (  # file, what stands there, what is planted
        ("fsw/core/a.hpp", "  kBad,", "  kBad,\n  kWorse,"),
        ("fsw/core/a.hpp", "kFine", "kGood"),
        ("fsw/core/a.hpp", "kSomeCount = 2", "kSomeCount = 3"),
        (TELEMETRY + ".hpp", "the state", "a state"),
        (TELEMETRY + ".hpp", "double range_m", "float range_m"),
        (TELEMETRY + ".hpp", "  double range_m = 0.0;\n", ""),
        (TELEMETRY + ".hpp", "  double range_m = 0.0;\n", "  double range_m = 0.0;\n  float more = 0.0F;\n"),
        (TELEMETRY + ".cpp", "  w.field(r.range_m);\n", ""),
        (TELEMETRY + ".cpp", "  w.field(r.status);\n  w.field(r.counts);\n", "  w.field(r.counts);\n  w.field(r.status);\n"),
        (TELECOMMAND + ".cpp", "      w.field(c.number);\n", ""),
        (TELECOMMAND + ".cpp", "kSend: return true", "kSend: w.field(c.pose); return true"),
        (ICD, "29 bytes", "30 bytes"),
        (ICD, "| 17 |", "| 18 |"),
        (ICD, "| 72 | f64 |", "| 72 | f32 |"),
        (ICD, "| 8 | u32 | id |\n", ""),
        (ICD, "| `SomeStatus` | 0", "| `Some` | 0"),
        (ICD, "| 25 | u32 | CRC | | |\n", "| `SomeStatus` | 0 `kFine`, 1 `kBad` |\n| 25 | u32 | CRC | | |\n"),
        (ICD, "### Telecommand 2: send, 12 bytes", "### Telecommand 3: send, 12 bytes"),
    )
    for path, old, new in planted:
        broken = dict(tree)
        broken[path] = tree[path].replace(old, new, 1)
        assert broken[path] != tree[path], (path, old)
        assert check(broken), (path, old, new)
    broken = dict(tree)
    broken[ICD] = made({**tree, ICD: tree[ICD].replace("29", "7").replace("0 `kFine`", "").replace("| 64 |", "| x |")})[0]
    assert check(broken) == []
    print(f"icd: self-test passed ({len(planted)} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    write = arguments[:1] == ["--write"]
    root = (arguments[1:] if write else arguments)[:1] or ["."]
    texts = read(root[0])
    if write:
        texts[ICD], _ = made(texts)
        with open(os.path.join(root[0], ICD), "w", encoding="utf-8") as file:
            file.write(texts[ICD])
    faults = check(texts)
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"icd: {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
