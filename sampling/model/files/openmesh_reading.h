#pragma once
#include <functional>
#include <iosfwd>
#include <string>

namespace hilbrush {

/// Runs one of OpenMesh's readers on bytes in memory. Its readers are singletons with state, hence one at a time; they
/// report to stderr, which is silenced; they do not look at the stream's state, hence it throws at the first byte that
/// does not fit.
/// @throws InputError at `name` if the reader fails or runs out of bytes.
void read_with_openmesh(std::string bytes, const std::string& name, bool stops_at_fault,
                        const std::function<bool(std::istream&)>& read);

}  // namespace hilbrush
