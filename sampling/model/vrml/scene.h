#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

/// The node tree of one VRML file as it was written: any node, any field, nothing interpreted. DEF/USE share
/// nodes; PROTOs are kept as templates and bound when the tree is walked (see binding.h), so a small file
/// stays small in memory whatever it expands to.
namespace hilbrush::vrml {

struct Node;
using NodePointer = std::shared_ptr<const Node>;

/// The value of a field. Its type follows only from its use: numbers also hold booleans (0, 1).
struct Value {
  std::vector<double> numbers;
  std::vector<std::string> strings;  ///< and, in VRML 1.0, enumeration words
  std::vector<NodePointer> nodes;
};

struct Field {
  std::string name;
  std::string is;  ///< "IS name" inside a PROTO: the value is the instance's field of that name
  Value value;
  int line = 0;
};

/// A PROTO's interface with defaults, and the first node of its body (the others, scripts and routes, have no
/// shape).
struct Prototype {
  std::string name;
  std::vector<Field> defaults;
  NodePointer body;  ///< null: EXTERNPROTO, or an empty body
};

struct Node {
  std::string type;
  std::vector<Field> fields;
  std::vector<NodePointer> children;  ///< VRML 1.0: nodes that stand in the body without a field name
  std::shared_ptr<const Prototype> prototype;  ///< not null: an instance of it
  std::shared_ptr<const std::string> file;     ///< for messages
  int line = 0;
  bool is_open = true;  ///< while its body is being read: USE of it would be a cycle

  const Field* find(std::string_view name) const {
    for (const Field& field : fields)
      if (field.name == name) return &field;
    return nullptr;
  }
};

/// One file.
struct Scene {
  int version = 2;  ///< 1 or 2
  std::vector<NodePointer> roots;
};

}  // namespace hilbrush::vrml
