# shellcheck shell=bash
# What the project needs from the distribution, and its installation through apt.

readonly COMMON_PACKAGES=(
  cmake g++ make pkg-config python3
  libbenchmark-dev libboost-program-options-dev libconsole-bridge-dev libeigen3-dev libfmt-dev libgmock-dev libgtest-dev
  libode-dev
  liburdfdom-dev libyaml-cpp-dev pybind11-dev python3-dev python3-jinja2 python3-matplotlib python3-numpy
  python3-scipy python3-setuptools python3-tqdm python3-yaml valgrind)

# ROS 1 as Debian 11 and 12 ship it, under /usr. The python3-*-msgs are for rostopic, and for rosservice, which else know no message.
readonly DEBIAN_ROS_PACKAGES=(
  catkin ros-core ros-core-dev rosbash python3-rostest ros-robot-state-publisher
  libdiagnostic-updater-dev libdynamic-reconfigure-config-init-mutex-dev libmessage-filters-dev libtf2-msgs-dev libtf2-ros-dev pluginlib-dev
  python3-dynamic-reconfigure python3-diagnostic-msgs python3-geometry-msgs python3-nav-msgs python3-sensor-msgs
  python3-std-srvs python3-tf2-msgs python3-visualization-msgs)

# ROS Noetic on Ubuntu 20.04, under /opt/ros/noetic: what runs on a Jackal.
readonly NOETIC_PACKAGES=(
  ros-noetic-catkin ros-noetic-controller-interface ros-noetic-diagnostic-updater
  ros-noetic-dynamic-reconfigure ros-noetic-hardware-interface ros-noetic-jackal-msgs ros-noetic-message-filters
  ros-noetic-nav-msgs ros-noetic-pluginlib ros-noetic-robot-state-publisher ros-noetic-ros-core ros-noetic-rosbash
  ros-noetic-rostest ros-noetic-tf2-msgs ros-noetic-tf2-ros ros-noetic-topic-tools
  ros-noetic-visualization-msgs)

# shellcheck disable=SC2034 # ros_prefix, packages and rviz_package are for workspace.sh
# detect_system: sets ros_prefix (where ROS is) and packages (all that is needed) for this system.
detect_system() {
  local system=unknown
  [[ -r /etc/os-release ]] && system=$(. /etc/os-release && printf '%s %s' "${ID:-}" "${VERSION_ID:-}")
  case $system in
    "debian 11" | "debian 12")
      ros_prefix=/usr
      packages=("${COMMON_PACKAGES[@]}" "${DEBIAN_ROS_PACKAGES[@]}")
      rviz_package=rviz
      ;;
    "ubuntu 20.04")
      ros_prefix=/opt/ros/noetic
      packages=("${COMMON_PACKAGES[@]}" "${NOETIC_PACKAGES[@]}")
      rviz_package=ros-noetic-rviz
      [[ -d $ros_prefix ]] || grep -rqs '^[^#]*packages.ros.org' /etc/apt/sources.list /etc/apt/sources.list.d ||
        fail "Ubuntu 20.04 has no ROS without the apt source packages.ros.org: add it as wiki.ros.org/noetic/Installation/Ubuntu says, then run this again"
      ;;
    *) fail "this system ($system) has no ROS 1 packages that the project knows; use Debian 12 or 11, or Ubuntu 20.04 with ROS Noetic" ;;
  esac
}

# The arguments that are not installed, one per line.
missing_packages() {
  comm -23 <(printf '%s\n' "$@" | sort -u) \
    <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null | sed -n 's/^installed //p' | sort -u)
}

# Prints what has to stand before apt-get: nothing for root, else sudo, which may ask for a password.
become_root() {
  if ((EUID == 0)); then return 0; fi
  if ! command -v sudo >/dev/null; then return 1; fi
  if sudo -n true 2>/dev/null || { [[ -t 0 && -t 2 ]] && sudo -v; }; then
    printf 'sudo'
  else
    return 1
  fi
}

# What is there already is neither upgraded nor removed.
readonly APT_INSTALL=(install --no-install-recommends --no-upgrade --no-remove)

# What apt would upgrade for the missing packages: --no-upgrade spares only those that it is given.
upgrades() {
  LC_ALL=C apt-get --simulate "${APT_INSTALL[@]}" "${missing[@]}" | sed -nE 's/^Inst ([^ ]+) \[.*/\1/p' | sort -u | paste -sd ' '
}

apt_install() {
  local apt=("$@") upgraded
  "${apt[@]}" update
  upgraded=$(upgrades)
  if [[ -n $upgraded ]]; then
    printf 'E: newer versions of installed packages are needed. Run: apt-get install --only-upgrade %s\n' "$upgraded"
    return 1
  fi
  "${apt[@]}" "${APT_INSTALL[@]}" -y "${missing[@]}"
}

# Asks once whether apt may install what is missing. --yes and a shell without a terminal go ahead.
confirm_installation() {
  local answer sizes
  # shellcheck disable=SC2154 # workspace.sh sets assume_yes
  if [[ $assume_yes == true || ! -t 0 || ! -t 1 ]]; then return 0; fi
  sizes=$(LC_ALL=C apt-get -o Debug::NoLocking=true "${APT_INSTALL[@]}" --assume-no "${missing[@]}" 2>/dev/null |
    sed -nE 's/^(Need to get|After this operation).*/  &/p') || true
  say "To be installed with apt-get (nothing is upgraded or removed):"
  say "  ${missing[*]}"
  if [[ -n $sizes ]]; then say "$sizes"; fi
  read -r -p "Go on? [Y/n] " answer
  case $answer in
    "" | [Yy]*) ;;
    *) fail "nothing was installed" ;;
  esac
}

# install_packages LOG PACKAGE...: installs what is missing. Silent, and without a network, when nothing is.
install_packages() {
  local log=$1 root apt
  shift
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} > 0)) || return 0
  confirm_installation
  root=$(become_root) || fail "cannot become root to install: as root, run: apt-get ${APT_INSTALL[*]} ${missing[*]}"
  say "Installing with apt: ${missing[*]}"
  apt=(env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 -o APT::Status-Fd=1)
  if [[ -n $root ]]; then apt=("$root" -n "${apt[@]}"); fi
  run_phase "Installing packages" "$log" apt_install "${apt[@]}" ||
    fail "apt-get failed: $(grep -m 1 '^E: ' "$log" || tail -n 1 "$log") (log: $log)"
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) || fail "not installed although apt-get reports success: ${missing[*]} (log: $log)"
}
