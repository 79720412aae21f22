#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "sampling/base/check.h"

/// The names of an enum's values in files, messages and reports. A table stands beside its enum and names
/// each value itself: the order of the enumerators means nothing, that of the table is the order in messages.
namespace hilbrush {

template <class Enum>
struct EnumName {
  Enum value;
  const char* name;
};

template <class Enum, std::size_t kCount>
const char* name_of(const EnumName<Enum> (&names)[kCount], Enum value) {
  for (const EnumName<Enum>& entry : names)
    if (entry.value == value) return entry.name;
  check_failed(__FILE__, __LINE__,
               "an enumerator without a name: " + std::to_string(static_cast<int>(value)));
}

/// All names, in the order of the table.
template <class Enum, std::size_t kCount>
std::vector<std::string> all_names(const EnumName<Enum> (&names)[kCount]) {
  std::vector<std::string> texts;
  for (const EnumName<Enum>& entry : names) texts.emplace_back(entry.name);
  return texts;
}

}  // namespace hilbrush
