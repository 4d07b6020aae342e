#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""kills_test.py AXISCAL RUN.csv [COUNT]: kills the command at random times and checks the files that are left.

A third of the kills are of a single calibration, a third of a batch of units, and a third of a guided session with a
simulated instrument. The output of a calibration is complete: the earlier one or the new one. A record of a batch is
complete or does not exist. A journal contains complete lines, and a session can resume from it. The next run leaves
no temporary file.
"""
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

SEED = 7


def run(command, folder, **more):
    return subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL, **more)


def kill_after(command, folder, seconds):
    process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    time.sleep(seconds)
    process.send_signal(random.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT]))
    process.wait()


def is_whole(path):
    try:
        with open(path, encoding='utf-8') as file:
            return json.load(file)['format'] == 'axiscal-calibration'
    except (ValueError, KeyError):
        return False


def left_over(folder):
    return [name for name in os.listdir(folder) if name.startswith('.axiscal-') or name.startswith('axiscal-')]


class Kills:
    def __init__(self, axiscal, rows, folder):
        self.axiscal, self.rows, self.folder, self.faults = axiscal, rows, folder, []
        self.run_csv = os.path.join(folder, 'run.csv')
        with open(self.run_csv, 'w', encoding='utf-8') as file:
            file.writelines(rows)
        header, *body = rows
        with open(os.path.join(folder, 'units.csv'), 'w', encoding='utf-8') as file:
            file.write('serial,' + header)
            for unit in range(12):
                file.writelines(f'u{unit},{row}' for row in body)

    def fail(self, what):
        self.faults.append(what)

    def output(self, delay):
        command = [self.axiscal, 'calibrate', 'run.csv', '--instrument', 'accelerometer', '-o', 'cal.json']
        kill_after(command, self.folder, delay)
        path = os.path.join(self.folder, 'cal.json')
        if os.path.exists(path) and not is_whole(path):
            self.fail('an output is cut short')

    def batch(self, delay):
        command = [self.axiscal, 'calibrate', 'units.csv', '--each', '--instrument', 'accelerometer', '-o',
                   'unit-{serial}.json', '--table', 'table.csv']
        kill_after(command, self.folder, delay)
        for name in os.listdir(self.folder):
            if name.startswith('unit-') and not is_whole(os.path.join(self.folder, name)):
                self.fail(f'{name} is cut short')

    def session(self, delay):
        for name in os.listdir(self.folder):
            if name.startswith('session.'):
                os.remove(os.path.join(self.folder, name))
        start = [self.axiscal, 'acquire', '--connect', 'sim:?speed=400&rate=50', '--instrument', 'accelerometer',
                 '--unattended', '--plain', '--name', 'session']
        kill_after(start, self.folder, delay)
        journal = os.path.join(self.folder, 'session.journal')
        if not os.path.exists(journal):
            return
        with open(journal, 'rb') as file:
            lines = file.read().split(b'\n')
        if len(lines) < 2:
            return  # killed before its first line was complete
        for line in lines[:-1]:
            json.loads(line)
        done = run([self.axiscal, 'acquire', '--resume', 'session.journal', '--connect', 'sim:?speed=max&rate=50',
                    '--unattended', '--plain', '--name', 'session'], self.folder, timeout=60)
        record = os.path.join(self.folder, 'session.json')
        if done.returncode not in (0, 1) or not os.path.exists(record):
            self.fail(f'a session of {len(lines) - 1} lines does not go on: status {done.returncode}')


def main(axiscal, run_csv, count='60'):
    random.seed(SEED)
    with open(run_csv, encoding='utf-8') as file:
        rows = [line for line in file if not line.startswith('#')]
    with tempfile.TemporaryDirectory() as folder:
        os.environ['TMPDIR'] = folder
        kills = Kills(axiscal, rows, folder)
        for i in range(int(count)):
            kind, most = [(kills.output, 0.03), (kills.batch, 0.08), (kills.session, 0.4)][i % 3]
            kind(random.uniform(0.0, most))
        run([axiscal, 'calibrate', 'run.csv', '--instrument', 'accelerometer', '-o', 'cal.json'], folder)
        if left_over(folder):
            kills.fail(f'left over: {left_over(folder)}')
    print(f'kills_test.py: {count} kills, {len(kills.faults)} faults')
    for fault in kills.faults:
        print(fault)
    return 1 if kills.faults else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
