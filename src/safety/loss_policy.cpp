#include "jackal_aic/safety/loss_policy.hpp"

namespace jackal_aic {

const char* text(Loss loss) {
  switch (loss) {
    case Loss::none:
      return "";
    case Loss::yaw_rate:
      return "yaw rate lost";
    case Loss::left_encoder:
      return "left encoder lost";
    case Loss::right_encoder:
      return "right encoder lost";
    case Loss::encoder_and_yaw_rate:
      return "encoder and yaw rate lost";
    case Loss::both_encoders:
      return "both encoders lost";
    case Loss::unclear:
      return "too few channels count";
  }
  return "";
}

LossDecision decideOnLoss(const LossPolicyParameters& policy, LossTolerance tolerance, const ChannelValidity& valid,
                          double blind_time, bool on_box) {
  const bool yaw_tells = valid.yaw_rate && !on_box;
  const int wheels = valid.wheel_left + valid.wheel_right;
  if (wheels == 2) {
    if (valid.yaw_rate) return {};
    return {policy.imu, Loss::yaw_rate};
  }
  if (wheels == 1 && yaw_tells) {
    return {policy.one_wheel, valid.wheel_left ? Loss::right_encoder : Loss::left_encoder};
  }
  const Loss loss = wheels == 1 ? Loss::encoder_and_yaw_rate : Loss::both_encoders;
  const bool go_on = tolerance == LossTolerance::model && blind_time <= policy.model_time;
  return {go_on ? policy.wheels : LossAction::stop, loss};
}

}  // namespace jackal_aic
