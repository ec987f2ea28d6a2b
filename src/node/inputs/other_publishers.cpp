#include "inputs/other_publishers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>

#include "process/wall_times.hpp"

namespace jackal_aic {
namespace {

constexpr double kFirstPeriod = 0.1;  // s of wall time between checks until all is checked

bool ask(const char* question, const std::string& about, XmlRpc::XmlRpcValue& answer) {
  XmlRpc::XmlRpcValue request, response;
  request[0] = ros::this_node::getName();
  if (!about.empty()) request[1] = about;
  return ros::master::execute(question, request, response, answer, false);
}

/// False if a node that the master lists has died: nothing answers at its address. A node that hangs counts as alive.
bool alive(const std::string& node) {
  XmlRpc::XmlRpcValue uri;
  std::string host;
  std::uint32_t port = 0;
  if (!ask("lookupNode", node, uri) || !ros::network::splitURI(static_cast<std::string>(uri), host, port)) return false;
  boost::asio::ip::tcp::iostream connection;
  connection.expires_after(std::chrono::milliseconds(500));  // with a machine that does not answer
  connection.connect(host, std::to_string(port));
  return connection.error() != boost::asio::error::connection_refused;
}

/// The living publishers of a topic, but for this node. @param topics of [topic, [publisher, ...]].
std::vector<std::string> publishers(XmlRpc::XmlRpcValue& topics, const std::string& topic) {
  std::vector<std::string> names;
  for (int i = 0; i < topics.size(); ++i) {
    for (int k = 0; topics[i][0] == topic && k < topics[i][1].size(); ++k) {
      const std::string node = topics[i][1][k];
      if (node != ros::this_node::getName() && alive(node)) names.push_back(node);
    }
  }
  return names;
}

}  // namespace

void OtherPublishers::watch(ros::NodeHandle node, bool until_checked) {
  check();  // without a publisher of an input there is no wait
  timer_ = node.createWallTimer(ros::WallDuration(kFirstPeriod), [this, until_checked](const ros::WallTimerEvent&) {
    check();
    const bool checked = emergency_stop_.connected && set_points_.connected;
    if (checked) timer_.setPeriod(ros::WallDuration(kCheckPeriod));
    if (checked && until_checked) timer_.stop();
  });
}

void OtherPublishers::check() {
  XmlRpc::XmlRpcValue state;
  master_reachable_ = ask("getSystemState", "", state);
  if (!master_reachable_) return;
  std::vector<std::string> contenders, stops, wishes;
  for (const std::string& topic : commands_) {
    for (const std::string& node : publishers(state[0], topic)) contenders.push_back(node + " on " + topic);
  }
  const auto connect = [&state](Input& input, std::vector<std::string>& sources) {
    if (input.connected) return true;
    const ros::WallTime now = ros::WallTime::now();
    for (const ros::Subscriber& subscriber : input.subscribers) {
      const auto nodes = publishers(state[0], subscriber.getTopic());
      for (const std::string& node : nodes) sources.push_back(node + " on " + subscriber.getTopic());
      if (subscriber.getNumPublishers() < nodes.size()) input.unconnected = now;
    }
    // roscpp counts a connection before the publisher answers it.
    return sources.empty() || (now - input.unconnected).toSec() > kCheckPeriod;
  };
  const bool stop_connected = connect(emergency_stop_, stops);
  const bool set_points_connected = connect(set_points_, wishes);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    text_ = !contenders.empty()
                ? fmt::format("{}; remap the commands of one of the two (launch/jackal.launch says how)",
                              fmt::join(contenders, ", "))
            : stop_connected ? ""
                             : fmt::format("waits for {}", fmt::join(stops, " and "));
  }
  // Set after the names: the flag is read without a lock, and then the names are complete.
  contended_ = !contenders.empty();
  emergency_stop_.connected = stop_connected;
  set_points_.connected = set_points_connected;
}

std::string OtherPublishers::text() const {
  if (checked() && !contended_) return "";  // without a lock
  const std::lock_guard<std::mutex> lock(mutex_);
  return text_;
}

}  // namespace jackal_aic
