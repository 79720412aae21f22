#pragma once
#include <string_view>

/// POSIX write() until everything is written.
namespace hilbrush {

/// Writes all of `bytes` to the descriptor, however many calls that takes. @return false if one failed; errno
/// says why.
[[nodiscard]] bool write_all(int fd, std::string_view bytes);

}  // namespace hilbrush
