#include "recorded_drive.hpp"

#include <fmt/format.h>
#include <rosbag/view.h>

#include "input_message.hpp"

namespace jackal_aic {
namespace {

/// Calls back for each message of a topic; stops where that returns false.
template <class Message, class Take>
void forEach(const rosbag::Bag& bag, const std::string& topic, Take take) {
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& instance : view) {
    const auto message = instance.instantiate<Message>();
    if (message && !take(*message)) return;
  }
}

}  // namespace

RecordedDrive::RecordedDrive(const std::string& path, const std::string& name_space)
    : path_(path), name_space_(name_space), bag_(path, rosbag::bagmode::Read) {}

bool RecordedDrive::has(const std::string& topic) const {
  return rosbag::View(bag_, rosbag::TopicQuery(topic)).size() > 0;
}

bool RecordedDrive::hasLog() const { return has(topic("jackal_AIC/inputs")); }

std::string RecordedDrive::configuration() const {
  std::string configuration;
  forEach<LoopInputs>(bag_, topic("jackal_AIC/inputs"), [&](const LoopInputs& message) {
    configuration = message.configuration;
    return configuration.empty();
  });
  return configuration;
}

std::vector<ControllerState> RecordedDrive::states() const {
  std::vector<ControllerState> states;
  forEach<ControllerState>(bag_, topic("jackal_AIC/state"), [&](const ControllerState& state) {
    states.push_back(state);
    return true;
  });
  return states;
}

LogReport RecordedDrive::playLog(const Sink& sink) const {
  LogReport report;
  bool any = false;
  std::uint64_t next = 0;
  forEach<LoopInputs>(bag_, topic("jackal_AIC/inputs"), [&](const LoopInputs& message) {
    if (!any) report.first = message.first;
    report.restarted = any && message.first < next;
    if (report.restarted) return false;
    if (any) report.missing += message.first - next;
    any = true;
    for (const DriveInput& input : inputsOf(message)) sink(input);
    report.inputs += message.inputs.size();
    next = message.first + message.inputs.size();
    return true;
  });
  return report;
}

void RecordedDrive::playMessages(MessagePlayer& player, const std::string& set_point) const {
  const auto topics = player.topics();
  std::vector<std::string> names;
  for (const auto& [name, type] : topics) names.push_back(name);
  for (const std::string& needed : {topic("joint_states"), topic("imu/data"), topic(set_point)}) {
    if (has(needed)) continue;
    std::string others;
    rosbag::View all(bag_);
    for (const auto* connection : all.getConnections()) {
      if (connection->datatype == topics.at(needed)) others += (others.empty() ? "" : ", ") + connection->topic;
    }
    throw ParameterError(fmt::format("{}: no messages on {} ({}); of that type it has {}", path_, needed,
                                     topics.at(needed), others.empty() ? "none" : others));
  }
  rosbag::View view(bag_, rosbag::TopicQuery(names));
  for (const auto* connection : view.getConnections()) {
    const std::string& type = topics.at(connection->topic);
    const bool stamped = type == "geometry_msgs/Twist" && connection->datatype == "geometry_msgs/TwistStamped";
    if (connection->datatype == type || stamped) continue;
    throw ParameterError(
        fmt::format("{}: {} has type {}, expected {}", path_, connection->topic, connection->datatype, type));
  }
  // What is static holds from the start, also if the recorder heard the first measurement before it.
  const std::string fixed = "/tf_static";
  for (const rosbag::MessageInstance& message : rosbag::View(bag_, rosbag::TopicQuery(fixed))) player.play(message);
  for (const rosbag::MessageInstance& message : view) {
    if (message.getTopic() != fixed) player.play(message);
  }
}

}  // namespace jackal_aic
