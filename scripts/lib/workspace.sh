# shellcheck shell=bash
# Source this first in every script: installs what is missing, makes the catkin workspace, builds it, sources it.
#
# Everything a checkout produces lies in its own git-ignored workspace, ws/ (or JACKAL_AIC_WS): build, logs, ROS home. Its name
# has no dot, because the completion of rosbash omits paths with a dot.

set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
workspace=${JACKAL_AIC_WS:-$repository/ws}
cmake_arguments=(-DCMAKE_BUILD_TYPE=Release)
ros_prefix="" packages=()
missing=()

# A python or a ROS workspace of the caller (pyenv, conda, a sourced setup.bash) must not leak into the build.
export PATH=/usr/bin:/usr/sbin:/bin:/sbin:$PATH LC_ALL=C.UTF-8
unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_MASTER_URI ROS_HOSTNAME ROS_IP ROS_NAMESPACE PYTHONPATH PYTHONHOME

# Every script takes --yes.
assume_yes=false arguments_left=()
for argument; do
  if [[ $argument == --yes ]]; then assume_yes=true; else arguments_left+=("$argument"); fi
done
set -- ${arguments_left[@]+"${arguments_left[@]}"}

# shellcheck source=scripts/lib/progress.sh
. "$repository/scripts/lib/progress.sh"
# shellcheck source=scripts/lib/packages.sh
. "$repository/scripts/lib/packages.sh"

# other_option [WORD]: --help prints the comment at the head of the script; any other word is refused.
other_option() {
  (($# > 0)) || return 0
  [[ $1 == --help || $1 == -h ]] || fail "unknown option $1 (see --help)"
  sed -n '2,/^$/s/^# \{0,1\}//p' "$0"
  say "Installs missing packages with apt first, and asks once on a terminal (--yes: never); it removes nothing."
  exit 0
}

# take_options "NAME ..." ARGUMENT...: sets option[NAME] from each `--NAME VALUE` in the arguments, and refuses others.
declare -A option=()
# shellcheck disable=SC2034 # option is for the scripts
take_options() {
  local known=" $1 "
  shift
  while (($# > 0)); do
    [[ $1 == --* && $known == *" ${1#--} "* ]] || other_option "$1"
    (($# >= 2)) || fail "$1 needs a value (see --help)"
    option[${1#--}]=$2
    shift 2
  done
}

# Refuses a directory of the user: these scripts made the workspace (then it contains the file `location`), or it is empty or missing.
require_own_workspace() {
  local owner='' place='' why=''
  if [[ -f $workspace/location ]]; then
    read -r owner place <"$workspace/location" || true
    if [[ -n $owner && $owner$place != /*/* ]]; then why="the file location in it is not theirs"; fi
    if [[ -n $owner && $owner != "$repository" && -e $owner/package.xml && $place == "$(cd "$workspace" && pwd -P)" ]]; then
      why="it belongs to the checkout $owner"
    fi
  elif [[ -e $workspace && (! -d $workspace || -n $(ls -A "$workspace")) ]]; then
    why="these scripts did not make it"
  fi
  [[ -z $why ]] || fail "$workspace: $why: set JACKAL_AIC_WS to an empty directory"
}

make_workspace() {
  [[ $repository$workspace != *[[:space:]]* ]] || fail "catkin cannot build in a path with a space: $repository, $workspace"
  require_own_workspace
  { mkdir -p "$workspace" && touch "$workspace/location" && mkdir -p "$workspace/src" "$workspace/log"; } || fail "cannot write to $workspace"
  # Otherwise a checkout in the src directory of a user's workspace would contain the package twice.
  touch "$workspace/CATKIN_IGNORE"
  workspace=$(cd "$workspace" && pwd -P)
  export ROS_HOME=$workspace/ros MPLCONFIGDIR=$workspace/matplotlib
  # ROS uses the loopback address, so neither a network nor a host name is needed.
  export ROS_IP=127.0.0.1
}

# Links the packages to build; deletes a build of a checkout at another path.
link_packages() {
  local entry package=$workspace/src/jackal_aic
  if [[ $(cat "$workspace/location" 2>/dev/null) != "$repository $workspace" ]]; then
    rm -rf "$workspace/build" "$workspace/devel" "$package"
    printf '%s\n' "$repository $workspace" >"$workspace/location"
  fi
  # A link per entry: one link to the checkout would contain the workspace again, and rosrun and roslaunch, which follow all links,
  # would find every program twice. scripts/ has no link, because rosrun would offer them. The manifest is a copy, because
  # catkin_make install copies links. Correct links stay, because another script may use them.
  mkdir -p "$package"
  find "$package" -xtype l -delete
  for entry in "$repository"/*; do
    [[ ${entry##*/} =~ ^(scripts|results|ws|ws-.*)$ || $workspace/ == "$entry"/* || -e $package/${entry##*/} ]] || ln -s "$entry" "$package/"
  done
  cmp -s "$repository/package.xml" "$package/package.xml" ||
    cp --remove-destination --preserve=timestamps "$repository/package.xml" "$package/"
  # catkin runs the tests in the environment of the first configuration, without directories that do not exist then.
  mkdir -p "$workspace/devel/lib/python3/dist-packages"
  # Where the system does not have the packages, those of sim/ stand in.
  rm -f "$workspace/src/jackal_msgs" "$workspace/src/ros_control"
  [[ -e $ros_prefix/share/jackal_msgs/package.xml ]] || ln -s "$repository/sim/jackal_msgs" "$workspace/src/"
  [[ -e $ros_prefix/share/controller_interface/package.xml ]] || ln -s "$repository/sim/ros_control" "$workspace/src/"
}

# As many compilers at a time as processors and free memory (1 GiB each) allow.
build_jobs() { awk -v cores="$(nproc)" '/^MemAvailable:/ { n = int($2 / 1048576); print n < 1 ? 1 : n < cores ? n : cores }' /proc/meminfo; }

# build_workspace TARGET...: builds them; shows the compiler's output if that failed.
build_workspace() {
  local log=$workspace/log/build_$1.log
  run_phase "Building jackal_aic: $1" "$log" catkin_make -C "$workspace" -j"${JACKAL_AIC_JOBS:-$(build_jobs)}" \
    "${cmake_arguments[@]}" -DPYTHON_EXECUTABLE=/usr/bin/python3 "$@" || {
    grep -m 20 -A 4 -E '(error|Error|ERROR)[: ]|undefined reference' "$log" >&2 || tail -n 30 "$log" >&2
    fail "the build failed (log: $log)"
  }
}

# set_up TARGET...: from a bare machine to a built and sourced workspace.
set_up() {
  local lock
  detect_system
  make_workspace
  exec {lock}>"$workspace/lock"
  flock -n "$lock" || { say "Waiting for another script that is building in $workspace" && flock "$lock"; }
  install_packages "${packages[@]}"
  set +u # the setup files of ROS read unset variables
  # shellcheck disable=SC1091
  if [[ -e $ros_prefix/setup.bash ]]; then . "$ros_prefix/setup.bash"; fi
  link_packages
  build_workspace "$@"
  # shellcheck disable=SC1091
  . "$workspace/devel/setup.bash"
  set -u
  exec {lock}>&-
}
