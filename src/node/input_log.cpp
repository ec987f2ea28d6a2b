#include "input_log.hpp"

#include <ros/console.h>

#include "input_message.hpp"

namespace jackal_aic {
namespace {

constexpr double kRecorderComes = 20.0;        // with a recorder that is to come [s]
constexpr double kInputRate = 1400.0;          // the belief's 1 kHz, three times 50 Hz of sensors, actions and the rest
constexpr double kConfigurationPeriod = 10.0;  // s
constexpr std::uint32_t kQueue = 100;          // messages: 2 s of a busy recorder

}  // namespace

InputLog::InputLog(ros::NodeHandle& node, const NodeParameters& parameters, DriveLoop& loop)
    : configuration_(parameters), publisher_(node.advertise<LoopInputs>("jackal_AIC/inputs", kQueue)) {
  kept_.reserve(static_cast<std::size_t>(kRecorderComes * kInputRate));
  loop.listen([this](const DriveInput& input) { keep(input); });
}

void InputLog::keep(const DriveInput& input) {
  if (kept_.size() == kept_.capacity()) {
    incomplete_ = true;
    first_ += kept_.size();
    kept_.clear();
  }
  kept_.push_back(input);
}

void InputLog::publish(const ros::Time& now) {
  const bool heard = publisher_.getNumSubscribers() > 0;
  if (!heard && !listened_ && !incomplete_) return;
  if (incomplete_ && !listened_) {
    ROS_WARN_ONCE(
        "Nothing recorded jackal_AIC/inputs in the first %.0f s: a later recording cannot be replayed bit by bit",
        kRecorderComes);
  }
  listened_ = listened_ || heard;
  if (heard) {
    LoopInputs message;
    message.header.stamp = now;
    message.first = first_;
    if (configured_.isZero() || now < configured_ || (now - configured_).toSec() >= kConfigurationPeriod) {
      message.configuration = configurationText(configuration_);
      configured_ = now;
    }
    message.inputs.reserve(kept_.size());
    for (const DriveInput& input : kept_) addInput(input, message);
    publisher_.publish(message);
  }
  for (const DriveInput& input : kept_) {
    if (const auto* changed = std::get_if<GainsInput>(&input.what)) {
      std::visit([this](const auto& gains) { configuration_.controller = gains; }, changed->gains);
    }
  }
  first_ += kept_.size();
  kept_.clear();
}

}  // namespace jackal_aic
