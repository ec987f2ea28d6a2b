#include "input_message.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "node_parameters.hpp"

namespace jackal_aic {
namespace {

/// Appends numbers to a list.
class Writer {
 public:
  explicit Writer(std::vector<double>& values) : values_(values) {}
  void operator()(double value) { values_.push_back(value); }
  void operator()(bool value) { values_.push_back(value ? 1.0 : 0.0); }
  void operator()(AppliedSource value) { values_.push_back(static_cast<double>(value)); }
  void operator()(const std::optional<double>& value) {
    values_.push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  static bool done() { return false; }

 private:
  std::vector<double>& values_;
};

/// Takes them off the list in the same order.
class Reader {
 public:
  explicit Reader(const std::vector<double>& values) : values_(values) {}
  void operator()(double& value) { value = next(); }
  void operator()(bool& value) { value = next() != 0.0; }
  void operator()(AppliedSource& value) {
    const double source = next();
    if (!(source >= 0.0) || source > static_cast<double>(AppliedSource::wheels)) {
      throw ParameterError(fmt::format("a recorded command has the unknown source {:g}", source));
    }
    value = static_cast<AppliedSource>(static_cast<int>(source));
  }
  void operator()(std::optional<double>& value) {
    const double number = next();
    value = std::isfinite(number) ? std::optional<double>(number) : std::nullopt;
  }

  /// True if every number was taken.
  bool done() const { return next_ == values_.size(); }

 private:
  double next() {
    if (done()) throw ParameterError(fmt::format("a recorded input has {} values: too few", values_.size()));
    return values_[next_++];
  }

  const std::vector<double>& values_;
  std::size_t next_ = 0;
};

// The order of the values, for both directions; LoopInput.msg describes it.

template <class Archive>
void visitValues(Archive& a, Observation& y) {
  a(y.stamp), a(y.yaw_rate), a(y.wheel_left), a(y.wheel_right), a(y.acceleration_x), a(y.acceleration_y);
  a(y.acceleration_z);
  a(y.valid.yaw_rate), a(y.valid.wheel_left), a(y.valid.wheel_right), a(y.valid.acceleration);
}

template <class Archive>
void visitValues(Archive& a, SensorReading& reading) {
  visitValues(a, reading.observation);
  for (Eigen::Index i = 0; i < reading.sample.size(); ++i) a(reading.sample(i));
  a(reading.may_repeat);
}

template <class Archive>
void visitValues(Archive&, BeliefInput&) {}
template <class Archive>
void visitValues(Archive& a, ActionInput& input) {
  a(input.due);
}
template <class Archive>
void visitValues(Archive& a, SetPointInput& input) {
  a(input.wanted.forward), a(input.wanted.lateral), a(input.wanted.yaw_rate), a(input.stamp);
}
template <class Archive>
void visitValues(Archive& a, WheelsInput& input) {
  visitValues(a, input.reading);
}
template <class Archive>
void visitValues(Archive& a, ImuInput& input) {
  visitValues(a, input.reading);
}
template <class Archive>
void visitValues(Archive& a, ObservationInput& input) {
  visitValues(a, input.observation);
}
template <class Archive>
void visitValues(Archive& a, FeedbackInput& input) {
  a(input.stamp);
}
template <class Archive>
void visitValues(Archive& a, StatusInput& input) {
  RobotStatus& s = input.status;
  a(s.emergency_stop), a(s.robot_stopped), a(s.motors_off), a(s.driver_fault), a(s.contended), a(s.graph_checked);
  a(s.ending), a(s.rivals);
  // Older recordings lack the last ones.
  if (!a.done()) a(s.disabled);
  if (!a.done()) a(s.unheard);
}
template <class Archive>
void visitValues(Archive& a, AppliedInput& input) {
  a(input.command.left), a(input.command.right), a(input.source);
}
template <class Archive>
void visitValues(Archive& a, SlipState& slip) {
  a(slip.effective_track), a(slip.slip_factor);
  bool known = slip.turn.has_value();
  a(known);
  if (!known) return;
  if (!slip.turn) slip.turn.emplace();
  for (int i = 0; i < 4; ++i) a(slip.turn->mean(i));
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      a(slip.turn->covariance(i, j));
      slip.turn->covariance(j, i) = slip.turn->covariance(i, j);
    }
  }
}
template <class Archive>
void visitValues(Archive& a, LearnedInput& input) {
  visitValues(a, input.learned.slip);
  auto& timing = input.learned.timing;
  bool known = timing.has_value();
  if (!a.done()) a(known);  // recordings from before it was learned do not say
  if (!known) return;
  if (!timing) timing.emplace();
  a(timing->dead_time), a(timing->lag);
  if (!a.done()) a(timing->acceleration_limit);  // recordings from before it was learned have none
}
template <class Archive>
void visitValues(Archive& a, LearningInput& input) {
  a(input.frozen);
}
template <class Archive>
void visitValues(Archive&, GainsInput&) {}
template <class Archive>
void visitValues(Archive& a, StartInput& input) {
  a(input.driven.left), a(input.driven.right);
}

using What = decltype(DriveInput::what);
constexpr std::size_t kKinds = std::variant_size_v<What>;
template <std::size_t kind, class Input>
constexpr bool isKind = std::is_same_v<std::variant_alternative_t<kind, What>, Input>;
static_assert(isKind<LoopInput::BELIEF, BeliefInput> && isKind<LoopInput::ACTION, ActionInput> &&
              isKind<LoopInput::SET_POINT, SetPointInput> && isKind<LoopInput::WHEELS, WheelsInput> &&
              isKind<LoopInput::IMU, ImuInput> && isKind<LoopInput::OBSERVATION, ObservationInput> &&
              isKind<LoopInput::FEEDBACK, FeedbackInput> && isKind<LoopInput::STATUS, StatusInput> &&
              isKind<LoopInput::APPLIED, AppliedInput> && isKind<LoopInput::SLIP, LearnedInput> &&
              isKind<LoopInput::LEARNING, LearningInput> && isKind<LoopInput::GAINS, GainsInput> &&
              isKind<LoopInput::START, StartInput> && kKinds == LoopInput::START + 1);

/// An input of a kind with nothing in it yet.
template <std::size_t... kinds>
What emptyInput(std::size_t kind, std::index_sequence<kinds...>) {
  What what;
  const bool known = ((kind == kinds ? (what.emplace<kinds>(), true) : false) || ...);
  if (!known) throw ParameterError(fmt::format("a recorded input is of kind {}, which is not known", kind));
  return what;
}

}  // namespace

void addInput(const DriveInput& input, LoopInputs& message) {
  message.inputs.emplace_back();
  LoopInput& added = message.inputs.back();
  added.kind = static_cast<std::uint8_t>(input.what.index());
  added.now = input.now;
  Writer write(added.values);
  if (const auto* changed = std::get_if<GainsInput>(&input.what)) {
    message.gains.push_back(std::visit([](const auto& gains) { return gainsText(gains); }, changed->gains));
    return;
  }
  What copy = input.what;
  std::visit([&](auto& what) { visitValues(write, what); }, copy);
}

std::vector<DriveInput> inputsOf(const LoopInputs& message) {
  std::vector<DriveInput> inputs;
  inputs.reserve(message.inputs.size());
  std::size_t gains = 0;
  for (const LoopInput& recorded : message.inputs) {
    DriveInput input{recorded.now, emptyInput(recorded.kind, std::make_index_sequence<kKinds>())};
    Reader read(recorded.values);
    std::visit([&](auto& what) { visitValues(read, what); }, input.what);
    if (!read.done()) {
      throw ParameterError(
          fmt::format("a recorded input of kind {} has {} values: too many", recorded.kind, recorded.values.size()));
    }
    if (auto* changed = std::get_if<GainsInput>(&input.what)) {
      if (gains == message.gains.size()) throw ParameterError("recorded gains are missing");
      changed->gains = readGainsText(message.gains[gains++]);
    }
    inputs.push_back(std::move(input));
  }
  return inputs;
}

}  // namespace jackal_aic
