#!/bin/bash
# Runs each test many times beside two busy loops: what races or waits too short a time is seen under load.
# usage: flaky.sh TIMES TEST...
times=$1
shift
busy=()
for _ in 1 2; do
  while :; do :; done &
  busy+=($!)
done
trap 'kill "${busy[@]}"' EXIT
failed=0
for test in "$@"; do
  passed=0
  for ((i = 1; i <= times; ++i)); do
    log=$test.flaky.$i.log
    if timeout 900 "$test" >"$log" 2>&1; then
      passed=$((passed + 1))
      rm -f "$log"
    else
      grep -aE '^\[  (ERROR|FAILED)' "$log"
      echo "  see $log"
    fi
  done
  echo "$(basename "$test"): $passed of $times passed"
  [ $passed = "$times" ] || failed=1
done
exit $failed
