#include "parameters/learned_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "../temporary_directory.hpp"
#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {
namespace {

const SlipState kConfigured{0.5621, 1.0};
const LearnedModel kThen{kConfigured, DriveTrainTiming{0.08, 0.006}};

class LearnedFileTest : public testing::Test {
 protected:
  void write(const std::string& text) const { std::ofstream(path_) << text; }

  std::string text() const {
    std::ostringstream text;
    text << std::ifstream(path_).rdbuf();
    return text.str();
  }

  std::string refusal() const {
    try {
      readLearnedFile(path_, kThen);
    } catch (const ParameterError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << text();
    return "";
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.path("slip.yaml");
};

TEST_F(LearnedFileTest, GivesBackWhatWasWritten) {
  writeLearnedFile(path_, {{0.7123, 0.93}}, kThen);
  const auto slip = readLearnedFile(path_, kThen);
  ASSERT_TRUE(slip);
  EXPECT_NEAR(slip->slip.effective_track, 0.7123, 1e-9);
  EXPECT_NEAR(slip->slip.slip_factor, 0.93, 1e-9);
}

TEST_F(LearnedFileTest, GivesBackHowTheTurnDependsOnTheMotion) {
  SlipBelief belief(kConfigured, 0.098, {});
  for (int k = 0; k < 2000; ++k) {
    const double mean = 0.01 * (k % 1000);
    belief.learnTrack(0.6 + 0.01 * mean, {4.0, 1e-4, 0.0, 0.0, mean, 0.0}, 0.02);
  }
  writeLearnedFile(path_, {belief.state()}, kThen);
  const auto slip = readLearnedFile(path_, kThen);
  ASSERT_TRUE(slip && slip->slip.turn);
  EXPECT_EQ(slip->slip.turn->mean, belief.state().turn->mean);
  EXPECT_EQ(slip->slip.turn->covariance, belief.state().turn->covariance);

  const std::string given = "slip: {slip_factor: 1.0, effective_track: 0.5621, ";
  write(given + "turn_coefficients: [1.8, 0, 0, 0]}");
  EXPECT_NE(refusal().find("4 and 0 numbers: must be 4 and 10"), std::string::npos) << refusal();
  write(given + "turn_coefficients: [1.8, 0, 0, 0], turn_covariance: [1, 0, 1, 0, 0, -1, 0, 0, 0, 1]}");
  EXPECT_NE(refusal().find("positive definite"), std::string::npos) << refusal();
}

TEST_F(LearnedFileTest, GivesBackDeadTimeAndLag) {
  writeLearnedFile(path_, {{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}}, kThen);
  const auto learned = readLearnedFile(path_, kThen);
  ASSERT_TRUE(learned && learned->timing);
  EXPECT_NEAR(learned->timing->dead_time, 0.123, 1e-9);
  EXPECT_NEAR(learned->timing->lag, 0.045, 1e-9);

  const std::string slip = "slip: {slip_factor: 1.0, effective_track: 0.5621}\n";
  write(slip);
  EXPECT_FALSE(readLearnedFile(path_, kThen)->timing) << "a file from before they were learned";
  write(slip + "drive_train: {dead_time: 0.1}");
  EXPECT_NE(refusal().find("drive_train.lag"), std::string::npos) << refusal();
  write(slip + "drive_train: {dead_time: 2.0, lag: 0.01}");
  EXPECT_NE(refusal().find("drive_train.dead_time = 2: must be in [0, 0.4] s"), std::string::npos) << refusal();
}

/// The robot has been identified since, or it is another one.
TEST_F(LearnedFileTest, RefusesWhatWasLearnedWithAnotherConfiguration) {
  writeLearnedFile(path_, {{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}}, kThen);
  try {
    readLearnedFile(path_, {kConfigured, DriveTrainTiming{0.2, 0.006}});
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_EQ(error.what(), "slip.file = '" + path_ +
                                "': learned with dead time 0.08 s, lag 0.006 s, configured with dead time 0.2 s, "
                                "lag 0.006 s now");
  }
  EXPECT_THROW(readLearnedFile(path_, {{5.0, 1.0}, kThen.timing}), ParameterError);
}

/// It is kept for a person to look at.
TEST_F(LearnedFileTest, PutsAFileAsideThatCannotBeUsed) {
  write("slip: {told_track: 0.5}");
  std::ofstream(path_ + ".old") << "an earlier one";
  EXPECT_TRUE(putAside(path_));
  EXPECT_FALSE(std::filesystem::exists(path_));
  path_ += ".old";
  EXPECT_EQ(text(), "slip: {told_track: 0.5}");
  path_ = directory_.path("");
  EXPECT_FALSE(putAside(path_)) << "a directory";
}

TEST_F(LearnedFileTest, ARobotThatIsSlowerThanAnythingLearnedReadsItsFileAgain) {
  const LearnedModel slow{kConfigured, DriveTrainTiming{0.6, 0.7}};
  writeLearnedFile(path_, slow, slow);
  const auto kept = readLearnedFile(path_, slow);
  ASSERT_TRUE(kept);
  EXPECT_FALSE(kept->timing);
}

TEST_F(LearnedFileTest, GivesBackEveryStateThatTheBeliefCanReach) {
  for (double alpha : {1e-3, 1e3}) {
    for (double track : {1e-3, 1e3}) {
      SlipBelief belief(kConfigured, 0.098, {});
      belief.setState({track, alpha});
      writeLearnedFile(path_, {belief.state()}, kThen);
      const auto slip = readLearnedFile(path_, kThen);
      ASSERT_TRUE(slip);
      EXPECT_NEAR(slip->slip.effective_track, belief.state().effective_track, 1e-6);
    }
  }
}

TEST_F(LearnedFileTest, IsEmptyWithoutAFile) { EXPECT_FALSE(readLearnedFile(path_, kThen)); }

TEST_F(LearnedFileTest, RefusesWhatIsOutOfRangeMissingUnknownOrNoNumber) {
  write("slip: {effective_track: 3.0, slip_factor: 1.0}");
  EXPECT_NE(refusal().find("slip.effective_track = 3"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find(path_), std::string::npos);
  write("slip: {effective_track: 0.5, slip_factor: 2.5}");
  EXPECT_NE(refusal().find("slip.slip_factor = 2.5"), std::string::npos) << refusal();
  write("slip: {effective_track: .nan, slip_factor: 1.0}");
  EXPECT_NE(refusal().find("slip.effective_track"), std::string::npos) << refusal();
  write("slip: {effective_track: 0.5}");
  EXPECT_NE(refusal().find("slip.slip_factor"), std::string::npos) << refusal();
  write("slip: {effective_track: 0.5, slip_factor: 1.0, beta: 2.0}");
  EXPECT_NE(refusal().find("slip.beta"), std::string::npos) << refusal();
  write("slip: {effective_track: wide, slip_factor: 1.0}");
  EXPECT_NE(refusal().find("wide"), std::string::npos) << refusal();
  write("slip: [0.5");
  EXPECT_NE(refusal().find(path_), std::string::npos);
  write("");
  EXPECT_FALSE(refusal().empty());
}

/// A path that no file can have is refused like a file that cannot be read, in one short line.
TEST_F(LearnedFileTest, RefusesAPathThatCannotBe) {
  path_ += "\n" + std::string(300, 'x');
  EXPECT_EQ(refusal().rfind("slip.file = '/", 0), 0u) << refusal();
  EXPECT_EQ(refusal().find('\n'), std::string::npos) << refusal();
}

TEST_F(LearnedFileTest, ReplacesTheOldFileAsAWhole) {
  writeLearnedFile(path_, {{0.6, 1.0}}, kThen);
  std::ofstream(path_ + ".new") << "half a fi";  // a writer that was killed
  writeLearnedFile(path_, {{0.7, 1.0}}, kThen);
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.7, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
}

TEST_F(LearnedFileTest, SaysWhyItCannotWrite) {
  try {
    writeLearnedFile("/nowhere/slip.yaml", {kConfigured}, kThen);
    FAIL() << "written";
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/slip.yaml"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("No such file or directory"), std::string::npos) << error.what();
  }
}

/// Whole or not at all.
TEST_F(LearnedFileTest, AFullDiskLeavesTheOldFile) {
  writeLearnedFile(path_, {{0.6, 1.0}}, kThen);
  std::filesystem::create_symlink("/dev/full", path_ + ".new");
  try {
    writeLearnedFile(path_, {{0.7, 1.0}}, kThen);
    FAIL() << "written";
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("No space left on device"), std::string::npos) << error.what();
  }
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.6, 1e-9);
}

}  // namespace
}  // namespace jackal_aic
