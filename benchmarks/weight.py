"""Print the weight of the project: lines, classes, modules of each command, what the demo runs.

``python benchmarks/weight.py [ROOT] [--demo]``: ``ROOT`` is another checkout, default this one.
"""

import ast
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).resolve().parents[1]
PLACES = ("src/*", "envs/*", "evidence/*", "tests", "benchmarks")
LOADED = """
import atexit, sys
atexit.register(lambda: print(sum(m.split(".")[0].startswith("chladni") for m in sys.modules)))
from chladni.__main__ import main
sys.argv = ["chladni", *sys.argv[1:]]
main()
"""
RUN = """
import atexit, sys
seen = set()
def called(code):
    if code.co_flags & 1 and not code.co_name.startswith("<"):  # functions, not bodies
        seen.add((code.co_filename, code.co_firstlineno))
def count():
    sys.setprofile(None)
    ours = {(f, k) for f, k in seen if "/chladni" in f and "site-packages" not in f}
    print(len({f for f, _ in ours}), "files,", len(ours), "functions")
atexit.register(count)
sys.setprofile(lambda frame, event, _: event == "call" and called(frame.f_code))
from chladni.__main__ import main
sys.argv = ["chladni", "demo", "--out", "demo"]
main()
"""


def lines(folder: Path) -> tuple[int, int, int]:
    """Lines, files and classes of the Python below a folder."""
    texts = [f.read_text(encoding="utf-8") for f in folder.rglob("*.py")]
    classes = sum(isinstance(n, ast.ClassDef) for t in texts for n in ast.walk(ast.parse(t)))
    return sum(t.count("\n") for t in texts), len(texts), classes


def last_line(root: Path, code: str, *words: str) -> str:
    """Last line that a program prints with the packages of a checkout."""
    path = os.pathsep.join(str(root / name) for name in ("src", "envs", "evidence"))
    with TemporaryDirectory() as scratch:
        done = subprocess.run(
            [sys.executable, "-c", code, *words], cwd=scratch, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
    return (done.stdout.splitlines() or [done.stderr[-300:]])[-1]


def main(root: Path, demo: bool) -> None:
    """Print the tables."""
    print("| package | lines | files | classes |\n|---|---|---|---|")
    whole = [0, 0, 0]
    for folder in sorted(f for place in PLACES for f in root.glob(place) if f.is_dir()):
        each = lines(folder)
        if each[1]:
            print(f"| {folder.relative_to(root)} | {each[0]} | {each[1]} | {each[2]} |")
            if folder.parent != root:
                whole = [a + b for a, b in zip(whole, each, strict=True)]
    print(f"| all but tests and benchmarks | {whole[0]} | {whole[1]} | {whole[2]} |")
    print("\n| command | modules loaded by its --help |\n|---|---|")
    for name in ("", "modes", "check", "correlate", "calibrate", "diagnose", "plan", "study"):
        print(f"| {name} | {last_line(root, LOADED, *name.split(), '--help')} |")
    if demo:
        print(f"\nchladni demo runs {last_line(root, RUN)}")


if __name__ == "__main__":
    words = [w for w in sys.argv[1:] if w != "--demo"]
    main(Path(words[0]).resolve() if words else HERE, "--demo" in sys.argv)
