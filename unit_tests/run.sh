#!/bin/bash
# Runs every test, also where one fails; then fails. A test that passes shows its sums and what it skipped.
# usage: run.sh COMMAND FOLDER TEST...    COMMAND runs IMAGE; FOLDER/failing/fails is there to be seen to fail
command=$1 folder=$2
shift 2
run() { timeout 900 ${command//IMAGE/$1} >"$1.log" 2>&1; }
failed=
for test in "$@"; do
  if run "$test"; then
    echo "${test#"$folder"/}"
    grep -aE '^(skipped: |\[==========\] .* run\.|\[  (PASSED|SKIPPED) )' "$test.log"
  else
    cat "$test.log"
    failed+=" ${test#"$folder"/}"
  fi
done
fails=$folder/failing/fails
if ! run "$fails" && grep -qaE '2 test\(s\) run' "$fails.log"; then
  echo 'a test that fails: seen to fail'
else
  failed+=' failing/fails'
fi
[ -z "$failed" ] || { echo "  FAILED:$failed"; exit 1; }
