#include "wheel_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic::identification {
namespace {

/// Below this command the offset decreases to zero with the command [rad/s].
constexpr double kSmallCommand = 0.3;

/// Steps by which derivatives are taken: wide enough to bridge the kinks where a command switches between two samples.
const Theta kDifference = (Theta() << 0.002, 0.002, 0.005, 0.05, 0.02).finished();

/// Target speed of a command: gain |u| - o with an offset o, at least zero.
double targetOf(const Theta& theta, double command, double speed_limit) {
  const double magnitude = std::abs(command);
  const double offset = theta[kOffset] * std::min(1.0, magnitude / kSmallCommand);
  const double target = std::min(std::max(0.0, theta[kGain] * magnitude - offset), speed_limit);
  return std::copysign(target, command);
}

/// Simulates one wheel over a stretch.
void simulateStretch(const WheelFit& fit, const Stretch& stretch, const Theta& theta, double WheelCommand::*side,
                     std::vector<WheelCommand>& speeds) {
  const double limit = std::exp(theta[kLogLimit]) / fit.radius, dead_time = theta[kDeadTime], lag = theta[kLag];
  double speed = fit.wheels[stretch.begin].speed.*side;
  double time = fit.wheels[stretch.begin].time;
  double target = speed;  // earlier commands are unknown, so the speed is kept
  std::size_t next = 0;
  for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
    const double stamp = fit.wheels[i].time;
    while (next < stretch.commands.size() && stretch.commands[next].time + dead_time <= stamp) {
      const double acts = stretch.commands[next].time + dead_time;
      if (acts > time) {
        speed = speedAfter(speed, target, lag, limit, acts - time);
        time = acts;
      }
      target = targetOf(theta, stretch.commands[next++].command.*side, fit.speed_limit);
    }
    speed = speedAfter(speed, target, lag, limit, stamp - time);
    time = stamp;
    speeds[i].*side = speed;
  }
}

double cost(const WheelFit& fit, const Theta& theta) { return fit.residuals(theta).squaredNorm(); }

/// Least lag [s] at which its derivative is taken. For a shorter one the derivative vanishes: a search would stay
/// there, with an infinite interval, although the recording excludes longer lags.
constexpr double kShortestLag = 0.005;

/// Derivative of the fitted speeds by the parameters [rad/s per unit].
Eigen::Matrix<double, Eigen::Dynamic, kParameters> jacobian(const WheelFit& fit, const Theta& theta, int parameters) {
  Eigen::Matrix<double, Eigen::Dynamic, kParameters> J(2 * fit.wheels.size(), int(kParameters));
  J.setZero();
  for (int i = 0; i < parameters; ++i) {
    Theta up = theta, down = theta;
    if (i == kLag) up[i] = down[i] = std::max(theta[i], kShortestLag);
    up[i] = std::min(up[i] + kDifference[i], highest()[i]);
    down[i] = std::max(down[i] - kDifference[i], lowest()[i]);
    J.col(i) = (fit.residuals(down) - fit.residuals(up)) / (up[i] - down[i]);
  }
  return J;
}

/// Levenberg and Marquardt's method within the range. Returns the cost.
double refine(const WheelFit& fit, Theta& theta, int parameters) {
  constexpr int kIterations = 40;
  constexpr double kLargestDamping = 1e8, kGood = 1e-9;
  double damping = 1e-3, least = cost(fit, theta);
  for (int iteration = 0; iteration < kIterations && damping < kLargestDamping; ++iteration) {
    const auto J = jacobian(fit, theta, parameters);
    const Theta gradient = J.transpose() * fit.residuals(theta);
    const Eigen::Matrix<double, kParameters, kParameters> information = J.transpose() * J;
    const double before = least;
    for (; damping < kLargestDamping; damping *= 4.0) {
      auto damped = information;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-12 * static_cast<double>(fit.wheels.size());
      Theta next = theta + damped.ldlt().solve(gradient);
      next = next.cwiseMax(lowest()).cwiseMin(highest());
      const double value = cost(fit, next);
      if (value >= least) continue;
      theta = next;
      least = value;
      damping *= 0.2;
      break;
    }
    if (before - least <= kGood * before) break;
  }
  return least;
}

/// Residuals of a block, left and right of each sample in turn.
Eigen::VectorXd ofBlock(const Eigen::VectorXd& residuals, std::size_t begin, std::size_t end) {
  return residuals.segment(static_cast<Eigen::Index>(2 * begin), static_cast<Eigen::Index>(2 * (end - begin)));
}

/// Significance, in standard deviations, with which one fit explains the blocks of time better than another (Vuong
/// 1989).
double advantage(const WheelFit& fit, const Theta& one, const Theta& other) {
  const Eigen::VectorXd a = fit.residuals(one), b = fit.residuals(other);
  double sum = 0.0, squares = 0.0;
  forEachBlock(fit.wheels, [&](std::size_t begin, std::size_t end) {
    const double block = ofBlock(b, begin, end).squaredNorm() - ofBlock(a, begin, end).squaredNorm();
    sum += block;
    squares += block * block;
  });
  return sum / std::max(std::sqrt(squares), 1e-300);
}

/// Standard deviations by which a limit explains the wheels better than no limit. The bar for fitting is low, because a
/// few blocks with fast changes may decide. The bar for reporting is one in a hundred, because randomly late commands
/// and samples smear the fast blocks, which resembles a limit.
constexpr double kLikely = 1.5, kSure = 2.33;

/// The best fit without a limit near a fit. Returns its cost.
double refineUnlimited(const WheelFit& fit, Theta& theta, int parameters) {
  theta[kLogLimit] = highest()[kLogLimit];
  return refine(fit, theta, parameters);
}

/// Intervals of the first parameters.
FitResult intervals(const WheelFit& fit, const Theta& theta, int parameters) {
  const auto J = jacobian(fit, theta, parameters);
  const Eigen::VectorXd r = fit.residuals(theta);
  FitResult result{theta, Theta::Constant(HUGE_VAL)};
  std::vector<int> seen;
  for (int i = 0; i < kParameters; ++i) {
    if (J.col(i).squaredNorm() > 1e-7 * static_cast<double>(fit.size())) seen.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(seen.size());
  if (count == 0) return result;
  Eigen::MatrixXd S(r.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) S.col(i) = J.col(seen[static_cast<std::size_t>(i)]);
  const Eigen::MatrixXd bread = (S.transpose() * S).inverse();
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(count, count);
  const Eigen::MatrixXd influence = S * bread;
  // Of each parameter: sums of the information of the blocks, and of its square.
  Eigen::ArrayXd information_sum = Eigen::ArrayXd::Zero(count), information_squares = information_sum;
  forEachBlock(fit.wheels, [&](std::size_t begin, std::size_t end) {
    const auto first = static_cast<Eigen::Index>(2 * begin), rows = static_cast<Eigen::Index>(2 * (end - begin));
    const Eigen::VectorXd score = S.middleRows(first, rows).transpose() * r.segment(first, rows);
    const Eigen::ArrayXd information = influence.middleRows(first, rows).colwise().squaredNorm();
    meat += score * score.transpose();
    information_sum += information;
    information_squares += information.square();
  });
  // Blocks of few scores may look quieter than white noise of the same size: the larger variance counts.
  const double white = r.squaredNorm() / std::max(1.0, static_cast<double>(fit.size()) - static_cast<double>(count));
  const Eigen::MatrixXd robust = bread * meat * bread;
  for (Eigen::Index i = 0; i < count; ++i) {
    // The dead time follows from the few blocks with a step, so their number counts (Carter, Schnepel and Steigerwald
    // 2017).
    const double blocks =
        std::max(2.0, information_sum(i) * information_sum(i) / std::max(information_squares(i), 1e-300));
    const double variance = std::max(robust(i, i) * blocks / (blocks - 1.0), white * bread(i, i));
    result.half_width[seen[static_cast<std::size_t>(i)]] = studentQuantile(blocks - 1.0) * std::sqrt(variance);
  }
  return result;
}

}  // namespace

Theta lowest() { return (Theta() << -0.1, 0.0, 0.1, std::log(0.1), -3.0).finished(); }
Theta highest() { return (Theta() << 0.5, 1.0, 3.0, std::log(100.0), 3.0).finished(); }

std::vector<WheelCommand> WheelFit::simulate(const Theta& theta) const {
  std::vector<WheelCommand> speeds;
  speeds.reserve(wheels.size());
  for (const WheelSample& sample : wheels) speeds.push_back(sample.speed);
  for (const Stretch& stretch : stretches) {
    simulateStretch(*this, stretch, theta, &WheelCommand::left, speeds);
    simulateStretch(*this, stretch, theta, &WheelCommand::right, speeds);
  }
  return speeds;
}

Eigen::VectorXd WheelFit::residuals(const Theta& theta) const {
  const auto speeds = simulate(theta);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(2 * speeds.size()));
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    if ((counts[i] & kLeft) != 0) r(row) = wheels[i].speed.left - speeds[i].left;
    if ((counts[i] & kRight) != 0) r(row + 1) = wheels[i].speed.right - speeds[i].right;
  }
  return r;
}

std::size_t WheelFit::size() const {
  std::size_t values = 0;
  for (const char c : counts) values += ((c & kLeft) != 0) + ((c & kRight) != 0);
  return values;
}

Theta searchLeastSquares(const WheelFit& fit, double gain, bool fit_offset) {
  constexpr std::size_t kStarts = 3;
  std::vector<std::pair<double, Theta>> starts;
  for (int i = -1; i <= 12; ++i) {
    for (double lag : {0.01, 0.04, 0.15, 0.4}) {
      for (double limit : {1.0, 3.0, 10.0, 50.0}) {
        Theta theta;
        theta << 0.04 * i, lag, gain, std::log(limit), 0.0;
        starts.emplace_back(cost(fit, theta), theta);
      }
    }
  }
  std::partial_sort(starts.begin(), starts.begin() + kStarts, starts.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  starts.resize(kStarts);
  const int parameters = fit_offset ? kParameters : kOffset;
  for (auto& start : starts) start.first = refine(fit, start.second, parameters);
  const auto best =
      *std::min_element(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  // A limit that the wheels never reached can still fit some noise, so it has to explain more than chance.
  Theta unlimited = best.second;
  const double without = refineUnlimited(fit, unlimited, parameters);
  return without <= best.first || advantage(fit, best.second, unlimited) <= kLikely ? unlimited : best.second;
}

double studentQuantile(double degrees_of_freedom) {
  const double n = std::max(1.0, degrees_of_freedom);
  return 1.959964 + 2.372271 / n + 2.822496 / (n * n) + 2.555853 / (n * n * n);
}

FitResult withIntervals(const WheelFit& fit, const Theta& theta, bool fit_offset) {
  const int parameters = fit_offset ? kParameters : kOffset;
  FitResult result = intervals(fit, theta, parameters);
  Theta unlimited = theta;
  refineUnlimited(fit, unlimited, parameters);
  if (advantage(fit, theta, unlimited) <= kSure) result.half_width[kLogLimit] = HUGE_VAL;
  return result;
}

FitResult fitPart(const WheelFit& part, const Theta& theta, bool fit_offset) {
  const int parameters = fit_offset ? kParameters : kOffset;
  Theta near = theta;
  refine(part, near, parameters);
  return intervals(part, near, parameters);
}

}  // namespace jackal_aic::identification
