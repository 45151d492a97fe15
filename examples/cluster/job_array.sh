#!/bin/bash
# A data set by an array of jobs: sbatch job_array.sh
#SBATCH --job-name=creepkit
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail

: "${SLURM_ARRAY_TASK_ID:=1}" "${SLURM_ARRAY_TASK_COUNT:=1}" "${SLURM_CPUS_PER_TASK:=1}"
: "${SAMPLES:=155186}" "${FILE:=combined.h5}"
COMMAND=(creepkit surrogate generate combined --specimen bulge --domain conditioned --samples "$SAMPLES" --seed 1 --to "$FILE")

"${COMMAND[@]}" --workers "$SLURM_CPUS_PER_TASK" --part "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"

# The first job waits for nobody: it submits the one that merges when all of the array have ended.
if [ "$SLURM_ARRAY_TASK_ID" = 1 ] && command -v sbatch >/dev/null; then
    sbatch --dependency="afterany:$SLURM_ARRAY_JOB_ID" --cpus-per-task="$SLURM_CPUS_PER_TASK" --time=01:00:00 \
        --wrap "${COMMAND[*]} --workers $SLURM_CPUS_PER_TASK"
fi
