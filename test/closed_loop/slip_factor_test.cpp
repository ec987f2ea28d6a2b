// Effective track and slip factor have one meaning: theta_dot = r alpha (w_R - w_L) / b_hat (3-1), in identification,
// certificate, controller and fault monitor.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jackal_aic/certificate/linear_loop.hpp"
#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/identification/plant_identification.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "linear_plant.hpp"
#include "stepped_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kTrack = 0.6;  // true b_hat [m]

class AtSlipFactor : public testing::TestWithParam<double> {
 protected:
  /// Of the controller: the slip factor is known, the effective track is not.
  GeometryParameters geometry() const {
    GeometryParameters geometry;
    geometry.slip_factor = GetParam();
    return geometry;
  }

  static PlantModel robot() {
    PlantModel model;
    model.dead_time = 0.06;
    model.lag = 0.03;
    model.acceleration_limit = 100.0;
    model.effective_track = kTrack;
    return model;
  }

  /// A recorded drive of the robot: both directions, straight and turning.
  DriveRecording recording() const {
    LinearPlant plant(robot(), geometry());
    DriveRecording recording;
    const WheelCommand legs[] = {{}, {4.0, 4.0}, {-3.0, 3.0}, {}, {3.0, -3.0}, {-4.0, -4.0}, {2.0, 5.0}, {}};
    for (int k = 0; k < 8000; ++k) {
      if (k % 20 == 0) {
        recording.commands.push_back({0.001 * k, legs[k / 1000]});
        plant.command(legs[k / 1000]);
      }
      plant.step();
      if (k % 20 != 19) continue;
      const Observation y = plant.observation();
      recording.wheels.push_back({y.stamp, {y.wheel_left, y.wheel_right}});
      recording.yaw.push_back({y.stamp, y.yaw_rate});
    }
    return recording;
  }

  PlantModel identified() const {
    const GeometryParameters g = geometry();
    PlantModel model = robot();
    model.effective_track = identifyDriveTrain(recording(), g.wheel_radius, g.slip_factor).track_left.value;
    return model;
  }
};

TEST_P(AtSlipFactor, TrackIsIdentified) {
  const GeometryParameters g = geometry();
  const Identification found = identifyDriveTrain(recording(), g.wheel_radius, g.slip_factor);
  ASSERT_TRUE(found.track_left.known() && found.track_right.known());
  EXPECT_NEAR(found.track_left.value, kTrack, 0.005 * kTrack);
  EXPECT_NEAR(found.track_right.value, kTrack, 0.005 * kTrack);
}

TEST_P(AtSlipFactor, PredictiveControllerReachesItsSetPoint) {
  for (const bool learn : {false, true}) {
    PredictiveParameters parameters;
    parameters.learn_track = learn;
    PlantModel model = identified();
    if (learn) model.effective_track = 1.25 * kTrack;
    SteppedLoop loop(LinearPlant(robot(), geometry()), PredictiveController(parameters, geometry(), model));
    loop.controller.setSetPoint({0.4, 0.0, 0.5});
    for (int k = 0; k < 4000; ++k) loop.step();
    const Observation y = loop.plant.observation();
    const GeometryParameters truth = geometryOf(robot(), geometry());
    const BodyVector driven = SkidSteerKinematics(truth).bodyVelocity({y.wheel_left, y.wheel_right});
    EXPECT_NEAR(driven(kForward), 0.4, 0.004) << "learning " << learn;
    EXPECT_NEAR(driven(kYaw), 0.5, 0.005) << "learning " << learn;
    EXPECT_NEAR(y.yaw_rate, driven(kYaw), 1e-9);
    EXPECT_NEAR(loop.controller.believedVelocity()(kForward), 0.4, 0.004);
    // An arc shows little of the turn in place.
    EXPECT_NEAR(loop.controller.effectiveTrack(), kTrack, 0.04 * kTrack);
  }
}

INSTANTIATE_TEST_SUITE_P(SlipFactors, AtSlipFactor, testing::Values(0.8, 1.0, 1.2));

}  // namespace
}  // namespace jackal_aic
