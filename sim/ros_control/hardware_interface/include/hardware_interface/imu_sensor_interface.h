#pragma once

/// @file
/// IMUs that can be read.

#include <string>

#include "hardware_interface/internal/hardware_resource_manager.h"

namespace hardware_interface {

/// Reads an IMU from where the robot keeps it. What an IMU does not measure is a null pointer.
class ImuSensorHandle {
 public:
  /// What a handle is made of.
  struct Data {
    Data() {}
    std::string name;
    std::string frame_id;
    double* orientation = nullptr;                     ///< quaternion (x, y, z, w)
    double* orientation_covariance = nullptr;          ///< 3x3, by rows
    double* angular_velocity = nullptr;                ///< (x, y, z) [rad/s]
    double* angular_velocity_covariance = nullptr;     ///< 3x3, by rows
    double* linear_acceleration = nullptr;             ///< (x, y, z) [m/s^2]
    double* linear_acceleration_covariance = nullptr;  ///< 3x3, by rows
  };

  ImuSensorHandle(const Data& data = {})
      : ImuSensorHandle(data.name, data.frame_id, data.orientation, data.orientation_covariance, data.angular_velocity,
                        data.angular_velocity_covariance, data.linear_acceleration,
                        data.linear_acceleration_covariance) {}

  ImuSensorHandle(const std::string& name, const std::string& frame_id, const double* orientation,
                  const double* orientation_covariance, const double* angular_velocity,
                  const double* angular_velocity_covariance, const double* linear_acceleration,
                  const double* linear_acceleration_covariance)
      : name_(name),
        frame_id_(frame_id),
        orientation_(orientation),
        orientation_covariance_(orientation_covariance),
        angular_velocity_(angular_velocity),
        angular_velocity_covariance_(angular_velocity_covariance),
        linear_acceleration_(linear_acceleration),
        linear_acceleration_covariance_(linear_acceleration_covariance) {}

  std::string getName() const { return name_; }
  std::string getFrameId() const { return frame_id_; }
  const double* getOrientation() const { return orientation_; }
  const double* getOrientationCovariance() const { return orientation_covariance_; }
  const double* getAngularVelocity() const { return angular_velocity_; }
  const double* getAngularVelocityCovariance() const { return angular_velocity_covariance_; }
  const double* getLinearAcceleration() const { return linear_acceleration_; }
  const double* getLinearAccelerationCovariance() const { return linear_acceleration_covariance_; }

 private:
  std::string name_;
  std::string frame_id_;
  const double* orientation_;
  const double* orientation_covariance_;
  const double* angular_velocity_;
  const double* angular_velocity_covariance_;
  const double* linear_acceleration_;
  const double* linear_acceleration_covariance_;
};

/// IMUs, for any number of controllers.
class ImuSensorInterface : public HardwareResourceManager<ImuSensorHandle> {};

}  // namespace hardware_interface
