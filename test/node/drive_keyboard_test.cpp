// drive_keyboard in a pseudo terminal: keys in, set points out, zero and a restored terminal at the end.

#include <fcntl.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <functional>
#include <string>
#include <vector>

namespace jackal_aic::test {
namespace {

/// A program that runs in a pseudo terminal.
class Terminal {
 public:
  explicit Terminal(std::vector<std::string> words) : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    grantpt(master_);
    unlockpt(master_);
    slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY);
    fcntl(master_, F_SETFL, O_NONBLOCK);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      setsid();
      for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(slave_, stream);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
  }
  ~Terminal() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(slave_);
    close(master_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void type(const std::string& keys) {
    EXPECT_EQ(write(master_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  void signal(int number) const { kill(pid_, number); }

  /// Reads what was printed; true once the program has ended.
  bool ended() {
    char part[1024];
    for (ssize_t n; (n = read(master_, part, sizeof part)) > 0;) printed_.append(part, static_cast<std::size_t>(n));
    if (pid_ > 0 && waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
    return pid_ < 0;
  }
  int exitStatus() const { return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1; }
  const std::string& printed() const { return printed_; }

  /// Whether typed characters are echoed, and handed over line by line.
  bool cooked() const {
    termios settings{};
    tcgetattr(slave_, &settings);
    return (settings.c_lflag & ECHO) != 0 && (settings.c_lflag & ICANON) != 0;
  }

 private:
  int master_;
  int slave_ = -1;
  pid_t pid_ = -1;
  int status_ = -1;
  std::string printed_;
};

class DriveKeyboard : public testing::Test {
 protected:
  bool waitFor(const std::function<bool()>& condition, double seconds = 20.0) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    while (ros::ok() && !condition() && ros::WallTime::now() < end) {
      ros::spinOnce();
      terminal.ended();
      ros::WallDuration(0.01).sleep();
    }
    return condition();
  }

  bool isAt(double forward, double yaw_rate) {
    return waitFor([&] {
      return !heard.empty() && std::abs(heard.back().linear.x - forward) < 1e-9 &&
             std::abs(heard.back().angular.z - yaw_rate) < 1e-9;
    });
  }

  void start() {
    ASSERT_TRUE(waitFor([&] { return !terminal.cooked() && subscriber.getNumPublishers() > 0; })) << terminal.printed();
  }

  void expectEndAtRest() {
    ASSERT_TRUE(waitFor([&] { return terminal.ended(); })) << terminal.printed();
    EXPECT_EQ(terminal.exitStatus(), 0) << terminal.printed();
    EXPECT_TRUE(isAt(0.0, 0.0));
    EXPECT_TRUE(terminal.cooked());
  }

  ros::NodeHandle node;
  std::vector<geometry_msgs::Twist> heard;
  ros::Subscriber subscriber = node.subscribe<geometry_msgs::Twist>(
      "jackal_AIC/set_point", 100, [this](const geometry_msgs::TwistConstPtr& message) { heard.push_back(*message); });
  Terminal terminal{{"rosrun", "jackal_aic", "drive_keyboard"}};
};

TEST_F(DriveKeyboard, KeysChangeTheSetPointAndTheEndIsZero) {
  start();
  ros::WallDuration(0.3).sleep();
  ros::spinOnce();
  EXPECT_TRUE(heard.empty()) << "no key was pressed";
  terminal.type("ww");
  ASSERT_TRUE(isAt(0.2, 0.0)) << terminal.printed();
  terminal.type("\x1b[D");
  ASSERT_TRUE(isAt(0.2, 0.2));
  terminal.type("\x1b[C\x1b[C\x1b[B");
  ASSERT_TRUE(isAt(0.1, -0.2));
  terminal.type(" ");
  ASSERT_TRUE(isAt(0.0, 0.0));
  terminal.type("\x1bOA");
  ASSERT_TRUE(isAt(0.1, 0.0));
  const std::size_t before = heard.size();
  EXPECT_TRUE(waitFor([&] { return heard.size() >= before + 10; })) << "it goes on";
  terminal.type("q");
  expectEndAtRest();
}

TEST_F(DriveKeyboard, ASignalEndsItAtRest) {
  start();
  terminal.type("w");
  ASSERT_TRUE(isAt(0.1, 0.0)) << terminal.printed();
  terminal.signal(SIGTERM);
  expectEndAtRest();
}

}  // namespace
}  // namespace jackal_aic::test
