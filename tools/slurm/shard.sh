#!/usr/bin/env bash
# One shard of a sweep. `plumbline run --launcher slurm` submits it as an array and sets PLUMBLINE (the program), SWEEP
# (the folder of the sweep) and SHARDS (their number). It may run twice, be requeued and be killed.
#SBATCH --job-name=plumbline
#SBATCH --ntasks=1
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
exec "$PLUMBLINE" run "$SWEEP" --shard "$SLURM_ARRAY_TASK_ID/$SHARDS" --jobs "${SLURM_CPUS_PER_TASK:-1}"
