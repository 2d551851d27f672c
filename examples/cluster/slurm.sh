#!/bin/bash
#SBATCH --job-name=maglev-study
#SBATCH --array=0-9
#SBATCH --cpus-per-task=2
#SBATCH --time=02:00:00
#SBATCH --requeue
# Computes a study in the tasks of a Slurm array, each a part of the points:
#
#     sbatch slurm.sh STUDY.json OUT
#     sbatch --dependency=afterok:JOB --wrap "maglev study merge OUT"
#
# OUT is a folder that all nodes see. A task that is killed, or runs out of time, continues where it ended: run the same
# command again. Exit status 75 means that points remain.
set -eu
study=$1
out=$2
tasks=${SLURM_ARRAY_TASK_COUNT:-1}
task=$((${SLURM_ARRAY_TASK_ID:-0} - ${SLURM_ARRAY_TASK_MIN:-0}))
count=$(maglev study points "$study" --count)
first=$((task * count / tasks + 1))
last=$(((task + 1) * count / tasks))
if [ "$first" -gt "$last" ]; then
    exit 0 # more tasks than points
fi
status=0
maglev study run "$study" --points "$first..$last" --workers "${SLURM_CPUS_PER_TASK:-1}" --out "$out" --quiet || status=$?
if [ "$status" -eq 75 ] && [ -n "${SLURM_JOB_ID:-}" ] && command -v scontrol > /dev/null; then
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$status"
