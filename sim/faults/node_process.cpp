#include "node_process.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <signal.h>
#include <unistd.h>
#include <xmlrpcpp/XmlRpc.h>

#include <cstdint>
#include <fstream>

namespace jackal_aic::sim {
namespace {

constexpr int kAnswer = 2;  // index of the value in [code, message, value]

bool succeeded(XmlRpc::XmlRpcValue& result) { return result.valid() && result.size() > kAnswer && int(result[0]) == 1; }

XmlRpc::XmlRpcValue caller() {
  XmlRpc::XmlRpcValue arguments;
  arguments[0] = ros::this_node::getName();
  return arguments;
}

}  // namespace

std::optional<pid_t> processOf(const std::string& node_name) {
  XmlRpc::XmlRpcValue arguments = caller(), result, payload;
  arguments[1] = node_name;
  if (!ros::master::execute("lookupNode", arguments, result, payload, false)) return std::nullopt;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(payload, host, port)) return std::nullopt;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  if (!client.execute("getPid", caller(), result) || !succeeded(result)) return std::nullopt;
  return int(result[kAnswer]);
}

std::optional<pid_t> masterProcess() {
  XmlRpc::XmlRpcValue result, payload;
  if (!ros::master::execute("getPid", caller(), result, payload, false)) return std::nullopt;
  return int(payload);
}

bool isRunning(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string line;
  if (!std::getline(file, line)) return false;
  // "pid (name) state ...": a process that has ended and was not waited for is a zombie.
  const auto end = line.rfind(')');
  return end != std::string::npos && end + 2 < line.size() && line[end + 2] != 'Z';
}

std::size_t residentMemory(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/statm");
  std::size_t total = 0, resident = 0;
  if (!(file >> total >> resident)) return 0;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace jackal_aic::sim
