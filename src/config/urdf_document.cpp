#include "urdf_document.hpp"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <sstream>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

// Bounds far beyond any robot. Within them the parser and walks up the tree of links need little stack and time.
constexpr std::size_t kLargestText = std::size_t{16} << 20;  // bytes
constexpr std::size_t kMostLinks = 1000;
constexpr int kDeepestElement = 1000;

/// How deep the elements of a text are nested at most. Comments count as text, as they may hold elements only in pairs.
int elementDepth(const std::string& xml) {
  int depth = 0, deepest = 0;
  for (std::size_t i = 0; i + 1 < xml.size(); ++i) {
    const char next = xml[i + 1];
    if (xml[i] == '<' && next != '/' && next != '!' && next != '?') deepest = std::max(deepest, ++depth);
    if ((xml[i] == '<' && next == '/') || (xml[i] == '/' && next == '>')) --depth;
  }
  return deepest;
}

/// Refuses, before parsing, texts that would overflow the recursive parser.
void checkSize(const std::string& xml) {
  if (xml.size() > kLargestText) throw ParameterError("URDF: more than 16 MiB of text");
  if (elementDepth(xml) > kDeepestElement) throw ParameterError("URDF: elements nested more than 1000 deep");
  std::size_t links = 0;
  for (std::size_t at = 0; (at = xml.find("<link", at)) != std::string::npos; ++at) ++links;
  if (links > kMostLinks) throw ParameterError("URDF: more than 1000 links");
}

/// Refuses cyclic links: the parser accepts them, and a walk to the root would not end.
void checkTree(const urdf::ModelInterface& model) {
  for (const auto& [name, link] : model.links_) {
    urdf::LinkConstSharedPtr above = link;
    for (std::size_t steps = 0; above && above->parent_joint; ++steps) {
      if (steps > model.links_.size()) {
        throw ParameterError("URDF: link " + quoted(name) + " does not hang on the root link " +
                             quoted(model.getRoot()->name));
      }
      above = model.getLink(above->parent_joint->parent_link_name);
    }
  }
}

/// Collects the parser's first messages for the one line of the exception instead of printing them. The first says what
/// is wrong, the next where.
class Complaints : public console_bridge::OutputHandler {
 public:
  explicit Complaints(const std::string& urdf_xml) : level_(console_bridge::getLogLevel()) {
    // The parser takes parts of the text for a printf format: a '%' in a number would be undefined behaviour.
    if (urdf_xml.find('%') != std::string::npos) {
      console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
      unsaid_ = "no reason is given for a text with a '%' in it";
    }
    console_bridge::useOutputHandler(this);
  }
  ~Complaints() override {
    console_bridge::restorePreviousOutputHandler();
    console_bridge::setLogLevel(level_);
  }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    constexpr int kMost = 2;
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR || ++complaints_ > kMost) return;
    text_ += (text_.empty() ? "" : "; ") + text;
  }

  /// Reason of a refusal without a message of the parser.
  const char* unsaid() const { return unsaid_; }

  /// On one line; empty if there are none.
  std::string line() const {
    constexpr std::size_t kLongest = 300;
    return shortened(text_, kLongest);
  }

 private:
  console_bridge::LogLevel level_;
  std::string text_;
  const char* unsaid_ = "not valid XML";
  int complaints_ = 0;
};

double radiusOf(const urdf::GeometrySharedPtr& geometry) {
  if (const auto cylinder = std::dynamic_pointer_cast<urdf::Cylinder>(geometry)) return cylinder->radius;
  if (const auto sphere = std::dynamic_pointer_cast<urdf::Sphere>(geometry)) return sphere->radius;
  return 0.0;
}

}  // namespace

UrdfDocument parseUrdf(const std::string& urdf_xml) {
  checkSize(urdf_xml);
  // The output handler is one per process.
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  Complaints complaints(urdf_xml);
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(urdf_xml);
  } catch (const std::exception& error) {
    throw ParameterError("URDF: cannot be parsed: " + onOneLine(error.what()));
  }
  const std::string complaint = complaints.line();
  if (!model || !model->getRoot())
    throw ParameterError("URDF: cannot be parsed: " + (complaint.empty() ? complaints.unsaid() : complaint));
  checkTree(*model);
  return {model, complaint};
}

const urdf::Joint& requiredJoint(const urdf::ModelInterface& model, const std::string& name) {
  const urdf::JointConstSharedPtr joint = model.getJoint(name);
  if (!joint) throw ParameterError("URDF: no joint " + quoted(name));
  return *joint;
}

const urdf::Joint& requiredWheelJoint(const urdf::ModelInterface& model, const std::string& name) {
  const urdf::Joint& joint = requiredJoint(model, name);
  if (joint.type == urdf::Joint::CONTINUOUS || joint.type == urdf::Joint::REVOLUTE) return joint;
  throw ParameterError("URDF: wheel joint " + quoted(name) + " does not turn: its type must be continuous or revolute");
}

Eigen::Isometry3d toEigen(const urdf::Pose& pose) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translation() << pose.position.x, pose.position.y, pose.position.z;
  const urdf::Rotation& q = pose.rotation;
  transform.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  return transform;
}

Eigen::Isometry3d poseInRoot(const urdf::ModelInterface& model, const urdf::Joint& joint) {
  const Eigen::Isometry3d in_parent = toEigen(joint.parent_to_joint_origin_transform);
  const urdf::JointConstSharedPtr above = model.getLink(joint.parent_link_name)->parent_joint;
  return above ? poseInRoot(model, *above) * in_parent : in_parent;
}

double wheelRadius(const UrdfDocument& document, const urdf::Joint& joint) {
  const urdf::LinkConstSharedPtr link = document.model->getLink(joint.child_link_name);
  double radius = link->collision ? radiusOf(link->collision->geometry) : 0.0;
  if (radius == 0.0 && link->visual) radius = radiusOf(link->visual->geometry);
  if (!(radius > 0.0) || !std::isfinite(radius)) {
    throw ParameterError("URDF: link " + quoted(link->name) + " has no cylinder or sphere with a positive radius" +
                         (document.left_out.empty() ? "" : "; left out of the URDF: " + document.left_out));
  }
  return radius;
}

}  // namespace jackal_aic
