#!/usr/bin/env bash
# Runs a command where srun has a cluster of one node, this machine: with_slurm.sh FOLDER COMMAND...; needs root, munge and slurm-wlm.
set -euo pipefail
work=$(mkdir -p "$1" && cd "$1" && pwd)
shift
rm -rf "${work:?}"/*
mkdir -p "$work"/{munge,state,spool}
dd if=/dev/urandom of="$work/munge/key" bs=1024 count=1 status=none
chmod 700 "$work/munge" && chmod 600 "$work/munge/key"
read -r ctld_port slurmd_port < <(python3 -c '
import socket
both = [socket.socket() for _ in range(2)]
for s in both: s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in both))')
cat >"$work/slurm.conf" <<CONF
ClusterName=flappy
SlurmctldHost=localhost
SlurmUser=root
SlurmctldPort=$ctld_port
SlurmdPort=$slurmd_port
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
NodeName=localhost CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES OverSubscribe=FORCE:64 State=UP
CONF
export SLURM_CONF=$work/slurm.conf
stop() { for daemon in "${daemons[@]}"; do kill "$daemon" 2>/dev/null || true; done; }
daemons=()
trap stop EXIT
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/log" --seed-file="$work/munge/seed" &
daemons+=($!)
slurmctld -D &>/dev/null &
daemons+=($!)
slurmd -D -N localhost &>/dev/null &
daemons+=($!)
for _ in $(seq 100); do
  [ "$(sinfo -h -o %t 2>/dev/null)" = idle ] && break
  sleep 0.2
done
"$@"
