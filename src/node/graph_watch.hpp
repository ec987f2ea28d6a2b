#pragma once

/// @file
/// Looks in the ROS graph for other publishers of our commands, and for those of set points and of the emergency stop.

#include <xmlrpcpp/XmlRpcValue.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace jackal_aic {

/// What is to be found in the graph, and who may be there.
struct GraphRules {
  std::vector<std::string> topics;      ///< of our commands, resolved names
  std::vector<std::string> companions;  ///< other nodes that may publish there
  bool others_allowed = false;          ///< any node may
  std::string lone;                     ///< resolved name of a topic on which one node is to publish; empty: none
  bool rivals_allowed = false;          ///< several nodes may publish there
  std::string awaited;                  ///< resolved name of a topic that has to be heard before anything is done
  std::function<std::uint32_t()> connected = [] { return 0u; };  ///< publishers of it that are connected
};

/// Asks the master every `period` of wall time, in a thread of its own because the master may be slow or gone, who else
/// publishes on given topics. A publisher whose process is dead, whom the master still lists, does not count,
/// even if another process has its port now. While the master cannot be reached the last answer stands.
class GraphWatch {
 public:
  /// @param period [s].
  GraphWatch(GraphRules rules, double period);

  /// Ends the thread.
  ~GraphWatch();

  GraphWatch(const GraphWatch&) = delete;
  GraphWatch& operator=(const GraphWatch&) = delete;

  /// True once the master has answered and every living publisher of the awaited topic is connected: what it latched
  /// has then been heard.
  bool checked() const { return checked_; }

  /// True if the master answered last time.
  bool masterReachable() const { return master_reachable_; }

  /// True if a node publishes on one of our topics that may not.
  bool contended() const { return contended_; }

  /// True if more nodes than allowed publish on the lone topic.
  bool rivalled() const { return rivalled_; }

  /// What is against the rules, and what to do about it; empty if nothing is.
  std::string complaint() const;

  /// Types as which living nodes publish on the lone topic; of one that does not answer it is empty. Only while more
  /// than one is listed: a single one is not asked.
  std::vector<std::string> loneTypes() const;

  /// Who publishes on what: "/name on /cmd_drive, ...". Empty without any.
  std::string others() const;

 private:
  void run();
  void look();
  std::vector<std::string> othersIn(XmlRpc::XmlRpcValue& nodes) const;

  struct Rivals {
    std::string names;               // if there is more than one
    std::vector<std::string> types;  // of each
  };
  static Rivals rivalsIn(XmlRpc::XmlRpcValue& nodes, const std::string& topic);

  const GraphRules rules_;
  const double period_;
  const std::vector<std::string> ours_;  // nodes: this one and its companions
  std::atomic<bool> checked_{false};
  std::atomic<bool> master_reachable_{true};
  std::atomic<bool> contended_{false};
  std::atomic<bool> rivalled_{false};
  bool connected_ = false;    // of the thread: the awaited topic, at the last look
  mutable std::mutex mutex_;  // of the following
  std::condition_variable wake_;
  std::string others_;
  std::string rivals_;
  std::string unconnected_;
  std::vector<std::string> lone_types_;
  bool ending_ = false;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace jackal_aic
