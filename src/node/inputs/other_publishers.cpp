#include "inputs/other_publishers.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>

namespace jackal_aic {
namespace {

/// False if a node that the master lists has died: nothing answers at its address. One that hangs counts as alive.
bool alive(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return false;
  if (!ros::network::splitURI(static_cast<std::string>(uri), host, port)) return false;
  boost::asio::ip::tcp::iostream connection;
  connection.expires_after(std::chrono::milliseconds(500));  // with a machine that does not answer
  connection.connect(host, std::to_string(port));
  return connection.error() != boost::asio::error::connection_refused;
}

void append(const std::string& separator, const std::string& text, std::string& list) {
  list += (list.empty() ? "" : separator) + text;
}

}  // namespace

void OtherPublishers::look() {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  master_reachable_ = ros::master::execute("getSystemState", request, response, state, false);
  if (!master_reachable_) return;
  std::string contenders, awaited;
  std::uint32_t stops = 0;
  XmlRpc::XmlRpcValue& topics = state[0];  // of [topic, [publisher, ...]]
  for (int i = 0; i < topics.size(); ++i) {
    const std::string topic = topics[i][0];
    const bool ours = std::find(commands_.begin(), commands_.end(), topic) != commands_.end();
    const bool stop = emergency_stop_ != nullptr && topic == emergency_stop_->getTopic();
    for (int k = 0; k < topics[i][1].size() && (ours || stop); ++k) {
      const std::string node = topics[i][1][k];
      if (node == ros::this_node::getName() || !alive(node)) continue;
      if (ours) append(", ", node + " on " + topic, contenders);
      if (stop) append(" and ", node, awaited), ++stops;
    }
  }
  // What a publisher latched comes right after its connection, which counts before: at the next look it has come.
  const bool connected = emergency_stop_ == nullptr || emergency_stop_->getNumPublishers() >= stops;
  const bool checked = checked_ || (connected && (connected_ || stops == 0));
  connected_ = connected;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    text_.clear();
    if (!contenders.empty()) {
      text_ = contenders + "; remap the commands of one of the two (launch/jackal.launch says how)";
    } else if (!checked) {
      text_ = "waits for " + awaited + " on " + emergency_stop_->getTopic();
    }
  }
  // Set after the names: the flag is read without a lock, and then the names are complete.
  contended_ = !contenders.empty();
  checked_ = checked;
}

std::string OtherPublishers::text() const {
  if (checked_ && !contended_) return "";  // without a lock
  const std::lock_guard<std::mutex> lock(mutex_);
  return text_;
}

}  // namespace jackal_aic
