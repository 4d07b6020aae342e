#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""hostile_test.py AXISCAL ARCHIVE: files that were made to exhaust a reader are refused soon.

`log` and `noise` read each file by its name; `log` also reads it from standard input. A run takes at most 5 s and
256 MiB of memory, and writes at most 64 MiB to a file. It leaves no file and prints no control character. Its status
is 1 or 3. For the files of READABLE it may also be 0: they can be read, and only rows or names in them are bad.
"""
import os
import resource
import subprocess
import sys
import tarfile
import tempfile

READABLE = {'ansi.csv', 'late3.csv', 'lost3.csv', 'lost12.csv', 'lostnote.csv', 'wal.db3', 'lines.csv.xz'}
MIB = 1 << 20


def limits_of(seconds):
    """Returns a function that sets the limits of CPU time and file size in the process of a run."""
    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (64 * MIB, 64 * MIB))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    return limited


def run(command, stdin, folder, copies, seconds):
    """Runs a command. Returns its status, its output, and the largest memory of its processes [MiB]."""
    script = ('import os, resource, subprocess, sys\n'
              'status = subprocess.call(sys.argv[1:])\n'
              'memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss\n'
              'os.write(2, b"\\n%d %d" % (status, memory))\n')
    environment = dict(os.environ, TMPDIR=copies)
    with open(stdin, 'rb') as source:
        done = subprocess.run([sys.executable, '-c', script, *command], stdin=source, cwd=folder, env=environment,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=limits_of(seconds), timeout=20 * seconds)
    text, _, figures = done.stderr.rpartition(b'\n')
    status, memory = (int(word) for word in figures.split())
    return status, done.stdout + text, memory / 1024


def controls(output):
    return [byte for byte in output if (byte < 32 and byte not in b'\t\n') or byte == 127]


def main(axiscal, archive):
    with open(axiscal, 'rb') as program:
        has_shadow_memory = b'__asan_init' in program.read()
    seconds = 50 if has_shadow_memory else 5
    faults = []
    with tempfile.TemporaryDirectory() as scratch:
        folder, copies = os.path.join(scratch, 'files'), os.path.join(scratch, 'copies')
        os.mkdir(copies)
        with tarfile.open(archive) as packed:
            packed.extractall(folder)
        files = sorted(os.listdir(folder))
        runs = [(name, [verb, name], os.devnull) for name in files for verb in ('log', 'noise')]
        runs += [(name, ['log', '-'], os.path.join(folder, name)) for name in files]
        most = 0
        for name, words, stdin in runs:
            allowed = {1, 3} | ({0} if name in READABLE else set())
            try:
                status, output, memory = run([axiscal, *words], stdin, folder, copies, seconds)
            except subprocess.TimeoutExpired:
                faults.append(f'{name}: {words}: does not end')
                continue
            most = max(most, memory)
            if status not in allowed:
                faults.append(f'{name}: {words}: status {status}: {output[-200:]}')
            if memory > 256 and not has_shadow_memory:
                faults.append(f'{name}: {words}: {memory:.0f} MiB')
            if controls(output):
                faults.append(f'{name}: {words}: prints control characters')
            if sorted(os.listdir(folder)) != files or os.listdir(copies):
                faults.append(f'{name}: {words}: leaves {set(os.listdir(folder)) - set(files)} {os.listdir(copies)}')
                files = sorted(os.listdir(folder))
    print(f'hostile_test.py: {len(runs)} runs over {len(files)} files, at most {most:.0f} MiB')
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
