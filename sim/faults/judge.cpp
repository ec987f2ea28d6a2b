#include "judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kMargin = 1.2;         // on configured times
constexpr double kStillSpeed = 0.02;    // m/s, below which the robot stands
constexpr double kStillYawRate = 0.05;  // rad/s
constexpr double kSpeedWindow = 0.4;    // s, over which a speed is averaged
constexpr double kRounding = 1e-3;      // relative: commands travel as float32
constexpr double kSmallestSpeed = 0.2;  // m/s and rad/s: below it, the tolerance at the end is absolute

bool still(const TruthSample& sample) {
  return std::abs(sample.forward) < kStillSpeed && std::abs(sample.yaw_rate) < kStillYawRate;
}

/// Speed of the faster wheels over ground.
double wheelSpeed(const TruthSample& sample, const GeometryParameters& geometry) {
  return std::abs(sample.forward) + 0.5 * geometry.effective_track * std::abs(sample.yaw_rate);
}

/// Part of a limit that is used; 0 stands for no limit.
double shareOf(double value, double limit) { return limit > 0.0 ? std::abs(value) / limit : 0.0; }

/// Looks at one run from every side.
class Judgement {
 public:
  Judgement(const Scenario& scenario, const RunRecord& record, const CampaignLimits& limits)
      : scenario_(scenario), record_(record), limits_(limits) {}

  Verdict verdict() {
    if (!record_.breakdown.empty()) failUnsound(record_.breakdown);
    if (record_.truth.empty() || record_.commands.empty() || record_.states.empty()) {
      failUnsound("nothing was recorded");
      return verdict_;
    }
    tellHistory();
    measureMotion();
    measureCommands();
    measureDetection();
    checkOutcome();
    return verdict_;
  }

 private:
  void fail(const std::string& failure) { verdict_.failures.push_back(failure); }

  void failUnsound(const std::string& failure) {
    verdict_.unsound.push_back(failure);
    fail(failure);
  }

  void tellHistory() {
    const std::string* last = nullptr;
    for (const StateSample& state : record_.states) {
      if (last != nullptr && *last == state.text) continue;
      verdict_.history += fmt::format("{}{:.2f} s {}", last == nullptr ? "" : ", ", state.time, state.text);
      last = &state.text;
    }
  }

  TruthSample atOnset() const {
    TruthSample last = record_.truth.front();
    for (const TruthSample& sample : record_.truth) {
      if (sample.time <= scenario_.onset) last = sample;
    }
    return last;
  }

  void measureMotion() {
    const TruthSample onset = atOnset();
    const double fastest = std::max(std::abs(onset.forward), std::abs(scenario_.motion.forward));
    const double fastest_turn = std::max(std::abs(onset.yaw_rate), std::abs(scenario_.motion.yaw_rate));
    const TruthSample* previous = nullptr;
    for (const TruthSample& sample : record_.truth) {
      if (sample.time > scenario_.onset) {
        verdict_.overspeed = std::max(verdict_.overspeed, std::abs(sample.forward) - fastest);
        verdict_.yaw_overspeed = std::max(verdict_.yaw_overspeed, std::abs(sample.yaw_rate) - fastest_turn);
        const bool counts = sample.time <= scenario_.clear() && !verdict_.standstill;
        if (counts && previous) verdict_.distance += std::abs(sample.forward) * (sample.time - previous->time);
        if (sample.time <= scenario_.clear()) noteStandstill(sample);
      }
      previous = &sample;
    }
    checkSpeed("at the onset", scenario_.onset, scenario_.motion.forward, scenario_.motion.yaw_rate);
    verdict_.allowed_standstill = allowedStandstill(scenario_.expectation, limits_, onset);
    const double allowed = scenario_.expectation.overspeed;
    if (verdict_.overspeed > allowed)
      fail(fmt::format("overspeed {:.2f} m/s, allowed {:.2f}", verdict_.overspeed, allowed));
    const double allowed_turn = 2.0 * allowed / limits_.geometry.effective_track;
    if (verdict_.yaw_overspeed > allowed_turn) {
      fail(fmt::format("yaw rate {:.2f} rad/s too high, allowed {:.2f}", verdict_.yaw_overspeed, allowed_turn));
    }
  }

  void noteStandstill(const TruthSample& sample) {
    if (!still(sample)) {
      verdict_.standstill.reset();
    } else if (!verdict_.standstill) {
      verdict_.standstill = sample.time - scenario_.onset;
    }
  }

  void measureCommands() {
    const SkidSteerKinematics kinematics(limits_.geometry);
    const CommandSample* previous = nullptr;
    for (const CommandSample& sample : record_.commands) {
      if (!sample.speeds.vector().allFinite()) return failUnsound("a drive command is not finite");
      checkBounds(sample, kinematics);
      if (sample.fresh_start && sample.speeds != WheelCommand{})
        failUnsound("an old motion goes on after a fresh start");
      if (previous != nullptr && !sample.fresh_start) measureStep(*previous, sample, kinematics);
      previous = &sample;
    }
    if (verdict_.limit_use > 1.0 + kRounding)
      failUnsound(fmt::format("a drive command is {:.2f} of the limits", verdict_.limit_use));
    if (verdict_.acceleration_use > 1.0 + kRounding) {
      failUnsound(fmt::format("drive command steps by {:.2f} rad/s in one period, {:.2f} of the limit",
                              verdict_.command_step, verdict_.acceleration_use));
    }
  }

  void checkBounds(const CommandSample& sample, const SkidSteerKinematics& kinematics) {
    const BodyVector body = kinematics.bodyVelocity(sample.speeds);
    const double wheel = std::max(std::abs(sample.speeds.left), std::abs(sample.speeds.right));
    const double use =
        std::max({std::abs(body(kForward)) / limits_.gate.limits.linear_speed,
                  std::abs(body(kYaw)) / limits_.gate.limits.angular_speed, wheel / limits_.gate.limits.wheel_speed});
    verdict_.limit_use = std::max(verdict_.limit_use, use);
  }

  void measureStep(const CommandSample& from, const CommandSample& to, const SkidSteerKinematics& kinematics) {
    // Periods in which nothing was sent (a stall) may be made up for.
    const double periods = std::max(1.0, std::round((to.time - from.time) / limits_.action_period));
    const double duration = periods * limits_.action_period;
    const BodyVector change = kinematics.bodyVelocity(to.speeds) - kinematics.bodyVelocity(from.speeds);
    const double wheel =
        std::max(std::abs(to.speeds.left - from.speeds.left), std::abs(to.speeds.right - from.speeds.right));
    verdict_.command_step = std::max(verdict_.command_step, wheel / periods);
    const LimitParameters& bounds = limits_.gate.limits;
    verdict_.acceleration_use =
        std::max({verdict_.acceleration_use, shareOf(change(kForward), duration * bounds.linear_acceleration),
                  shareOf(change(kYaw), duration * bounds.angular_acceleration)});
  }

  bool expected(const std::string& told) const {
    const auto& reasons = scenario_.expectation.reasons;
    return std::any_of(reasons.begin(), reasons.end(),
                       [&](const std::string& reason) { return told.find(reason) != std::string::npos; });
  }

  void noteDetection(double time, const std::string& told) {
    if (verdict_.detected_after || time < scenario_.onset) return;
    verdict_.detected_after = time - scenario_.onset;
    verdict_.told = told;
  }

  /// Counters as they were at the onset.
  StateSample stateAtOnset() const {
    StateSample last = record_.states.front();
    for (const StateSample& state : record_.states) {
      if (state.time <= scenario_.onset) last = state;
    }
    return last;
  }

  void measureDetection() {
    const Detection by = scenario_.expectation.detected_by;
    const StateSample before = stateAtOnset();
    for (const StateSample& state : record_.states) {
      const auto set_points = state.rejected_set_points - before.rejected_set_points;
      const auto measurements = state.rejected_measurements - before.rejected_measurements;
      const bool later = state.time > scenario_.onset;
      if (by == Detection::state && later && expected(state.text)) noteDetection(state.time, state.text);
      if (by == Detection::set_points && later && set_points > 0) {
        noteDetection(state.time, fmt::format("{} set points rejected", set_points));
      }
      if (by == Detection::measurements && later && measurements > 0) {
        noteDetection(state.time, fmt::format("{} measurements rejected", measurements));
      }
    }
    if (by == Detection::diagnostics) {
      for (const DiagnosticSample& diagnostic : record_.diagnostics) {
        if (expected(diagnostic.text)) noteDetection(diagnostic.time, diagnostic.text);
      }
    }
    const double bar = scenario_.expectation.detected_within;
    if (by == Detection::tolerated) {
      verdict_.told = "tolerated";
    } else if (!verdict_.detected_after) {
      fail("undetected; the controller last said '" + lastWord() + "'");
    } else if (bar > 0.0 && *verdict_.detected_after > bar) {
      fail(fmt::format("told after {:.2f} s, allowed {:.2f}", *verdict_.detected_after, bar));
    }
  }

  /// What the controller said at the end of the faults.
  std::string lastWord() const {
    std::string word;
    for (const StateSample& state : record_.states) {
      if (state.time <= scenario_.clear()) word = state.text;
    }
    return word;
  }

  void checkOutcome() {
    const Expectation& expectation = scenario_.expectation;
    if (expectation.outcome == Outcome::stops) {
      checkStandstill();
      if (expectation.recovers) {
        checkFinalSpeed(scenario_.motion.forward, scenario_.motion.yaw_rate);
      } else {
        checkFinalSpeed(0.0, 0.0);
      }
      return;
    }
    if (expectation.outcome == Outcome::drives) checkUninterrupted();
    if (expectation.outcome == Outcome::resumes) checkNothingLatched();
    checkFinalSpeed(scenario_.motion.forward, scenario_.motion.yaw_rate);
  }

  void checkStandstill() {
    if (!verdict_.standstill) {
      fail("the robot does not stop");
    } else if (*verdict_.standstill > verdict_.allowed_standstill) {
      fail(fmt::format("standstill after {:.2f} s, allowed {:.2f}", *verdict_.standstill, verdict_.allowed_standstill));
    }
  }

  void checkUninterrupted() {
    for (const StateSample& state : record_.states) {
      if (state.time <= scenario_.onset || state.driving) continue;
      return fail("the drive is interrupted: '" + state.text + "'");
    }
  }

  /// A fault stays until it is acknowledged, also one that came and went at rest, where no speed shows it.
  void checkNothingLatched() {
    for (const StateSample& state : record_.states) {
      if (state.time > scenario_.onset && state.text.rfind("faulted", 0) == 0)
        return fail("latched: '" + state.text + "'");
    }
    if (!record_.states.back().driving) fail("does not drive at the end: '" + record_.states.back().text + "'");
  }

  void checkFinalSpeed(double forward, double yaw_rate) {
    checkSpeed("at the end", record_.truth.back().time, forward, yaw_rate);
  }

  /// Mean motion over a window that ends at a time [s].
  void checkSpeed(const char* when, double end, double forward, double yaw_rate) {
    double sum = 0.0, turn = 0.0;
    int count = 0;
    for (const TruthSample& sample : record_.truth) {
      if (sample.time < end - kSpeedWindow || sample.time > end) continue;
      sum += sample.forward;
      turn += sample.yaw_rate;
      ++count;
    }
    if (count == 0) return fail(std::string("nothing was recorded ") + when);
    const double tolerance = scenario_.expectation.tolerance;
    if (std::abs(sum / count - forward) > tolerance * std::max(std::abs(forward), kSmallestSpeed)) {
      fail(fmt::format("{:.2f} m/s, expected {:.2f}, ", sum / count, forward) + when);
    }
    if (std::abs(turn / count - yaw_rate) > tolerance * std::max(std::abs(yaw_rate), kSmallestSpeed)) {
      fail(fmt::format("{:.2f} rad/s, expected {:.2f}, ", turn / count, yaw_rate) + when);
    }
  }

  const Scenario& scenario_;
  const RunRecord& record_;
  const CampaignLimits& limits_;
  Verdict verdict_;
};

}  // namespace

double allowedStandstill(const Expectation& expectation, const CampaignLimits& limits, const TruthSample& at_onset) {
  const BrakeParameters& brake = limits.gate.brake;
  const double gate = std::min(brake.time, std::max(std::abs(at_onset.forward) / brake.linear_deceleration,
                                                    std::abs(at_onset.yaw_rate) / brake.angular_deceleration));
  const double robot = wheelSpeed(at_onset, limits.geometry) / limits.robot_acceleration;
  return kMargin * (expectation.within + std::max(gate, robot)) + limits.robot_dead_time;
}

Verdict judge(const Scenario& scenario, const RunRecord& record, const CampaignLimits& limits) {
  return Judgement(scenario, record, limits).verdict();
}

}  // namespace jackal_aic::sim
