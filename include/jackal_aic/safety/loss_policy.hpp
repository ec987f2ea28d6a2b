#pragma once

/// @file
/// Decision between driving on and stopping when channels are lost. Pure; used by the measurement watch.

#include <array>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Reaction to a loss.
enum class LossAction {
  drive,  ///< drive on with the remaining channels
  stop    ///< brake
};

/// Words of LossAction, in the order of the enumerators.
inline constexpr std::array<const char*, 2> kLossActionNames{"drive", "stop"};

/// Reactions to the losses. YAML prefix `on_loss`.
struct LossPolicyParameters {
  LossAction imu = LossAction::drive;       ///< no yaw rate: drive on the wheels and the learned effective track
  LossAction one_wheel = LossAction::stop;  ///< one encoder: drive on the other and the yaw rate
  LossAction wheels = LossAction::stop;     ///< both encoders, or one and the yaw rate: drive on the model
  double model_time = 1.0;                  ///< longest time of driving on the model alone [s]
};

/// Lists the fields of LossPolicyParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, LossPolicyParameters& p) {
  v.field("imu", p.imu, kLossActionNames, Presence::optional);
  v.field("one_wheel", p.one_wheel, kLossActionNames, Presence::optional);
  v.field("wheels", p.wheels, kLossActionNames, Presence::optional);
  v.field("model_time", p.model_time, {0.0, 60.0}, "s", Presence::optional);
}

/// What is lost.
enum class Loss {
  none,
  yaw_rate,              ///< the gyro
  left_encoder,          ///< of the left wheels
  right_encoder,         ///< of the right wheels
  encoder_and_yaw_rate,  ///< one wheel is left
  both_encoders,         ///< no wheel is left
  unclear                ///< valid channels, but too few at a time
};

/// Text for people; empty for `none`.
const char* text(Loss loss);

/// What to do about it; empty for `none`.
const char* remedy(Loss loss);

/// Decision with what is lost.
struct LossDecision {
  LossAction action = LossAction::drive;  ///< what to do
  Loss loss = Loss::none;                 ///< what is missing
};

/// Decides for or against driving on. @param valid channels that count; @param blind_time time since the last sample
/// with which two of yaw rate and wheels counted [s]; @param on_box the yaw rate does not depend on the wheels.
LossDecision decideOnLoss(const LossPolicyParameters& policy, const ChannelValidity& valid, double blind_time,
                          bool on_box);

}  // namespace jackal_aic
