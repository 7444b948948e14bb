#!/usr/bin/env bash
# Joins the shards of a sweep once they have ended, well or not; says what is missing. PLUMBLINE and SWEEP as in
# shard.sh.
#SBATCH --job-name=plumbline-merge
#SBATCH --ntasks=1
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
exec "$PLUMBLINE" merge "$SWEEP" --wait
