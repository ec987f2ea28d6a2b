#include "jackal_aic/safety/loss_policy.hpp"

#include <cstddef>

#include "jackal_aic/safety/stop_cause.hpp"

namespace jackal_aic {

const char* text(Loss loss) {
  static constexpr const char* kTexts[] = {"",
                                           "yaw rate lost",
                                           "left encoder lost",
                                           "right encoder lost",
                                           "encoder and yaw rate lost",
                                           "both encoders lost",
                                           "too few channels count"};
  return kTexts[static_cast<std::size_t>(loss)];
}

const char* remedy(Loss loss) {
  if (loss == Loss::none) return "";
  if (loss == Loss::yaw_rate) return remedy(StopCause::imu_missing);
  if (loss == Loss::encoder_and_yaw_rate || loss == Loss::unclear) {
    return "Check the sensors and their drivers (joint_states, imu/data)";
  }
  return remedy(StopCause::wheels_missing);
}

LossDecision decideOnLoss(const LossPolicyParameters& policy, const ChannelValidity& valid, double blind_time,
                          bool on_box) {
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
  return {blind_time <= policy.model_time ? policy.wheels : LossAction::stop, loss};
}

}  // namespace jackal_aic
