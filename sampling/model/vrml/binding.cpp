#include "sampling/model/vrml/binding.h"

#include <Eigen/Geometry>

#include "sampling/base/input_error.h"

namespace hilbrush::vrml {
namespace {

/// The field's first `count` numbers, or null if it is absent.
const double* numbers(const Reference& reference, std::string_view field, std::size_t count) {
  const BoundValue bound = find(reference, field);
  if (!bound) return nullptr;
  if (bound.value->numbers.size() < count)
    throw InputError(*reference.node->file + ":" + std::to_string(bound.line),
                     std::string(field) + " of " + reference.node->type.substr(0, 80) + " needs " +
                         std::to_string(count) + (count == 1 ? " number" : " numbers") + ", found " +
                         std::to_string(bound.value->numbers.size()));
  return bound.value->numbers.data();
}

}  // namespace

std::string at(const Node& node) {
  return *node.file + ":" + std::to_string(node.line);
}

BoundValue find(const Reference& reference, std::string_view field) {
  const Field* found = reference.node->find(field);
  const Frame* frame = reference.frame;
  while (found && !found->is.empty()) {
    if (!frame) return {};
    const Node& instance = *frame->instance;
    const std::string& name = found->is;
    found = instance.find(name);
    frame = frame->outer;
    if (found) continue;
    for (const Field& standard : instance.prototype->defaults)
      if (standard.name == name) return {&standard.value, frame, standard.line};
  }
  if (!found) return {};
  return {&found->value, frame, found->line};
}

double number_of(const Reference& reference, std::string_view field, double otherwise) {
  const double* n = numbers(reference, field, 1);
  return n ? n[0] : otherwise;
}

bool flag_of(const Reference& reference, std::string_view field, bool otherwise) {
  const double* n = numbers(reference, field, 1);
  return n ? n[0] != 0 : otherwise;
}

Eigen::Vector2d vector2_of(const Reference& reference, std::string_view field,
                           const Eigen::Vector2d& otherwise) {
  const double* n = numbers(reference, field, 2);
  return n ? Eigen::Vector2d(n[0], n[1]) : otherwise;
}

Eigen::Vector3d vector3_of(const Reference& reference, std::string_view field,
                           const Eigen::Vector3d& otherwise) {
  const double* n = numbers(reference, field, 3);
  return n ? Eigen::Vector3d(n[0], n[1], n[2]) : otherwise;
}

Eigen::Vector4d rotation_of(const Reference& reference, std::string_view field,
                            const Eigen::Vector4d& otherwise) {
  const double* n = numbers(reference, field, 4);
  return n ? Eigen::Vector4d(n[0], n[1], n[2], n[3]) : otherwise;
}

std::string word_of(const Reference& reference, std::string_view field, const std::string& otherwise) {
  const BoundValue bound = find(reference, field);
  return bound && !bound.value->strings.empty() ? bound.value->strings[0] : otherwise;
}

const std::vector<double>& numbers_of(const Reference& reference, std::string_view field) {
  static const std::vector<double> none;
  const BoundValue bound = find(reference, field);
  return bound ? bound.value->numbers : none;
}

Reference node_of(const Reference& reference, std::string_view field) {
  const BoundValue bound = find(reference, field);
  if (!bound || bound.value->nodes.empty()) return {};
  return {bound.value->nodes[0].get(), bound.frame};
}

std::vector<Reference> nodes_of(const Reference& reference, std::string_view field) {
  std::vector<Reference> nodes;
  if (const BoundValue bound = find(reference, field))
    for (const NodePointer& node : bound.value->nodes) nodes.push_back({node.get(), bound.frame});
  return nodes;
}

Eigen::Matrix3d rotation_matrix(const Eigen::Vector4d& axis_angle) {
  const Eigen::Vector3d axis = axis_angle.head<3>();
  const double length = axis.stableNorm();
  if (!(length > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(axis_angle[3], axis / length).toRotationMatrix();
}

}  // namespace hilbrush::vrml
