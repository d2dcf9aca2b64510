#!/usr/bin/env python3
"""What formatters leave to people: comments, columns of the Makefile and of prose.

Comments of C++ files (words in `//`; a paragraph is what goes on at one indentation):
  orphan    no line of a paragraph ends before column SHORT in mid-sentence where the next line's first word had
            room, and none but a long word or a sentence of its own stands alone on a line, or with one more;
  formula   none is broken behind an operator;
  entry     what goes on from an entry of a list or table hangs below the entry's text;
  rule      `// ---- title ----` is one line;
  column    none goes beyond MARGIN.
Formulas, lists and tables are their writer's: a line that is indented deeper, begins with a mark, or holds a gap
of blanks begins something of its own.

Code: the head of an enum ends in ` {`, not in an initialiser's `{`, and no comment behind a declaration pushes its
value onto the next line. Makefiles have MAKE_COLUMNS at most, prose PROSE_COLUMNS (tables, code and what has no
blank to break at aside).

usage: layout.py [ROOT]       check the tree at ROOT (default: the working folder)
       layout.py --self-test
"""
import os
import re
import sys
import tempfile

from names import tracked

MARGIN = 110         # .clang-format's
SHORT = 80           # a line that ends here or later is full
FULL = 90            # one that ends before here had no need to break off a word or two
LONG_WORD = 18       # characters, which may stand alone
MAKE_COLUMNS = 120
PROSE_COLUMNS = 100
WIDE_YET = {         # prose and Makefiles that are not held to their columns; each leaves once it keeps them
    "doc/ICD.md",
}

LITERAL = re.compile(r'R"(?P<tag>[^(\s]*)\(.*?\)(?P=tag)"|"(?:\\.|[^"\\])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\])+\'')
RAW = re.compile(r'R"([^(\s"]*)\(')
COMMENT = re.compile(r"//[/!]?<?(?=\s|$)")
MARK = re.compile(r"([-*+]|\d+[.):]|\(?[a-z0-9]\)|[@\\]\w+) +")
GAP = re.compile(r"(?<=[^\s.:;?!)])  +(?=\S)|(?<=\S)   +(?=\S)")
SENTENCE_END = re.compile(r"[.:;!?][)'\"`]*$")
OPERATOR_END = re.compile(r"[\w)\]] [-+*/=<>]$")
TITLE = re.compile(r"---- .*[^-]$")
RULER = re.compile(r"-{8,}$")
APART = re.compile(r"SPDX-|---- .*---$")
ENUM_HEAD = re.compile(r"\benum\b[^;{]*\w\{")


class Line:
    """A line with a comment: the code before it, the blanks before its text, the text, and where the line ends."""

    def __init__(self, number, whole, begin, marker):
        body = whole[begin + len(marker):].rstrip()
        self.number, self.column, self.marker = number, begin, marker
        self.code, self.text = whole[:begin].rstrip(), body.lstrip()
        self.indent, self.end = len(body) - len(self.text), len(whole.rstrip())
        lead = MARK.match(self.text) or GAP.search(self.text)
        self.hang = self.indent + lead.end() if lead else self.indent  # where an entry's text begins

    def is_entry(self):
        return self.hang != self.indent

    def fits(self, text):
        return self.end + 1 + len(text.split()[0]) <= MARGIN


def comments(text):
    """Lines with a `//` comment that is in no literal."""
    raw = None
    for number, line in enumerate(text.splitlines(), 1):
        if raw is not None:
            at = line.find(raw)
            if at < 0:
                continue
            line, raw = " " * (at + len(raw)) + line[at + len(raw):], None
        bare = LITERAL.sub(lambda m: "_" * len(m.group(0)), line)
        found, opened = COMMENT.search(bare), RAW.search(bare)
        if opened and not (found and found.start() < opened.start()):
            raw = f'){opened.group(1)}"'
        elif found:
            yield Line(number, line, found.start(), found.group(0))


def runs(text):
    """Comments that go on from each other: on lines next to each other, in one column, of one kind."""
    run = []
    for line in comments(text):
        if run and not (line.number == run[-1].number + 1 and not line.code and line.column == run[-1].column
                        and line.marker == run[-1].marker):
            yield run
            run = []
        run.append(line)
    if run:
        yield run


def paragraphs(run):
    """Lines of the run that one sentence may lead through."""
    base = min((line.indent for line in run if line.text), default=0)
    part = []
    for line in run:
        if part:
            first, last = part[0], part[-1]
            goes_on = line.indent in (first.hang, first.indent) if last is first else line.indent == last.indent
            by_itself = not first.is_entry() and first.indent > base  # a formula, a line of code
            if not line.text or line.is_entry() or not goes_on or by_itself or APART.match(last.text):
                yield part
                part = []
        if line.text:
            part.append(line)
    if part:
        yield part


def faults_of_pair(a, b, is_first):
    """What is wrong where b goes on from a in a paragraph."""
    ends = SENTENCE_END.search(a.text)
    if RULER.fullmatch(b.text) and TITLE.match(a.text):
        yield b, "rule apart from its title"
    elif OPERATOR_END.search(a.text):
        yield a, "formula broken behind an operator"
    elif is_first and a.is_entry() and b.indent == a.indent:
        if a.end >= FULL and not ends:
            yield b, "goes on from an entry, but does not hang below its text"
    elif a.end < SHORT and not ends and a.fits(b.text):
        yield a, "orphan: ends early in mid-sentence"
    elif a.end >= FULL and not ends and len(b.text.split()) <= 2 and len(b.text) < LONG_WORD:
        yield b, "orphan: a word or two alone"


def faults_of_comments(text):
    for run in runs(text):
        for line in run:
            if line.end > MARGIN and " " in line.text[:MARGIN - line.column]:
                yield line.number, f"comment beyond column {MARGIN}", line.text
        for part in paragraphs(run):
            for a, b in zip(part, part[1:]):
                for line, fault in faults_of_pair(a, b, a is part[0]):
                    yield line.number, fault, line.text


def faults_of_code(text):
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        if ENUM_HEAD.search(line):
            yield number, "an enum laid out as an initialiser", line
    for comment in comments(text):
        before = lines[comment.number - 2] if comment.number > 1 else ""
        if before.endswith(" =") and comment.code and len(before) + 1 + len(comment.code.strip()) <= MARGIN:
            yield comment.number, "a value pushed onto a line of its own by its comment", comment.text


def faults_of_prose(text):
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        begin = line.lstrip()
        if fenced or len(line) <= PROSE_COLUMNS or begin[:1] in ("|", "<"):
            continue
        if " " in begin[2:PROSE_COLUMNS]:
            yield number, f"prose beyond column {PROSE_COLUMNS}", line


def faults_of_make(text):
    for number, line in enumerate(text.splitlines(), 1):
        if len(line.expandtabs(8)) > MAKE_COLUMNS:
            yield number, f"beyond column {MAKE_COLUMNS}", line


CHECKS = {
    ".cpp": (faults_of_comments, faults_of_code), ".hpp": (faults_of_comments, faults_of_code),
    ".c": (faults_of_comments,), ".h": (faults_of_comments,),
    ".md": (faults_of_prose,), ".mk": (faults_of_make,), "Makefile": (faults_of_make,),
}


def check(root, wide_yet):
    faults, files = [], 0
    for path in tracked(root):
        full = os.path.join(root, path)
        checks = CHECKS.get(os.path.splitext(path)[1] or os.path.basename(path))
        if not checks or not os.path.isfile(full):
            continue
        files += 1
        with open(full, encoding="utf-8") as file:
            text = file.read()
        found = [f"{path}:{number}: {fault}: {line.strip()[:60]}"
                 for faults_of in checks for number, fault, line in faults_of(text)]
        if path in wide_yet:
            found = [] if found else [f"{path}:1: keeps its columns now: take it out of WIDE_YET"]
        faults.extend(found)
    return faults, files


def filled(length, words="as far as the margin lets it go so that it may be read without "):
    """Text of just that length that breaks off in mid-sentence."""
    return (words * (length // len(words) + 1))[:length - 1] + "x"


def self_test():
    full = filled(100)
    planted = {
        # orphans
        f"/// {full}\n/// one\n/// more line of it": True,
        f"/// {full}\n/// the end.": True,
        f"/// {full}\n/// the end of it.": False,
        f"/// {full}\n/// unit_tests/opencv/test_mean_shift.cpp": False,
        f"/// {full[:-1]}.\n/// No more.": False,
        "/// Ends early and\n/// goes on for no reason.": True,
        "/// Ends early.\n/// Begins anew.": False,
        f"/// Ends early\n/// {'w' * 99}": False,
        "/// Ends early\n// is of another kind": False,
        "/// Ends early\n///\n/// Begins anew": False,
        "  int a = 0;  // ends early and\n              // goes on": True,
        "  int a = 0;  // one thing\n  int b = 0;  // another thing": False,
        f"  int a = 0;  ///< {filled(85)}\n              ///< alone": True,
        f'  f("// {full}");\n  g("// one");': False,
        f'auto s = R"(\n// {full}\n// one\n)";': False,
        "// SPDX-License-Identifier: Apache-2.0\n// What it is.": False,
        # formulas, lists and tables
        "/// With\n///   a = b + c\n///   d = e\n/// it is": False,
        f"/// {filled(90)} = y *\n/// z, and so on for a while": True,
        "///   name   what\n///   other  what\n///   longest what": False,
        f"///   name   {filled(90)}\n///   it is": True,
        f"///   name   {filled(90)}\n///          it is known by": False,
        f"/// - {full}\n/// the entry goes on here": True,
        f"/// - {full}\n///   the entry goes on here": False,
        f"/// - {full}\n///   end": True,
        "/// - one\n/// - two": False,
        "// ---- title\n// ------------------------": True,
        "// ---- title ------------------------\n// Text of it.": False,
        f"/// {filled(107)}": True,
        f"/// https://a.b/{'c' * 100}": False,
        # code
        "enum class [[nodiscard]] A : std::uint8_t{": True,
        "enum class A : std::uint8_t {": False,
        "double a =\n    1.0;  ///< something long": True,
        "double a =\n    // something long\n    1.0;": False,
        f"double {'a' * 60} =\n    {'b' * 60};  // something": False,
    }
    prose = {
        filled(101): True,
        filled(100): False,
        f"- {filled(120)}": True,
        f"| {filled(120)} |": False,
        f"```\n{filled(120)}\n```\n": False,
        f"```\na\n```\n{filled(120)}": True,
        "https://a.b/" + "c" * 120: False,
    }
    wide_yet = {"still.md": (filled(101), False), "no_more.md": (filled(100), True)}
    recipes = {filled(120): False, filled(121): True, "\t" + filled(113): True, "\t" + filled(112): False}
    cases = [(f"{i:02d}{kind}", text, is_fault) for kind, table in ((".hpp", planted), (".md", prose), (".mk", recipes))
             for i, (text, is_fault) in enumerate(table.items())]
    cases.extend((name, *case) for name, case in wide_yet.items())
    with tempfile.TemporaryDirectory() as root:
        for name, text, _ in cases:
            with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                file.write(text + "\n")
        faults, files = check(root, wide_yet)
    assert files == len(cases), files
    for name, text, is_fault in cases:
        assert any(f.startswith(name + ":") for f in faults) == is_fault, (text, [f for f in faults if f.startswith(name)])
    print(f"layout: self-test passed ({sum(is_fault for _, _, is_fault in cases)} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults, files = check(arguments[0] if arguments else ".", WIDE_YET)
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"layout: {files} files, {len(faults)} faults")
    return 1 if faults or not files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
