#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""plain_english.py [--list] finds phrases that are hard to read, in comments, messages and docs.

The rule: a sentence states one fact in the order subject, verb, object. It uses the usual technical names, "if" for a
condition, "none" or nullopt for an empty result, and no clause that begins with "what". The status is 1 if the share of
sentences with such a phrase exceeds a limit in LIMITS. --list prints these sentences.
"""
import re
import subprocess
import sys

PHRASES = [
    r"(?i)(^|[.:;,(] ?|\b(of|by|from|to|and|than|as|with|for|in|on) )what\b(?! (is|are) (the|a)\b[^.]*\?)",
    r"(?i)\b(of|by|with|from|about) (it|them|these|those|others|all|both)(?=[,.;:)]|$)",
    r"(?i)\bnothing (where|if|of|is|are|without)\b|\b(or|gives|returns?) nothing\b",
    r"(?i)(^|[,;] |\bnot |\bonly )where (it|they|there|that|none|nothing|one|all|some|no|this)\b",
    r"(?i)\b(is|are|was|were|has|have) no (?!longer|more|need|effect|way|such|error|reason|less)\w+",
    r"(?i)\b(beside|likewise|anew|the like|hitherto|therein|thereof)\b",
    r"(?i)\b(says?|said|tells?|told|knows?|known) (of|nothing)\b",
    r"(?i)\b(makes?|made|comes?|came|becomes?|takes?) of\b",
    r"(?i)^(how|whether|which) (it|they|the|a|an|each|far|much|many|well)\b[^?]*$",
]
LIMITS = {"comments": 3.0, "messages": 1.0, "docs": 1.5}  # per cent
MARK = re.compile(r"^\s*///?<?\s?(.*)$")


def files(*endings):
    listed = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout.split()
    return [name for name in listed if name.endswith(endings) and not name.startswith("tests/")]


def comments():
    """Yields blocks of comment lines, and comments at the end of a line. A Doxygen command starts a new block."""
    for name in files(".cpp", ".hpp"):
        block, start = [], 0
        for number, line in enumerate(open(name), 1):
            mark = MARK.match(line)
            text = mark[1].strip() if mark else ""
            if block and (not text or re.match(r"[@\\]\w+", text)):
                yield name, start, " ".join(block)
                block = []
            if text:
                start = start if block else number
                block.append(re.sub(r"^[@\\](param\s+\S+|throws|return)\s*", "", text))
            tail = None if mark else re.search(r"\S\s+///?<?\s(.+)$", line)
            if tail and '"' not in line and "://" not in line:
                yield name, number, tail[1]


def messages():
    for name in files(".cpp", ".hpp"):
        text = re.sub(r'"\s*\n\s*"', lambda gap: "\0" * gap[0].count("\n"), open(name).read())
        for number, line in enumerate(text.split("\n"), 1):
            if not re.match(r"\s*(//|#include)", line):
                for literal in re.finditer(r'"((?:[^"\\]|\\.)*)"', line):
                    yield name, number, literal[1].replace("\0", "")


def docs():
    for name in files(".md"):
        fenced = False
        for number, line in enumerate(open(name), 1):
            fenced ^= line.startswith("```")
            if not fenced and not line.startswith("    ") and not line.lstrip().startswith("|"):
                for sentence in re.split(r"(?<=[.!?]) ", re.sub(r"`[^`]*`", "X", line.strip())):
                    yield name, number, sentence


def main():
    failed = False
    for kind, source in (("comments", comments), ("messages", messages), ("docs", docs)):
        texts = [(name, number, text) for name, number, text in source()
                 if len(text.split()) >= 4 and not re.search(r"SPDX|NOLINT|clang-format", text)]
        found = [one for one in texts if any(re.search(phrase, one[2]) for phrase in PHRASES)]
        share = 100.0 * len(found) / max(len(texts), 1)
        print(f"{kind}: {len(found)} of {len(texts)} ({share:.1f} %, limit {LIMITS[kind]} %)")
        if share > LIMITS[kind] or "--list" in sys.argv:
            failed |= share > LIMITS[kind]
            for name, number, text in found:
                print(f"  {name}:{number}: {text[:150]}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
