#include "jackal_aic/faults/repetition.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace jackal_aic::faults {
namespace {

/// A sensor with noise and a resolution, and ln of the odds of its present run that it is frozen.
class Sensor {
 public:
  Sensor(double noise, double quantum) : noise_(noise), quantum_(quantum) {}

  /// A sample of a true value. @returns the odds.
  double read(double truth) {
    const double value = truth + noise_ * normal_(random_);
    return take(quantum_ > 0.0 ? quantum_ * std::round(value / quantum_) : value);
  }
  double take(double value, Repetition::Kind kind = Repetition::moving) {
    silence_ = repetition.repeats(value) ? silence_ - repetition.logChance(value, kind) : 0.0;
    repetition.update(value, 0.0, kind, 1.0 / (1.0 + std::exp(silence_ - kSilent)));
    return silence_;
  }
  /// Samples after which a value that repeats is frozen; 1000 if it never is.
  int samplesUntilFrozen(double value) {
    for (int k = 0; k < 1000; ++k) {
      if (take(value) > kSilent) return k;
    }
    return 1000;
  }

  static constexpr double kSilent = 18.0;
  Repetition repetition;

 private:
  double noise_, quantum_, silence_ = 0.0;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_;
};

TEST(Repetition, FindsAFrozenSensorByTheNoiseThatItLacks) {
  struct Case {
    double noise, quantum;
    int most;  // samples
  };
  for (const Case& c : {Case{0.03, 0.0, 6}, Case{0.03, 0.003, 9}, Case{0.03, 0.02, 25}}) {
    Sensor sensor(c.noise, c.quantum);
    for (int k = 0; k < 500; ++k) ASSERT_LT(sensor.read(5.0), Sensor::kSilent) << c.quantum;
    EXPECT_LE(sensor.samplesUntilFrozen(5.02), c.most) << c.quantum;
  }
}

TEST(Repetition, SaysNothingOfASensorWithoutNoise) {
  for (const double quantum : {0.0, 0.1}) {
    Sensor sensor(0.0, quantum);
    for (int k = 0; k < 300; ++k) sensor.read(5.0 + 0.01 * k);
    EXPECT_EQ(sensor.samplesUntilFrozen(8.1), 1000) << quantum;
  }
}

TEST(Repetition, InTheMiddleOfACoarseStepAValueStaysForLong) {
  Sensor sensor(0.02, 0.1);
  for (int k = 0; k < 3000; ++k) {  // through many steps, with noise at their edges
    ASSERT_LT(sensor.read(5.0 + 1e-3 * k), Sensor::kSilent) << k;
  }
  EXPECT_EQ(sensor.samplesUntilFrozen(8.0), 1000);
}

TEST(Repetition, TheFirstRunCondemnsNobody) {
  Sensor sensor(0.0, 0.0);
  EXPECT_EQ(sensor.samplesUntilFrozen(5.0), 1000);
}

TEST(Repetition, ASourceThatHoldsItsValuesIsLearned) {
  Repetition repetition;
  for (int k = 0; k < 200; ++k) {
    repetition.update(0.1 * k, 0.1, Repetition::under_way, 1.0);
    const double first = repetition.held(0.1 * k);
    if (k > 100) EXPECT_GT(first, 0.5) << "each value comes twice";
    repetition.update(0.1 * k, 0.0, Repetition::under_way, 1.0);
  }
  EXPECT_EQ(repetition.held(1e3), 0.0) << "a new value was measured";
}

TEST(Repetition, ChangesThatAreExplainedAreNoNoise) {
  Sensor sensor(0.0, 0.0);
  for (int k = 0; k < 400; ++k) sensor.repetition.update(k % 2 == 0 ? 5.0 : 5.1, 0.1, Repetition::moving, 1.0);
  EXPECT_EQ(sensor.samplesUntilFrozen(5.0), 1000);
}

}  // namespace
}  // namespace jackal_aic::faults
