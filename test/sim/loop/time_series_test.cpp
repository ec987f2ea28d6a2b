#include "time_series.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace jackal_aic::sim {
namespace {

TimeSeries series(const std::vector<double>& time, const std::vector<double>& value) {
  TimeSeries result;
  for (std::size_t i = 0; i < time.size(); ++i) result.add(time[i], value[i]);
  return result;
}

TEST(TimeSeries, HoldsTheLatestValue) {
  const TimeSeries signal = series({1.0, 2.0}, {10.0, 20.0});
  EXPECT_FALSE(signal.at(0.999));
  EXPECT_EQ(signal.at(1.0), 10.0);
  EXPECT_EQ(signal.at(1.999), 10.0);
  EXPECT_EQ(signal.at(2.0), 20.0);
  EXPECT_EQ(signal.at(99.0), 20.0);
}

TEST(TimeSeries, SampleThatIsNotLaterIsIgnored) {
  const TimeSeries signal = series({1.0, 2.0, 2.0, 1.5, 3.0}, {10.0, 20.0, 99.0, 99.0, 30.0});
  EXPECT_EQ(signal.time(), (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(signal.value(), (std::vector<double>{10.0, 20.0, 30.0}));
}

TEST(TimeSeries, TableHasEmptyCellsBeforeTheFirstSample) {
  const TimeSeries fast = series({0.0, 0.5, 1.0}, {1.0, 2.0, 3.0});
  const TimeSeries late = series({0.75}, {-0.125});
  std::ostringstream out;
  writeTable(out, fast.time(), {{"fast", &fast}, {"late", &late}});
  EXPECT_EQ(out.str(),
            "time,fast,late\n"
            "0,1,\n"
            "0.5,2,\n"
            "1,3,-0.125\n");
}

}  // namespace
}  // namespace jackal_aic::sim
