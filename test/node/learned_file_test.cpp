#include "parameters/learned_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "../complaint.hpp"
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
    return complaint([this] { readLearnedFile(path_, kThen); }, 400 + path_.size());
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
}

/// The robot has been identified since, or it is another one.
TEST_F(LearnedFileTest, RefusesWhatWasLearnedWithAnotherConfiguration) {
  writeLearnedFile(path_, {{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}}, kThen);
  EXPECT_EQ(complaint([&] {
              readLearnedFile(path_, {kConfigured, DriveTrainTiming{0.2, 0.006}});
            }),
            "slip.file = '" + path_ +
                "': learned with dead time 0.08 s, lag 0.006 s, configured with dead time 0.2 s, lag 0.006 s now");
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

TEST_F(LearnedFileTest, ARobotSlowerThanAnythingLearnedReadsItsFile) {
  const LearnedModel slow{kConfigured, DriveTrainTiming{0.6, 0.7}};
  writeLearnedFile(path_, slow, slow);
  const auto kept = readLearnedFile(path_, slow);
  ASSERT_TRUE(kept);
  EXPECT_FALSE(kept->timing);
}

TEST_F(LearnedFileTest, IsEmptyWithoutAFile) { EXPECT_FALSE(readLearnedFile(path_, kThen)); }

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
    write(text);
    EXPECT_NE(refusal().find(said), std::string::npos) << text << "\n" << refusal();
  }
  write(rows[0].first);
  EXPECT_NE(refusal().find(path_), std::string::npos);
  path_ += "\n" + std::string(300, 'x');  // a path that cannot be
  EXPECT_EQ(refusal().rfind("slip.file = '/", 0), 0u) << refusal();
}

std::string complaintOfWriting(const std::string& path) {
  return complaint([&] { writeLearnedFile(path, {{0.7, 1.0}}, kThen); });
}

TEST_F(LearnedFileTest, IsWrittenWholeOrNotAtAll) {
  EXPECT_EQ(complaintOfWriting(path_), "");
  std::ofstream(path_ + ".new") << "half a fi";  // a writer that was killed
  writeLearnedFile(path_, {{0.6, 1.0}}, kThen);
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.6, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
  std::filesystem::create_symlink("/dev/full", path_ + ".new");
  EXPECT_NE(complaintOfWriting(path_).find("No space left on device"), std::string::npos);
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.6, 1e-9);
  const std::string nowhere = complaintOfWriting("/nowhere/slip.yaml");
  EXPECT_NE(nowhere.find("/nowhere/slip.yaml"), std::string::npos) << nowhere;
  EXPECT_NE(nowhere.find("No such file or directory"), std::string::npos) << nowhere;
}

}  // namespace
}  // namespace jackal_aic
