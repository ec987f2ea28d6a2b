# shellcheck shell=bash
# Packages of the distribution, and their installation through apt.

readonly COMMON_PACKAGES=(cmake g++ make pkg-config python3 libbenchmark-dev libboost-program-options-dev
  libeigen3-dev libfmt-dev libgmock-dev libgtest-dev libode-dev liburdfdom-dev libyaml-cpp-dev
  pybind11-dev python3-dev python3-jinja2 python3-matplotlib python3-numpy python3-pandas python3-scipy python3-setuptools
  python3-tqdm python3-yaml)

# ROS 1 as Debian 11 and 12 ship it, under /usr. rostopic and rosservice need the python3-*-msgs.
readonly DEBIAN_ROS_PACKAGES=(catkin ros-core ros-core-dev rosbash python3-rostest ros-robot-state-publisher
  libdiagnostic-updater-dev libdynamic-reconfigure-config-init-mutex-dev libmessage-filters-dev libtf2-msgs-dev libtf2-ros-dev
  pluginlib-dev python3-dynamic-reconfigure python3-{diagnostic,geometry,nav,sensor,tf2,visualization}-msgs python3-std-srvs)

# ROS Noetic on Ubuntu 20.04, under /opt/ros/noetic: what runs on a Jackal.
readonly NOETIC_PACKAGES=(ros-noetic-{catkin,controller-interface,diagnostic-updater,dynamic-reconfigure,hardware-interface}
  ros-noetic-{jackal-msgs,message-filters,nav-msgs,pluginlib,robot-state-publisher,ros-core,rosbash,rostest,tf2-msgs,tf2-ros}
  ros-noetic-{topic-tools,visualization-msgs})

# shellcheck disable=SC2034 # ros_prefix and packages are for workspace.sh
# detect_system: sets ros_prefix (where ROS is) and packages (all that is needed) for this system.
detect_system() {
  local system=unknown
  [[ -r /etc/os-release ]] && system=$(. /etc/os-release && printf '%s %s' "${ID:-}" "${VERSION_ID:-}")
  case $system in
    "debian 11" | "debian 12")
      ros_prefix=/usr
      packages=("${COMMON_PACKAGES[@]}" "${DEBIAN_ROS_PACKAGES[@]}")
      ;;
    "ubuntu 20.04")
      ros_prefix=/opt/ros/noetic
      packages=("${COMMON_PACKAGES[@]}" "${NOETIC_PACKAGES[@]}")
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

# Nothing is removed. A package is upgraded only if a new one needs that, as after a security update.
readonly APT_INSTALL=(install --no-install-recommends --no-remove)

# install_packages PACKAGE...: installs what is missing; silent, and without a network, when nothing is. apt asks once on a terminal.
# --yes and a shell without a terminal go ahead.
install_packages() {
  local root=()
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} > 0)) || return 0
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "cannot become root to install: as root, run: apt-get ${APT_INSTALL[*]} ${missing[*]}"
    root=(sudo)
  fi
  say "Installing with apt-get (nothing is removed): ${missing[*]}"
  ${root[@]+"${root[@]}"} apt-get -q -o DPkg::Lock::Timeout=300 update
  # shellcheck disable=SC2154 # workspace.sh sets assume_yes
  # Without a person at the terminal no package may ask either.
  if [[ $assume_yes == true || ! -t 0 || ! -t 1 ]]; then missing+=(-y) && export DEBIAN_FRONTEND=noninteractive; fi
  ${root[@]+"${root[@]}"} apt-get -q -o DPkg::Lock::Timeout=300 "${APT_INSTALL[@]}" "${missing[@]}" || fail "apt-get installed nothing"
}
