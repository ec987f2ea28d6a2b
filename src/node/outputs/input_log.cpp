#include "outputs/input_log.hpp"

#include <fmt/format.h>
#include <ros/console.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace jackal_aic {
namespace {

constexpr std::size_t kKept = 16000;           // inputs before the first recorder: 20 s of twice the usual rates
constexpr double kConfigurationPeriod = 10.0;  // s

/// Appends numbers to a list, or reads them from it in the same order.
class Archive {
 public:
  Archive(std::vector<double>& values, bool reading) : values_(values), reading_(reading) {}
  template <class... Fields>
  void operator()(Fields&... fields) {
    (pass(fields), ...);
  }
  bool done() const { return next_ == values_.size(); }  ///< every number was read

 private:
  template <class Number>
  void pass(Number& value) {
    double number = reading_ ? 0.0 : static_cast<double>(value);
    next(number);
    value = static_cast<Number>(number);
  }
  void pass(std::optional<double>& value) {
    double number = value.value_or(std::nan(""));
    next(number);
    value = std::isfinite(number) ? std::optional<double>(number) : std::nullopt;
  }
  void pass(AppliedSource& value) {
    auto source = static_cast<double>(value);
    next(source);
    if (!(source >= 0.0) || source > static_cast<double>(AppliedSource::wheels)) {
      throw ParameterError(fmt::format("a recorded command has the unknown source {:g}", source));
    }
    value = static_cast<AppliedSource>(static_cast<int>(source));
  }
  void next(double& number) {
    if (!reading_) return values_.push_back(number);
    if (done()) throw ParameterError(fmt::format("a recorded input has {} values: too few", values_.size()));
    number = values_[next_++];
  }

  std::vector<double>& values_;
  bool reading_;
  std::size_t next_ = 0;
};

/// The order of the values, for both directions; LoopInput.msg describes it.
struct Values {
  Archive& a;

  void operator()(BeliefInput&) const {}
  void operator()(GainsInput&) const {}
  void operator()(ActionInput& input) const { a(input.due); }
  void operator()(SetPointInput& input) const {
    a(input.wanted.forward, input.wanted.lateral, input.wanted.yaw_rate, input.stamp);
  }
  void operator()(WheelsInput& input) const { (*this)(input.reading); }
  void operator()(ImuInput& input) const { (*this)(input.reading); }
  void operator()(ObservationInput& input) const { (*this)(input.observation); }
  void operator()(FeedbackInput& input) const { a(input.stamp); }
  void operator()(StatusInput& input) const {
    RobotStatus& s = input.status;
    a(s.emergency_stop, s.robot_stopped, s.motors_off, s.driver_fault, s.contended, s.graph_checked, s.ending, s.rivals,
      s.disabled, s.no_subscriber, s.set_points_connected);
  }
  void operator()(AppliedInput& input) const { a(input.command.left, input.command.right, input.source); }
  void operator()(LearningInput& input) const { a(input.frozen); }
  void operator()(StartInput& input) const { a(input.driven.left, input.driven.right); }
  void operator()(Observation& y) const {
    a(y.stamp, y.yaw_rate, y.wheel_left, y.wheel_right, y.acceleration_x, y.acceleration_y, y.acceleration_z);
    a(y.valid.yaw_rate, y.valid.wheel_left, y.valid.wheel_right, y.valid.acceleration, y.level);
  }
  void operator()(SensorReading& reading) const {
    (*this)(reading.observation);
    for (Eigen::Index i = 0; i < reading.sample.size(); ++i) a(reading.sample(i));
    a(reading.may_repeat);
  }
  void operator()(LearnedInput& input) const {
    auto& [slip, timing] = input.learned;
    a(slip.effective_track, slip.slip_factor);
    if (present(slip.turn)) {
      for (int i = 0; i < slip.turn->mean.size(); ++i) a(slip.turn->mean(i));
      auto& covariance = slip.turn->covariance;
      for (int i = 0; i < covariance.rows(); ++i) {
        for (int j = 0; j <= i; ++j) a(covariance(i, j));
      }
      covariance = covariance.selfadjointView<Eigen::Lower>().toDenseMatrix().eval();
    }
    if (present(timing)) a(timing->dead_time, timing->lag, timing->acceleration_limit);
  }

  template <class T>
  bool present(std::optional<T>& value) const {
    bool known = value.has_value();
    a(known);
    if (known && !value) value.emplace();
    return known;
  }
};

using What = decltype(DriveInput::what);
static_assert(std::variant_size_v<What> == LoopInput::START + 1,
              "the constants of LoopInput.msg are the indices of the variant");

/// An empty input of each kind.
template <std::size_t... kinds>
std::array<What, sizeof...(kinds)> emptyInputs(std::index_sequence<kinds...>) {
  return {What(std::in_place_index<kinds>)...};
}

}  // namespace

void addInput(const DriveInput& input, LoopInputs& message) {
  message.inputs.emplace_back();
  LoopInput& added = message.inputs.back();
  added.kind = static_cast<std::uint8_t>(input.what.index());
  added.now = input.now;
  What copy = input.what;
  Archive archive(added.values, false);
  std::visit(Values{archive}, copy);
  if (const auto* changed = std::get_if<GainsInput>(&input.what)) {
    message.gains.push_back(gainsText(changed->gains));
  }
}

std::vector<DriveInput> inputsOf(const LoopInputs& message) {
  static const auto kEmpty = emptyInputs(std::make_index_sequence<std::variant_size_v<What>>());
  std::vector<DriveInput> inputs;
  inputs.reserve(message.inputs.size());
  std::size_t gains = 0;
  for (const LoopInput& recorded : message.inputs) {
    if (recorded.kind >= kEmpty.size()) {
      throw ParameterError(fmt::format("a recorded input is of kind {}, which is not known", recorded.kind));
    }
    DriveInput input{recorded.now, kEmpty[recorded.kind]};
    std::vector<double> values = recorded.values;
    Archive archive(values, true);
    std::visit(Values{archive}, input.what);
    if (!archive.done()) {
      throw ParameterError(
          fmt::format("a recorded input of kind {} has {} values: too many", recorded.kind, values.size()));
    }
    if (auto* changed = std::get_if<GainsInput>(&input.what)) {
      if (gains == message.gains.size()) throw ParameterError("recorded gains are missing");
      changed->gains = readGainsText(message.gains[gains++]);
    }
    inputs.push_back(std::move(input));
  }
  return inputs;
}

InputLog::InputLog(ros::NodeHandle& node, const NodeParameters& parameters, DriveLoop& loop)
    : configuration_(parameters), publisher_(node.advertise<LoopInputs>("jackal_AIC/inputs", 100)) {
  kept_.reserve(kKept);
  loop.listen([this](const DriveInput& input) { keep(input); });
}

void InputLog::keep(const DriveInput& input) {
  if (kept_.size() == kept_.capacity()) {
    ROS_WARN_ONCE(
        "Nothing recorded jackal_AIC/inputs in the first 20 s: a later recording cannot be replayed bit by bit");
    dropKept();
  }
  kept_.push_back(input);
}

void InputLog::publish(const ros::Time& now) {
  const bool heard = publisher_.getNumSubscribers() > 0;
  if (!heard && first_ == 0) return;  // a recorder that starts with the node receives everything
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
  dropKept();
}

void InputLog::dropKept() {
  for (const DriveInput& input : kept_) {
    if (const auto* changed = std::get_if<GainsInput>(&input.what)) {
      std::visit([this](const auto& gains) { configuration_.controller = gains; }, changed->gains);
    }
  }
  first_ += kept_.size();
  kept_.clear();
}

}  // namespace jackal_aic
