#include "jackal_aic/faults/turn_witness.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;  // m
constexpr double kTrack = 0.55;    // m
constexpr double kPeriod = 0.02;   // s

/// A wheel that is where its commands lead, and an encoder that tells a part of it.
CommandedWheel wheel(double speed, double scale = 1.0) { return {scale * speed, speed, {speed - 0.1, speed + 0.1}}; }

/// What is found of a steady motion. @param slip part of the turn that the body makes of its wheels'.
TurnWitness after(double left, double right, double left_scale, double right_scale, double slip = 1.0,
                  double seconds = 1.0) {
  TurnWitness witness(kRadius, kTrack, 1.5);
  for (double t = 0.0; t < seconds; t += kPeriod) {
    witness.update(slip * kRadius * (right - left) / kTrack, wheel(left, left_scale), wheel(right, right_scale), 0.0,
                   kPeriod);
  }
  return witness;
}

TEST(TurnWitness, ConvictsTheEncoderWhoseScaleIsWrong) {
  for (const double scale : {-1.0, 0.0, 0.33, 0.5, 0.7, 1.5, 2.0, 57.3}) {
    EXPECT_TRUE(after(5.0, 5.0, scale, 1.0).leftWrong()) << scale;
    EXPECT_FALSE(after(5.0, 5.0, scale, 1.0).rightWrong()) << scale;
    EXPECT_TRUE(after(5.0, 5.0, 1.0, scale).rightWrong()) << scale;
    EXPECT_TRUE(after(5.0, 5.0, scale, 1.0).clearsGyro()) << scale;
  }
}

TEST(TurnWitness, SlipConvictsNoEncoder) {
  for (const double slip : {-1.0, 0.0, 0.3, 0.7, 1.4, 3.0}) {
    const TurnWitness witness = after(-5.0, 5.0, 1.0, 1.0, slip);
    EXPECT_FALSE(witness.leftWrong() || witness.rightWrong()) << slip;
  }
}

TEST(TurnWitness, AWeakMotorTurnsTheRobotAndConvictsNobody) {
  TurnWitness witness(kRadius, kTrack, 1.5);
  for (double t = 0.0; t < 1.0; t += kPeriod) {
    witness.update(kRadius * 1.5 / kTrack, {3.5, 5.0, {4.9, 5.1}}, wheel(5.0), 0.0, kPeriod);
  }
  EXPECT_FALSE(witness.leftWrong() || witness.rightWrong());
}

TEST(TurnWitness, ASpikeIsNoContradiction) {
  TurnWitness witness = after(5.0, 5.0, 1.0, 1.0);
  for (int i = 0; i < 3; ++i) witness.update(0.0, wheel(5.0, 5.0), wheel(5.0), 0.0, kPeriod);
  for (int i = 0; i < 20; ++i) {
    witness.update(0.0, wheel(5.0), wheel(5.0), 0.0, kPeriod);
    EXPECT_FALSE(witness.leftWrong()) << i;
  }
}

TEST(TurnWitness, AnEncoderThatHoldsItsValueNeedsAsManyNewOnes) {
  TurnWitness witness(kRadius, kTrack, 1.5);
  double until = 0.0;
  for (; until < 10.0 && !witness.leftWrong(); until += kPeriod) {
    witness.update(0.0, wheel(5.0, 0.5), wheel(5.0), 0.2, kPeriod);
  }
  EXPECT_GT(until, 3.9);
  EXPECT_LT(until, 5.0);
}

}  // namespace
}  // namespace jackal_aic
