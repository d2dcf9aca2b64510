#!/bin/bash
# Runs every test, also where one fails; then fails. A test that passes shows its sums and what it skipped.
# usage: run.sh COMMAND FOLDER TEST...    COMMAND runs IMAGE; FOLDER/failing/fails is there to be seen to fail
command=$1 folder=$2
shift 2
run() { timeout 900 ${command//IMAGE/$1} >"$1.log" 2>&1; }
one() {
  touch "$1.failed"
  if run "$1"; then
    rm "$1.failed"
    told=$(grep -aE '^(skipped: |\[==========\] .* run\.|\[  (PASSED|SKIPPED) )' "$1.log")
  else
    told=$(cat "$1.log")
  fi
  printf '%s\n%s\n' "${1#build/}" "$told"
}
# One more at a time than there are processors, since some wait for others; what one says stays together.
for test in "$@"; do
  while [ "$(jobs -rp | wc -l)" -gt "$(nproc)" ]; do wait -n; done
  one "$test" &
done
wait
failed=
for test in "$@"; do [ ! -e "$test.failed" ] || failed+=" ${test#build/}"; done
fails=$folder/failing/fails
if ! run "$fails" && grep -qaE '2 test\(s\) run' "$fails.log"; then
  echo 'a test that fails: seen to fail'
else
  failed+=' failing/fails'
fi
[ -z "$failed" ] || { echo "  FAILED:$failed"; exit 1; }
