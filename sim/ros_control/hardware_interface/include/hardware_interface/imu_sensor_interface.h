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
    std::string name;
    std::string frame_id;
    double* orientation = nullptr;          ///< quaternion (x, y, z, w)
    double* angular_velocity = nullptr;     ///< (x, y, z) [rad/s]
    double* linear_acceleration = nullptr;  ///< (x, y, z) [m/s^2]
  };

  explicit ImuSensorHandle(const Data& data) : data_(data) {}

  std::string getName() const { return data_.name; }
  std::string getFrameId() const { return data_.frame_id; }
  const double* getOrientation() const { return data_.orientation; }
  const double* getAngularVelocity() const { return data_.angular_velocity; }
  const double* getLinearAcceleration() const { return data_.linear_acceleration; }

 private:
  Data data_;
};

/// IMUs, for any number of controllers.
class ImuSensorInterface : public HardwareResourceManager<ImuSensorHandle> {};

}  // namespace hardware_interface
