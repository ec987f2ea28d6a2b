#include "parameters/learned_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <utility>

#include "../complaint.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/config/text_file.hpp"

namespace jackal_aic {
namespace {

const SlipState kConfigured{0.5621, 1.0};
const LearnedModel kThen{kConfigured, DriveTrainTiming{0.08, 0.006}};

class LearnedFileTest : public testing::Test {
 protected:
  /// What comes back of what is written.
  LearnedModel again(const LearnedModel& learned, const LearnedModel& configured = kThen) const {
    writeLearnedFile(path_, learned, configured);
    return readLearnedFile(path_, configured).value();
  }

  std::string refusal() const {
    return complaint([this] { readLearnedFile(path_, kThen); }, 400 + path_.size());
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.path("slip.yaml");
};

TEST_F(LearnedFileTest, GivesBackWhatWasWritten) {
  EXPECT_FALSE(readLearnedFile(path_, kThen)) << "there is no file";
  const LearnedModel learned = again({{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}});
  EXPECT_EQ(std::pair(learned.slip.effective_track, learned.slip.slip_factor), std::pair(0.7123, 0.93));
  EXPECT_EQ(std::pair(learned.timing.value().dead_time, learned.timing->lag), std::pair(0.123, 0.045));
  EXPECT_FALSE(again({{0.7123, 0.93}}).timing) << "it was not learned";
  const LearnedModel slow{kConfigured, DriveTrainTiming{0.6, 0.7}};
  EXPECT_FALSE(again(slow, slow).timing) << "slower than anything learned";
  directory_.write("slip.yaml", "slip: {slip_factor: 1.0, effective_track: 0.5621}\n");
  EXPECT_FALSE(readLearnedFile(path_, kThen)->timing) << "a file from before they were learned";
}

TEST_F(LearnedFileTest, GivesBackHowTheTurnDependsOnTheMotion) {
  SlipBelief belief(kConfigured, 0.098, {});
  for (int k = 0; k < 2000; ++k) {
    const double mean = 0.01 * (k % 1000);
    belief.learnTrack(0.6 + 0.01 * mean, 0.0, {4.0, 1e-4, 0.0, 0.0, mean, 0.0}, 0.02);
  }
  const auto turn = again({belief.state()}).slip.turn.value();
  EXPECT_EQ(turn.mean, belief.state().turn->mean);
  EXPECT_EQ(turn.covariance, belief.state().turn->covariance);
}

/// The robot has been identified since, or it is another one.
TEST_F(LearnedFileTest, RefusesWhatWasLearnedWithAnotherConfiguration) {
  const LearnedModel now{kConfigured, DriveTrainTiming{0.2, 0.006}};
  writeLearnedFile(path_, {{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}}, kThen);
  EXPECT_EQ(complaint([&] { readLearnedFile(path_, now); }),
            "slip.file = '" + path_ +
                "': learned with dead time 0.08 s, lag 0.006 s, configured with dead time 0.2 s, lag 0.006 s now");
  EXPECT_THROW(readLearnedFile(path_, {{5.0, 1.0}, kThen.timing}), ParameterError);
}

/// It is kept for a person to look at.
TEST_F(LearnedFileTest, PutsAFileAsideThatCannotBeUsed) {
  directory_.write("slip.yaml", "slip: {told_track: 0.5}");
  directory_.write("slip.yaml.old", "an earlier one");
  EXPECT_TRUE(putAside(path_));
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_EQ(readText(path_ + ".old"), "slip: {told_track: 0.5}");
  EXPECT_FALSE(putAside(directory_.path(""))) << "a directory";
}

TEST_F(LearnedFileTest, RefusesWhatIsOutOfRangeMissingUnknownOrNoNumber) {
  const std::string slip = "slip: {slip_factor: 1.0, effective_track: 0.5621";
  const std::pair<std::string, std::string> rows[] = {
      {"slip: {effective_track: 3.0, slip_factor: 1.0}", "slip.effective_track = 3"},
      {"slip: {effective_track: 0.5, slip_factor: 2.5}", "slip.slip_factor = 2.5"},
      {"slip: {effective_track: .nan, slip_factor: 1.0}", "slip.effective_track"},
      {"slip: {effective_track: 0.5}", "slip.slip_factor"},
      {"slip: {effective_track: 0.5, slip_factor: 1.0, beta: 2.0}", "slip.beta"},
      {"slip: {effective_track: wide, slip_factor: 1.0}", "wide"},
      {"slip: [0.5", path_},
      {"", ""},
      {slip + ", turn_coefficients: [1.8, 0, 0, 0]}", "4 and 0 numbers: must be 4 and 10"},
      {slip + ", turn_coefficients: [1.8, 0, 0, 0], turn_covariance: [1, 0, 1, 0, 0, -1, 0, 0, 0, 1]}",
       "positive definite"},
      {slip + "}\ndrive_train: {dead_time: 0.1}", "drive_train.lag"},
      {slip + "}\ndrive_train: {dead_time: 2.0, lag: 0.01}", "drive_train.dead_time = 2: must be in [0, 0.4] s"}};
  for (const auto& [text, said] : rows) {
    directory_.write("slip.yaml", text);
    expectSays(refusal(), {said});
  }
  directory_.write("slip.yaml", rows[0].first);
  expectSays(refusal(), {path_});
  path_ += "\n" + std::string(300, 'x');  // a path that cannot be
  EXPECT_EQ(refusal().rfind("slip.file = '/", 0), 0u) << refusal();
}

TEST_F(LearnedFileTest, IsWrittenWholeOrNotAtAll) {
  const auto refusalOfWriting = [](const std::string& path) {
    return complaint([&] { writeLearnedFile(path, {{0.7, 1.0}}, kThen); });
  };
  EXPECT_EQ(refusalOfWriting(path_), "");
  directory_.write("slip.yaml.new", "half a fi");  // a writer that was killed
  EXPECT_NEAR(again({{0.6, 1.0}}).slip.effective_track, 0.6, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
  std::filesystem::create_symlink("/dev/full", path_ + ".new");
  expectSays(refusalOfWriting(path_), {"No space left on device"});
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.6, 1e-9);
  expectSays(refusalOfWriting("/nowhere/slip.yaml"), {"/nowhere/slip.yaml", "No such file or directory"});
}

}  // namespace
}  // namespace jackal_aic
