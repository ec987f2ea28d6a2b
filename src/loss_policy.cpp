#include "jackal_aic/loss_policy.hpp"

namespace jackal_aic {

LossDecision decideOnLoss(const LossPolicyParameters& policy, LossTolerance tolerance, const ChannelValidity& valid,
                          double blind_time, bool on_box) {
  const bool yaw_tells = valid.yaw_rate && !on_box;
  const int wheels = valid.wheel_left + valid.wheel_right;
  if (wheels == 2) {
    if (valid.yaw_rate) return {};
    return {policy.imu, "yaw rate lost"};
  }
  if (wheels == 1 && yaw_tells) {
    return {policy.one_wheel, valid.wheel_left ? "right encoder lost" : "left encoder lost"};
  }
  const char* reason = wheels == 1 ? "encoder and yaw rate lost" : "both encoders lost";
  const bool go_on = tolerance == LossTolerance::model && blind_time <= policy.model_time;
  return {go_on ? policy.wheels : LossAction::stop, reason};
}

}  // namespace jackal_aic
