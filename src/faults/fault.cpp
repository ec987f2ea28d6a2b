#include "jackal_aic/faults/fault.hpp"

#include <array>
#include <cstddef>

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
    {Fault::moved, "moved by somebody else"},
    {Fault::stuck, "does not move although its wheels turn"},
    {Fault::wheels_off_model, "wheels turn less or more than their commands explain"},
    {Fault::turn_off_model, "robot turns less or more than its wheels explain"},
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

}  // namespace jackal_aic
