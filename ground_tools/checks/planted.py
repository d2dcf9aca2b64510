"""What a self-test plants: small pieces of C++ compiled as flight code is, which a check must see, each in an archive beside
a piece without fault."""
import os
import subprocess
import tempfile

CLEAN = "int clean(const int* p) { return *p + 1; }"


class Workshop:
    """Compiles and archives in a folder of its own. `compiler` is the whole command: flags of flight code and all."""

    def __init__(self, compiler, ar):
        self.compiler, self.ar = compiler.split(), ar
        self.folder = tempfile.TemporaryDirectory()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def compile(self, name, source, flags=()):
        """The object of `source`; its call graph lies beside it (.ci)."""
        with open(self.path(name + ".cpp"), "w", encoding="utf-8") as file:
            file.write(source + "\n")
        subprocess.run([*self.compiler, *flags, "-w", "-c", self.path(name + ".cpp"), "-o", self.path(name + ".o")], check=True)
        return self.path(name + ".o")

    def library(self, name, source, flags=()):
        """lib<name>.a of `source` (planted.o) and a piece without fault (clean.o)."""
        archive = self.path("lib" + name + ".a")
        if not os.path.exists(self.path("clean.o")):
            self.compile("clean", CLEAN)
        objects = [self.compile("planted", source, flags), self.path("clean.o")]
        subprocess.run([self.ar, "rcsD", archive, *objects], check=True)
        return archive


FLAGS = " -O2 -ffunction-sections -fdata-sections -fstack-usage -fcallgraph-info=su"
TOOLS = {"--nm": "nm", "--ar": "ar", "--readelf": "readelf", "--objdump": "objdump", "--cxx": "g++" + FLAGS}


def options(arguments, more):
    """(values of the tools' options and of more, what else stands on the command line)."""
    values, rest, at = {**TOOLS, **more}, [], 0
    while at < len(arguments):
        if arguments[at] in values:
            values[arguments[at]] = arguments[at + 1]
            at += 1
        else:
            rest.append(arguments[at])
        at += 1
    return values, rest
