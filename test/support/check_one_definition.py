#!/usr/bin/env python3
"""Types of one name in one namespace that two files define differently: the compiler
sees each alone, the linker keeps one of two destructors, and the program ends somewhere
else. (g++ -flto -Wodr finds them, too, and takes minutes.)

  check_one_definition.py FOLDER
"""
import collections
import pathlib
import re
import sys

OPENS = re.compile(r"namespace ?([\w:]*) ?\{")
CLOSES = re.compile(r"^(\}+) // namespace")
DEFINES = re.compile(r"^(?:struct|class|enum class) (?:\w+\(\w*\) )?(\w+)(?: final)?(?: :[^;]*)?\s*\{?$")


def definitions(path):
    """Names of types at the level of a namespace that has a name."""
    stack = []
    for line in path.read_text(errors="replace").splitlines():
        if not line.lstrip().startswith("//"):
            stack += OPENS.findall(line) if line.startswith("namespace") else []
        if closes := CLOSES.match(line):
            del stack[len(stack) - min(len(closes[1]), len(stack)):]
        if (defines := DEFINES.match(line)) and stack and "" not in stack:
            yield "::".join([*stack, defines[1]])


def main(root):
    files = collections.defaultdict(list)
    for folder in ("include", "src", "apps"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".h", ".hpp", ".cpp"):
                for name in definitions(path):
                    files[name].append(str(path.relative_to(root)))
    several = {name: where for name, where in files.items() if len(where) > 1}
    for name, where in sorted(several.items()):
        print(f"{name} is defined in {' and '.join(where)}")
    return 1 if several or not files else 0


sys.exit(main(pathlib.Path(sys.argv[1])))
