#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Finds nested initialisers of the form `{.a = {..}, .b = f()}`.

If f() throws, g++ 12 destroys the members of `a` twice. `{.a = A{..}, .b = f()}` is safe.

    scripts/nested_initialisers.py [FILE ..]     without files: all sources of the repository
"""
import re
import subprocess
import sys

PLAIN = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
NESTED = re.compile(r'\.\w+\s*=\s*\{(?=\s*\.\w+\s*[={])')
CALL = re.compile(r'\w\s*(?:<[\w:, ]*>)?\(')


def blanked(text):
    """Returns the text with comments and literals replaced by spaces, so that all positions stay the same."""
    return PLAIN.sub(lambda found: re.sub(r'[^\n]', ' ', found.group()), text)


def end_of(text, at):
    """Returns the index after the bracket that closes the bracket at index `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] in '{([') - (text[i] in '})]')
        if depth == 0:
            return i + 1
    return len(text)


def rest_of_list(text, at):
    """Returns the text from index `at` up to the brace that closes the enclosing list."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] in '{([') - (text[i] in '})]')
        if depth < 0:
            return text[at:i]
    return text[at:]


def faults(text):
    text = blanked(text)
    for found in NESTED.finditer(text):
        end = end_of(text, found.end() - 1)
        if text[end:].lstrip().startswith(',') and CALL.search(rest_of_list(text, end)):
            yield text.count('\n', 0, found.start()) + 1


def main(files):
    files = files or subprocess.run(['git', 'ls-files', '*.cpp', '*.hpp'], check=True, text=True,
                                    stdout=subprocess.PIPE).stdout.split()
    count = 0
    for path in files:
        with open(path, encoding='utf-8') as file:
            for line in faults(file.read()):
                print(f'{path}:{line}: name the type of the nested initialiser: g++ 12 destroys its members '
                      'twice if a later member throws')
                count += 1
    return 1 if count else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
