#include "recorded_drive.hpp"

#include <fmt/format.h>
#include <rosbag/view.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "input_message.hpp"

namespace jackal_aic {
namespace {

/// The messages of topics in the order in which they were recorded. That of a rosbag::View is by the time of the
/// recorder, which mixes what came before its clock was set back with what came after.
class RecordedOrder : private rosbag::View {
 public:
  RecordedOrder(const rosbag::Bag& bag, const std::vector<std::string>& topics)
      : rosbag::View(bag, rosbag::TopicQuery(topics)), bag_(bag) {
    for (const rosbag::MessageRange* range : ranges_) {
      for (auto entry = range->begin; entry != range->end; ++entry) found_.push_back({&*entry, range->connection_info});
    }
    const auto place = [](const Found& f) { return std::pair(f.entry->chunk_pos, f.entry->offset); };
    std::sort(found_.begin(), found_.end(), [&](const Found& a, const Found& b) { return place(a) < place(b); });
    // Within a stretch of time without such a step: a bag may hold one topic after the other.
    const auto earlier = [](const Found& a, const Found& b) { return *a.entry < *b.entry; };
    auto begin = found_.begin();
    std::map<const rosbag::ConnectionInfo*, ros::Time> last;
    for (auto next = begin; next != found_.end(); ++next) {
      ros::Time& before = last[next->connection];
      if (next->entry->time + ros::Duration(kDisorder) < before) {
        std::stable_sort(begin, next, earlier);
        begin = next;
        last.clear();
      }
      last[next->connection] = next->entry->time;
    }
    std::stable_sort(begin, found_.end(), earlier);
  }

  /// Calls back for each message; stops where that returns false.
  template <class Take>
  void forEach(const Take& take) {
    for (const Found& found : found_) {
      const std::unique_ptr<rosbag::MessageInstance> message(newMessageInstance(found.connection, *found.entry, bag_));
      if (!take(*message)) return;
    }
  }

 private:
  static constexpr double kDisorder = 0.1;  // s, within a topic whose messages have the times of their stamps

  struct Found {
    const rosbag::IndexEntry* entry;
    const rosbag::ConnectionInfo* connection;
  };

  const rosbag::Bag& bag_;
  std::vector<Found> found_;
};

/// Calls back for each message of a topic; stops where that returns false.
template <class Message, class Take>
void forEachInOrder(const rosbag::Bag& bag, const std::string& topic, Take take) {
  RecordedOrder(bag, {topic}).forEach([&](const rosbag::MessageInstance& instance) {
    const auto message = instance.instantiate<Message>();
    return !message || take(*message);
  });
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
  forEachInOrder<LoopInputs>(bag_, topic("jackal_AIC/inputs"), [&](const LoopInputs& message) {
    configuration = message.configuration;
    return configuration.empty();
  });
  return configuration;
}

std::uint64_t RecordedDrive::firstInput() const {
  std::uint64_t first = 0;
  forEachInOrder<LoopInputs>(bag_, topic("jackal_AIC/inputs"), [&](const LoopInputs& message) {
    first = message.first;
    return false;
  });
  return first;
}

std::vector<ControllerState> RecordedDrive::states() const {
  std::vector<ControllerState> states;
  forEachInOrder<ControllerState>(bag_, topic("jackal_AIC/state"), [&](const ControllerState& state) {
    states.push_back(state);
    return true;
  });
  return states;
}

LogReport RecordedDrive::playLog(const Sink& sink) const {
  LogReport report;
  bool any = false;
  std::uint64_t next = 0;
  forEachInOrder<LoopInputs>(bag_, topic("jackal_AIC/inputs"), [&](const LoopInputs& message) {
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
  RecordedOrder(bag_, names).forEach([&](const rosbag::MessageInstance& message) {
    if (message.getTopic() != fixed) player.play(message);
    return true;
  });
}

}  // namespace jackal_aic
