#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""stores_test.py AXISCAL RUN.csv: a store of SQLite and one of PostgreSQL, with writers that are killed.

The same units go into both stores, by two processes at once. Writers are killed at random times, and the PostgreSQL
server is stopped once while units are written. After each failure the writer is called again. In the end both stores
contain each unit once, and both pass `axiscal store verify`. Without a PostgreSQL server the test covers SQLite only.
"""
import csv
import glob
import io
import os
import pwd
import random
import shutil
import subprocess
import sys
import tempfile
import time

SEED = 5
UNITS = 120


class Server:
    """A PostgreSQL server that belongs to the test."""

    def __init__(self, folder):
        self.folder = folder
        self.user = None
        programs = sorted(glob.glob('/usr/lib/postgresql/*/bin/pg_ctl'))
        self.programs = os.path.dirname(programs[-1]) if programs else None
        if self.programs is None:
            return
        if os.getuid() == 0:  # PostgreSQL refuses to run as root
            try:
                self.user = pwd.getpwnam('postgres')
            except KeyError:
                self.programs = None
                return
            os.chmod(os.path.dirname(folder), 0o755)
            os.makedirs(folder)
            os.chown(folder, self.user.pw_uid, self.user.pw_gid)
        else:
            os.makedirs(folder)
        self._call('initdb', '-D', folder + '/data', '-A', 'trust', '-U', 'axiscal', '--no-sync')
        self.start()
        self._call('createdb', '-h', folder, '-U', 'axiscal', 'lab')

    def _call(self, program, *arguments):
        def become():
            if self.user is not None:
                os.setgid(self.user.pw_gid)
                os.setuid(self.user.pw_uid)

        subprocess.run([os.path.join(self.programs, program), *arguments], check=True, cwd='/', preexec_fn=become,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start(self):
        self._call('pg_ctl', '-D', self.folder + '/data', '-w', '-l', self.folder + '/log', '-o',
                   f"-k {self.folder} -c listen_addresses='' -c fsync=off", 'start')

    def stop(self):
        self._call('pg_ctl', '-D', self.folder + '/data', '-w', '-m', 'immediate', 'stop')

    @property
    def address(self):
        return f'postgresql:///lab?host={self.folder}&user=axiscal'


def units(run):
    """Returns CSV text with the example run for each unit, with a random offset and random scatter."""
    with open(run, encoding='utf-8') as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith('#')))
    random.seed(SEED)
    lines = ['serial,batch,rest,fence,x,y,z']
    for unit in range(UNITS):
        offset = random.gauss(0.0, 1e-3)
        for row in rows:
            numbers = [f'{float(row[axis]) + offset + random.gauss(0.0, 1e-4):.6f}' for axis in 'xyz']
            lines.append(f'S{unit:04d},b{unit // 50},{row["rest"]},{row["fence"]},' + ','.join(numbers))
    return '\n'.join(lines) + '\n'


def main():
    axiscal, run = sys.argv[1:3]
    folder = tempfile.mkdtemp(prefix='axiscal-stores-')
    server = None
    try:
        with open(folder + '/units.csv', 'w', encoding='utf-8') as file:
            file.write(units(run))
        server = Server(folder + '/postgresql')
        stores = [folder + '/lab.db'] + ([server.address] if server.programs else [])
        lists = [written(axiscal, folder, store, server) for store in stores]
        for serials in lists:
            assert serials == [f'S{unit:04d}' for unit in range(UNITS)], serials
        print(f'{len(stores)} stores, {UNITS} units each')
    finally:
        if server is not None and server.programs:
            try:
                server.stop()
            except subprocess.CalledProcessError:
                pass
        shutil.rmtree(folder, ignore_errors=True)


def stream(axiscal, folder, store, shard):
    return subprocess.Popen(
        [axiscal, 'calibrate', 'units.csv', '--stream', '--instrument', 'accelerometer', '--unit', 'V', '--store', store,
         '--shard', shard, '--resume'], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def written(axiscal, folder, store, server):
    """Writes all units; kills writers and stops the server meanwhile. Returns the stored serial numbers."""

    def ask(*arguments):
        done = subprocess.run([axiscal, 'store', *arguments, '--store', store], cwd=folder, capture_output=True,
                              text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    for _ in range(10):  # kills a writer at a random time
        writer = stream(axiscal, folder, store, '1/2')
        time.sleep(random.uniform(0.005, 0.15))
        writer.kill()
        writer.communicate()
    if store.startswith('postgresql'):  # stops the server while a writer works
        writer = stream(axiscal, folder, store, '2/2')
        time.sleep(0.03)
        server.stop()
        _, messages = writer.communicate()
        assert writer.returncode == 0 or 'postgresql' in messages, messages
        status, _, messages = ask('list')
        assert status == 3 and 'no connection to the database' in messages, messages
        server.start()
    both = [stream(axiscal, folder, store, f'{shard}/2') for shard in (1, 2)]
    for writer in both:
        _, messages = writer.communicate()
        assert writer.returncode == 0, messages
    status, output, _ = ask('verify')
    assert status == 0 and f'calibrations: {UNITS}; defects: 0' in output, output
    status, output, _ = ask('show', '--serial', 'S0007')
    assert status == 0 and '"serial":"S0007"' in output, output
    rows = list(csv.DictReader(io.StringIO(ask('list')[1])))
    assert {row['batch'] for row in rows} == {'b0', 'b1', 'b2'}
    return [row['serial'] for row in rows]


if __name__ == '__main__':
    main()
