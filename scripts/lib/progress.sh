# shellcheck shell=bash
# Long commands under a person's eyes: output goes to a log, the terminal shows title, percentage and elapsed time.

readonly PATIENCE=5   # s that a command may take before a line is spent on it
readonly HEARTBEAT=15 # s between the lines where the output is no terminal

phase_pid=""

# One line for the person at the terminal.
say() { printf '%s\n' "$*"; }

# Ends the script with one line on standard error.
fail() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

on_terminal() { [[ -t 1 && -z ${CI:-} && ${TERM:-dumb} != dumb ]]; }

# 75 -> 1:15
minutes() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }

# Where a log has got to: the last "[ 42%]" of make and of step_recorder, or apt's status lines.
percentage() {
  tail -c 8192 "$1" | tr '\r' '\n' | sed -nE \
    -e 's/^dlstatus:[^:]*:([0-9]+).*/downloading \1 %/p' \
    -e 's/^pmstatus:[^:]*:([0-9]+).*/installing \1 %/p' \
    -e 's/.*\[ *([0-9]+)%\].*/\1 %/p' | tail -n 1
}

# Ends the running phase: first politely (roslaunch then stops its nodes in order), after 20 s for good.
stop_phase() {
  local pid=$phase_pid
  [[ -n $pid ]] || return 0
  phase_pid=""
  kill -TERM -- "-$pid" 2>/dev/null || return 0
  for _ in {1..200}; do
    kill -0 -- "-$pid" 2>/dev/null || return 0
    sleep 0.1
  done
  kill -KILL -- "-$pid" 2>/dev/null || true
}
trap stop_phase EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

# run_phase TITLE LOG COMMAND...: runs the command with its output in LOG and returns its status. Leaves no line behind
# if it takes less than PATIENCE.
run_phase() {
  local title=$1 log=$2 start=$SECONDS spoken=0 tick=0 status=0
  shift 2
  # A process group of its own, so that stop_phase reaches the command's children too.
  set -m
  "$@" >"$log" 2>&1 </dev/null &
  phase_pid=$!
  set +m
  while kill -0 "$phase_pid" 2>/dev/null; do
    local elapsed=$((SECONDS - start))
    if on_terminal; then
      local spinner='/-\|'
      printf '\r\033[K%s %s  %s  %s' "${spinner:tick++%4:1}" "$title" "$(minutes $elapsed)" "$(percentage "$log")"
      sleep 0.2
    else
      if ((elapsed >= PATIENCE + spoken * HEARTBEAT)); then
        local detail
        detail=$(percentage "$log")
        say "$title  $(minutes $elapsed)${detail:+  $detail}"
        spoken=$((spoken + 1))
      fi
      sleep 0.2
    fi
  done
  wait "$phase_pid" || status=$?
  phase_pid=""
  if on_terminal; then printf '\r\033[K'; fi
  if ((status == 0 && SECONDS - start >= PATIENCE)); then say "$title  done in $(minutes $((SECONDS - start)))"; fi
  return "$status"
}
