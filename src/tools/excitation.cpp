#include "excitation.hpp"

#include <algorithm>

namespace jackal_aic {

Excitation::Excitation(const ExcitationParameters& parameters, const GeometryParameters& geometry) {
  const SkidSteerKinematics kinematics(geometry);
  append({}, parameters.rest);
  for (int repetition = 0; repetition < parameters.repetitions; ++repetition) {
    for (double part : {0.5, -0.5, 1.0, -1.0}) {
      append(kinematics.wheelSpeeds(part * parameters.linear_speed, 0.0), parameters.hold);
      append({}, parameters.rest);
    }
    for (double part : {0.5, -0.5, 1.0, -1.0}) {
      append(kinematics.wheelSpeeds(0.0, part * parameters.angular_speed), parameters.hold);
      append({}, parameters.rest);
    }
  }
}

void Excitation::append(const WheelCommand& command, double length) {
  ends_.push_back(duration() + length);
  commands_.push_back(command);
}

WheelCommand Excitation::at(double time) const {
  const auto piece = std::upper_bound(ends_.begin(), ends_.end(), time);
  return piece == ends_.end() ? WheelCommand{} : commands_[static_cast<std::size_t>(piece - ends_.begin())];
}

}  // namespace jackal_aic
