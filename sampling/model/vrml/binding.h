#pragma once
#include <Eigen/Core>
#include <deque>
#include <string>
#include <string_view>

#include "sampling/model/vrml/scene.h"

/// Reading the fields of nodes, inside and outside of PROTO instances.
namespace hilbrush::vrml {

/// A PROTO instance whose body is being walked; `outer` is the one that the instance itself stands in.
struct Frame {
  const Node* instance = nullptr;
  const Frame* outer = nullptr;
  std::size_t search_items = 0;  ///< fields of this instance and the outer ones: what a search may visit
};

/// A node, seen from inside of `frame`.
struct Reference {
  const Node* node = nullptr;
  const Frame* frame = nullptr;
  explicit operator bool() const { return node != nullptr; }
};

/// A field's value and the frame that its nodes belong to.
struct BoundValue {
  const Value* value = nullptr;
  const Frame* frame = nullptr;
  int line = 0;
  explicit operator bool() const { return value != nullptr; }
};

/// "file:line" of a node.
std::string at(const Node& node);

/// The value of a field, through any number of IS; null if it is not given.
BoundValue find(const Reference& reference, std::string_view field);

/// Fields by type. What is absent gives `otherwise`; too few numbers are an InputError that names the field.
double number_of(const Reference& reference, std::string_view field, double otherwise);
bool flag_of(const Reference& reference, std::string_view field, bool otherwise);
Eigen::Vector2d vector2_of(const Reference& reference, std::string_view field,
                           const Eigen::Vector2d& otherwise);
Eigen::Vector3d vector3_of(const Reference& reference, std::string_view field,
                           const Eigen::Vector3d& otherwise);
/// x y z angle
Eigen::Vector4d rotation_of(const Reference& reference, std::string_view field,
                            const Eigen::Vector4d& otherwise);
std::string word_of(const Reference& reference, std::string_view field, const std::string& otherwise);

/// The field's numbers, or an empty list.
const std::vector<double>& numbers_of(const Reference& reference, std::string_view field);
/// The field's first node, or null. May be a PROTO instance.
Reference node_of(const Reference& reference, std::string_view field);
/// The field's nodes.
std::vector<Reference> nodes_of(const Reference& reference, std::string_view field);

/// Rotation about an axis that need not be a unit vector; none for a zero one.
Eigen::Matrix3d rotation_matrix(const Eigen::Vector4d& axis_angle);

}  // namespace hilbrush::vrml
