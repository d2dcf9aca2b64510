#!/bin/bash
# Runs each fuzzer from its corpus on, in parts, each with another seed.
# usage: run.sh EXECUTIONS PARTS FOUND FUZZER...    EXECUTIONS of all together; inputs that fail go to FOUND
executions=$1 parts=$2 found=$3
shift 3
each=$((executions / $#))
export ASAN_OPTIONS=quarantine_size_mb=8:malloc_context_size=2
for fuzzer in "$@"; do
  name=$(basename "$fuzzer")
  mkdir -p "$found/$name"
  for ((part = 1; part <= parts; ++part)); do
    nice "$fuzzer" -runs=$((each / parts)) -seed=$part -max_len=1024 -timeout=30 -rss_limit_mb=1024 \
      -artifact_prefix="$found/$name-" "$found/$name" "$(dirname "$0")/corpus/$name" >"$found/$name.log" 2>&1 || {
      tail -n 40 "$found/$name.log"
      echo "fuzz: $name found a fault; the input is in $found"
      exit 1
    }
    echo "$name: $((each / parts * part)) executions"
  done
done
echo 'fuzz: no findings'
