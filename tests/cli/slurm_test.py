#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""slurm_test.py AXISCAL RUN.csv SOURCE: a fleet on a Slurm cluster of this machine.

The test starts munged, slurmctld and two slurmd on the loopback interface, and calibrates a fleet by
scripts/fleet_slurm.sh. The files and the store are equal to those of one process. One task is killed and requeued.
Without Slurm the test is skipped.
"""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import stores_test

SHARDS = 4
PROGRAMS = ('munged', 'slurmctld', 'slurmd', 'sbatch', 'squeue', 'scontrol', 'scancel')


def is_there(program):
    return shutil.which(program, path=os.environ.get('PATH', '') + ':/usr/sbin:/sbin') is not None


class Cluster:
    """Two nodes of one processor each; their files are in the folder."""

    def __init__(self, folder):
        self.folder = folder
        host = subprocess.run(['hostname', '-s'], capture_output=True, text=True, check=True).stdout.strip()
        user = subprocess.run(['id', '-un'], capture_output=True, text=True, check=True).stdout.strip()
        port = 20000 + os.getpid() % 20000
        for name in ('state', 'spool-n1', 'spool-n2'):
            os.makedirs(os.path.join(folder, name))
        os.makedirs(folder + '/munge', mode=0o700)
        with open(folder + '/munge/key', 'wb') as file:
            file.write(os.urandom(1024))
        os.chmod(folder + '/munge/key', 0o400)
        with open(folder + '/slurm.conf', 'w', encoding='utf-8') as file:
            file.write(f'''ClusterName=axiscal
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CredType=cred/munge
SlurmctldPort={port}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={port + 1} CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={port + 2} CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
''')
        self.environment = {**os.environ, 'SLURM_CONF': folder + '/slurm.conf',
                            'PATH': os.environ.get('PATH', '') + ':/usr/sbin:/sbin'}

    def call(self, *command):
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, check=True,
                              cwd=self.folder).stdout.strip()

    def start(self):
        munge = self.folder + '/munge/'
        self.call('munged', '--force', f'--key-file={munge}key', f'--socket={munge}socket', f'--pid-file={munge}pid',
                  f'--log-file={munge}log', f'--seed-file={munge}seed')
        self.call('slurmctld', '-f', self.folder + '/slurm.conf')
        for node in ('n1', 'n2'):
            self.call('slurmd', '-f', self.folder + '/slurm.conf', '-N', node)
        for _ in range(100):
            if self.call('sinfo', '--noheader', '--states=idle', '--format=%D') == '2':
                return True
            time.sleep(0.1)
        return False

    def stop(self):
        subprocess.run(['scontrol', 'shutdown'], env=self.environment, capture_output=True, check=False)
        for name in ('munge/pid', 'slurmctld.pid', 'slurmd-n1.pid', 'slurmd-n2.pid'):
            try:
                with open(os.path.join(self.folder, name), encoding='utf-8') as file:
                    os.kill(int(file.read()), signal.SIGTERM)
            except (OSError, ValueError):
                pass

    def wait(self, job):
        for _ in range(600):
            if not self.call('squeue', '--noheader', '--states=all', f'--jobs={job}', '--format=%T').startswith(
                    ('PENDING', 'RUNNING', 'COMPLETING')):
                return
            time.sleep(0.1)
        raise AssertionError('the jobs do not end:\n' + self.call('squeue'))


def read(path):
    with open(path, 'rb') as file:
        return file.read()


def main():
    axiscal, run, source = sys.argv[1:4]
    if not all(is_there(program) for program in PROGRAMS):
        print('skipped: slurm-wlm and munge are not installed')
        return 77
    folder = tempfile.mkdtemp(prefix='axiscal-slurm-')
    cluster = Cluster(folder + '/cluster') if os.makedirs(folder + '/cluster') is None else None
    try:
        if not cluster.start():
            print('skipped: the nodes of Slurm do not start on this machine')
            return 77
        units = folder + '/units.csv'
        with open(units, 'w', encoding='utf-8') as file:
            file.write(stores_test.units(run))
        options = ['--instrument', 'accelerometer', '--unit', 'V']
        cluster.environment.update(AXISCAL=axiscal, SOURCE_DATE_EPOCH='1700000000')
        subprocess.run([axiscal, 'calibrate', units, '--stream', *options, '-o', folder + '/one.jsonl', '--table',
                        folder + '/one.csv', '--store', folder + '/one.db'], env=cluster.environment, check=False,
                       capture_output=True)
        job = cluster.call(os.path.join(source, 'scripts', 'fleet_slurm.sh'), '-n', str(SHARDS), '-o', folder + '/fleet',
                           '-s', folder + '/fleet.db', units, *options)
        # The first task is killed; Slurm starts it again.
        array = int(job) - 1
        subprocess.run(['scontrol', 'requeue', f'{array}_1'], env=cluster.environment, capture_output=True, check=False)
        cluster.wait(job)
        for name in ('records.jsonl', 'units.csv'):
            one = folder + ('/one.jsonl' if name.endswith('jsonl') else '/one.csv')
            assert read(f'{folder}/fleet/{name}') == read(one), name
        lists = [subprocess.run([axiscal, 'store', 'list', '--store', f'{folder}/{name}.db'], capture_output=True,
                                text=True, check=True).stdout for name in ('one', 'fleet')]
        assert lists[0] == lists[1]
        assert lists[0].count('\n') == stores_test.UNITS + 1
        print(f'{SHARDS} tasks on two nodes gave the bytes of one process')
    finally:
        cluster.stop()
        shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
