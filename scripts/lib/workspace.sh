# shellcheck shell=bash
# Source this first in every script: installs what is missing, makes the catkin workspace, builds it, sources it.
#
# Everything a checkout produces lies in its own git-ignored workspace, ws/ (or JACKAL_AIC_WS): build, logs, ROS home. Its name
# has no dot: the completion of rosbash leaves out paths with one.

set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
workspace=${JACKAL_AIC_WS:-$repository/ws}
# Several sources are compiled as one: the headers of ROS take most of the time of a first build.
cmake_arguments=(-DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON)
ros_prefix=""
packages=()
rviz_package=""
missing=()

# A python or a ROS workspace of the caller (pyenv, conda, a sourced setup.bash) must not leak into the build.
export PATH=/usr/bin:/usr/sbin:/bin:/sbin:$PATH LC_ALL=C.UTF-8
unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH ROS_MASTER_URI ROS_HOSTNAME ROS_IP ROS_NAMESPACE PYTHONPATH PYTHONHOME

# Every script takes --yes.
assume_yes=false
arguments_left=()
for argument; do
  if [[ $argument == --yes ]]; then assume_yes=true; else arguments_left+=("$argument"); fi
done
set -- ${arguments_left[@]+"${arguments_left[@]}"}

# shellcheck source=scripts/lib/progress.sh
. "$repository/scripts/lib/progress.sh"
# shellcheck source=scripts/lib/packages.sh
. "$repository/scripts/lib/packages.sh"

# The scripts that ROS generates read unset variables.
source_ros() {
  set +u
  # shellcheck disable=SC1090
  . "$1"
  set -u
}

# Whether the directory of the workspace is one that these scripts made (it holds the file `location` then), empty or not there yet.
# What else a user has there is neither used nor deleted.
require_own_workspace() {
  local owner='' place=''
  if [[ -f $workspace/location ]]; then
    read -r owner place <"$workspace/location" || true
    [[ -z $owner || $owner$place == /*/* ]] || fail "$workspace/location was not written by these scripts: set JACKAL_AIC_WS to an empty directory"
    [[ -z $owner || $owner == "$repository" || ! -e $owner/package.xml || $place != "$(cd "$workspace" && pwd -P)" ]] ||
      fail "$workspace is the workspace of the checkout $owner: set JACKAL_AIC_WS to an empty directory"
  elif [[ -e $workspace && ! -d $workspace ]]; then
    fail "$workspace is no directory: set JACKAL_AIC_WS to an empty directory"
  elif [[ -d $workspace && -n $(ls -A "$workspace") ]]; then
    fail "$workspace holds files that these scripts did not make: set JACKAL_AIC_WS to an empty directory"
  fi
}

make_workspace() {
  [[ $repository$workspace != *[[:space:]]* ]] || fail "catkin cannot build in a path with a space: $repository, $workspace"
  require_own_workspace
  { mkdir -p "$workspace" && touch "$workspace/location" && mkdir -p "$workspace/src" "$workspace/log"; } || fail "cannot write to $workspace"
  # A checkout in the src directory of a workspace of the user would else hold the package twice.
  touch "$workspace/CATKIN_IGNORE"
  workspace=$(cd "$workspace" && pwd -P)
  export ROS_HOME=$workspace/ros MPLCONFIGDIR=$workspace/matplotlib
  # ROS talks to itself over the loopback address: no network and no name of this machine is needed.
  export ROS_IP=127.0.0.1
  getent hosts localhost >/dev/null || fail "this machine does not know localhost: add the line '127.0.0.1 localhost' to /etc/hosts"
}

# Whether an entry of the checkout stays out of the package: what a build makes, and what holds programs that are not of ROS.
left_out() {
  case $1 in
    scripts | results | ws | ws-*) return 0 ;;
    *) [[ $workspace/ == "$repository/$1"/* ]] ;;
  esac
}

# Links the packages to build; a build that knows another place of the checkout is thrown away.
link_packages() {
  local entry package
  if [[ $(cat "$workspace/location" 2>/dev/null) != "$repository $workspace" ]]; then
    rm -rf "$workspace/build" "$workspace/devel"
    printf '%s\n' "$repository $workspace" >"$workspace/location"
  fi
  # A link per entry and not one to the checkout: that would hold the workspace again, and rosrun and roslaunch, which search a
  # package through all links, would find every program twice. scripts/ is left out: rosrun would offer them. The manifest is
  # a copy, because catkin_make install copies links.
  # What is right already stays: another script may be running on it.
  package=$workspace/src/jackal_aic
  if [[ -L $package ]]; then rm "$package"; fi
  mkdir -p "$package"
  for entry in "$package"/*; do
    if [[ -L $entry ]] && { [[ ! -e $entry || $(readlink "$entry") != "$repository/${entry##*/}" ]] || left_out "${entry##*/}"; }; then
      rm "$entry"
    fi
  done
  for entry in "$repository"/*; do
    left_out "${entry##*/}" || [[ -e $package/${entry##*/} ]] || ln -s "$entry" "$package/"
  done
  cmp -s "$repository/package.xml" "$package/package.xml" ||
    cp --remove-destination --preserve=timestamps "$repository/package.xml" "$package/"
  # The first configuration keeps the environment in which catkin will run the tests, and leaves out of it what is not there yet.
  mkdir -p "$workspace/devel/lib/python3/dist-packages"
  link_stand_in jackal_msgs jackal_msgs
  link_stand_in controller_interface ros_control
}

# link_stand_in PACKAGE DIRECTORY: puts sim/DIRECTORY into the workspace where the system does not have PACKAGE.
link_stand_in() {
  if [[ -e $ros_prefix/share/$1/package.xml ]]; then
    rm -f "$workspace/src/$2"
  else
    ln -sfn "$repository/sim/$2" "$workspace/src/$2"
  fi
}

# As many compilers at a time as processors and free memory (1 GiB each) allow.
build_jobs() {
  local processors memory
  processors=$(nproc)
  memory=$(awk '/^MemAvailable:/ { print int($2 / 1048576) }' /proc/meminfo 2>/dev/null)
  memory=$((${memory:-1} > 0 ? ${memory:-1} : 1))
  printf '%d' $((memory < processors ? memory : processors))
}

# build_workspace TARGETS: builds them (one or more words), then shows the compiler's own words if that failed.
build_workspace() {
  local targets log
  read -ra targets <<<"$1"
  log=$workspace/log/build_${targets[0]}.log
  run_phase "Building jackal_aic: ${targets[0]}" "$log" catkin_make -C "$workspace" -j"${JACKAL_AIC_JOBS:-$(build_jobs)}" \
    "${cmake_arguments[@]}" -DPYTHON_EXECUTABLE=/usr/bin/python3 "${targets[@]}" || {
    grep -m 20 -A 4 -E '(error|Error|ERROR)[: ]|undefined reference' "$log" >&2 || tail -n 30 "$log" >&2
    fail "the build failed (log: $log)"
  }
}

# Installs rviz, which nothing but showing the robot needs.
install_rviz() {
  detect_system
  make_workspace
  install_packages "$workspace/log/install_rviz.log" "$rviz_package"
}

# set_up TARGETS...: from a bare machine to a built and sourced workspace; the targets of an argument are built in one go.
set_up() {
  local lock target
  detect_system
  make_workspace
  exec {lock}>"$workspace/lock"
  flock -n "$lock" || { say "Waiting for another script that is building in $workspace" && flock "$lock"; }
  install_packages "$workspace/log/install.log" "${packages[@]}"
  if [[ -e $ros_prefix/setup.bash ]]; then source_ros "$ros_prefix/setup.bash"; fi
  link_packages
  for target; do build_workspace "$target"; done
  source_ros "$workspace/devel/setup.bash"
  exec {lock}>&-
}
