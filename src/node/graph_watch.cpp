#include "graph_watch.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpc.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace jackal_aic {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kPatience(1);  // with a node that does not answer
constexpr double kPoll = 0.05;                // s
constexpr double kFirstPeriod = 0.1;          // s between looks until the first answer counts

/// Type of a topic in a reply to getPublications, which may be anybody's; nothing if it does not hold the topic.
std::optional<std::string> typeIn(XmlRpc::XmlRpcValue& reply, const std::string& topic) {
  using XmlRpc::XmlRpcValue;
  XmlRpcValue publications;  // of [topic, type]
  if (!ros::XMLRPCManager::instance()->validateXmlrpcResponse("getPublications", reply, publications)) return {};
  if (publications.getType() != XmlRpcValue::TypeArray) return {};
  for (int i = 0; i < publications.size(); ++i) {
    XmlRpcValue& publication = publications[i];
    if (publication.getType() != XmlRpcValue::TypeArray || publication.size() == 0) continue;
    if (publication[0] != XmlRpcValue(topic)) continue;
    const bool typed = publication.size() > 1 && publication[1].getType() == XmlRpcValue::TypeString;
    return typed ? static_cast<std::string>(publication[1]) : "";
  }
  return {};
}

/// Type as which a node whom the master lists as a publisher of a topic publishes it. Nothing if it does not: its
/// process is gone, its port refuses the connection, or belongs to another process by now, which publishes no such
/// topic. Empty if it hangs.
std::optional<std::string> publishedType(const std::string& node, const std::string& topic) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return {};
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(static_cast<std::string>(uri), host, port)) return {};

  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue caller, reply;
  caller[0] = ros::this_node::getName();
  if (!client.executeNonBlock("getPublications", caller)) return {};
  XmlRpc::XmlRpcDispatch dispatch;
  dispatch.addSource(&client, XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
  const auto end = Clock::now() + kPatience;
  bool answered = false;
  while (!answered && Clock::now() < end) {
    dispatch.work(kPoll);
    answered = client.executeCheckDone(reply);
  }
  dispatch.removeSource(&client);
  client.close();
  return answered ? typeIn(reply, topic) : "";
}

std::vector<std::string> withThisNode(std::vector<std::string> companions) {
  companions.push_back(ros::this_node::getName());
  return companions;
}

}  // namespace

GraphWatch::GraphWatch(GraphRules rules, double period)
    : rules_(std::move(rules)), period_(period), ours_(withThisNode(rules_.companions)), thread_([this] { run(); }) {}

GraphWatch::~GraphWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

std::string GraphWatch::others() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return others_;
}

std::vector<std::string> GraphWatch::loneTypes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return lone_types_;
}

std::string GraphWatch::complaint() const {
  if (checked_ && !contended_ && !rivalled_) return "";  // without a lock
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!checked_) return unconnected_;
  if (contended_) return others_ + "; remap the commands of one of the two (launch/jackal.launch says how)";
  return rivals_ + "; end one, or set allow_multiple_set_points";
}

void GraphWatch::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ending_) {
    lock.unlock();
    look();
    lock.lock();
    const double pause = checked_ ? period_ : std::min(period_, kFirstPeriod);
    wake_.wait_for(lock, std::chrono::duration<double>(pause), [this] { return ending_; });
  }
}

std::vector<std::string> GraphWatch::othersIn(XmlRpc::XmlRpcValue& nodes) const {
  std::vector<std::string> others;
  for (int i = 0; i < nodes.size(); ++i) {
    const std::string name = nodes[i];
    if (std::find(ours_.begin(), ours_.end(), name) == ours_.end()) others.push_back(name);
  }
  return others;
}

GraphWatch::Rivals GraphWatch::rivalsIn(XmlRpc::XmlRpcValue& nodes, const std::string& topic) {
  Rivals rivals;
  for (int i = 0; i < nodes.size() && nodes.size() > 1; ++i) {
    const std::string name = nodes[i];
    const std::optional<std::string> type = publishedType(name, topic);
    if (!type) continue;
    rivals.names += (rivals.types.empty() ? "" : " and ") + name;
    rivals.types.push_back(*type);
  }
  if (rivals.types.size() < 2) rivals.names.clear();
  return rivals;
}

void GraphWatch::look() {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  master_reachable_ = ros::master::execute("getSystemState", request, response, state, false);
  if (!master_reachable_) return;
  std::string text, unconnected;
  std::uint32_t awaited = 0;
  Rivals rivals;
  XmlRpc::XmlRpcValue& publishers = state[0];
  for (int i = 0; i < publishers.size(); ++i) {
    const std::string topic = publishers[i][0];
    if (topic == rules_.lone) rivals = rivalsIn(publishers[i][1], topic);
    if (topic == rules_.awaited && !checked_) {
      for (const std::string& name : othersIn(publishers[i][1])) {
        if (!publishedType(name, topic)) continue;
        ++awaited;
        unconnected += (unconnected.empty() ? "waits for " : " and ") + name;
      }
    }
    if (std::find(rules_.topics.begin(), rules_.topics.end(), topic) == rules_.topics.end()) continue;
    for (const std::string& name : othersIn(publishers[i][1])) {
      if (!publishedType(name, topic)) continue;
      if (!text.empty()) text += ", ";
      text.append(name).append(" on ").append(topic);
    }
  }
  if (!rivals.names.empty()) rivals.names.append(" on ").append(rules_.lone);
  const std::lock_guard<std::mutex> lock(mutex_);
  others_ = text;
  rivals_ = rivals.names;
  lone_types_ = rivals.types;
  // After the names: a thread that sees the flag, which takes no lock, finds the names.
  contended_ = !text.empty() && !rules_.others_allowed;
  rivalled_ = !rivals.names.empty() && !rules_.rivals_allowed;
  if (checked_) return;
  unconnected_ = unconnected.empty() ? "" : unconnected + " on " + rules_.awaited;
  // What a publisher latched comes right after its connection, which counts before: at the next look it has come.
  const bool connected = rules_.connected() >= awaited;
  checked_ = connected && (connected_ || awaited == 0);
  connected_ = connected;
}

}  // namespace jackal_aic
