#pragma once

/// @file
/// A controller of the body velocity of one law per wheel: how every baseline of control drives through DriveLoop.

#include <functional>
#include <memory>

#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "wheel_law.hpp"

namespace jackal_aic::sim {

/// Makes the law of a wheel.
using WheelLawMaker = std::function<std::unique_ptr<WheelLaw>()>;

/// Both wheels by the same law, towards the wheel speeds of eq. 3-1 for the set point. It believes what the encoders
/// measure, and takes samples alone in which both of them count.
class WheelwiseController : public VelocityController {
 public:
  /// @param dead_zone of the motors; the laws give and take what it leaves of a command.
  WheelwiseController(const GeometryParameters& geometry, const WheelLawMaker& make,
                      const DeadZone& dead_zone = DeadZone(PlantModel{}));

  bool setSetPoint(const SetPoint& set_point) override;
  SampleVerdict observe(const Observation& observation) override;
  void updateBelief() override;
  WheelCommand updateAction() override;
  void hold(const WheelCommand& applied) override;
  void overrule(const WheelCommand& applied) override;
  void restart() override;
  void reset() override;

  /// As measured by the encoders.
  BodyVector believedVelocity() const override;
  WheelCommand action() const override;

  /// Zero: it has no generative model.
  double freeEnergy() const override { return 0.0; }
  double beliefStep() const override { return WheelLaw::kStep; }
  int beliefStepsPerAction() const override;

 private:
  SkidSteerKinematics kinematics_;
  DeadZone dead_zone_;
  std::unique_ptr<WheelLaw> left_, right_;
  SetPoint set_point_;
  Observation observation_;
  bool started_ = false;
  bool observed_ = false;
};

}  // namespace jackal_aic::sim
