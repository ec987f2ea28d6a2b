// From a bag to a plant model: bags as rosbag record writes them, from the simulated robot.

#include <geometry_msgs/TwistStamped.h>
#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Float64.h>
#include <sys/stat.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "../command.hpp"
#include "../complaint.hpp"
#include "../excitation.hpp"
#include "../temporary_directory.hpp"
#include "bag_file.hpp"
#include "drive_bag.hpp"
#include "identification_report.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "outputs/commands.hpp"
#include "plant/test_plant.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;

/// What a test changes in the messages of the sensors before they are recorded.
using Change = std::function<void(sensor_msgs::JointState&, sensor_msgs::Imu&)>;

void writeMeasurement(rosbag::Bag& bag, const sim::PlantMeasurement& measurement, const ros::Time& now,
                      const Change& change = {}) {
  sensor_msgs::JointState joints;
  joints.header.stamp = ros::Time(100.0 + measurement.stamp);
  joints.name.assign(sim::kWheelJoints.begin(), sim::kWheelJoints.end());
  joints.velocity.assign(measurement.wheel_velocity.begin(), measurement.wheel_velocity.end());
  sensor_msgs::Imu imu;
  imu.header.stamp = joints.header.stamp;
  imu.header.frame_id = "base_link";
  imu.angular_velocity.z = measurement.angular_velocity.z();
  if (change) change(joints, imu);
  bag.write("/joint_states", now, joints);
  bag.write("/imu/data", now, imu);
}

/// Records the excitation on the simulated robot, as identify.launch does.
void writeBag(const std::string& path, const sim::PlantParameters& parameters, const Change& change = {}) {
  sim::JackalPlant plant(sim::jackalUrdf(), parameters);
  const Excitation excitation(ExcitationParameters{}, GeometryParameters{});
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (int k = 0; k < 1000 * excitation.duration(); ++k) {
    const ros::Time now(100.0 + plant.time());
    if (k % 20 == 13) {
      const WheelCommand command = excitation.at(plant.time());
      plant.command(command);
      bag.write("/cmd_drive", now, driveMessage(command));
    }
    plant.step();
    if (plant.measurement()) writeMeasurement(bag, *plant.measurement(), ros::Time(100.0 + plant.time()), change);
  }
}

class BadBag : public testing::Test {
 protected:
  /// Message of the error that reading throws: one line that names the file.
  static std::string refusal(const std::string& path) {
    const std::string message = complaint<IdentificationError>([&] { readDriveBag(path, {}); });
    EXPECT_NE(message.find(path), std::string::npos) << message;
    return message;
  }

  TemporaryDirectory directory;
  std::string file = directory.path("bad.bag");
};

TEST_F(BadBag, ThatIsNoneOrTruncated) {
  refusal("/nonexistent/drive.bag");
  for (const char* content : {"", "time,left,right\n0.0,1.0,1.0\n"}) {
    std::ofstream(file) << content;
    refusal(file);
  }
  writeBag(file, {});
  ASSERT_EQ(truncate(file.c_str(), 20000), 0);
  refusal(file);
  unlink(file.c_str());
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  for (const std::string& path : {file, std::string("/dev/zero")}) {
    EXPECT_EQ(refusal(path), path + ": cannot be read as a bag: it is no file");
  }
}

TEST_F(BadBag, WithoutTheDriveTopicOrWithAnotherTypeOnIt) {
  {
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    writeMeasurement(bag, *sim::JackalPlant(sim::jackalUrdf(), {}).measurement(), ros::Time(100.0));
  }
  EXPECT_NE(refusal(file).find("no messages on /cmd_drive"), std::string::npos);
  rosbag::Bag(file, rosbag::bagmode::Write).write("/cmd_drive", ros::Time(100.0), std_msgs::Float64());
  EXPECT_NE(refusal(file).find("std_msgs/Float64"), std::string::npos);
}

TEST_F(BadBag, WithWheelsOrStampsThatCannotBe) {
  using Joints = sensor_msgs::JointState;
  using Imu = sensor_msgs::Imu;
  const auto from = [](double time, void (*breaks)(Joints&)) {
    return [=](Joints& joints, Imu&) {
      if (joints.header.stamp > ros::Time(time)) breaks(joints);
    };
  };
  const std::pair<Change, const char*> rows[] = {
      {[](Joints& j, Imu&) { j.header.stamp += ros::Duration(0.1); }, "stamps are 0.100 s later than their arrival"},
      {[](Joints& j, Imu&) { j.header.stamp -= ros::Duration(3.0); }, "stamps are 3.000 s before their arrival"},
      {[](Joints& j, Imu&) { j.header.stamp = ros::Time(); }, "/joint_states: the message that arrived at 100.0"},
      {[](Joints&, Imu& i) { i.header.stamp = ros::Time(); }, "/imu/data: the message that arrived at 100.0"},
      {from(105.0, [](Joints& j) { j.velocity[2] = NAN; }),
       "/joint_states: the velocity of joint 'rear_left_wheel' at 105.0"},
      {from(105.0, [](Joints& j) { j.velocity.resize(3); }), "'rear_right_wheel' at 105.0"},
      {from(0.0,
            [](Joints& j) {
              j.name = {"a", "b", "c", "d"};
            }),
       "no message names a joint of front_left_wheel"}};
  for (const auto& [change, said] : rows) {
    writeBag(file, {}, change);
    EXPECT_NE(refusal(file).find(said), std::string::npos) << said << "\n" << refusal(file);
  }
}

/// Header of the messages that a node sends.
template <class Message>
boost::shared_ptr<ros::M_string> headerOf(const std::string& node) {
  const auto header = boost::make_shared<ros::M_string>();
  (*header)["callerid"] = node;
  (*header)["type"] = ros::message_traits::datatype<Message>();
  (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
  (*header)["message_definition"] = ros::message_traits::definition<Message>();
  return header;
}

/// A bag of one message on each topic; each of the nodes sends one command.
void writeMountedImu(const std::string& path, const std::vector<std::string>& nodes, bool with_frames) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (const std::string& node : nodes) {
    bag.write("/cmd_drive", ros::Time(100.0), driveMessage({1.0, 1.0}), headerOf<jackal_msgs::Drive>(node));
  }
  writeMeasurement(bag, *sim::JackalPlant(sim::jackalUrdf(), {}).measurement(), ros::Time(100.0));
  sensor_msgs::Imu imu;
  imu.header.stamp = ros::Time(100.0);
  imu.header.frame_id = "/imu_link";
  imu.angular_velocity.y = 0.7;
  bag.write("/imu/mounted", ros::Time(100.0), imu);
  if (!with_frames) return;
  // base_link <- mid_mount <- imu_link; the IMU lies on its side: its y axis points down.
  tf2_msgs::TFMessage frames;
  frames.transforms.resize(2);
  frames.transforms[0].header.frame_id = "base_link";
  frames.transforms[0].child_frame_id = "mid_mount";
  frames.transforms[0].transform.rotation.w = 1.0;
  frames.transforms[1].header.frame_id = "mid_mount";
  frames.transforms[1].child_frame_id = "imu_link";
  frames.transforms[1].transform.rotation.w = std::sqrt(0.5);
  frames.transforms[1].transform.rotation.x = -std::sqrt(0.5);
  bag.write("/tf_static", ros::Time(100.0), frames);
}

TEST_F(BadBag, WithSeveralPublishersOfCommands) {
  std::vector<std::string> nodes{"/jackal_node", "/excitation"};
  writeMountedImu(file, nodes, false);
  for (const char* said : {"2 publishers", "/jackal_node", "/excitation"}) {
    EXPECT_NE(refusal(file).find(said), std::string::npos) << refusal(file);
  }
  while (nodes.size() < 200) nodes.push_back("/node" + std::to_string(nodes.size()));
  writeMountedImu(file, nodes, false);
  const std::string message = refusal(file);
  EXPECT_NE(message.find("200 publishers"), std::string::npos) << message;
  EXPECT_LT(message.size(), 400U);
}

/// Joints of other robots are not ours.
TEST_F(BadBag, WithTwoPublishersOfWheelSpeeds) {
  writeBag(file, {});
  const auto publish = [&](const std::vector<std::string>& joints) {
    sensor_msgs::JointState message;
    message.header.stamp = ros::Time(105.0);
    message.name = joints;
    message.velocity.assign(joints.size(), 0.0);
    rosbag::Bag bag(file, rosbag::bagmode::Append);
    bag.write("/joint_states", ros::Time(105.0), message, headerOf<sensor_msgs::JointState>("/joint_state_publisher"));
  };
  publish({"arm"});
  EXPECT_EQ(readDriveBag(file, {}).remarks, std::vector<std::string>{});
  publish({sim::kWheelJoints.begin(), sim::kWheelJoints.end()});
  const std::string message = refusal(file);
  EXPECT_NE(message.find("/joint_states has 2 publishers"), std::string::npos) << message;
  EXPECT_NE(message.find("'/joint_state_publisher' sent 1"), std::string::npos) << message;
}

TEST(DriveBag, AMessageNowAndThenThatIsNotFiniteIsLeftOut) {
  const TemporaryDirectory directory;
  const std::string file = directory.path("not_finite.bag");
  writeBag(file, {}, [](sensor_msgs::JointState& joints, sensor_msgs::Imu& imu) {
    const double time = joints.header.stamp.toSec();
    if (std::abs(time - 105.0) < 0.009) joints.velocity[2] = NAN;
    if (std::abs(time - 107.0) < 0.009) imu.angular_velocity.z = NAN;
  });
  const DriveRecording recording = readDriveBag(file, {});
  ASSERT_EQ(recording.remarks.size(), 2u);
  EXPECT_EQ(recording.remarks[0].find("left out: 1 message(s); /joint_states: the velocity of joint 'rear_left_wheel'"),
            0u)
      << recording.remarks[0];
  EXPECT_EQ(recording.remarks[1].find("left out: 1 message(s); /imu/data"), 0u) << recording.remarks[1];
  EXPECT_TRUE(identifyDriveTrain(recording, kRadius).track_left.known());
}

/// On a robot with twist_mux.
TEST(DriveBag, CommandsMayBeBodyVelocities) {
  const TemporaryDirectory directory;
  const std::string drives = directory.path("drives.bag"), twists = directory.path("twists.bag");
  writeBag(drives, {});
  const SkidSteerKinematics kinematics(GeometryParameters{});
  {
    const rosbag::Bag from(drives, rosbag::bagmode::Read);
    rosbag::Bag to(twists, rosbag::bagmode::Write);
    for (const rosbag::MessageInstance& message : rosbag::View(from)) {
      const auto drive = message.instantiate<jackal_msgs::Drive>();
      if (!drive) {
        to.write(message.getTopic(), message.getTime(), message);
        continue;
      }
      geometry_msgs::TwistStamped stamped;
      stamped.twist = twistMessage(kinematics.bodyVelocity({drive->drivers[0], drive->drivers[1]}));
      to.write("/cmd_vel", message.getTime(), stamped.twist);
      to.write("/jackal_velocity_controller/cmd_vel_out", message.getTime(), stamped);
    }
  }
  const Identification by_drive = identifyDriveTrain(readDriveBag(drives, {}), kRadius);
  for (const char* topic : {"/cmd_vel", "/jackal_velocity_controller/cmd_vel_out"}) {
    BagTopics topics;
    topics.commands = topic;
    const Identification by_twist = identifyDriveTrain(readDriveBag(twists, topics), kRadius);
    EXPECT_NEAR(by_twist.dead_time.value, by_drive.dead_time.value, 1e-4) << topic;
    EXPECT_NEAR(by_twist.gain.value, by_drive.gain.value, 1e-4) << topic;
    EXPECT_NEAR(by_twist.track_left.value, by_drive.track_left.value, 1e-4) << topic;
  }
}

TEST(DriveBag, TurnsTheImuAsItIsMounted) {
  const TemporaryDirectory directory;
  const std::string file = directory.path("mounted.bag");
  writeMountedImu(file, {"/excitation"}, true);
  BagTopics topics;
  topics.imu = "/imu/mounted";
  EXPECT_NEAR(readDriveBag(file, topics).yaw.at(0).yaw_rate, -0.7, 1e-9) << "as /tf_static says";
  topics.imu_rotation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(readDriveBag(file, topics).yaw.at(0).yaw_rate, 0.7, 1e-9) << "as the user says";
  writeMountedImu(file, {"/excitation"}, false);
  topics.imu_rotation.reset();
  const DriveRecording nobody_says = readDriveBag(file, topics);
  EXPECT_TRUE(nobody_says.yaw.empty());
  EXPECT_EQ(nobody_says.yaw_unknown,
            "neither /tf_static nor /tf says how IMU frame '/imu_link' is mounted on 'base_link': say it with "
            "--imu-roll, --imu-pitch and --imu-yaw");
  topics.base_frame = "imu_link";
  EXPECT_NEAR(readDriveBag(file, topics).yaw.at(0).yaw_rate, 0.0, 1e-9) << "it is that of the base";
}

/// The remarks on a drive whose stamps are late by so much.
std::vector<std::string> remarksOnLate(double wheels, double imu) {
  const TemporaryDirectory directory;
  const std::string file = directory.path("late.bag");
  writeBag(file, {}, [=](sensor_msgs::JointState& joints, sensor_msgs::Imu& sample) {
    joints.header.stamp += ros::Duration(wheels);
    sample.header.stamp += ros::Duration(imu);
  });
  return identifyDriveTrain(readDriveBag(file, {}), kRadius).remarks;
}

TEST(DriveBag, StampsOfAnotherClockAreTold) {
  EXPECT_TRUE(remarksOnLate(0.004, 0.004).empty());
  const auto expect = [](const std::vector<std::string>& remarks, const std::string& text) {
    ASSERT_EQ(remarks.size(), 1U);
    EXPECT_EQ(remarks[0].rfind(text, 0), 0U) << remarks[0];
  };
  expect(remarksOnLate(-0.06, 0.0), "/joint_states: stamps are 0.060 s before their arrival at the recorder (median)");
  expect(remarksOnLate(0.0, -0.06), "/imu/data: stamps are 0.060 s before their arrival at the recorder (median)");
  expect(remarksOnLate(0.0, 0.02), "/imu/data: stamps are 0.020 s later than their arrival at the recorder (median)");
}

/// The program, in a directory of its own with one bag.
class IdentifyProgram : public testing::Test {
 protected:
  /// What it prints; its exit status goes to `status`.
  std::string run(const std::string& arguments) {
    const CommandResult result = runCommand("cd " + directory.path() + " && " JACKAL_AIC_IDENTIFY " " + arguments);
    status = result.status;
    return result.text;
  }

  const TemporaryDirectory directory;
  int status = -1;
};

TEST_F(IdentifyProgram, TakesAnglesOfTheImu) {
  // The IMU lies on its side: its y axis points up.
  writeBag(directory.path("drive.bag"), {}, [](sensor_msgs::JointState&, sensor_msgs::Imu& imu) {
    imu.header.frame_id = "imu_link";
    std::swap(imu.angular_velocity.y, imu.angular_velocity.z);
  });
  for (const char* arguments :
       {"drive.bag --no-plot --imu-roll 90", "--no-plot --imu-roll -270 --imu-yaw 0 drive.bag"}) {
    const std::string text = run(arguments);
    EXPECT_EQ(status, 0) << text;
    EXPECT_NE(text.find("effective track, left         0.5"), std::string::npos) << arguments << "\n" << text;
  }
  EXPECT_EQ(run("drive.bag --imu-yaw 1e300"), "identify: --imu-yaw must be in [-360, 360] deg\n");
  EXPECT_EQ(run("drive.bag --imu-pitch nan"), "identify: --imu-pitch must be in [-360, 360] deg\n");
}

TEST_F(IdentifyProgram, DrawsBesideTheBag) {
  std::filesystem::create_directory(directory.path("my.bags"));
  writeBag(directory.path("my.bags/e\x1b[31m.bag"), {});
  const std::string text = run("'my.bags/e\x1b[31m.bag'");
  EXPECT_EQ(status, 0) << text;
  EXPECT_TRUE(std::filesystem::exists(directory.path("my.bags/e\x1b[31m_identification.png"))) << text;
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

TEST_F(IdentifyProgram, KeepsAnEarlierPlantModel) {
  writeBag(directory.path("drive.bag"), {});
  directory.write("mine.yaml", "by hand");
  const auto text = [this](const std::string& name) { return readText(directory.path(name)); };
  EXPECT_NE(run("drive.bag --out mine.yaml --robot one").find("is now mine.yaml.1\n"), std::string::npos);
  EXPECT_EQ(text("mine.yaml.1"), "by hand");
  const std::string first = text("mine.yaml");
  EXPECT_NE(first.find("one"), std::string::npos) << first;
  EXPECT_NE(run("drive.bag --out mine.yaml --robot two").find("is now mine.yaml.2\n"), std::string::npos);
  EXPECT_EQ(text("mine.yaml.1"), "by hand");
  EXPECT_EQ(text("mine.yaml.2"), first);
  EXPECT_NE(text("mine.yaml").find("two"), std::string::npos);
  EXPECT_EQ(run("no.bag --out mine.yaml").find("is now"), std::string::npos);
  EXPECT_NE(text("mine.yaml").find("two"), std::string::npos) << "nothing came to replace it";
  EXPECT_NE(run("drive.bag --out /dev/stdout").find("dead_time"), std::string::npos) << "what is no file is written to";
}

TEST_F(IdentifyProgram, WritesTheModelWithoutAPicture) {
  writeBag(directory.path("drive.bag"), {});
  const auto expectModel = [](const std::string& text, std::initializer_list<const char*> told) {
    for (const char* said : told) EXPECT_NE(text.find(said), std::string::npos) << said << "\n" << text;
    EXPECT_EQ(text.find("Traceback"), std::string::npos) << text;
  };
  std::string text = run("drive.bag --no-plot --csv speeds.csv");
  EXPECT_EQ(status, 0) << text;
  expectModel(text, {"Table: speeds.csv\n"});
  EXPECT_EQ(text.find("Figure"), std::string::npos) << text;
  EXPECT_FALSE(std::filesystem::exists(directory.path("drive_identification.png")));
  EXPECT_NE(run("drive.bag --no-plot --plot picture.png").find("--plot and --no-plot"), std::string::npos);
  EXPECT_NE(status, 0);

  directory.write("matplotlib.py", "raise ImportError('hidden')\n");
  setenv("PYTHONPATH", directory.path().c_str(), 1);
  text = run("drive.bag --out model.yaml --csv speeds.csv");
  unsetenv("PYTHONPATH");
  EXPECT_EQ(status, 0) << text;
  expectModel(text,
              {"Plant model: model.yaml\n", "Table: speeds.csv\n", "needs matplotlib",
               "identify: drive_identification.png: could not be drawn, as said above; --no-plot leaves it out\n"});

  text = run("drive.bag --out model.yaml --plot nowhere/picture.png");
  EXPECT_NE(status, 0) << "it was asked for";
  expectModel(text, {"The earlier plant model is now model.yaml.1\n"});
}

/// What a report is made of, without a track.
Identification foundDriveTrain() {
  Identification result;
  result.dead_time = {0.12, 0.001, ""};
  result.lag = {0.05, 0.002, ""};
  result.gain = {0.97, 0.003, ""};
  result.acceleration_limit = {3.2, 0.0, "never reached; at least the largest acceleration seen"};
  return result;
}

/// The plant model of a report, as a parameter file has it.
ParameterMap written(const Identification& result, const std::string& bag = "drive.bag") {
  ParameterMap map;
  addYamlText(plantModelYaml(result, {bag, "", ""}), "plant_model.yaml", map);
  return map;
}

TEST(IdentificationReport, YamlSaysWhereItComesFrom) {
  Identification result = foundDriveTrain();
  result.offset = {0.5, 0.02, ""};
  result.r_squared = 0.98765;
  result.remarks = {"cut: 2.0 s of driving that the commands do not explain"};
  const std::string text = plantModelYaml(result, {"drive.bag", "2022-05-17 14:03 UTC", "my Jackal"});
  for (const char* said : {"drive.bag", "2022-05-17 14:03 UTC", "my Jackal", "R^2 0.9877", "0.5000 +- 0.0200",
                           "# cut: 2.0 s of driving"}) {
    EXPECT_NE(text.find(said), std::string::npos) << said << "\n" << text;
  }
  EXPECT_NE(identificationTable(result).find("R^2"), std::string::npos);
}

TEST(IdentificationReport, AnOffsetThatMayBeNoneIsNotWritten) {
  Identification result = foundDriveTrain();
  for (const Estimate& offset :
       {Estimate{0.04, 0.05, ""}, Estimate{-0.2, 0.05, ""}, Estimate{0.2, 0.0, "the commands are of one speed only"}}) {
    result.offset = offset;
    ParameterMap map = written(result);
    const auto model = readParameters<PlantModel>(map, "plant_model");
    EXPECT_EQ(model.offset, 0.0) << offset.value;
    EXPECT_EQ(model.offset_half_width, 0.0) << offset.value;
  }
}

TEST(IdentificationReport, TheNameOfABagStaysInItsComment) {
  EXPECT_FALSE(written(foundDriveTrain(), "of\nlimits: {linear_speed: 9.0}\n.bag").hasSection("limits"));
}

TEST(IdentificationReport, YamlHoldsTheEstimates) {
  Identification result = foundDriveTrain();
  result.offset = {0.48, 0.02, ""};
  result.sensor_rate = 20.0;
  result.track_left = {0.55, 0.01, ""};
  result.track_right = {0.0, 0.0, "no turn to the right"};
  ParameterMap map = written(result);
  for (const auto& [key, value] : {std::pair("dead_time", 0.12),
                                   {"lag", 0.05},
                                   {"gain", 0.97},
                                   {"acceleration_limit", 3.2},
                                   {"effective_track", 0.55},
                                   {"dead_time_half_width", 0.001},
                                   {"lag_half_width", 0.002},
                                   {"gain_half_width", 0.003},
                                   {"offset", 0.48},
                                   {"sensor_rate", 20.0},
                                   {"offset_half_width", 0.02}}) {
    EXPECT_DOUBLE_EQ(std::get<double>(*map.take(std::string("plant_model.") + key)), value) << key;
  }
  EXPECT_NE(identificationTable(result).find("no turn to the right"), std::string::npos);
  result.gain.unknown = "the recording does not depend on it";
  EXPECT_THROW(plantModelYaml(result, {"drive.bag", "", ""}), IdentificationError);
}

}  // namespace
}  // namespace jackal_aic

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::Time::init();
  return RUN_ALL_TESTS();
}
