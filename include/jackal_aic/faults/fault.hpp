#pragma once

/// @file
/// What the fault detection finds.

#include <string>

namespace jackal_aic {

/// A finding of the fault detection.
enum class Fault {
  none,
  wheels_blocked,           ///< neither side follows its command: blocked, or without power
  left_wheels_blocked,      ///< the left wheels do not follow their command
  right_wheels_blocked,     ///< the right wheels do not follow their command
  left_encoder_frozen,      ///< it repeats its value exactly
  left_encoder_wrong,       ///< it contradicts the prediction and the other witnesses
  right_encoder_frozen,     ///< it repeats its value exactly
  right_encoder_wrong,      ///< it contradicts the prediction and the other witnesses
  imu_upside_down,          ///< the accelerometer measures gravity the wrong way round
  gyro_frozen,              ///< it repeats its value exactly
  gyro_reversed,            ///< it reads the turn with the wrong sign: mounted upside down, or wired so
  gyro_disagrees,           ///< with the wheels
  accelerometer_frozen,     ///< it repeats its value exactly
  accelerometer_disagrees,  ///< with the wheels
  no_gravity,               ///< the accelerometer reads something else at rest: absent, in g, or mounted otherwise
  moved,                    ///< no fault: the robot is pushed or carried
  stuck,                    ///< no fault: wheels turn, and the body stands: against a wall, on its belly
  wheels_off_model,         ///< no fault: wheels turn beyond what a robot near its model makes of its commands
  turn_off_model            ///< no fault: the body turns beyond what the range of the track allows
};

/// Number of findings, `none` included.
inline constexpr int kFaults = static_cast<int>(Fault::turn_off_model) + 1;

/// True for a fault of a sensor or a motor, not for `none` and remarks.
inline bool isFault(Fault fault) { return fault != Fault::none && fault < Fault::moved; }

/// Faults of the wheels of one side.
struct WheelFaults {
  Fault blocked, frozen, wrong;
};
inline constexpr WheelFaults kLeftWheels{Fault::left_wheels_blocked, Fault::left_encoder_frozen,
                                         Fault::left_encoder_wrong};
inline constexpr WheelFaults kRightWheels{Fault::right_wheels_blocked, Fault::right_encoder_frozen,
                                          Fault::right_encoder_wrong};

/// What a person reads; empty for `none`. In a remark with a share "…" stands for its number.
const char* text(Fault fault);

/// The same with the number. @param share of what was expected that the remark is about [-]; told from -999 to 999 %.
std::string text(Fault fault, double share);

/// What to do about an IMU that repeats, or is not there.
inline constexpr const char* kCheckImu = "Check the IMU, its cable and its driver (imu/data)";

/// What to do about it: the second sentence of a log line; empty for `none` and `moved`.
const char* remedy(Fault fault);

}  // namespace jackal_aic
