#include "jackal_aic/faults/fault.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "jackal_aic/model/enum_table.hpp"

namespace jackal_aic {
namespace {

constexpr const char* kFreeWheels = "Free the wheels, and check the power of the motors; then send a zero set point";
constexpr const char* kEncoder = "Check the encoder and its cable";
constexpr const char* kMounting = "Check how the IMU is mounted, and its frame in the URDF";

struct Entry {
  Fault fault;
  const char* text;
  const char* remedy;
};

constexpr std::array<Entry, kFaults> kEntries{{
    {Fault::none, "", ""},
    {Fault::wheels_blocked, "wheels do not follow their command", kFreeWheels},
    {Fault::left_wheels_blocked, "left wheels do not follow their command", kFreeWheels},
    {Fault::right_wheels_blocked, "right wheels do not follow their command", kFreeWheels},
    {Fault::left_encoder_frozen, "left encoder frozen", kEncoder},
    {Fault::left_encoder_wrong, "left encoder wrong", kEncoder},
    {Fault::right_encoder_frozen, "right encoder frozen", kEncoder},
    {Fault::right_encoder_wrong, "right encoder wrong", kEncoder},
    {Fault::imu_upside_down, "IMU upside down", kMounting},
    {Fault::gyro_frozen, "gyro frozen", kCheckImu},
    {Fault::gyro_reversed, "gyro turns against the wheels: mounted upside down?", kMounting},
    {Fault::gyro_disagrees, "gyro disagrees with the wheels",
     "Check the unit (rad/s) and the bias of the gyro, and the effective track"},
    {Fault::accelerometer_frozen, "accelerometer frozen", kCheckImu},
    {Fault::accelerometer_disagrees, "accelerometer wrong",
     "Check the unit (m/s^2) and the mounting of the accelerometer"},
    {Fault::no_gravity, "accelerometer does not read gravity at rest",
     "Check that the accelerometer is there, in m/s^2, and mounted as tf says"},
    {Fault::moved, "moved from outside", ""},
    {Fault::stuck, "does not move although its wheels turn", "Free the robot, or stop driving"},
    {Fault::wheels_off_model, "wheels reach … % of their commands",
     "Check the scale of the encoders, the motors and the plant model"},
    {Fault::turn_off_model, "robot reaches … % of the yaw rate of its wheels",
     "Check the ground, the scale of the gyro, robot.effective_track and robot.track_range"},
}};

static_assert(inOrder(kEntries, &Entry::fault), "one entry for each fault, in the order of the enumerators");

}  // namespace

const char* text(Fault fault) { return kEntries[static_cast<std::size_t>(fault)].text; }

const char* remedy(Fault fault) { return kEntries[static_cast<std::size_t>(fault)].remedy; }

std::string text(Fault fault, double share) {
  constexpr const char* kNumber = "…";
  std::string words = text(fault);
  const std::size_t place = words.find(kNumber);
  if (place == std::string::npos) return words;
  const long percent = std::lround(100.0 * std::clamp(share, -9.99, 9.99));
  return words.replace(place, std::char_traits<char>::length(kNumber), std::to_string(percent));
}

}  // namespace jackal_aic
