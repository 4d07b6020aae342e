#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tutorials.py make|check AXISCAL PAGE..: runs the commands of tutorial pages in their order.

In a ```console block a line that begins with "$ " is a command. The lines after it are its output (standard output and
standard error together). `check` runs a page's commands in a new folder and compares their output with the page.
`make` writes their output to the page. A command that ends in "# shown elsewhere" is not run. Times and checksums are
not compared."""
import os
import re
import subprocess
import sys
import tempfile

BLOCK = re.compile(r"(```console\n)(.*?)(```)", re.S)
CHANGING = [
    (re.compile(r"\d{4}-\d\d-\d\dT[\d:]+Z|\d{8}T\d{6}Z"), "TIME"),
    (re.compile(r"\b[0-9a-f]{64}\b"), "SHA256"),
]
LONG = re.compile(r"-?\d+\.\d{10,}(e[-+]?\d+)?")  # numbers whose last digits depend on the processor


def masked(text):
    for pattern, name in CHANGING:
        text = pattern.sub(name, text)
    text = LONG.sub(lambda number: f"{float(number.group()):.6g}", text)
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def run(command, folder, axiscal):
    environment = {**os.environ, "PATH": os.path.dirname(os.path.abspath(axiscal)) + ":" + os.environ["PATH"],
                   "NO_COLOR": "1", "COLUMNS": "80"}
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, text=True, timeout=120,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.stdout, done.returncode


def is_open(command):
    """Whether a command continues in the next line: after a backslash, or within a here-document."""
    here = re.search(r"<<-?'?(\w+)'?", command)
    return command.endswith("\\") or (here is not None and command.splitlines()[-1] != here.group(1))


def commands_of(block):
    """Returns pairs of a command and its output as the page shows it."""
    steps = []
    for line in block.splitlines():
        if line.startswith("$ "):
            steps.append([line[2:], []])
        elif steps and not steps[-1][1] and is_open(steps[-1][0]):
            steps[-1][0] += "\n" + line
        elif steps:
            steps[-1][1].append(line)
    return [(command, "\n".join(shown)) for command, shown in steps]


def page(path, axiscal, make):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        examples = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "examples")
        os.symlink(examples, os.path.join(folder, "examples"))

        def replay(match):
            out = ""
            for command, shown in commands_of(match.group(2)):
                if command.endswith("# shown elsewhere"):
                    out += f"$ {command}\n" + (shown + "\n" if shown else "")
                    continue
                printed, status = run(command, folder, axiscal)
                if status not in (0, 1):
                    wrong.append(f"{path}: `{command}` ends with status {status}: {printed}")
                # A page may show only the beginning of a long output. It then ends with "...".
                begins = shown.rstrip().endswith("\n...") or shown.strip() == "..."
                wanted = shown.rstrip()[:-3] if begins else shown
                got = masked(printed)
                if begins:
                    got = "\n".join(got.splitlines()[:len(masked(wanted).splitlines())])
                if not make and got != masked(wanted):
                    wrong.append(f"{path}: `{command}` prints\n{printed}\nand the page shows\n{shown}")
                if make:
                    lines = printed.rstrip("\n").splitlines()
                    if begins:
                        lines = lines[:max(1, len(wanted.strip().splitlines()))] + ["..."]
                    shown = "\n".join(line.rstrip() for line in lines)
                out += f"$ {command}\n" + (shown + "\n" if shown else "")
            return match.group(1) + out + match.group(3)

        text = BLOCK.sub(replay, text)
    if make:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    return wrong


def main():
    mode, axiscal, *pages = sys.argv[1:]
    wrong = [message for path in pages for message in page(path, axiscal, mode == "make")]
    print("\n\n".join(wrong) or f"{len(pages)} pages: the output of all commands is as the pages show it")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
