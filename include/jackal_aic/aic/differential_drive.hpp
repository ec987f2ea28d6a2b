#pragma once

/// @file
/// The baseline: open-loop differential drive, as the stock diff_drive_controller drives a Jackal.

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Settings of the differential drive baseline; defaults as on the stock Jackal. YAML prefix `diff_drive`.
struct DifferentialDriveParameters {
  double rate = 50.0;                  ///< rate of the wheel commands [Hz]
  double wheel_radius = 0.098;         ///< r [m]
  double wheel_gain = 1.0;             ///< assumed true wheel speed / command
  double effective_track = 0.563385;   ///< 1.5 x the geometric track of 0.37559 m [m]
  double linear_speed = 2.0;           ///< largest |x_dot| [m/s]
  double linear_acceleration = 20.0;   ///< largest |x_ddot| [m/s^2]
  double angular_speed = 4.0;          ///< largest |theta_dot| [rad/s]
  double angular_acceleration = 25.0;  ///< largest |theta_ddot| [rad/s^2]

  /// Wheel radius and effective track.
  GeometryParameters geometry() const;
};

/// Lists the fields of DifferentialDriveParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, DifferentialDriveParameters& p) {
  v.field("rate", p.rate, {1.0, 1000.0}, "Hz", Presence::optional);
  v.field("wheel_radius", p.wheel_radius, {0.01, 1.0}, "m", Presence::optional);
  v.field("wheel_gain", p.wheel_gain, {0.1, 3.0}, "", Presence::optional);
  v.field("effective_track", p.effective_track, {0.05, 5.0}, "m", Presence::optional);
  v.field("linear_speed", p.linear_speed, {0.01, 10.0}, "m/s", Presence::optional);
  v.field("linear_acceleration", p.linear_acceleration, {0.01, 1000.0}, "m/s^2", Presence::optional);
  v.field("angular_speed", p.angular_speed, {0.01, 20.0}, "rad/s", Presence::optional);
  v.field("angular_acceleration", p.angular_acceleration, {0.01, 1000.0}, "rad/s^2", Presence::optional);
}

/// Open-loop differential drive: set point, limited in speed and acceleration, through the inverse of eq. 3-1. It uses
/// no measurement and has no belief.
class DifferentialDrive : public VelocityController {
 public:
  /// Drives by these settings.
  explicit DifferentialDrive(const DifferentialDriveParameters& parameters) : parameters_(parameters) {}

  bool setSetPoint(const SetPoint& set_point) override;

  /// Takes the stamp of a measurement; its values are not used.
  SampleVerdict observe(const Observation& observation) override;

  void updateBelief() override {}

  WheelCommand updateAction() override;

  /// Continues from the driven command.
  void hold(const WheelCommand& applied) override;

  /// As hold().
  void overrule(const WheelCommand& applied) override;

  /// Continues from rest.
  void restart() override { overrule({}); }

  void reset() override;

  bool hasBelief() const override { return false; }

  /// Zero: it has no belief.
  BodyVector believedVelocity() const override { return BodyVector::Zero(); }

  WheelCommand action() const override { return action_; }

  /// Zero: it has no belief.
  double freeEnergy() const override { return 0.0; }

  double beliefStep() const override { return 1.0 / parameters_.rate; }
  int beliefStepsPerAction() const override { return 1; }

 private:
  DifferentialDriveParameters parameters_;
  SetPoint set_point_;
  WheelCommand action_;
  double forward_ = 0.0;   // limited set point of the last period, m/s
  double yaw_rate_ = 0.0;  // limited set point of the last period, rad/s
  double stamp_ = 0.0;     // of the last measurement, s
  bool observed_ = false;
};

}  // namespace jackal_aic
