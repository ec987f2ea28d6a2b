# shellcheck shell=bash
# The tests that catkin registered with CTest.

# test_targets BUILD PATTERN: what make has to build for the tests that match. A gtest is a target of its name, a rostest names gtests,
# which depend on the nodes. Other tests, and those with the label nodes, start programs as a user does, and need the whole build.
test_targets() {
  local listing launch
  listing=$(cd "$1" && ctest -N -V -R "$2" 2>&1) || true
  [[ $listing != *RegularExpression* ]] || fail "--only $2: no regular expression"
  [[ $listing == *"Test command"* ]] ||
    fail "--only $2: no test has such a name; names are gtest_drive_gate_test, rostest_test_node_lockstep.xml"
  {
    sed -nE 's|.*/(\w+) --gtest_output.*|\1|p' <<<"$listing"
    sed -nE 's|.* (/\S+\.xml) [^"]*"$|\1|p' <<<"$listing" | while read -r launch; do
      # A test in Python needs the programs.
      grep -oP '<test\s[^>]*type="\K[^"]+' "$launch" | sed 's/.*\.py$/all/'
    done
    if grep -qE '_(python|roslaunch-check)_|^ *Labels: .*nodes' <<<"$listing"; then echo all; fi
  } | sort -u
}

# run_tests BUILD PATTERN FINDINGS LAUNCHER...: runs the tests that match, two per processor at a time (those that compute count
# twice), the longest first. Node tests that fail in parallel run once more, alone, and that result counts. Counts their cases and the
# reports of sanitizers in the directory FINDINGS.
run_tests() {
  local build=$1 results=$1/test_results log=$1/tests.log with_nodes='(rostest_|python_(launch|user_pages))' again timed_out passed failed finding
  rm -rf "$results" "$log" "$1/Testing/Temporary/LastTestsFailed.log"
  run_ctest "$1" "${@:4}" ctest -j $((2 * $(nproc))) -R "${2:-.}"
  again=$(sed -nE "s/^[0-9]+:(.*_$with_nodes.*)/\1/p" "$build/Testing/Temporary/LastTestsFailed.log" 2>/dev/null | paste -sd '|') || true
  if [[ -n $again ]]; then
    say "Again, alone:"
    sed -i -E "/ $with_nodes.*\*\*\*/d" "$log"
    run_ctest "$1" "${@:4}" ctest -R "^($again)\$"
  fi
  timed_out=$(grep -cE '\*\*\*(Timeout|Not Run)' "$log") || true
  # shellcheck disable=SC2154 # repository is of workspace.sh
  read -r passed failed < <(python3 "$repository/scripts/lib/count_tests.py" "$results")
  for finding in "$3"/*; do
    [[ -e $finding ]] || continue
    say "sanitizer, $finding: $(grep -m 1 '^SUMMARY' "$finding" || head -n 1 "$finding")"
    timed_out=$((timed_out + 1))
  done
  failed=$((failed + timed_out))
  if ((failed > 0)); then say "Logs: $build/Testing/Temporary/LastTest.log"; fi
  say "$passed passed, $failed failed"
  return $((failed > 0))
}

# run_ctest BUILD COMMAND...: runs CTest there, at most 15 minutes a test; what it prints is in BUILD/tests.log, too.
run_ctest() {
  (cd "$1" && "${@:2}" --timeout 900 </dev/null) | sed -u 's/_ctest_jackal_aic_//' | tee -a "$1/tests.log" || true
}
