#include "ros_control_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "jackal_aic/config/urdf_geometry.hpp"

namespace jackal_aic {
namespace {

/// First words of the keys that the drive loop reads.
constexpr const char* kOurs[] = {"controller", "predictive", "diff_drive",   "sensors",           "plant_model",
                                 "robot",      "limits",     "deadlines",    "on_loss",           "faults",
                                 "brake",      "slip",       "plausibility", "restart_after_stop"};

/// Keys of the stock configuration that have no meaning here.
constexpr const char* kSilent[] = {"type", "k_l", "k_r", "velocity_rolling_window_size"};

constexpr Bounds kSpeed{-100.0, 100.0};
constexpr double kNoTime = 1e-9;  // s; 0 would mean "no deadline"

bool isOurs(const std::string& key) {
  const std::string first = key.substr(0, key.find('.'));
  return std::find(std::begin(kOurs), std::end(kOurs), first) != std::end(kOurs);
}

ParameterMap ours(ParameterMap& map) {
  ParameterMap ours;
  for (const std::string& key : map.keys()) {
    if (isOurs(key)) ours.set(key, *map.take(key));
  }
  return ours;
}

/// One axis of diff_drive_controller's limits.
struct AxisLimits {
  bool has_velocity_limits = false, has_acceleration_limits = false;
  double max_velocity = 0.0, max_acceleration = 0.0;
  double min_velocity = 0.0, min_acceleration = 0.0;
};

AxisLimits readAxis(ParameterMap& map, const std::string& prefix) {
  constexpr Bounds kAny{-1e6, 1e6};
  AxisLimits p;
  ParameterReader reader(map, prefix);
  reader.field("has_velocity_limits", p.has_velocity_limits, Presence::optional);
  reader.field("has_acceleration_limits", p.has_acceleration_limits, Presence::optional);
  bool has_jerk_limits = false;
  reader.field("has_jerk_limits", has_jerk_limits, Presence::optional);
  if (has_jerk_limits)
    throw ParameterError(prefix + ".has_jerk_limits = true: must be false, the jerk has no limit here");
  reader.field("max_velocity", p.max_velocity, kSpeed, "", Presence::optional);
  reader.field("max_acceleration", p.max_acceleration, kAny, "", Presence::optional);
  for (const char* key : {"min_jerk", "max_jerk"}) map.take(prefix + "." + key);
  // Whenever a min_* is unspecified, it is -max_*.
  p.min_velocity = -p.max_velocity;
  p.min_acceleration = -p.max_acceleration;
  reader.field("min_velocity", p.min_velocity, kSpeed, "", Presence::optional);
  reader.field("min_acceleration", p.min_acceleration, kAny, "", Presence::optional);
  return p;
}

void setUnlessGiven(ParameterMap& map, const std::string& key, double value) {
  if (!map.has(key)) map.set(key, value);
}

void setLimits(ParameterMap& map, const std::string& axis, const AxisLimits& p) {
  const std::string prefix = "limits." + axis + "_";
  if (p.has_velocity_limits) setUnlessGiven(map, prefix + "speed", std::max(p.max_velocity, -p.min_velocity));
  if (p.has_acceleration_limits) {
    setUnlessGiven(map, prefix + "acceleration", p.max_acceleration);
    if (p.min_acceleration != -p.max_acceleration) setUnlessGiven(map, prefix + "deceleration", -p.min_acceleration);
  }
}

/// A brake within a limit of the deceleration.
void setBrake(ParameterMap& map, const std::string& axis) {
  const auto value = [&](const std::string& key, double fallback) {
    ParameterReader reader(map, "limits");
    reader.field(key.c_str(), fallback, {0.0, 1e6}, "", Presence::optional);
    return fallback;
  };
  const LimitParameters limits;
  const double deceleration = value(axis + "_deceleration", 0.0);
  if (deceleration == 0.0) return;
  const bool linear = axis == "linear";
  const BrakeParameters brake;
  const double own = linear ? brake.linear_deceleration : brake.angular_deceleration;
  const double speed = value(axis + "_speed", linear ? limits.linear_speed : limits.angular_speed);
  setUnlessGiven(map, "brake." + axis + "_deceleration", std::min(own, deceleration));
  double time = brake.time;
  ParameterReader(map, "brake").field("time", time, {0.0, 1e6}, "s", Presence::optional);
  map.set("brake.time", std::max(time, speed / deceleration));
}

/// Sets the missing keys of a struct.
template <class Parameters>
void setDefaults(ParameterMap& map, const std::string& prefix, Parameters values) {
  for (const Field& field : fieldsOf(values)) {
    const std::string key = prefix + "." + field.name;
    if (!map.has(key)) map.set(key, field.value);
  }
}

/// The assumed model of config/jackal_model.yaml, for a Jackal without identification.
PlantModel assumedModel() {
  PlantModel model;
  model.identified = false;
  return model;
}

void setStructure(ParameterMap& map) {
  const bool thesis = map.hasSection("controller"), open_loop = map.hasSection("diff_drive");
  if (thesis || open_loop) return;
  setDefaults(map, "predictive", PredictiveParameters{});
  if (map.hasSection("plant_model")) return;
  setDefaults(map, "plant_model", assumedModel());
  map.set("plant_model.robot", std::string("Clearpath Jackal"));
}

/// Names of the wheels of one side: a text, or a list of texts.
std::vector<std::string> wheelNames(ParameterMap& map, const std::string& key) {
  const ParameterValue* value = map.take(key);
  if (!value) throw ParameterError("Couldn't retrieve wheel param '" + key + "'");
  if (const auto* name = std::get_if<std::string>(value)) return {*name};
  const auto* names = std::get_if<std::vector<std::string>>(value);
  if (names && !names->empty()) return *names;
  throw ParameterError("Wheel param '" + key + "' = " + describe(*value) + ": neither a list of strings nor a string");
}

/// The diagonal of a covariance; empty without the key or for an empty list.
std::optional<std::array<double, 6>> diagonal(ParameterMap& map, const std::string& key) {
  const ParameterValue* value = map.take(key);
  if (!value) return std::nullopt;
  const auto* numbers = std::get_if<std::vector<double>>(value);
  if (numbers && numbers->empty()) return std::nullopt;
  if (!numbers || numbers->size() != 6) throw ParameterError(key + " = " + describe(*value) + ": must be 6 numbers");
  std::array<double, 6> diagonal{};
  std::copy(numbers->begin(), numbers->end(), diagonal.begin());
  return diagonal;
}

LiveParameters readLive(ParameterMap& map) {
  auto p = readParameters<LiveParameters>(map, "");
  double both = 0.0;
  ParameterReader(map, "").field("wheel_radius_multiplier", both, {0.1, 10.0}, "", Presence::optional);
  if (both > 0.0) p.left_wheel_radius_multiplier = p.right_wheel_radius_multiplier = both;
  return p;
}

/// Replaces the node's geometry by that of diff_drive_controller.
void setGeometry(ParameterMap& stock, ParameterMap& map, RosControlParameters& parameters,
                 const std::function<std::string()>& robot_description) {
  for (const char* key : {"wheel_radius", "effective_track", "left_wheel_joints", "right_wheel_joints", "base_frame"}) {
    if (!map.has(std::string("robot.") + key)) continue;
    throw ParameterError(std::string("robot.") + key +
                         ": give wheel_radius, wheel_separation with wheel_separation_multiplier, left_wheel, "
                         "right_wheel and base_frame_id instead");
  }
  const auto left = wheelNames(stock, "left_wheel"), right = wheelNames(stock, "right_wheel");
  if (left.size() != right.size()) {
    throw ParameterError("#left wheels (" + std::to_string(left.size()) + ") != #right wheels (" +
                         std::to_string(right.size()) + ")");
  }
  double radius = 0.0;
  std::string base_frame = "base_link";
  ParameterReader reader(stock, "");
  reader.field("wheel_radius", radius, {0.001, 10.0}, "m", Presence::optional);
  reader.field("wheel_separation", parameters.wheel_separation, {0.001, 10.0}, "m", Presence::optional);
  reader.field("base_frame_id", base_frame, Presence::optional);
  if (radius == 0.0 || parameters.wheel_separation == 0.0) {
    const std::string urdf = robot_description();
    if (urdf.empty()) throw ParameterError("Robot description couldn't be retrieved from param server");
    if (parameters.wheel_separation == 0.0) {
      parameters.wheel_separation = readWheelSeparation(urdf, left.front(), right.front());
    }
    if (radius == 0.0) radius = readWheelRadius(urdf, left.front());
  }
  map.set("robot.left_wheel_joints", left);
  map.set("robot.right_wheel_joints", right);
  map.set("robot.base_frame", base_frame);
  map.set("robot.wheel_radius", radius);
  map.set("robot.effective_track", parameters.wheel_separation * parameters.live.wheel_separation_multiplier);
}

void setTimeout(ParameterMap& stock, ParameterMap& map) {
  double timeout = DeadlineParameters{}.set_point;
  ParameterReader(map, "deadlines").field("set_point", timeout, {0.0, 60.0}, "s", Presence::optional);
  const bool given = stock.has("cmd_vel_timeout");
  ParameterReader(stock, "").field("cmd_vel_timeout", timeout, {0.0, 60.0}, "s", Presence::optional);
  map.set("deadlines.set_point", given ? std::max(timeout, kNoTime) : timeout);
}

std::vector<std::string> unusedKeys(ParameterMap& map) {
  for (const char* key : kSilent) map.take(key);
  const auto known = map.knownKeys();
  std::vector<std::string> unused;
  for (const std::string& key : map.keys()) {
    if (!std::binary_search(known.begin(), known.end(), key)) unused.push_back(key);
  }
  return unused;
}

}  // namespace

RosControlParameters readRosControlParameters(ParameterMap map, const std::function<std::string()>& robot_description) {
  RosControlParameters parameters;
  ParameterMap drive = ours(map);
  parameters.live = readLive(map);
  setGeometry(map, drive, parameters, robot_description);
  setTimeout(map, drive);
  setLimits(drive, "linear", readAxis(map, "linear.x"));
  setLimits(drive, "angular", readAxis(map, "angular.z"));
  setBrake(drive, "linear");
  setBrake(drive, "angular");
  setStructure(drive);
  ParameterReader reader(map, "");
  reader.field("open_loop", parameters.open_loop, Presence::optional);
  reader.field("allow_multiple_cmd_vel_publishers", parameters.allow_multiple_cmd_vel_publishers, Presence::optional);
  reader.field("publish_cmd", parameters.publish_cmd, Presence::optional);
  reader.field("odom_frame_id", parameters.odom_frame_id, Presence::optional);
  reader.field("imu_topic", parameters.imu_topic, Presence::optional);
  parameters.pose_covariance_diagonal = diagonal(map, "pose_covariance_diagonal");
  parameters.twist_covariance_diagonal = diagonal(map, "twist_covariance_diagonal");
  parameters.unused = unusedKeys(map);
  parameters.drive = readNodeParameters(drive, robot_description);
  return parameters;
}

}  // namespace jackal_aic
