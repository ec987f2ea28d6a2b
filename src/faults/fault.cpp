#include "jackal_aic/faults/fault.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace jackal_aic {
namespace {

struct Entry {
  Fault fault;
  const char* text;
};

constexpr std::array<Entry, kFaults> kEntries{{
    {Fault::none, ""},
    {Fault::wheels_blocked, "wheels do not follow their command"},
    {Fault::left_wheels_blocked, "left wheels do not follow their command"},
    {Fault::right_wheels_blocked, "right wheels do not follow their command"},
    {Fault::left_encoder_frozen, "left encoder frozen"},
    {Fault::left_encoder_wrong, "left encoder wrong"},
    {Fault::right_encoder_frozen, "right encoder frozen"},
    {Fault::right_encoder_wrong, "right encoder wrong"},
    {Fault::imu_upside_down, "IMU upside down"},
    {Fault::gyro_frozen, "gyro frozen"},
    {Fault::gyro_reversed, "gyro turns against the wheels: mounted upside down?"},
    {Fault::gyro_disagrees, "gyro disagrees with the wheels"},
    {Fault::accelerometer_frozen, "accelerometer frozen"},
    {Fault::accelerometer_disagrees, "accelerometer wrong"},
    {Fault::no_gravity, "accelerometer does not read gravity at rest"},
    {Fault::moved, "moved from outside"},
    {Fault::stuck, "does not move although its wheels turn"},
    {Fault::wheels_off_model, "wheels reach … % of their commands"},
    {Fault::turn_off_model, "robot reaches … % of the yaw rate of its wheels"},
}};

constexpr bool inOrder() {
  for (std::size_t i = 0; i < kEntries.size(); ++i) {
    if (static_cast<std::size_t>(kEntries[i].fault) != i) return false;
  }
  return true;
}
static_assert(inOrder(), "one entry for each fault, in the order of the enumerators");

}  // namespace

const char* text(Fault fault) { return kEntries[static_cast<std::size_t>(fault)].text; }

std::string text(Fault fault, double share) {
  constexpr const char* kNumber = "…";
  std::string words = text(fault);
  const std::size_t place = words.find(kNumber);
  if (place == std::string::npos) return words;
  const long percent = std::lround(100.0 * std::clamp(share, -9.99, 9.99));
  return words.replace(place, std::char_traits<char>::length(kNumber), std::to_string(percent));
}

}  // namespace jackal_aic
