#pragma once

/// @file
/// A topic on which things go wrong: messages in, messages with their times out. Pure; time is an argument.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "injected_fault.hpp"
#include "message_access.hpp"

namespace jackal_aic::sim {

/// A message and when it is to be sent [s].
template <class Message>
struct TimedMessage {
  double time;
  Message message;
};

/// Passes the messages of one topic through its faults, in the order in which those are listed.
template <class Message>
class FaultyChannel {
 public:
  using Batch = std::vector<TimedMessage<Message>>;

  /// Arms faults and forgets everything from before. @param onset time from which `start` of a fault counts [s];
  /// @param seed of the choice of messages where `share` is below 1. Equal seeds and messages give equal results.
  void arm(const std::vector<InjectedFault>& faults, double onset, std::uint64_t seed) {
    faults_.clear();
    for (const auto& fault : faults) faults_.push_back({fault, std::nullopt, false});
    onset_ = onset;
    random_.seed(seed);
    last_good_.reset();
  }

  /// What becomes of a message that comes in now: any number of messages, none of them due before now.
  Batch pass(double now, const Message& message) {
    Batch batch{{now, message}};
    for (auto& fault : faults_) {
      if (fault.parameters.activeAt(now - onset_)) batch = apply(fault, now, std::move(batch));
    }
    const bool faulty = std::any_of(faults_.begin(), faults_.end(),
                                    [&](const Fault& fault) { return fault.parameters.activeAt(now - onset_); });
    if (!faulty) last_good_ = message;
    return batch;
  }

 private:
  struct Fault {
    InjectedFault parameters;
    std::optional<Message> first;  // message in force when the fault began
    bool second;                   // whether the next message is the second of a pair
  };

  /// The largest value of a field: those of the drivers are float32.
  static constexpr double kLargest =
      std::is_same_v<Message, jackal_msgs::Drive> || std::is_same_v<Message, jackal_msgs::Feedback> ? 1e38 : 1e300;

  bool hit(double share) { return share >= 1.0 || std::uniform_real_distribution<double>(0.0, 1.0)(random_) < share; }

  Batch apply(Fault& fault, double now, Batch batch) {
    Batch result;
    for (auto& entry : batch) {
      if (!fault.first) fault.first = last_good_ ? *last_good_ : entry.message;
      if (!hit(fault.parameters.share)) {
        result.push_back(std::move(entry));
      } else if (!affectTime(fault, now, entry, result)) {
        affectContent(fault, entry.message);
        result.push_back(std::move(entry));
      }
    }
    return result;
  }

  /// Faults of when a message comes; false if the fault is not of this kind.
  bool affectTime(Fault& fault, double now, const TimedMessage<Message>& entry, Batch& result) {
    const double amount = fault.parameters.amount;
    switch (fault.parameters.kind) {
      case FaultKind::drop:
        return true;
      case FaultKind::delay:
        result.push_back({entry.time + amount, entry.message});
        return true;
      case FaultKind::duplicate:
        result.insert(result.end(), 1 + static_cast<std::size_t>(std::max(0.0, amount)), entry);
        return true;
      case FaultKind::reorder:
        result.push_back({entry.time + (fault.second ? 0.0 : amount), entry.message});
        fault.second = !fault.second;
        return true;
      case FaultKind::burst: {
        const double begun = onset_ + fault.parameters.start;
        const double period = std::max(amount, std::numeric_limits<double>::min());
        result.push_back({begun + period * (std::floor((now - begun) / period) + 1.0), entry.message});
        return true;
      }
      default:
        return false;
    }
  }

  void affectContent(Fault& fault, Message& message) {
    switch (fault.parameters.kind) {
      case FaultKind::freeze:
        freeze(fault, message);
        break;
      case FaultKind::stale:
        message = *fault.first;
        break;
      case FaultKind::stamp_zero:
      case FaultKind::stamp_shift:
      case FaultKind::stamp_repeated:
      case FaultKind::stamp_reversed:
        if (ros::Time* stamp = stampIn(message)) *stamp = falsified(*stamp, fault);
        break;
      default:
        if (!spoil(message, fault.parameters.kind)) affectValues(fault.parameters, message);
    }
  }

  void affectValues(const InjectedFault& fault, Message& message) {
    mapValues(message, fault.channel,
              [&fault](double value) { return faultyValue(fault.kind, fault.amount, value, kLargest); });
  }

  /// The first message's values under the stamp of this one: of the whole message, or of one channel.
  void freeze(Fault& fault, Message& message) {
    if (fault.parameters.channel == FaultChannel::all) {
      Message frozen = *fault.first;
      if (const ros::Time* fresh = stampIn(message)) *stampIn(frozen) = *fresh;
      message = frozen;
      return;
    }
    std::vector<double> values;
    mapValues(*fault.first, fault.parameters.channel, [&values](double value) {
      values.push_back(value);
      return value;
    });
    std::size_t i = 0;
    mapValues(message, fault.parameters.channel, [&](double value) { return i < values.size() ? values[i++] : value; });
  }

  ros::Time falsified(const ros::Time& stamp, const Fault& fault) const {
    const ros::Time first = stampOn(*fault.first);
    switch (fault.parameters.kind) {
      case FaultKind::stamp_zero:
        return ros::Time();
      case FaultKind::stamp_repeated:
        return first;
      case FaultKind::stamp_reversed:
        return ros::Time(std::max(1e-9, first.toSec() - (stamp - first).toSec()));
      default:
        return ros::Time(std::max(1e-9, stamp.toSec() + fault.parameters.amount));
    }
  }

  std::vector<Fault> faults_;
  double onset_ = 0.0;
  std::mt19937_64 random_;
  std::optional<Message> last_good_;
};

/// Messages waiting for their time.
template <class Message>
class ReleaseQueue {
 public:
  /// Adds messages.
  void add(std::vector<TimedMessage<Message>> batch) {
    for (auto& entry : batch) {
      const auto later = [](double time, const TimedMessage<Message>& other) { return time < other.time; };
      // Behind those of the same time, so that what came first goes first.
      waiting_.insert(std::upper_bound(waiting_.begin(), waiting_.end(), entry.time, later), std::move(entry));
    }
  }

  /// Takes out the messages that are due, in the order of their times.
  std::vector<Message> takeDue(double now) {
    std::vector<Message> due;
    auto end = waiting_.begin();
    for (; end != waiting_.end() && end->time <= now; ++end) due.push_back(std::move(end->message));
    waiting_.erase(waiting_.begin(), end);
    return due;
  }

  /// Forgets all messages.
  void clear() { waiting_.clear(); }

 private:
  std::vector<TimedMessage<Message>> waiting_;  // in the order of their times
};

}  // namespace jackal_aic::sim
