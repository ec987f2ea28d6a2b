#include "controller_manager/controller_manager.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace controller_manager {
namespace {

using Switch = controller_manager_msgs::SwitchController;

const char* stateOf(const controller_interface::ControllerBase& controller) {
  if (controller.isRunning()) return "running";
  if (controller.isInitialized()) return "initialized";
  if (controller.isStopped()) return "stopped";
  return controller.isWaiting() ? "waiting" : "aborted";
}

}  // namespace

ControllerManager::ControllerManager(hardware_interface::RobotHW* robot_hw, const ros::NodeHandle& nh)
    : robot_hw_(robot_hw), root_nh_(nh), loader_("controller_interface", "controller_interface::ControllerBase") {
  using namespace controller_manager_msgs;
  ros::NodeHandle node(nh, "controller_manager");
  servers_.push_back(node.advertiseService("list_controllers", &ControllerManager::list, this));
  servers_.push_back(node.advertiseService<LoadController::Request, LoadController::Response>(
      "load_controller", [this](auto& request, auto& response) {
        response.ok = loadController(request.name);
        return true;
      }));
  servers_.push_back(node.advertiseService<UnloadController::Request, UnloadController::Response>(
      "unload_controller", [this](auto& request, auto& response) {
        response.ok = unloadController(request.name);
        return true;
      }));
  servers_.push_back(node.advertiseService<Switch::Request, Switch::Response>(
      "switch_controller", [this](auto& request, auto& response) {
        response.ok = switchController(request.start_controllers, request.stop_controllers, request.strictness,
                                       request.start_asap, request.timeout);
        return true;
      }));
}

void ControllerManager::update(const ros::Time& time, const ros::Duration& period, bool reset_controllers) {
  const std::lock_guard<std::mutex> lock(lists_);
  for (const Loaded& loaded : loaded_) {
    if (reset_controllers && loaded.controller->isRunning()) {
      loaded.controller->stopRequest(time);
      loaded.controller->startRequest(time);
    }
    loaded.controller->updateRequest(time, period);
  }
  if (!switching_) return;
  for (const Loaded* stopped : stop_) stopped->controller->stopRequest(time);
  for (const Loaded* started : start_) started->controller->startRequest(time);
  switching_ = false;
}

bool ControllerManager::loadController(const std::string& name) {
  const std::lock_guard<std::mutex> service(services_);
  if (getControllerByName(name)) {
    ROS_ERROR("A controller named '%s' was already loaded inside the controller manager", name.c_str());
    return false;
  }
  try {
    ros::NodeHandle node(root_nh_, name);
    Loaded loaded;
    loaded.info.name = name;
    if (!node.getParam("type", loaded.info.type)) throw std::runtime_error("parameter 'type' is missing");
    loaded.controller = loader_.createUniqueInstance(loaded.info.type);
    if (!loaded.controller->initRequest(robot_hw_, root_nh_, node, loaded.info.claimed_resources)) {
      throw std::runtime_error("initialization failed");
    }
    const std::lock_guard<std::mutex> lock(lists_);
    loaded_.push_back(std::move(loaded));
    return true;
  } catch (const std::exception& error) {
    ROS_ERROR("Could not load controller '%s': %s", name.c_str(), error.what());
    return false;
  }
}

bool ControllerManager::unloadController(const std::string& name) {
  const std::lock_guard<std::mutex> service(services_);
  std::list<Loaded> unloaded;  // destroyed without the lock
  const std::lock_guard<std::mutex> lock(lists_);
  const auto found =
      std::find_if(loaded_.begin(), loaded_.end(), [&](const Loaded& loaded) { return loaded.info.name == name; });
  if (found == loaded_.end() || found->controller->isRunning()) {
    ROS_ERROR("Could not unload controller with name '%s' because it %s", name.c_str(),
              found == loaded_.end() ? "does not exist" : "is still running");
    return false;
  }
  unloaded.splice(unloaded.end(), loaded_, found);
  return true;
}

bool ControllerManager::choose(const std::vector<std::string>& names, bool running, bool strict,
                               std::vector<Loaded*>& chosen) {
  for (const std::string& name : names) {
    const auto found =
        std::find_if(loaded_.begin(), loaded_.end(), [&](const Loaded& loaded) { return loaded.info.name == name; });
    if (found != loaded_.end() && found->controller->isRunning() == running) {
      chosen.push_back(&*found);
    } else if (strict) {
      ROS_ERROR("Could not %s controller with name '%s'", running ? "stop" : "start", name.c_str());
      return false;
    }
  }
  return true;
}

bool ControllerManager::conflicts(const std::vector<Loaded*>& start, const std::vector<Loaded*>& stop) const {
  std::list<hardware_interface::ControllerInfo> info;
  for (const Loaded& loaded : loaded_) {
    const auto in = [&](const std::vector<Loaded*>& list) {
      return std::find(list.begin(), list.end(), &loaded) != list.end();
    };
    if (in(start) || (loaded.controller->isRunning() && !in(stop))) info.push_back(loaded.info);
  }
  return robot_hw_->checkForConflict(info);
}

bool ControllerManager::switchController(const std::vector<std::string>& start_controllers,
                                         const std::vector<std::string>& stop_controllers, int strictness,
                                         bool /*start_asap*/, double timeout) {
  const std::lock_guard<std::mutex> service(services_);
  {
    const std::lock_guard<std::mutex> lock(lists_);
    std::vector<Loaded*> start, stop;
    const bool strict = strictness == Switch::Request::STRICT;
    if (!choose(stop_controllers, true, strict, stop) || !choose(start_controllers, false, strict, start)) return false;
    if (conflicts(start, stop)) {
      ROS_ERROR("Could not switch controllers, due to resource conflict");
      return false;
    }
    start_ = start;
    stop_ = stop;
    switching_ = true;
  }
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout + 1.0);
  while (switching_ && ros::ok()) {
    if (timeout > 0.0 && std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  return ros::ok();
}

controller_interface::ControllerBase* ControllerManager::getControllerByName(const std::string& name) {
  const std::lock_guard<std::mutex> lock(lists_);
  const auto found =
      std::find_if(loaded_.begin(), loaded_.end(), [&](const Loaded& loaded) { return loaded.info.name == name; });
  return found == loaded_.end() ? nullptr : found->controller.get();
}

bool ControllerManager::list(controller_manager_msgs::ListControllers::Request&,
                             controller_manager_msgs::ListControllers::Response& response) {
  const std::lock_guard<std::mutex> lock(lists_);
  for (const Loaded& loaded : loaded_) {
    controller_manager_msgs::ControllerState state;
    state.name = loaded.info.name;
    state.type = loaded.info.type;
    state.state = stateOf(*loaded.controller);
    for (const auto& claimed : loaded.info.claimed_resources) {
      controller_manager_msgs::HardwareInterfaceResources resources;
      resources.hardware_interface = claimed.hardware_interface;
      resources.resources.assign(claimed.resources.begin(), claimed.resources.end());
      state.claimed_resources.push_back(resources);
    }
    response.controller.push_back(state);
  }
  return true;
}

}  // namespace controller_manager
