#!/usr/bin/env python3
"""Pages of prose: what they point at is there, and their tables can be read.

  link    every link to a file or a heading of the repository leads somewhere; so does every `doc/...` that code names;
  file    every file of the repository that stands between backquotes exists (`localizer/localizer.hpp` is fsw's);
  goal    every `make goal` is a goal of a Makefile;
  table   every table has its rule of dashes below its first row: a blank line in it makes two, one without;
  cell    no cell of a table has more than CELL_WORDS words (the ICD aside, whose rows are its fields).

usage: prose.py [ROOT]       check the tree at ROOT (default: the working folder)
       prose.py --self-test
"""
import os
import re
import sys
import tempfile

from names import tracked

CELL_WORDS = 15
WIDE_TABLES = {"doc/ICD.md"}
FOLDERS = ("", "fsw", "ground_tools")  # where a file's name may begin

LINK = re.compile(r"\]\(([^)\s]+)\)|src=\"([^\"]+)\"")
HEADING = re.compile(r"#+ (.*)")
SPAN = re.compile(r"`([^`]+)`")
FILE = re.compile(r"[\w.-]+(?:/[\w.-]+)+\.(?:hpp|cpp|h|c|S|s|ld|mk|py|sh|js|css|html|toml|md|csv|jpg)")
DOC_FILE = re.compile(r"(?<![\w/.-])doc/[\w/.-]*\w")
MAKE = re.compile(r"(?:^|[\s`(&;])make((?:\s+[A-Z_0-9]+=(?:'[^']*'|\S+))*)((?:\s+[a-z][a-z-]*)*)(?=$|[\s`,;:.)])")
GOAL = re.compile(r"^([\w.-]+(?: [\w.-]+)*)\s*:(?!=)", re.MULTILINE)
RULE = re.compile(r"\|(\s*:?-+:?\s*\|)+$")
MADE = re.compile(r"check-")  # goals that the Makefile makes from lists


def anchor(heading):
    """A heading's anchor, as GitHub makes it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip().lower())
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def lines_of(text):
    """Number, line, and whether it is code."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            continue
        yield number, line, fenced


def anchors(text):
    found = set()
    for _, line, fenced in lines_of(text):
        heading = HEADING.match(line)
        if heading and not fenced:
            name, n = anchor(heading.group(1)), 0
            while name + (f"-{n}" if n else "") in found:
                n += 1
            found.add(name + (f"-{n}" if n else ""))
    return found


def words(cell):
    return sum(1 for word in cell.split() if re.search(r"\w", word))


class Tree:
    def __init__(self, root):
        self.root, self.files = root, tracked(root)
        self.names = set(self.files)
        for path in self.files:
            while os.path.dirname(path):
                path = os.path.dirname(path)
                self.names.add(path)
        self.heads = {folder: {n[len(folder) + 1 if folder else 0:].split("/")[0] for n in self.names
                               if not folder or n.startswith(folder + "/")} for folder in FOLDERS}
        makefiles = [self.read(path) for path in self.files if os.path.basename(path) == "Makefile"]
        self.goals = {goal for text in makefiles for goals in GOAL.findall(text) for goal in goals.split()}

    def read(self, path):
        with open(os.path.join(self.root, path), encoding="utf-8", errors="replace") as file:
            return file.read()

    def link_fault(self, page, target):
        if re.match(r"\w+:", target):
            return None  # another place
        path, _, name = target.partition("#")
        full = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if full not in self.names:
            return f"no {full}"
        if name and (not full.endswith(".md") or name not in anchors(self.read(full))):
            return f"no heading '{name}' in {full}"
        return None

    def file_fault(self, page, name):
        """Only names that begin with a folder of the repository are its files."""
        places = [os.path.join(folder, name) for folder in FOLDERS if name.split("/")[0] in self.heads[folder]]
        if name.split("/")[0] == "build" or not places or any(place in self.names for place in places):
            return None
        beside = os.path.normpath(os.path.join(os.path.dirname(page), name))
        return None if beside in self.names else f"no {name}"

    def faults_of_page(self, page):
        rows = 0  # of the table so far
        for number, line, fenced in lines_of(self.read(page)):
            rows = rows + 1 if not fenced and line.startswith("|") else 0
            if rows == 2 and not RULE.match(line.rstrip()):
                yield number, "a table without a rule below its first row"
            code = [line] if fenced else SPAN.findall(line)
            if not fenced:
                for found in LINK.findall(SPAN.sub("", line)):
                    fault = self.link_fault(page, "".join(found))
                    if fault:
                        yield number, fault
                for span in code:
                    fault = self.file_fault(page, span) if FILE.fullmatch(span) else None
                    if fault:
                        yield number, fault
            for text in code:
                for _, goals in MAKE.findall(text.split("#")[0]):
                    for goal in goals.split():
                        if goal not in self.goals and not MADE.match(goal):
                            yield number, f"no goal '{goal}' of make"
            if not fenced and line.startswith("|") and page not in WIDE_TABLES:
                for cell in re.split(r"(?<!\\)\|", line):
                    if words(cell) > CELL_WORDS:
                        yield number, f"{words(cell)} words in a cell: {cell.strip()[:40]}"

    def faults_of_code(self, path):
        for number, line in enumerate(self.read(path).splitlines(), 1):
            for name in DOC_FILE.findall(line):
                if name.rstrip(".") not in self.names:
                    yield number, f"no {name}"


def check(root):
    tree, faults, pages = Tree(root), [], 0
    for path in tree.files:
        if not os.path.isfile(os.path.join(root, path)) or path.startswith("ground_tools/checks/"):
            continue  # checks name what is not there, to be seen
        if path.endswith(".md"):
            pages += 1
            found = tree.faults_of_page(path)
        elif path.endswith((".cpp", ".hpp", ".c", ".h", ".py", ".mk", ".js", ".html", ".csv", "Makefile")):
            found = tree.faults_of_code(path)
        else:
            continue
        faults.extend(f"{path}:{number}: {fault}" for number, fault in dict.fromkeys(found))
    return faults, pages


def self_test():
    planted = {
        "[a](b.md)": None,
        "[a](c.md)": "no doc/c.md",
        "[a](../README.md), [b](https://x.y/z)": None,
        "[a](b.md#two-words-2nd)": None,
        "[a](b.md#three)": "no heading 'three'",
        "[a](#here)\n# Here": None,
        "[a](#there)\n# Here": "no heading 'there'",
        "![a](p.jpg)": "no doc/p.jpg",
        '<img src="p.jpg" alt="">': "no doc/p.jpg",
        "`[a](c.md)`": None,
        "[`a`](c.md)": "no doc/c.md",
        "```\n[a](c.md)\n```": None,
        "`fsw/m/a.hpp`, `m/a.hpp`, `b.md`, `OUT/x.csv`": None,
        "`m/b.hpp`": "no m/b.hpp",
        "`fsw/m/b.hpp`": "no fsw/m/b.hpp",
        "`make good`, `make A=b C='d e' good`, make sure": None,
        "`make bad`": "no goal 'bad'",
        "```\nmake A=b bad  # comment\n```": "no goal 'bad'",
        "```\nmake good   # make bad jokes\n```": None,
        "| a | b |\n|---|:-:|\n| c | d |": None,
        "| a | b |\n|---|---|\n\n| c | d |\n| e | f |": "without a rule",
        f"| {'a ' * 15}| b |": None,
        f"| {'a ' * 16}| b |": "16 words",
        f"```\n| {'a ' * 16}| b |\n```": None,
    }
    with tempfile.TemporaryDirectory() as root:
        for folder in ("doc", "fsw/m"):
            os.makedirs(os.path.join(root, folder))
        files = {"README.md": "", "doc/b.md": "## Two words, 2nd", "fsw/m/a.hpp": "// doc/b.md\n",
                 "fsw/m/c.cpp": "// doc/none.md\n", "Makefile": "all good: x\nB := y\n"}
        for i, text in enumerate(planted):
            files[f"doc/t{i:02d}.md"] = text
        for name, text in files.items():
            with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                file.write(text + "\n")
        faults, pages = check(root)
    assert pages == len(planted) + 2, pages
    assert "fsw/m/c.cpp:1: no doc/none.md" in faults, faults
    for i, (text, expected) in enumerate(planted.items()):
        own = [f for f in faults if f.startswith(f"doc/t{i:02d}.md:")]
        assert any(expected in f for f in own) if expected else not own, (text, expected, own)
    assert not [f for f in faults if f.startswith(("README", "doc/b", "fsw/m/a"))], faults
    print(f"prose: self-test passed ({sum(1 for e in planted.values() if e) + 1} planted faults seen)")


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    faults, pages = check(arguments[0] if arguments else ".")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"prose: {pages} pages, {len(faults)} faults")
    return 1 if faults or not pages else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
