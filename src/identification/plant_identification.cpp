#include "jackal_aic/identification/plant_identification.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlopt.hpp>

#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic {
namespace {

constexpr double kStep = 0.001;             // s, longest integration step of the model
constexpr double kLeastCommand = 0.5;       // rad/s, commands below this excite nothing
constexpr int kLeastSteps = 2;              // changes of the command
constexpr std::size_t kLeastSamples = 100;  // wheel samples, 2 s at 50 Hz
constexpr double kLeastDifference = 0.5;    // rad/s between the sides, to count as a turn
constexpr int kLeastTurnSamples = 25;
constexpr double kLargestTrack = 5.0;  // m; a larger one means that the robot does not turn with its wheels
constexpr double kNormal95 = 1.96;

/// theta = (dead time, ln lag, gain, ln acceleration limit): what the search moves.
using Theta = std::array<double, 4>;
constexpr Theta kLow{0.0, -6.9, 0.3, -1.6};  // 0 s, 1 ms, 0.3, 0.2 m/s^2
constexpr Theta kHigh{0.5, 0.0, 2.0, 4.6};   // 0.5 s, 1 s, 2, 100 m/s^2

using Component = double WheelCommand::*;

/// What the fit keeps fixed.
struct Problem {
  const DriveRecording& recording;
  double radius;       ///< of the wheels [m]
  double speed_limit;  ///< wheel speed at which the motors are clipped [rad/s]; infinite if they never were
};

/// Fitted speed of one wheel at the stamps of the measured ones.
std::vector<double> simulateWheel(const Problem& problem, Component side, const Theta& theta) {
  const DriveRecording& recording = problem.recording;
  const double dead_time = theta[0], lag = std::exp(theta[1]), gain = theta[2];
  const double limit = std::exp(theta[3]) / problem.radius;
  std::vector<double> speeds;
  speeds.reserve(recording.wheels.size());
  double time = recording.wheels.front().time;
  double speed = recording.wheels.front().speed.*side;
  std::size_t next = 0;
  double target = 0.0;
  const auto takeCommands = [&] {
    while (next < recording.commands.size() && recording.commands[next].time + dead_time <= time + 1e-12) {
      target = std::clamp(gain * (recording.commands[next++].command.*side), -problem.speed_limit, problem.speed_limit);
    }
  };
  for (const WheelSample& sample : recording.wheels) {
    takeCommands();
    while (time < sample.time) {
      double end = std::min(time + kStep, sample.time);
      if (next < recording.commands.size()) end = std::min(end, recording.commands[next].time + dead_time);
      const double step = std::max(end - time, 1e-9);
      speed += paceOf(lag, limit, step).towards(target, speed);
      time += step;
      takeCommands();
    }
    speeds.push_back(speed);
  }
  return speeds;
}

/// Measured minus fitted speed, left wheels then right wheels.
Eigen::VectorXd residuals(const Problem& problem, const Theta& theta) {
  const DriveRecording& recording = problem.recording;
  const auto left = simulateWheel(problem, &WheelCommand::left, theta);
  const auto right = simulateWheel(problem, &WheelCommand::right, theta);
  const auto n = static_cast<Eigen::Index>(left.size());
  Eigen::VectorXd r(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    r(i) = recording.wheels[i].speed.left - left[i];
    r(n + i) = recording.wheels[i].speed.right - right[i];
  }
  return r;
}

/// Least squares over the whole range: the best of a coarse grid, refined without derivatives (the cost has kinks where
/// a command switches between two samples).
Theta searchLeastSquares(const std::function<double(const Theta&)>& cost) {
  std::vector<std::pair<double, Theta>> starts;
  for (int i = 0; i <= 10; ++i) {
    for (double lag : {0.01, 0.04, 0.15}) {
      for (double limit : {1.0, 3.0, 10.0, 50.0}) {
        const Theta theta{0.04 * i, std::log(lag), 1.0, std::log(limit)};
        starts.emplace_back(cost(theta), theta);
      }
    }
  }
  std::sort(starts.begin(), starts.end());

  Theta best = starts.front().second;
  double least = starts.front().first;
  for (std::size_t i = 0; i < 3; ++i) {
    nlopt::opt search(nlopt::LN_SBPLX, 4);
    search.set_lower_bounds({kLow.begin(), kLow.end()});
    search.set_upper_bounds({kHigh.begin(), kHigh.end()});
    search.set_initial_step({0.01, 0.3, 0.05, 0.3});
    search.set_xtol_abs({1e-5, 1e-3, 1e-5, 1e-3});
    search.set_maxeval(600);
    search.set_min_objective(
        [](const std::vector<double>& x, std::vector<double>&, void* data) {
          const auto& f = *static_cast<const std::function<double(const Theta&)>*>(data);
          return f({x[0], x[1], x[2], x[3]});
        },
        const_cast<void*>(static_cast<const void*>(&cost)));
    std::vector<double> x(starts[i].second.begin(), starts[i].second.end());
    double value = 0.0;
    search.optimize(x, value);
    if (value < least) {
      least = value;
      best = {x[0], x[1], x[2], x[3]};
    }
  }
  return best;
}

/// Standard deviations of theta from the linearised fit; infinite where the recording does not depend on a parameter.
Theta standardDeviations(const Problem& problem, const Theta& theta) {
  const Theta delta{0.002, 0.05, 0.005, 0.05};
  const Eigen::VectorXd r = residuals(problem, theta);
  Eigen::MatrixXd J(r.size(), 4);
  for (int i = 0; i < 4; ++i) {
    Theta up = theta, down = theta;
    up[i] = std::min(up[i] + delta[i], kHigh[i]);
    down[i] = std::max(down[i] - delta[i], kLow[i]);
    J.col(i) = (residuals(problem, up) - residuals(problem, down)) / (up[i] - down[i]);
  }
  const double variance = r.squaredNorm() / static_cast<double>(r.size() - 4);
  const Eigen::Matrix4d information = J.transpose() * J;
  Theta deviations;
  deviations.fill(HUGE_VAL);
  std::vector<int> seen;
  for (int i = 0; i < 4; ++i) {
    if (information(i, i) > 1e-9 * static_cast<double>(r.size())) seen.push_back(i);
  }
  const auto count = static_cast<int>(seen.size());
  Eigen::MatrixXd reduced(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) reduced(i, j) = information(seen[i], seen[j]);
  }
  const Eigen::MatrixXd covariance = variance * reduced.inverse();
  for (int i = 0; i < count; ++i) deviations[seen[i]] = std::sqrt(std::max(0.0, covariance(i, i)));
  return deviations;
}

template <class Sample>
void checkSeries(const std::vector<Sample>& series, const char* name, std::size_t least) {
  if (series.size() < least) {
    throw IdentificationError(fmt::format("{}: {} samples, at least {} are needed", name, series.size(), least));
  }
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!std::isfinite(series[i].time)) throw IdentificationError(std::string(name) + ": a stamp is not finite");
    if (i > 0 && series[i].time < series[i - 1].time) {
      throw IdentificationError(fmt::format("{}: stamps are not monotonic ({:g} s is followed by {:g} s)", name,
                                            series[i - 1].time, series[i].time));
    }
  }
}

void checkValues(const DriveRecording& recording) {
  for (const auto& c : recording.commands) {
    if (!c.command.vector().allFinite()) throw IdentificationError("wheel commands: a value is not finite");
  }
  for (const auto& w : recording.wheels) {
    if (!w.speed.vector().allFinite()) throw IdentificationError("wheel speeds: a value is not finite");
  }
  for (const auto& y : recording.yaw) {
    if (!std::isfinite(y.yaw_rate)) throw IdentificationError("yaw rate: a value is not finite");
  }
}

void checkExcitation(const DriveRecording& recording) {
  int steps = 0;
  double previous = 0.0;
  for (const auto& sample : recording.commands) {
    const double command = sample.command.left;
    if (std::abs(command - previous) >= kLeastCommand) {
      ++steps;
      previous = command;
    }
  }
  if (steps < kLeastSteps) {
    throw IdentificationError(
        fmt::format("wheel commands: no excitation ({} steps of 0.5 rad/s or more, at least 2 are needed)", steps));
  }
}

/// A stretch of constant command that the wheel had time to answer.
struct Plateau {
  double command;  ///< [rad/s]
  double speed;    ///< mean measured wheel speed at its end [rad/s]
};

/// Plateaus of one wheel: commands held for at least 0.8 s, answered by the mean over their last 0.2 s.
std::vector<Plateau> plateaus(const DriveRecording& recording, Component side) {
  constexpr double kHeld = 0.8, kMean = 0.2;
  std::vector<Plateau> found;
  for (std::size_t i = 0; i < recording.commands.size();) {
    const double command = recording.commands[i].command.*side;
    std::size_t end = i;
    while (end < recording.commands.size() && recording.commands[end].command.*side == command) ++end;
    const double stop = end < recording.commands.size() ? recording.commands[end].time : recording.wheels.back().time;
    double sum = 0.0;
    int count = 0;
    for (const auto& wheels : recording.wheels) {
      if (wheels.time <= stop - kMean || wheels.time > stop) continue;
      sum += wheels.speed.*side;
      ++count;
    }
    if (std::abs(command) >= kLeastCommand && stop - recording.commands[i].time >= kHeld && count > 0) {
      found.push_back({command, sum / count});
    }
    i = end;
  }
  return found;
}

/// Wheel speed at which the motors are clipped: where the fastest plateaus fall short of the gain of the slower ones.
/// Infinite if none does.
double clippedSpeed(const DriveRecording& recording) {
  std::vector<Plateau> all = plateaus(recording, &WheelCommand::left);
  const auto right = plateaus(recording, &WheelCommand::right);
  all.insert(all.end(), right.begin(), right.end());
  if (all.size() < 2) return HUGE_VAL;
  std::sort(all.begin(), all.end(),
            [](const Plateau& a, const Plateau& b) { return std::abs(a.command) < std::abs(b.command); });
  const auto ratio = [](const Plateau& p) { return p.speed / p.command; };
  const double slow = ratio(all.front()), fast = ratio(all.back());
  return fast < 0.93 * slow ? std::abs(all.back().speed) : HUGE_VAL;
}

/// Remarks on what the recording leaves out.
std::vector<std::string> remarksOn(const DriveRecording& recording, double speed_limit) {
  std::vector<std::string> remarks;
  double fastest = 0.0, slowest = 0.0;
  for (const auto& sample : recording.commands) {
    fastest = std::max({fastest, sample.command.left, sample.command.right});
    slowest = std::min({slowest, sample.command.left, sample.command.right});
  }
  if (slowest > -kLeastCommand) remarks.push_back("one-sided: the wheels were only driven forward");
  if (fastest < kLeastCommand) remarks.push_back("one-sided: the wheels were only driven backward");
  if (std::isfinite(speed_limit)) {
    remarks.push_back(
        fmt::format("clipped: the wheels did not get beyond {:g} rad/s although up to {:g} rad/s were "
                    "commanded; the gain is that below the clipping",
                    speed_limit, std::max(fastest, -slowest)));
  }
  return remarks;
}

/// Effective track of one turn direction by least squares of yaw = r alpha (omega_R - omega_L) / b.
/// @param rolling_radius r alpha [m].
Estimate effectiveTrack(const DriveRecording& recording, double rolling_radius, double gyro_bias, double direction) {
  double sxx = 0.0, sxy = 0.0, syy = 0.0;
  int count = 0;
  std::size_t k = 0;
  for (const auto& wheels : recording.wheels) {
    while (k + 1 < recording.yaw.size() && recording.yaw[k + 1].time <= wheels.time + 1e-6) ++k;
    if (recording.yaw.empty() || std::abs(recording.yaw[k].time - wheels.time) > 0.015) continue;
    const double difference = wheels.speed.right - wheels.speed.left;
    if (direction * difference < kLeastDifference) continue;
    const double x = rolling_radius * difference, y = recording.yaw[k].yaw_rate - gyro_bias;
    sxx += x * x;
    sxy += x * y;
    syy += y * y;
    ++count;
  }
  Estimate track;
  if (recording.yaw.empty()) {
    track.unknown = "no IMU data";
  } else if (count < kLeastTurnSamples) {
    track.unknown = std::string("no turn to the ") + (direction > 0 ? "left" : "right");
  } else if (sxy * kLargestTrack <= sxx) {
    track.unknown = "the yaw rate does not follow the wheels (robot on blocks?)";
  } else {
    const double slope = sxy / sxx;  // 1/b
    const double variance = std::max(0.0, syy - slope * sxy) / (count - 1);
    track.value = 1.0 / slope;
    track.half_width = kNormal95 * std::sqrt(variance / sxx) / (slope * slope);
  }
  return track;
}

/// An estimate with its interval; unknown if the recording does not depend on it or leaves it open by more than its
/// value.
Estimate estimate(double value, double deviation) {
  Estimate result{value, kNormal95 * deviation, ""};
  if (!std::isfinite(deviation) || result.half_width > std::max(std::abs(value), 0.02)) {
    result.unknown = "the recording does not depend on it";
  }
  return result;
}

/// The acceleration limit, if the fitted wheels ever reached it; else the largest acceleration they reached, as a lower
/// bound.
Estimate accelerationLimit(const Problem& problem, const Theta& theta, double deviation) {
  const double limit = std::exp(theta[3]);
  double largest = 0.0;  // of the fitted motion, which has no noise
  for (Component side : {&WheelCommand::left, &WheelCommand::right}) {
    const auto speeds = simulateWheel(problem, side, theta);
    for (std::size_t i = 1; i < speeds.size(); ++i) {
      const double step = problem.recording.wheels[i].time - problem.recording.wheels[i - 1].time;
      if (step > 0.0) largest = std::max(largest, problem.radius * std::abs(speeds[i] - speeds[i - 1]) / step);
    }
  }
  Estimate result = estimate(limit, limit * deviation);
  if (!result.known()) {
    result.value = largest;
    result.unknown = "never reached; at least the largest acceleration seen";
  }
  return result;
}

/// Mean yaw rate while the wheels stand still.
double gyroBias(const DriveRecording& recording) {
  double sum = 0.0;
  int count = 0;
  std::size_t k = 0;
  for (const auto& sample : recording.yaw) {
    while (k + 1 < recording.wheels.size() && recording.wheels[k + 1].time <= sample.time + 1e-6) ++k;
    if (recording.wheels[k].speed.vector().cwiseAbs().maxCoeff() > 0.2) continue;
    sum += sample.yaw_rate;
    ++count;
  }
  return count < kLeastTurnSamples ? 0.0 : sum / count;
}

}  // namespace

Identification identifyDriveTrain(const DriveRecording& recording, double wheel_radius, double slip_factor) {
  checkSeries(recording.commands, "wheel commands", 2);
  checkSeries(recording.wheels, "wheel speeds", kLeastSamples);
  checkSeries(recording.yaw, "yaw rate", 0);
  checkValues(recording);
  checkExcitation(recording);

  const Problem problem{recording, wheel_radius, clippedSpeed(recording)};
  const Theta theta = searchLeastSquares([&](const Theta& t) { return residuals(problem, t).squaredNorm(); });
  const Theta deviation = standardDeviations(problem, theta);

  Identification result;
  result.remarks = remarksOn(recording, problem.speed_limit);
  result.dead_time = estimate(theta[0], deviation[0]);
  result.lag = estimate(std::exp(theta[1]), std::exp(theta[1]) * deviation[1]);
  result.gain = estimate(theta[2], deviation[2]);
  result.acceleration_limit = accelerationLimit(problem, theta, deviation[3]);
  const double bias = gyroBias(recording);
  result.track_left = effectiveTrack(recording, wheel_radius * slip_factor, bias, 1.0);
  result.track_right = effectiveTrack(recording, wheel_radius * slip_factor, bias, -1.0);
  const Eigen::VectorXd r = residuals(problem, theta);
  result.residual = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  const auto n = static_cast<Eigen::Index>(recording.wheels.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const WheelSample& sample = recording.wheels[i];
    result.fitted.push_back({sample.time, {sample.speed.left - r(i), sample.speed.right - r(n + i)}});
  }
  return result;
}

}  // namespace jackal_aic
