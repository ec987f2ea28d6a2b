#pragma once

/// @file
/// Looks in the ROS graph for other publishers of our commands, and for those of set points.

#include <xmlrpcpp/XmlRpcValue.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace jackal_aic {

/// Asks the master every `period` of wall time, in a thread of its own because the master may be slow or gone, who else
/// publishes on given topics. A publisher whose process is dead, whom the master still lists, does not count. While the
/// master cannot be reached the last answer stands.
class GraphWatch {
 public:
  /// @param topics resolved names; @param period [s]; @param companions nodes beside this one that may publish there;
  /// @param lone resolved name of a topic on which one node is to publish, whichever; empty: none.
  GraphWatch(std::vector<std::string> topics, double period, std::vector<std::string> companions = {},
             std::string lone = {});

  /// Ends the thread.
  ~GraphWatch();

  GraphWatch(const GraphWatch&) = delete;
  GraphWatch& operator=(const GraphWatch&) = delete;

  /// True once the master has answered.
  bool checked() const { return checked_; }

  /// True if the master answered last time.
  bool masterReachable() const { return master_reachable_; }

  /// True if somebody else publishes on one of the topics.
  bool contended() const { return contended_; }

  /// True if more than one node publishes on the lone topic.
  bool rivalled() const { return rivalled_; }

  /// The nodes that publish on the lone topic, if they are more than one: "/a and /b on /topic". Else empty.
  std::string rivals() const;

  /// Who publishes on what: "/name on /cmd_drive, ...". Empty if nobody does.
  std::string others() const;

 private:
  void run();
  void look();
  std::vector<std::string> othersIn(XmlRpc::XmlRpcValue& nodes) const;
  static std::string rivalsIn(XmlRpc::XmlRpcValue& nodes);

  const std::vector<std::string> topics_;
  const double period_;
  const std::string lone_;
  const std::vector<std::string> ours_;  // nodes: this one and its companions
  std::atomic<bool> checked_{false};
  std::atomic<bool> master_reachable_{true};
  std::atomic<bool> contended_{false};
  std::atomic<bool> rivalled_{false};
  mutable std::mutex mutex_;  // of the following
  std::condition_variable wake_;
  std::string others_;
  std::string rivals_;
  bool ending_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace jackal_aic
