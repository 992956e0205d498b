# Sourced: a Slurm of one node on the loopback address, in a folder, as whoever runs it.
# shellcheck shell=bash

# Why it cannot be; nothing where it can.
slurm_obstacle() {
  local program
  for program in munged mungekey slurmctld slurmd sbatch squeue scontrol; do
    PATH=$PATH:/usr/sbin:/sbin type -P "$program" >/dev/null ||
      { echo "no $program: apt-get install slurmctld slurmd slurm-client munge"; return; }
  done
}

# A port that nobody listens at.
free_port() {
  python3 -c 'import socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

# slurm_configure FOLDER CPUS
slurm_configure() {
  slurm=$1
  export PATH=$PATH:/usr/sbin:/sbin SLURM_CONF=$slurm/slurm.conf
  mkdir -p "$slurm"/{state,spool,munge}
  chmod 755 "$slurm" "$slurm"/munge
  mungekey --create --keyfile="$slurm/munge/key"
  local host
  host=$(hostname -s)
  # No accounting, no cgroups: a container has neither.
  cat >"$SLURM_CONF" <<CONF
ClusterName=holdfast
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$slurm/munge/socket
CryptoType=crypto/munge
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd.pid
SlurmctldLogFile=$slurm/slurmctld.log
SlurmdLogFile=$slurm/slurmd.log
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_interval=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$2 RealMemory=2048 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
}

start_controller() {
  slurmctld -D -f "$SLURM_CONF" >"$slurm/slurmctld.out" 2>&1 &
  controller=$!
}

stop_controller() {
  kill "$controller" 2>/dev/null && wait "$controller" 2>/dev/null
  controller=
}

# wait_for SECONDS COMMAND...: until it succeeds.
wait_for() {
  local until=$((SECONDS + $1))
  shift
  until "$@"; do
    ((SECONDS < until)) || return 1
    sleep 0.2
  done
}

node_is_up() {
  sinfo -h -o %T 2>/dev/null | grep -qE '^(idle|mixed|allocated)$'
}

# Starts all three; false where that does not work.
start_slurm() {
  munged --foreground --force --socket="$slurm/munge/socket" \
    --key-file="$slurm/munge/key" --pid-file="$slurm/munge/pid" \
    --log-file="$slurm/munge/log" --seed-file="$slurm/munge/seed" \
    >"$slurm/munge/out" 2>&1 &
  munge=$!
  wait_for 10 test -S "$slurm/munge/socket" || return 1
  start_controller
  slurmd -D -f "$SLURM_CONF" -N "$(hostname -s)" >"$slurm/slurmd.out" 2>&1 &
  daemon=$!
  wait_for 20 node_is_up
}

stop_slurm() {
  local process
  for process in ${daemon:-} ${controller:-} ${munge:-}; do
    kill "$process" 2>/dev/null && wait "$process" 2>/dev/null
  done
  return 0
}
