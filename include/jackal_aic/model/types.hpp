#pragma once

/// @file
/// Quantities of the controller, with unit and frame. The symbols are those of the thesis (B.D. van der Meer, "Control
/// analysis of an active inference controller for a skid-steer mobile robot", TU Delft 2022).

#include <Eigen/Core>
#include <cmath>
#include <optional>

namespace jackal_aic {

static_assert(EIGEN_MAX_ALIGN_BYTES == 16, "compile with -DEIGEN_MAX_ALIGN_BYTES=16, as the library was");

/// Highest generalised order p that the code supports (the thesis uses p = 3 and mentions up to 5).
inline constexpr int kMaxOrders = 5;

/// Degrees of freedom of the body velocity (x_dot, y_dot, theta_dot).
inline constexpr int kBodySize = 3;

/// Measured channels (theta_dot, omega_L, omega_R, x_ddot, y_ddot) in the order of eq. 3-3.
inline constexpr int kSensorSize = 5;

/// Row of each channel in a sensor vector.
enum SensorChannel { kYawRate = 0, kWheelLeft = 1, kWheelRight = 2, kAccelerationX = 3, kAccelerationY = 4 };

/// Row of each degree of freedom in a body vector.
enum BodyChannel { kForward = 0, kLateral = 1, kYaw = 2 };

/// Body velocity (x_dot [m/s], y_dot [m/s], theta_dot [rad/s]) in base_link (x forward, y left, z up).
using BodyVector = Eigen::Matrix<double, kBodySize, 1>;

/// One sample of all measured channels, in the units of Observation.
using SensorVector = Eigen::Matrix<double, kSensorSize, 1>;

/// Wheel speeds (omega_L, omega_R) [rad/s], positive is forward.
using WheelVector = Eigen::Matrix<double, 2, 1>;

/// Generalised coordinates (2-8): column i is order i, the unit of order 0 per s^i. On the stack, unless the number of
/// rows is Eigen::Dynamic; the memory is the stacked vector (mu, mu', ..., mu^(p)) of the thesis.
template <int rows, int max_orders = kMaxOrders>
using Generalized =
    Eigen::Matrix<double, rows, Eigen::Dynamic, rows == 1 ? Eigen::RowMajor : Eigen::ColMajor, rows, max_orders + 1>;

/// Generalised body velocity mu_tilde, 3 x (p+1).
using GeneralizedBody = Generalized<kBodySize>;

/// Generalised measurement y_tilde, 5 x (p+1), in the units of SensorVector per s^i.
using GeneralizedSensor = Generalized<kSensorSize>;

/// Valid channels of an observation. A channel that was not measured or is faulty has precision zero.
struct ChannelValidity {
  bool yaw_rate = true;      ///< gyro
  bool wheel_left = true;    ///< encoder of the left wheels
  bool wheel_right = true;   ///< encoder of the right wheels
  bool acceleration = true;  ///< accelerometer, all axes

  /// True if every channel counts.
  bool all() const { return yaw_rate && wheel_left && wheel_right && acceleration; }
};

/// True if the same channels count.
inline bool operator==(const ChannelValidity& a, const ChannelValidity& b) {
  return a.yaw_rate == b.yaw_rate && a.wheel_left == b.wheel_left && a.wheel_right == b.wheel_right &&
         a.acceleration == b.acceleration;
}

/// The channels that count in both.
inline ChannelValidity operator&(const ChannelValidity& a, const ChannelValidity& b) {
  return {a.yaw_rate && b.yaw_rate, a.wheel_left && b.wheel_left, a.wheel_right && b.wheel_right,
          a.acceleration && b.acceleration};
}

/// One synchronised reading of the wheel encoders and the IMU.
struct Observation {
  double stamp = 0.0;           ///< time of the measurement [s]
  double yaw_rate = 0.0;        ///< theta_dot, gyro about z of base_link [rad/s]
  double wheel_left = 0.0;      ///< omega_L, mean of the left wheels [rad/s]
  double wheel_right = 0.0;     ///< omega_R, mean of the right wheels [rad/s]
  double acceleration_x = 0.0;  ///< x_ddot, along x of base_link, without gravity [m/s^2]
  double acceleration_y = 0.0;  ///< y_ddot, along y; both include gravity unless `level`
  std::optional<double> acceleration_z =
      {};  ///< specific force along z of base_link [m/s^2], gravity left in: about +g, -g upside down; empty: not known
  ChannelValidity valid = {};  ///< which of the channels count
  bool level = false;          ///< an attitude was there to remove gravity

  /// The channels as the vector y of eq. 3-3.
  SensorVector vector() const {
    SensorVector y;
    y << yaw_rate, wheel_left, wheel_right, acceleration_x, acceleration_y;
    return y;
  }

  /// True if the stamp and every channel that counts are finite.
  bool finite() const {
    const bool yaw = !valid.yaw_rate || std::isfinite(yaw_rate);
    const bool left = !valid.wheel_left || std::isfinite(wheel_left);
    const bool right = !valid.wheel_right || std::isfinite(wheel_right);
    const bool level = std::isfinite(acceleration_x) && std::isfinite(acceleration_y);
    const bool acceleration = !valid.acceleration || (level && std::isfinite(acceleration_z.value_or(0.0)));
    return std::isfinite(stamp) && yaw && left && right && acceleration;
  }
};

/// Verdict of a controller on a measurement.
enum class SampleVerdict {
  accepted,    ///< taken
  restarted,   ///< taken as the start of a new signal (the first sample, or the first after a gap)
  stale,       ///< refused: its stamp is not later than the last one (a repeated or reordered sample)
  not_finite,  ///< refused: a value or the stamp is NaN or infinite
  incomplete   ///< refused: too few of its channels count
};

/// True if the measurement was taken.
inline bool taken(SampleVerdict verdict) {
  return verdict == SampleVerdict::accepted || verdict == SampleVerdict::restarted;
}

/// Desired body velocity mu_d in base_link. A skid-steer robot cannot follow a lateral speed; it is kept because mu_d
/// has three components in the thesis.
struct SetPoint {
  double forward = 0.0;   ///< x_dot [m/s]
  double lateral = 0.0;   ///< y_dot [m/s]
  double yaw_rate = 0.0;  ///< theta_dot [rad/s]

  /// The set point as the vector mu_d.
  BodyVector vector() const { return {forward, lateral, yaw_rate}; }
};

/// Wheel speeds to be driven: the action a of eq. 3-13.
struct WheelCommand {
  double left = 0.0;   ///< omega_L [rad/s], positive is forward
  double right = 0.0;  ///< omega_R [rad/s], positive is forward

  /// The command as the vector a.
  WheelVector vector() const { return {left, right}; }

  /// The vector a as a command.
  static WheelCommand from(const WheelVector& a) { return {a(0), a(1)}; }
};

/// True if both wheel speeds are exactly equal.
inline bool operator==(const WheelCommand& a, const WheelCommand& b) { return a.left == b.left && a.right == b.right; }

/// True if the wheel speeds differ.
inline bool operator!=(const WheelCommand& a, const WheelCommand& b) { return !(a == b); }

}  // namespace jackal_aic
