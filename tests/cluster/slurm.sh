#!/bin/sh
# sh slurm.sh UNRIG SOURCES: sample_data/cluster/trial.sbatch under a Slurm of one node that is started here and ended again: the same bytes as from one call.
# Without Slurm (Debian: slurm-wlm), or where it cannot be started, it says so and ends with 77.
set -eu
unrig=$(realpath "$1") sources=$(realpath "$2")
skip() { echo "skipped: $1"; exit 77; }
PATH=$PATH:/usr/sbin:/sbin
for program in slurmctld slurmd sbatch sinfo; do command -v $program > /dev/null || skip "no $program (Debian: slurm-wlm)"; done
folder=$(mktemp -d)
controller= node=
finish() {
  [ -z "$node" ] || kill "$node" 2> /dev/null || true
  [ -z "$controller" ] || kill "$controller" 2> /dev/null || true
  wait
  rm -rf "$folder"
}
trap finish EXIT
trap 'exit 1' HUP INT TERM
mkdir "$folder/state" "$folder/spool" "$folder/work"
host=$(hostname -s) user=$(id -un) port=$((20000 + $$ % 20000))
cat > "$folder/slurm.conf" << CONF
ClusterName=unrig_test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/none
CredType=cred/none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_res
SelectTypeParameters=CR_CPU
ReturnToService=2
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$folder/slurm.conf"
slurmctld -D > "$folder/out" 2>&1 &
controller=$!
slurmd -D -N "$host" > "$folder/out_node" 2>&1 &
node=$!
waited=0
until [ "$(timeout 5 sinfo -h -o %t 2> /dev/null)" = idle ]; do
  waited=$((waited + 1))
  if [ $waited -gt 60 ] || ! kill -0 $controller 2> /dev/null || ! kill -0 $node 2> /dev/null; then
    cat "$folder/out" "$folder/out_node" "$folder/slurmctld.log" "$folder/slurmd.log" 2> /dev/null | tail -n 20
    skip "Slurm cannot be started here"
  fi
  sleep 1
done

cd "$folder/work"
null="$sources/sample_data/campaigns/null"
UNRIG=$unrig TRIALS=28 sbatch --wait "$sources/sample_data/cluster/trial.sbatch" "$null/rig.toml" "$null/dry_pluck.csv" --nulls --effects mains-hum --threads 1
[ "$(ls part?.json | wc -l)" = 7 ] || { cat part*.log; echo "wanted seven parts" >&2; exit 1; }
"$unrig" collect part?.json -o slurm.json > /dev/null
"$unrig" trial --rig "$null/rig.toml" "$null/dry_pluck.csv" --nulls --effects mains-hum --trials 28 --seed 1 --shard 1/1 -o one.json > /dev/null 2>&1
"$unrig" collect one.json -o all.json > /dev/null
cmp slurm.json all.json
echo "seven tasks of a Slurm array and one call: the same bytes"
