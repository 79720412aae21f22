#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "sampling/model/model_file.h"
#include "sampling/model/vrml/scene.h"

namespace hilbrush::vrml {

/// What reading several files of one model has used of its limits.
struct ParseBudget {
  std::size_t nodes = 0;
  std::size_t values = 0;
};

/// Reads VRML text. Takes what is found in the wild: no or odd header, byte order mark, a DEF without a name, USE of an
/// unknown name, unbracketed lists; each such thing is a warning "file:line: ...".
/// @throws InputError "file:line" with what was expected and found, or with the limit that is exceeded.
/// Cost: one pass, memory about 10 times the text.
Scene parse(std::string_view text, const std::string& file, const ModelLimits& limits, ParseBudget& budget,
            std::vector<std::string>& warnings);

}  // namespace hilbrush::vrml
