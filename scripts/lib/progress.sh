# shellcheck shell=bash
# Long commands: their output goes to a log; the terminal shows title, elapsed time and percentage.

readonly HEARTBEAT=15 # s between lines

phase_pid=""

# Prints one line.
say() { printf '%s\n' "$*"; }

# Ends the script with one line on standard error.
fail() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# 75 -> 1:15
minutes() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }

# Ends the running phase: by SIGTERM (roslaunch then stops its nodes in order), after 20 s by SIGKILL.
stop_phase() {
  [[ -n $phase_pid ]] || return 0
  kill -TERM -- "-$phase_pid" 2>/dev/null || return 0
  timeout 20 tail --pid="$phase_pid" -f /dev/null || true
  kill -KILL -- "-$phase_pid" 2>/dev/null || true
}
trap stop_phase EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

# run_phase TITLE LOG COMMAND...: runs the command with its output in LOG and returns its status; silent if it takes less than 5 s.
run_phase() {
  local title=$1 log=$2 start=$SECONDS due=5 status=0
  shift 2
  # A process group of its own, so that stop_phase reaches the command's children too.
  set -m
  "$@" >"$log" 2>&1 </dev/null &
  phase_pid=$!
  set +m
  while kill -0 "$phase_pid" 2>/dev/null; do
    if ((SECONDS - start >= due)); then
      say "$title  $(minutes $((SECONDS - start)))  $(tail -c 8192 "$log" | grep -oE '[0-9]+%' | tail -n 1)"
      due=$((due + HEARTBEAT))
    fi
    sleep 0.2
  done
  wait "$phase_pid" || status=$?
  phase_pid=""
  if ((status == 0 && due > 5)); then say "$title  done in $(minutes $((SECONDS - start)))"; fi
  return "$status"
}
