"""Pages of docs/ as a reader has them: blocks of code in order, files, what is printed."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SAVED = re.compile(r"this as `([\w./-]+\.\w+)`")
_TITLE = re.compile(r"# ([\w/]+\.(?:py|yaml))\n")
SHELL = "bash"


@dataclass(frozen=True)
class Block:
    """A block of a page.

    Attributes:
        language: what stands behind the three backticks.
        text: its lines.
        line: of the page, from 1.
        saved: the file that the page says to save it as, if any.
        printed: the block of text that follows at once, which is what it prints, if any.
    """

    language: str
    text: str
    line: int
    saved: str | None = None
    printed: str | None = None


def read_page(name: str) -> str:
    """The text of a page by its path in docs/."""
    return (DOCS / name).read_text("utf-8")


def list_blocks(text: str) -> list[Block]:
    """All blocks of a page but those that are what the block before prints."""
    found = [*_BLOCK.finditer(text)]
    blocks, end, printed_at = [], 0, -1
    for number, block in enumerate(found):
        language, content = block[1], block[2]
        before, end = text[end : block.start()], block.end()
        if number == printed_at:
            continue
        saved, title = [*_SAVED.findall(before)], _TITLE.match(content)
        name = saved[-1] if saved else title[1] if title else None
        printed = None
        below = found[number + 1] if number + 1 < len(found) else None
        is_code = language in ("python", SHELL)
        if is_code and below and below[1] == "text" and not text[end : below.start()].strip():
            printed, printed_at = below[2], number + 1
        line = text.count("\n", 0, block.start()) + 1
        blocks.append(Block(language, content, line, name, printed))
    return blocks


def drop_lines(script: str, prefixes: tuple[str, ...]) -> str:
    """A script without the commands that begin so, each with the lines that go on with it."""
    kept, is_dropped = [], False
    for line in script.splitlines(keepends=True):
        is_dropped = is_dropped or line.startswith(prefixes)
        if not is_dropped:
            kept.append(line)
        is_dropped = is_dropped and line.endswith("\\\n")
    return "".join(kept)


class Shell:
    """Runs blocks of bash in a folder, as a reader does who has installed what the page says.

    `python` is the given interpreter, with further options for the commands of `smaller`.
    `pip` and `make` change nothing: of `make` the rule is looked up. A server goes on in the
    background, on a port of its own for 8600, until `close`.
    """

    def __init__(self, folder: Path, python: str, port: int) -> None:
        self._folder, self._python, self._port = folder, python, str(port)
        self.smaller: dict[str, str] = {}  # further options by command
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]),
            "OMP_NUM_THREADS": "1",
            "COLUMNS": "200",
            "BROWSER": "true",
            "WANDB_SILENT": "true",
            "SGM_SERVER": f"http://127.0.0.1:{port}",
        }

    def _make_prelude(self) -> str:
        cases = "".join(
            f'{shlex.quote(name)}" "*) set -- "$@" {options} ;;\n'
            for name, options in self.smaller.items()
        )
        return f"""
            python() {{
                case "$* " in
                    "-m sgm.serve "*--stdio*) {self._python} "$@" < /dev/null ;;
                    "-m sgm.serve "*) stay "$@" --port {self._port} ;;
                    "-m sgm.export "*--follow*) stay "$@" ;;
                    "-m nep.view "*--save*) {self._python} "$@" ;;
                    "-m nep.view "*) stay "$@" ;;
                    *) case "$* " in {cases} esac; {self._python} "$@" ;;
                esac
            }}
            stay() {{
                : > stays.log  # here: what runs in the background empties it later
                {self._python} "$@" > stays.log 2>&1 & echo $! >> stays.pids
                for try in $(seq 600); do
                    if [ -s stays.log ] || [ -s out.mcap ]; then return 0; fi
                    sleep 0.1
                done
                cat stays.log; return 1
            }}
            pip() {{ :; }}
            make() {{ command make --dry-run -C {ROOT} "$@" > make.log; }}
            curl() {{ command curl --fail --silent --show-error --max-time 3 "$@" || [ $? = 28 ]; }}
        """  # 28: a stream that goes on

    def put_port(self, text: str) -> str:
        """A block that speaks to the server of this reader."""
        return text.replace("8600", self._port)

    def run(self, script: str, program: tuple[str, ...] = ("bash", "-e")) -> str:
        """Run a script and return what it prints; a command that fails is an error."""
        path = self._folder / ("script" if program[0] == "bash" else "script.mjs")
        own = self._make_prelude() if program[0] == "bash" else ""
        path.write_text(own + self.put_port(script), "utf-8")
        with (self._folder / "errors.log").open("w+") as errors:  # a server may keep a pipe open
            done = subprocess.run(
                [*program, str(path)],
                cwd=self._folder,
                env=self._environment,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                timeout=600,
                check=False,
            )
            errors.seek(0)
            assert done.returncode == 0, script + done.stdout + errors.read()
        return done.stdout

    def close(self) -> None:
        """End what goes on in the background."""
        pids = self._folder / "stays.pids"
        if pids.exists():
            self.run(
                "kill $(cat stays.pids); for pid in $(cat stays.pids); do "
                "while kill -0 $pid 2> /dev/null; do sleep 0.05; done; done"
            )
            pids.unlink()
