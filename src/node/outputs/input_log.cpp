#include "outputs/input_log.hpp"

#include <fmt/format.h>
#include <ros/console.h>

#include <cmath>
#include <cstddef>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kRecorderComes = 20.0;        // with a recorder that is to come [s]
constexpr double kInputRate = 1400.0;          // the belief's 1 kHz, three times 50 Hz of sensors, actions and the rest
constexpr double kConfigurationPeriod = 10.0;  // s
constexpr std::uint32_t kQueue = 100;          // messages: 2 s of a busy recorder

/// Appends numbers to a list.
class Writer {
 public:
  explicit Writer(std::vector<double>& values) : values_(values) {}
  template <class... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }

 private:
  void put(const std::optional<double>& value) { values_.push_back(value.value_or(std::nan(""))); }
  template <class T>
  void put(const T& value) {
    values_.push_back(static_cast<double>(value));
  }

  std::vector<double>& values_;
};

/// Takes them off the list in the same order.
class Reader {
 public:
  explicit Reader(const std::vector<double>& values) : values_(values) {}
  template <class... Fields>
  void operator()(Fields&... fields) {
    (take(fields), ...);
  }

  /// True if every number was taken.
  bool done() const { return next_ == values_.size(); }

 private:
  void take(double& value) { value = next(); }
  void take(bool& value) { value = next() != 0.0; }
  void take(AppliedSource& value) {
    const double source = next();
    if (!(source >= 0.0) || source > static_cast<double>(AppliedSource::wheels)) {
      throw ParameterError(fmt::format("a recorded command has the unknown source {:g}", source));
    }
    value = static_cast<AppliedSource>(static_cast<int>(source));
  }
  void take(std::optional<double>& value) {
    const double number = next();
    value = std::isfinite(number) ? std::optional<double>(number) : std::nullopt;
  }

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
  a(y.stamp, y.yaw_rate, y.wheel_left, y.wheel_right, y.acceleration_x, y.acceleration_y, y.acceleration_z);
  a(y.valid.yaw_rate, y.valid.wheel_left, y.valid.wheel_right, y.valid.acceleration);
}

template <class Archive>
void visitValues(Archive& a, SensorReading& reading) {
  visitValues(a, reading.observation);
  for (Eigen::Index i = 0; i < reading.sample.size(); ++i) a(reading.sample(i));
  a(reading.may_repeat);
}

template <class Archive>
void visitValues(Archive& a, LearnedModel& learned) {
  auto& turn = learned.slip.turn;
  auto& timing = learned.timing;
  bool turn_known = turn.has_value(), timing_known = timing.has_value();
  a(learned.slip.effective_track, learned.slip.slip_factor, turn_known);
  if (turn_known && !turn) turn.emplace();
  for (int i = 0; turn_known && i < turn->mean.size(); ++i) a(turn->mean(i));
  for (int i = 0; turn_known && i < turn->mean.size(); ++i) {
    for (int j = 0; j <= i; ++j) {
      a(turn->covariance(i, j));
      turn->covariance(j, i) = turn->covariance(i, j);
    }
  }
  a(timing_known);
  if (timing_known && !timing) timing.emplace();
  if (timing_known) a(timing->dead_time, timing->lag, timing->acceleration_limit);
}

template <class Archive>
struct Values {
  Archive& a;

  void operator()(BeliefInput&) const {}
  void operator()(GainsInput&) const {}
  void operator()(ActionInput& input) const { a(input.due); }
  void operator()(SetPointInput& input) const {
    a(input.wanted.forward, input.wanted.lateral, input.wanted.yaw_rate, input.stamp);
  }
  void operator()(WheelsInput& input) const { visitValues(a, input.reading); }
  void operator()(ImuInput& input) const { visitValues(a, input.reading); }
  void operator()(ObservationInput& input) const { visitValues(a, input.observation); }
  void operator()(FeedbackInput& input) const { a(input.stamp); }
  void operator()(StatusInput& input) const {
    RobotStatus& s = input.status;
    a(s.emergency_stop, s.robot_stopped, s.motors_off, s.driver_fault, s.contended, s.graph_checked, s.ending, s.rivals,
      s.disabled, s.unheard);
  }
  void operator()(AppliedInput& input) const { a(input.command.left, input.command.right, input.source); }
  void operator()(LearnedInput& input) const { visitValues(a, input.learned); }
  void operator()(LearningInput& input) const { a(input.frozen); }
  void operator()(StartInput& input) const { a(input.driven.left, input.driven.right); }
};

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
  std::visit(Values<Writer>{write}, copy);
}

std::vector<DriveInput> inputsOf(const LoopInputs& message) {
  std::vector<DriveInput> inputs;
  inputs.reserve(message.inputs.size());
  std::size_t gains = 0;
  for (const LoopInput& recorded : message.inputs) {
    DriveInput input{recorded.now, emptyInput(recorded.kind, std::make_index_sequence<kKinds>())};
    Reader read(recorded.values);
    std::visit(Values<Reader>{read}, input.what);
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
