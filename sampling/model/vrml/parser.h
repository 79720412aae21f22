#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "sampling/model/model_file.h"
#include "sampling/model/vrml/scene.h"

namespace hilbrush::vrml {

/// How much of its limits a model has used, over all its files.
struct ParseBudget {
  std::size_t nodes = 0;
  std::size_t values = 0;
};

/// Reads VRML text. Accepts what exporters write beside the standard: a missing or odd header, a byte order
/// mark, a DEF without a name, USE of an unknown name, lists without brackets; each such thing is a warning
/// "file:line: ...".
/// @throws InputError "file:line" with what was expected and found, or with the limit that is exceeded.
/// Cost: one pass, memory about 10 times the text.
Scene parse(std::string_view text, const std::string& file, const ModelLimits& limits, ParseBudget& budget,
            std::vector<std::string>& warnings);

}  // namespace hilbrush::vrml
